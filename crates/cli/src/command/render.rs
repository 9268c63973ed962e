//! `bansho render`

use crate::{args::RenderArgs, progress};

/// Draws a scene to files.
pub(crate) fn run(args: &RenderArgs) -> anyhow::Result<()> {
    super::watched(&args.work, |watcher| {
        let summary = args.job()?.prepare()?.run(watcher)?;
        Ok(progress::Result {
            what: "frame",
            drawn: summary.drawn,
            kept: summary.kept,
            files: vec![summary.first_file],
        })
    })
}
