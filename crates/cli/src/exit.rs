//! How the program ends: exit codes, and errors as a person reads them.

use std::process::ExitCode;

use bansho::job::{Cause, JobError};

use crate::{
    command::{new::Unknown, studio::SaidWhy},
    flags, interrupt,
    output::{self, to_stderr},
};

/// Failed on the way.
const FAILED: u8 = 1;
/// What was asked for makes no sense.
const USAGE: u8 = 2;
/// The scene is faulty.
const SCENE: u8 = 3;

/// An error that has been told already; only its exit code is left.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub(crate) struct Told(pub(crate) JobError);

/// The exit code of an error.
pub(crate) fn code(error: &anyhow::Error) -> u8 {
    let told = || error.downcast_ref::<Told>().map(|told| &told.0);
    match error.downcast_ref::<JobError>().or_else(told).map(JobError::cause) {
        Some(Cause::Usage) => USAGE,
        Some(Cause::Scene) => SCENE,
        Some(Cause::Cancelled) => interrupt::exit_code(),
        None if error.is::<Unknown>() => USAGE,
        Some(Cause::Work) | None => FAILED,
    }
}

/// Tells what went wrong, one `error:` for each fault, and gives the exit code.
pub(crate) fn report(error: &anyhow::Error) -> ExitCode {
    if !error.is::<Told>() && !error.is::<SaidWhy>() {
        tell(error);
    }
    ExitCode::from(code(error))
}

fn tell(error: &anyhow::Error) {
    match error.downcast_ref::<JobError>() {
        Some(job) => tell_job(job),
        None => output::tell("error", &format!("{error:#}")),
    }
}

/// Tells what went wrong with a job.
pub(crate) fn tell_job(error: &JobError) {
    match error.scene() {
        Some(scene) => {
            scene.faults().for_each(|fault| to_stderr(&format!("error: {fault}")));
            scene.more().iter().for_each(|more| to_stderr(more));
            flags::for_scene(scene).iter().for_each(|flag| output::tell("hint", flag));
        }
        None => output::tell("error", &flags::error(error)),
    }
}
