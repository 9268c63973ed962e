//! `bansho farm`

use std::path::PathBuf;

use clap::{Args, Subcommand};

use super::{
    RenderArgs,
    values::{self, ChunkLength, Frames},
};

/// Work on many machines.
#[derive(Args, Debug)]
pub(crate) struct FarmArgs {
    #[command(subcommand)]
    pub(crate) command: FarmCommand,
}

/// The commands of `bansho farm`.
#[derive(Debug, Subcommand)]
pub(crate) enum FarmCommand {
    /// Write the batch scripts that draw a shot as a job array of Slurm, and submit them.
    #[command(after_help = "\
A few frames are drawn first, to measure what a frame costs; they are kept. The folder NAME.farm beside the frames then has the plan, the scripts, \
snapshots of simulations, and what tasks print and report. Every task draws what is missing of its frames. A last job checks them, and makes the film and \
the contact sheet (of N frames that are spread over the shot). Repeat the command to submit what is \
still missing.

Examples:
  bansho farm slurm shot.toml -o /shots/a/a.####.exr --submit
  bansho farm slurm shot.toml --partition night --threads 16 --submit
  bansho farm slurm dome.toml --size 16384x16384 --tiles 2x2 --chunk 1
  bansho farm slurm shot.toml --film shot.mp4 --sbatch=--account=films")]
    Slurm(Box<SlurmArgs>),
    /// Print which frames of a shot are whole, missing or stale. The exit code is 0 only if all is whole.
    Status(FarmStatusArgs),
    /// Write a job template of Open Job Description, for AWS Deadline Cloud and other schedulers.
    #[command(after_help = "\
Options of `bansho render` for all frames follow `--`. The template has parameters for the scene, the frames, the size and the folder of the frames.

Examples:
  bansho farm openjd shot.toml -o shot.yaml
  bansho farm openjd shot.toml -o shot.yaml --film shot.mp4 -- --seed 7
  openjd run shot.yaml -p OutputFolder=/shots/a")]
    Openjd(OpenjdArgs),
    /// Check that every frame of a shot is whole, and make a film of the frames. Nothing is drawn.
    Finish(Box<FinishArgs>),
    /// Run a task of a plan. The scripts of `farm slurm` do this.
    Task(TaskArgs),
}

/// `bansho farm slurm`
#[derive(Args, Debug)]
pub(crate) struct SlurmArgs {
    #[command(flatten)]
    pub(crate) render: RenderArgs,
    /// Frames of a task, or `auto` for tasks of about --task-minutes.
    #[arg(long, value_name = "auto|N", default_value = "auto", value_parser = values::parse_chunk, help_heading = "Farm")]
    pub(crate) chunk: ChunkLength,
    /// Wanted time of a task, minutes.
    #[arg(long, value_name = "N", default_value = "30", value_parser = clap::value_parser!(u32).range(1..=10_080), help_heading = "Farm")]
    pub(crate) task_minutes: u32,
    /// Split each picture into so many tiles, a task each, which the last job joins.
    #[arg(long, value_name = "COLUMNSxROWS", default_value = "1x1", value_parser = values::parse_grid, conflicts_with = "crop", help_heading = "Farm")]
    pub(crate) tiles: [usize; 2],
    /// Film that the last job makes of the frames (.mp4 .mov .webm .apng .gif; of .png frames).
    #[arg(long, value_name = "PATH", help_heading = "Farm")]
    pub(crate) film: Option<PathBuf>,
    /// Partition of Slurm. [default: that of the cluster]
    #[arg(long, value_name = "NAME", help_heading = "Farm")]
    pub(crate) partition: Option<String>,
    /// Another option of `sbatch` for all jobs, such as `--sbatch=--account=films`. May be repeated.
    #[arg(long, value_name = "OPTION", allow_hyphen_values = true, help_heading = "Farm")]
    pub(crate) sbatch: Vec<String>,
    /// Largest number of tasks of an array. [default: MaxArraySize of the cluster; 1001 where it cannot be asked]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4_000_001), help_heading = "Farm")]
    pub(crate) max_array_size: Option<u32>,
    /// The program on the machines of the cluster. [default: the path of this one]
    #[arg(long, value_name = "PATH", help_heading = "Farm")]
    pub(crate) program: Option<PathBuf>,
    /// Submit the scripts.
    #[arg(long, help_heading = "Farm")]
    pub(crate) submit: bool,
}

