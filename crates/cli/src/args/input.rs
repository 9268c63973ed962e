//! The scene that a command reads, and limits for the files that it names.

use std::{
    io,
    path::{Path, PathBuf},
};

use bansho::{
    job::{JobError, SceneFile},
    media::assets::InputLimits,
};

use super::values;
use clap::Args;

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
