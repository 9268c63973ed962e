//! `bansho farm`: plans jobs for batch systems, runs their tasks, and reports their state.

mod arguments;
mod journal;
mod openjd;
mod slurm;
mod status;
mod task;
mod template_steps;

use std::{
    collections::hash_map::RandomState,
    hash::{BuildHasher, Hasher},
};

use bansho::job::FlipbookSummary;
use bansho_farm::FarmError;

use crate::{
    args::{FarmArgs, FarmCommand},
    interrupt,
    progress::{JobResult, ProgressReporter},
};

pub(crate) fn run(args: &FarmArgs) -> anyhow::Result<()> {
    match &args.command {
        FarmCommand::Slurm(args) => slurm::run(args),
        FarmCommand::Status(args) => status::run(args),
        FarmCommand::Openjd(args) => openjd::run(args),
        FarmCommand::Finish(args) => template_steps::finish(args),
        FarmCommand::Snapshots(args) => template_steps::snapshots(args),
        FarmCommand::Tile(args) => template_steps::tile(args),
        FarmCommand::Check(args) => template_steps::check(args),
        FarmCommand::Task(args) => task::run(args),
    }
}

/// A random word.
fn random_token() -> String {
    // Each state has keys of its own, the first ones from the system.
    let [first, second] = [(); 2].map(|()| RandomState::new().build_hasher().finish());
    format!("{first:016x}{second:016x}")
}

/// What is reported of a flipbook.
fn flipbook_result(summary: FlipbookSummary) -> JobResult {
    JobResult { unit: "frame", drawn: summary.frames, kept: 0, files: summary.files }
}

/// Runs `work` in a thread pool of its own, and reports what a job in it says and does. Without a result there was nothing to draw.
fn run_in_pool(
    threads: Option<u16>,
    reporter: ProgressReporter,
    work: impl FnOnce(&ProgressReporter) -> Result<Option<JobResult>, FarmError> + Send,
) -> anyhow::Result<()> {
    interrupt::set_grace_period(reporter.forced_exit_message());
    let pool = super::thread_pool(threads)?;
    match pool.install(|| work(&reporter)) {
        Ok(Some(result)) => reporter.finish(Ok(result), pool.current_num_threads()),
        Ok(None) => Ok(()),
        Err(FarmError::Job(error)) => reporter.finish(Err(error), pool.current_num_threads()),
        Err(error) => Err(error.into()),
    }
}
