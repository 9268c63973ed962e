//! `bansho studio`

use std::{
    env, io,
    path::PathBuf,
    process::{Command, ExitStatus},
};

use crate::args::StudioArgs;

/// The studio's program.
const PROGRAM: &str = "bansho-studio";

/// Why there is no studio.
#[derive(Debug, thiserror::Error)]
enum StudioError {
    /// It is not installed.
    #[error(
        "the studio is a program of its own, {PROGRAM}, and it is neither beside this one nor on the path; \
         from a checkout, `cargo install --path crates/studio` installs it"
    )]
    Missing,
    /// It cannot be started.
    #[error("{PROGRAM} cannot be started: {0}")]
    Start(io::Error),
    /// It failed, and said why.
    #[error("{PROGRAM} failed: {0}")]
    Failed(ExitStatus),
}

/// Starts the studio and waits until its window is closed.
pub(crate) fn run(args: &StudioArgs) -> anyhow::Result<()> {
    let program = beside().unwrap_or_else(|| PathBuf::from(PROGRAM));
    let status = Command::new(program).args(&args.scene).status().map_err(|error| match error.kind() {
        io::ErrorKind::NotFound => StudioError::Missing,
        _ => StudioError::Start(error),
    })?;
    if status.success() { Ok(()) } else { Err(StudioError::Failed(status).into()) }
}

/// The studio that lies beside this program.
fn beside() -> Option<PathBuf> {
    let path = env::current_exe().ok()?.with_file_name(format!("{PROGRAM}{}", env::consts::EXE_SUFFIX));
    path.is_file().then_some(path)
}
