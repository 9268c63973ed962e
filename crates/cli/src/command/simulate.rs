//! `bansho simulate`

use crate::{args::SimulateArgs, progress};

/// Simulates a scene and writes its particles.
pub(crate) fn run(args: &SimulateArgs) -> anyhow::Result<()> {
    super::watched(&args.work, |watcher| {
        let summary = args.simulation()?.prepare()?.run(watcher)?;
        Ok(progress::Result {
            what: "frame",
            drawn: summary.drawn,
            kept: summary.kept,
            files: vec![summary.first_file],
        })
    })
}
