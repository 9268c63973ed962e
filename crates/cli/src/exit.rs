//! How the program ends: exit codes, and the messages of errors.

use std::process::ExitCode;

use bansho::job::{ErrorCategory, JobError};
use bansho_farm::FarmError;

use crate::{
    flags, interrupt,
    output::{print_error_lines, print_message},
    plot::PlotError,
};

/// The command failed.
const FAILED: u8 = 1;
/// The command line is invalid.
const USAGE: u8 = 2;
/// The scene is invalid.
const SCENE: u8 = 3;

/// An invalid argument that only the command finds, such as an unknown name.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub(crate) struct UsageError(pub(crate) String);

/// An error whose message has already been printed. It only determines the exit code.
#[derive(Debug, thiserror::Error)]
pub(crate) enum ReportedError {
    /// A job failed.
    #[error(transparent)]
    Job(JobError),
    /// Not all frames of a shot are whole, which was the question.
    #[error("not all frames are whole")]
    Incomplete,
    /// Another program failed, which printed the error itself.
    #[error("another program failed")]
    OtherProgram,
}

/// The exit code of an error.
pub(crate) fn code(error: &anyhow::Error) -> u8 {
    match category(error) {
        Some(ErrorCategory::Usage) => USAGE,
        Some(ErrorCategory::Scene) => SCENE,
        Some(ErrorCategory::Cancelled) => interrupt::exit_code(),
        None if error.is::<UsageError>() => USAGE,
        Some(ErrorCategory::Work) | None => FAILED,
    }
}

/// What an error of a job, a farm or a figure is about; `None` for other errors.
fn category(error: &anyhow::Error) -> Option<ErrorCategory> {
    if let Some(ReportedError::Job(job)) = error.downcast_ref() {
        return Some(job.category());
    }
    let job = error.downcast_ref().map(JobError::category);
    let farm = error.downcast_ref().map(FarmError::category);
    job.or(farm).or(error.downcast_ref().map(PlotError::category))
}

/// The message of an error with those of its causes, each once: many messages contain that of their cause.
pub(crate) fn message(error: &anyhow::Error) -> String {
    let mut message = String::new();
    for cause in error.chain().map(ToString::to_string) {
        if message.is_empty() {
            message = cause;
        } else if !message.contains(&cause) {
            message = format!("{message}: {cause}");
        }
    }
    message
}

/// Prints an `error:` line for each error that has not been printed yet, and returns the exit code.
pub(crate) fn report(error: &anyhow::Error) -> ExitCode {
    if !error.is::<ReportedError>() {
        let of_farm = match error.downcast_ref() {
            Some(FarmError::Job(job)) => Some(job),
            _ => None,
        };
        match error.downcast_ref::<JobError>().or(of_farm) {
            Some(job) => print_job_error(job),
            None => print_message("error", &message(error)),
        }
    }
    ExitCode::from(code(error))
}

/// Prints the error of a job.
pub(crate) fn print_job_error(error: &JobError) {
    match error.scene() {
        Some(scene) => {
            let frame = error.frame().map(|number| format!("frame {number}: ")).unwrap_or_default();
            scene.messages().for_each(|message| print_error_lines(&format!("error: {frame}{message}")));
            scene.omitted_message().iter().for_each(|message| print_error_lines(message));
            flags::hint_for_scene(scene).iter().for_each(|hint| print_message("hint", hint));
        }
        None => print_message("error", &flags::error_message(error)),
    }
}

#[cfg(test)]
mod tests {
    use std::io;

    use super::*;

    #[test]
    fn causes_are_told_once() {
        let path = "/gone".into();
        let error = FarmError::Io { path, source: io::Error::other("it is away") };
        assert_eq!(message(&error.into()), "/gone: it is away");
        let error = anyhow::Error::from(io::Error::other("no more")).context("--threads 9");
        assert_eq!(message(&error), "--threads 9: no more");
    }
}
