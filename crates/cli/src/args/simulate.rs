//! `bansho simulate`

use std::path::PathBuf;

use bansho::job::{JobError, Simulate};
use clap::Args;

use super::{
    shared::{InputArgs, OverwriteArgs, StateArgs, WorkArgs},
    values::{self, Frames},
};

/// Options of a simulation.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  bansho simulate torch.toml --particles gas.####.ply          all frames
  bansho simulate torch.toml --particles gas.ply --frames 60   one
  bansho simulate torch.toml --particles gas.####.ply --snapshots states

Each file is a binary PLY with x y z (m, y up) and vx vy vz (m/s) of every particle in the middle of the frame's exposure; of a \
particle flame also temperature (K) and density (kg/m^3), of an aurora also energy (eV) and power (W), of \
rain diameter_mm (mm) and opacity (of the streak, on its axis) of every drop that the camera sees as a streak. Blender, MeshLab and Open3D read it.")]
pub(crate) struct SimulateArgs {
    /// The scene file; `-` reads it from standard input.
    pub(crate) scene: PathBuf,
    /// Output files, one .ply for each frame; `####` or `%04d` is replaced by the frame number.
    #[arg(long, value_name = "PATH")]
    particles: PathBuf,
    /// Frames: 0-239, 0-239x10 or 0-239:10 (every tenth), 17, -3-5, 1-5,9. [default: all]
    #[arg(long, value_name = "SPEC", allow_hyphen_values = true, value_parser = values::parse_frames)]
    frames: Option<Frames>,
    /// Replace the scene's seed.
    #[arg(long, value_name = "N", allow_hyphen_values = true, value_parser = values::parse_seed)]
    seed: Option<u64>,
    /// Change a setting of the scene for this run. May be repeated.
    #[arg(long, value_name = "KEY.PATH=VALUE")]
    set: Vec<String>,
    #[command(flatten)]
    states: StateArgs,
    #[command(flatten)]
    inputs: InputArgs,
    #[command(flatten)]
    output: OverwriteArgs,
    #[command(flatten)]
    pub(crate) work: WorkArgs,
}

impl SimulateArgs {
    /// The simulation job.
    pub(crate) fn simulation(&self) -> Result<Simulate, JobError> {
        let scene = self.inputs.read(&self.scene, &self.set)?;
        Ok(Simulate {
            frames: self.frames.clone().map(|Frames(numbers)| numbers),
            seed: self.seed,
            snapshots: self.states.snapshots.clone(),
            snapshot_every: self.states.snapshot_every,
            overwrite: self.output.overwrite,
            ..Simulate::new(scene, self.particles.clone())
        })
    }
}
