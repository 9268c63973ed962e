//! `bansho simulate`

use crate::{args::SimulateArgs, progress::JobResult};

/// Simulates a scene and writes its particles.
pub(crate) fn run(args: &SimulateArgs) -> anyhow::Result<()> {
    super::run_job(&args.work, |reporter| {
        let summary = args.simulation()?.prepare()?.run(reporter)?;
        Ok(JobResult { unit: "frame", drawn: summary.drawn, kept: summary.kept, files: vec![summary.first_file] })
    })
}
