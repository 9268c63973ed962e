//! The commands of the program.

pub(crate) mod calibrate;
pub(crate) mod check;
pub(crate) mod farm;
pub(crate) mod flipbook;
pub(crate) mod generated;
pub(crate) mod new;
pub(crate) mod plot;
pub(crate) mod render;
pub(crate) mod simulate;
pub(crate) mod streaks;
pub(crate) mod studio;
pub(crate) mod upgrade;

use bansho::{base::math::simd::set_vector_level, job::JobError};

use crate::{
    args::WorkArgs,
    interrupt,
    progress::{JobResult, ProgressReporter},
};

/// Runs a job in a thread pool of its own, and reports its progress and its result.
fn run_job(
    args: &WorkArgs,
    job: impl FnOnce(&ProgressReporter) -> Result<JobResult, JobError> + Send,
) -> anyhow::Result<()> {
    set_vector_level(args.vector_level)?;
    let reporter = ProgressReporter::new(args.progress, args.stats);
    interrupt::set_grace_period(reporter.forced_exit_message());
    // 0 is one thread for each core.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(args.threads.map_or(0, usize::from)).build()?;
    let result = pool.install(|| job(&reporter));
    reporter.finish(result, pool.current_num_threads())
}
