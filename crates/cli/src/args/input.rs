//! The scene that a command reads, and what the files that it names may be.

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

/// What errors and outputs call a scene from standard input.
const STDIN: &str = "stdin";

/// Options of everything that reads a scene.
#[derive(Args, Clone, Debug)]
pub(crate) struct InputArgs {
    /// Memory that the pictures, meshes and drawings of a scene may take together, such as 512MiB or 8GiB. Files that would take more are
    /// refused before they are read.
    #[arg(long, value_name = "SIZE", default_value = "2GiB", value_parser = values::parse_bytes, help_heading = "Input")]
    max_asset_memory: u64,
    /// Refuse files that a scene names outside of this folder, links followed. For scenes of people one does not know. [default: a scene may
    /// name any file]
    #[arg(long, value_name = "DIR", value_parser = values::parse_folder, help_heading = "Input")]
    asset_root: Option<PathBuf>,
}

impl InputArgs {
    /// Reads the scene at `path`, from standard input where that is `-`, with `changes` to be made to it.
    pub(crate) fn read(&self, path: &Path, changes: &[String]) -> Result<SceneFile, JobError> {
        let scene = match path.to_str() {
            Some("-") => SceneFile::read_stream(STDIN, io::stdin().lock())?,
            _ => SceneFile::read(path)?,
        };
        let inputs = InputLimits { memory_bytes: self.max_asset_memory, root: self.asset_root.clone() };
        Ok(SceneFile { changes: changes.to_vec(), inputs, ..scene })
    }
}
