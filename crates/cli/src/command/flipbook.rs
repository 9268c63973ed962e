//! `bansho flipbook`

use crate::{args::FlipbookArgs, progress::JobResult};

/// Draws a scene as a flipbook for game engines.
pub(crate) fn run(args: &FlipbookArgs) -> anyhow::Result<()> {
    super::run_job(&args.work, |reporter| {
        let flipbook = args.flipbook()?.prepare()?;
        let frames = flipbook.frame_count();
        let summary = flipbook.run(reporter)?;
        Ok(JobResult { unit: "frame", drawn: frames, kept: 0, files: summary.files })
    })
}
