//! Options that several commands have: the scene that they read with limits for the files that it names, and how they work and write.

use std::{
    io,
    path::{Path, PathBuf},
};

use bansho::{
    base::math::simd::VectorLevel,
    job::{JobError, SceneFile},
    media::assets::InputLimits,
};
use clap::Args;

use super::values;

/// Name of a scene from standard input in messages and outputs.
const STDIN: &str = "stdin";

/// Options of all commands that read a scene.
#[derive(Args, Clone, Debug)]
pub(crate) struct InputArgs {
    /// Maximum memory for all pictures, meshes and drawings of a scene together, such as 512MiB or 8GiB. Files that would need more are refused
    /// before they are read.
    #[arg(long, value_name = "SIZE", default_value = "2GiB", value_parser = values::parse_bytes, help_heading = "Input")]
    max_asset_memory: u64,
    /// Refuse files outside this folder, after following links. For scenes from untrusted sources. [default: a scene may name any file]
    #[arg(long, value_name = "DIR", value_parser = values::parse_folder, help_heading = "Input")]
    asset_root: Option<PathBuf>,
}

impl InputArgs {
    /// Reads the scene at `path`, or from standard input if `path` is `-`. `changes` are applied to it.
    pub(crate) fn read(&self, path: &Path, changes: &[String]) -> Result<SceneFile, JobError> {
        let scene = match path.to_str() {
            Some("-") => SceneFile::read_stream(STDIN, io::stdin().lock())?,
            _ => SceneFile::read(path)?,
        };
        let input_limits = InputLimits { memory_bytes: self.max_asset_memory, root: self.asset_root.clone() };
        Ok(SceneFile { changes: changes.to_vec(), input_limits, ..scene })
    }
}

/// `--progress`
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum ProgressKind {
    /// A bar on stderr with frame rate and remaining time, if stderr is a terminal; then one line.
    #[default]
    Bar,
    /// One JSON object per line on stdout: start, frame, stats with `--stats`, done, error.
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
