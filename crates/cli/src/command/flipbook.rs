//! `bansho flipbook`

use crate::{args::FlipbookArgs, progress};

/// Draws a scene into sheets for game engines.
pub(crate) fn run(args: &FlipbookArgs) -> anyhow::Result<()> {
    super::watched(&args.work, |watcher| {
        let flipbook = args.flipbook()?.prepare()?;
        let frames = flipbook.frame_count();
        let summary = flipbook.run(watcher)?;
        Ok(progress::Result { what: "frame", drawn: frames, kept: 0, files: summary.files })
    })
}