/// `bansho farm status`
#[derive(Args, Debug)]
pub(crate) struct FarmStatusArgs {
    /// The scene file.
    pub(crate) scene: PathBuf,
    /// The output that the tasks were planned with. [default: out/SCENE/SCENE.####.png]
    #[arg(short, long, value_name = "PATH")]
    pub(crate) out: Option<PathBuf>,
    /// Print one JSON object.
    #[arg(long)]
    pub(crate) json: bool,
}

/// `bansho farm openjd`
#[derive(Args, Debug)]
pub(crate) struct OpenjdArgs {
    /// The scene file.
    pub(crate) scene: PathBuf,
    /// The template.
    #[arg(short, long, value_name = "PATH")]
    pub(crate) out: PathBuf,
    /// Name of the frames: .png or .exr. [default: SCENE.####.png]
    #[arg(long, value_name = "NAME")]
    pub(crate) frame_name: Option<String>,
    /// Frames, as for `bansho render`. [default: all]
    #[arg(long, value_name = "SPEC", allow_hyphen_values = true, value_parser = values::parse_frames)]
    pub(crate) frames: Option<Frames>,
    /// Replace the scene's picture size.
    #[arg(long, value_name = "WIDTHxHEIGHT", value_parser = values::parse_size)]
    pub(crate) size: Option<[usize; 2]>,
    /// Frames of a chunk; schedulers may adapt it.
    #[arg(long, value_name = "N", default_value = "24", value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) chunk: u32,
    /// Wanted time of a chunk, minutes.
    #[arg(long, value_name = "N", default_value = "30", value_parser = clap::value_parser!(u32).range(1..=10_080))]
    pub(crate) task_minutes: u32,
    /// Film that the last step makes of the frames, beside them (.mp4 .mov .webm .apng .gif).
    #[arg(long, value_name = "NAME")]
    pub(crate) film: Option<String>,
    /// Options of `bansho render` for all frames.
    #[arg(last = true, value_name = "OPTIONS")]
    pub(crate) options: Vec<String>,
}

/// `bansho farm finish`
#[derive(Args, Debug)]
pub(crate) struct FinishArgs {
    #[command(flatten)]
    pub(crate) render: RenderArgs,
    /// Film to make of the frames (.mp4 .mov .webm .apng .gif).
    #[arg(long, value_name = "PATH", help_heading = "Farm")]
    pub(crate) film: Option<PathBuf>,
}

/// `bansho farm task`
#[derive(Args, Debug)]
pub(crate) struct TaskArgs {
    /// The folder of the plan.
    pub(crate) folder: PathBuf,
    /// The token of the plan that the task belongs to.
    #[arg(long)]
    pub(crate) token: String,
    #[command(subcommand)]
    pub(crate) task: TaskCommand,
}

/// What a task does.
#[derive(Clone, Copy, Debug, Subcommand)]
pub(crate) enum TaskCommand {
    /// Check that this machine may take part: it sees the same folder, runs the same version, and gives the same bytes.
    Check,
    /// Leave a snapshot at the beginning of every chunk.
    Snapshots {
        #[command(flatten)]
        threads: ThreadArgs,
    },
    /// Draw the frames of one task.
    Frames {
        /// Number of the task.
        #[arg(long)]
        index: usize,
        #[command(flatten)]
        threads: ThreadArgs,
    },
    /// Check that all frames are whole, join tiles and make the film.
    Finish {
        #[command(flatten)]
        threads: ThreadArgs,
    },
}

/// Threads of a task.
#[derive(Args, Clone, Copy, Debug)]
pub(crate) struct ThreadArgs {
    /// Number of threads. [default: one for each core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub(crate) threads: Option<u16>,
}
