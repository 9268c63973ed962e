//! What Slurm says of the jobs of a plan.

use std::{
    io,
    process::{Command, Output, Stdio},
};

use bansho::{
    farm::{FarmFolder, queue::Queue},
    media::files::input,
};

/// Largest list of jobs that is read, bytes.
const JOBS_BYTES: u64 = 64 << 10;

/// A program of Slurm with its output.
pub(super) fn slurm_output(program: &str, arguments: &[&str]) -> io::Result<Output> {
    Command::new(program).args(arguments).stdin(Stdio::null()).output()
}

/// The names and numbers of the jobs that were submitted last, a job a line; `None` where none were.
pub(super) fn submitted_jobs(folder: &FarmFolder) -> Option<String> {
    let text = input::read(&folder.jobs(), JOBS_BYTES).ok()?;
    Some(String::from_utf8_lossy(&text).into_owned())
}

/// What Slurm does with the jobs of a plan; `None` where none were submitted, or this machine cannot ask.
pub(super) fn queue(folder: &FarmFolder) -> Option<Queue> {
    let submitted = submitted_jobs(folder)?;
    // All jobs rather than these: the shot may be another user's, and Slurm refuses to list a job that it has forgotten.
    let format = format!("--format={}", Queue::SLURM_FORMAT);
    let output = slurm_output("squeue", &["--noheader", "--array", &format]).ok()?;
    output.status.success().then(|| Queue::of_slurm(&submitted, &String::from_utf8_lossy(&output.stdout)))
}
