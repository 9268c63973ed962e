//! `bansho render`

use crate::{args::RenderArgs, progress::JobResult};

/// Draws a scene to files.
pub(crate) fn run(args: &RenderArgs) -> anyhow::Result<()> {
    super::run_job(&args.work, |reporter| {
        let summary = args.job()?.prepare()?.run(reporter)?;
        Ok(JobResult { unit: "frame", drawn: summary.drawn, kept: summary.kept, files: vec![summary.first_file] })
    })
}
