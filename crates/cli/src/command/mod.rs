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

use anyhow::Context;
use bansho::{base::math::simd::set_vector_level, job::JobError};

use crate::{
    args::WorkArgs,
    interrupt,
    progress::{JobResult, ProgressReporter},
};

/// A pool of so many threads; of one for each core if there is no number.
fn thread_pool(threads: Option<u16>) -> anyhow::Result<rayon::ThreadPool> {
    let count = threads.map_or(0, usize::from);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(count).build();
    pool.with_context(|| match threads {
        Some(count) => format!("--threads {count}: the system starts no more threads; allowed: fewer"),
        None => "the system starts no thread for each core; --threads states how many".to_owned(),
    })
}

/// Runs a job in a thread pool of its own, and reports its progress and its result.
fn run_job(
    args: &WorkArgs,
    job: impl FnOnce(&ProgressReporter) -> Result<JobResult, JobError> + Send,
) -> anyhow::Result<()> {
    set_vector_level(args.vector_level)?;
    let reporter = ProgressReporter::new(args.progress, args.stats);
    interrupt::set_grace_period(reporter.forced_exit_message());
    let pool = thread_pool(args.threads)?;
    let result = pool.install(|| job(&reporter));
    reporter.finish(result, pool.current_num_threads())
}
