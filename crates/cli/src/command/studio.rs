//! `bansho studio`

use std::{
    env, io,
    path::PathBuf,
    process::{Command, ExitStatus},
};

use crate::{args::StudioArgs, exit::ReportedError};

/// The studio's program.
const PROGRAM: &str = "bansho-studio";

/// Why the studio does not run.
#[derive(Debug, thiserror::Error)]
enum StudioError {
    /// It is not installed.
    #[error(
        "the studio is a separate program, {PROGRAM}, which is neither in the folder of this one nor on the path; \
         from a checkout, `cargo install --path crates/studio` installs it"
    )]
    Missing,
    /// It cannot be started.
    #[error("{PROGRAM} cannot be started: {0}")]
    Start(io::Error),
    /// There is no display for a window.
    #[error(
        "there is no display for the studio's window: neither DISPLAY nor WAYLAND_DISPLAY is set; start it from a desktop session or \
         by `ssh -X`, or draw without a window: bansho render SCENE"
    )]
    NoDisplay,
    /// It was ended by a signal, or failed without a message.
    #[error("{PROGRAM} failed: {0}")]
    Failed(ExitStatus),
}

/// Starts the studio and waits until its window is closed.
pub(crate) fn run(args: &StudioArgs) -> anyhow::Result<()> {
    if !has_display() {
        return Err(StudioError::NoDisplay.into());
    }
    let program = in_own_folder().unwrap_or_else(|| PathBuf::from(PROGRAM));
    let status = Command::new(program).args(&args.scene).status().map_err(|error| match error.kind() {
        io::ErrorKind::NotFound => StudioError::Missing,
        _ => StudioError::Start(error),
    })?;
    match status.code() {
        Some(0) => Ok(()),
        Some(1) => Err(ReportedError::OtherProgram.into()),
        _ => Err(StudioError::Failed(status).into()),
    }
}

/// Whether the environment names a display. Always true on systems without such variables.
fn has_display() -> bool {
    let needed = cfg!(all(unix, not(any(target_os = "macos", target_os = "ios", target_os = "android"))));
    let variables = ["DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"];
    !needed || variables.into_iter().any(|name| env::var_os(name).is_some_and(|value| !value.is_empty()))
}

/// The studio in the folder of this program, if it is there.
fn in_own_folder() -> Option<PathBuf> {
    let path = env::current_exe().ok()?.with_file_name(format!("{PROGRAM}{}", env::consts::EXE_SUFFIX));
    path.is_file().then_some(path)
}
