//! How work is done, the same for several commands.

use std::path::PathBuf;

use clap::Args;

use crate::progress::ProgressKind;

/// Options of everything that draws.
#[derive(Args, Debug)]
pub(crate) struct WorkArgs {
    /// Threads that draw and write. The pictures are the same for any number. [default: one for each core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024), help_heading = "Work")]
    pub(crate) threads: Option<u16>,
    /// How progress is told.
    #[arg(long, value_enum, default_value_t, help_heading = "Work")]
    pub(crate) progress: ProgressKind,
    /// Say at the end where the time went.
    #[arg(long, help_heading = "Work")]
    pub(crate) stats: bool,
}

/// What may be written over.
#[derive(Args, Debug)]
pub(crate) struct OverwriteArgs {
    /// Write also over files that Bansho did not make. Files that it made are replaced without this; what the scene is read from never is.
    #[arg(long, help_heading = "Output")]
    pub(crate) overwrite: bool,
}

/// Where what is simulated in steps is kept.
#[derive(Args, Debug)]
pub(crate) struct StateArgs {
    /// Keep the state of what is simulated in steps here, and begin from the nearest state.
    #[arg(long, value_name = "DIR", help_heading = "Work")]
    pub(crate) snapshots: Option<PathBuf>,
    /// Frames between snapshots. [default: a second's worth]
    #[arg(long, value_name = "N", requires = "snapshots", help_heading = "Work")]
    pub(crate) snapshot_every: Option<u64>,
}
