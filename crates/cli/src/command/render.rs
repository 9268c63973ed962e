//! `bansho render`

use crate::{args::RenderArgs, progress::JobResult};

/// Draws a scene to files.
pub(crate) fn run(args: &RenderArgs) -> anyhow::Result<()> {
    super::run_job(&args.work, |reporter| {
        let job = args.job()?.prepare()?;
        reporter.set_estimated_memory(job.memory_bytes());
        let summary = job.run(reporter)?;
        Ok(JobResult { unit: "frame", drawn: summary.drawn, kept: summary.kept, files: vec![summary.first_file] })
    })
}
