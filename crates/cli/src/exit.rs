//! How the program ends: exit codes, and errors as a person reads them.

use std::process::ExitCode;

use bansho::job::{Cause, JobError};

use crate::{
    command::{new::Unknown, studio::AlreadyReported},
    flags, interrupt,
    output::{self, to_stderr},
};

/// The work failed.
const FAILED: u8 = 1;
/// The command line is invalid.
const USAGE: u8 = 2;
/// The scene is faulty.
const SCENE: u8 = 3;

/// An error that has already been reported; only its exit code is left.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub(crate) struct ReportedJobError(pub(crate) JobError);

/// The exit code of an error.
pub(crate) fn code(error: &anyhow::Error) -> u8 {
    let reported = || error.downcast_ref::<ReportedJobError>().map(|reported| &reported.0);
    match error.downcast_ref::<JobError>().or_else(reported).map(JobError::cause) {
        Some(Cause::Usage) => USAGE,
        Some(Cause::Scene) => SCENE,
        Some(Cause::Cancelled) => interrupt::exit_code(),
        None if error.is::<Unknown>() => USAGE,
        Some(Cause::Work) | None => FAILED,
    }
}

/// Prints one `error:` line for each error and returns the exit code.
pub(crate) fn report(error: &anyhow::Error) -> ExitCode {
    if !error.is::<ReportedJobError>() && !error.is::<AlreadyReported>() {
        tell(error);
    }
    ExitCode::from(code(error))
}

fn tell(error: &anyhow::Error) {
    match error.downcast_ref::<JobError>() {
        Some(job) => report_job_error(job),
        None => output::tell("error", &format!("{error:#}")),
    }
}

/// Prints the error of a job.
pub(crate) fn report_job_error(error: &JobError) {
    match error.scene() {
        Some(scene) => {
            scene.faults().for_each(|fault| to_stderr(&format!("error: {fault}")));
            scene.more().iter().for_each(|more| to_stderr(more));
            flags::for_scene(scene).iter().for_each(|flag| output::tell("hint", flag));
        }
        None => output::tell("error", &flags::error(error)),
    }
}
