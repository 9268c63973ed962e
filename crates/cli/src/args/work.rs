//! Options that several commands have.

use std::path::PathBuf;

use bansho::base::math::simd::VectorLevel;
use clap::Args;

/// `--progress`
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum ProgressKind {
    /// A bar on stderr with frame rate and remaining time, if stderr is a terminal; then one line.
    #[default]
    Bar,
    /// One JSON object a line on stdout: start, frame, stats with `--stats`, done, error.
    Json,
    /// Only warnings and errors.
    None,
}

/// Options of all commands that run jobs.
#[derive(Args, Debug)]
pub(crate) struct WorkArgs {
    /// Number of threads. The pictures are the same for any number. [default: one for each core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024), help_heading = "Work")]
    pub(crate) threads: Option<u16>,
    /// How progress is reported.
    #[arg(long, value_enum, default_value_t, help_heading = "Work")]
    pub(crate) progress: ProgressKind,
    /// Print the time of each stage and of each phenomenon at the end.
    #[arg(long, help_heading = "Work")]
    pub(crate) stats: bool,
    /// Vector instructions to use, for tests and measurements: the pictures are the same. [default: the widest that this machine has]
    #[arg(long, value_name = "LEVEL", help_heading = "Work")]
    pub(crate) vector_level: Option<VectorLevel>,
}

/// Options for existing files.
#[derive(Args, Debug)]
pub(crate) struct OverwriteArgs {
    /// Also overwrite files that Bansho did not make. Files that it made are overwritten without this option; files that the scene is read from
    /// never are.
    #[arg(long, help_heading = "Output")]
    pub(crate) overwrite: bool,
}

/// Options for snapshots of a simulation.
#[derive(Args, Debug)]
pub(crate) struct StateArgs {
    /// Save snapshots of simulated phenomena in this folder, and start from the nearest one.
    #[arg(long, value_name = "DIR", help_heading = "Work")]
    pub(crate) snapshots: Option<PathBuf>,
    /// Frames between snapshots. [default: one snapshot a second]
    #[arg(long, value_name = "N", requires = "snapshots", help_heading = "Work")]
    pub(crate) snapshot_every: Option<u64>,
}
