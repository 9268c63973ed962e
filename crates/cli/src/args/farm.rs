//! `bansho farm`

use std::path::PathBuf;

use bansho_farm::products::{FlipbookRequest, Products};
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
snapshots of simulations, and what tasks print and report. Every task draws what is missing of its frames. A last job checks them, and makes the film, \
the contact sheet (of N frames that are spread over the shot) and the flipbook. Repeat the command to submit what is \
still missing.

Examples:
  bansho farm slurm shot.toml -o /shots/a/a.####.exr --submit
  bansho farm slurm shot.toml --partition night --threads 16 --submit
  bansho farm slurm dome.toml --size 16384x16384 --tiles 2x2 --chunk 1
  bansho farm slurm shot.toml --film shot.mp4 --sbatch=--account=films
  bansho farm slurm shot.toml --flipbook game/a.png --flipbook-grid 8x8")]
    Slurm(Box<SlurmArgs>),
    /// Print which frames of a shot are whole, missing or stale, and the state of its tasks. The exit code is 0 only if everything is whole.
    Status(FarmStatusArgs),
    /// Write a job template of Open Job Description, for AWS Deadline Cloud and other schedulers.
    #[command(after_help = "\
Options of `bansho render` for all frames follow `--`. The template has parameters for the scene, the frames, the size and the folder of the frames.

Examples:
  bansho farm openjd shot.toml -o shot.yaml
  bansho farm openjd shot.toml -o shot.yaml --film shot.mp4 -- --seed 7
  openjd run shot.yaml -p OutputFolder=/shots/a")]
    Openjd(OpenjdArgs),
    /// Check that every frame of a shot is whole, join tiles, and make a film and a contact sheet of the frames. Only a flipbook is drawn.
    Finish(Box<FinishArgs>),
    /// Write snapshots at the beginning of chunks that have frames to draw. Nothing is drawn. Templates of `farm openjd` do this.
    Snapshots(Box<SnapshotsArgs>),
    /// Draw one tile of each frame. Templates of `farm openjd` do this.
    Tile(Box<TileArgs>),
    /// Check that this machine sees the folder of the frames and draws the same bytes. Templates of `farm openjd` do this.
    Check(CheckMachineArgs),
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
    /// Target time of a task, minutes.
    #[arg(long, value_name = "N", default_value = "30", value_parser = clap::value_parser!(u32).range(1..=10_080), help_heading = "Farm")]
    pub(crate) task_minutes: u32,
    /// Split each picture into this many tiles. Each tile is a task, and the last job joins them.
    #[arg(long, value_name = "COLUMNSxROWS", default_value = "1x1", value_parser = values::parse_grid, conflicts_with = "crop", help_heading = "Farm")]
    pub(crate) tiles: [usize; 2],
    #[command(flatten)]
    pub(crate) products: ProductArgs,
    /// Partition of Slurm. [default: that of the cluster]
    #[arg(long, value_name = "NAME", help_heading = "Farm")]
    pub(crate) partition: Option<String>,
    /// Another option of `sbatch` for all jobs, such as `--sbatch=--account=films`. May be repeated.
    #[arg(long, value_name = "OPTION", allow_hyphen_values = true, help_heading = "Farm")]
    pub(crate) sbatch: Vec<String>,
    /// Largest number of tasks of an array. [default: MaxArraySize of the cluster; 1001 if the cluster cannot be queried]
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
    /// Target time of a chunk, minutes.
    #[arg(long, value_name = "N", default_value = "30", value_parser = clap::value_parser!(u32).range(1..=10_080))]
    pub(crate) task_minutes: u32,
    /// Split each picture into this many tiles. Each tile is a task, and the last step joins them.
    #[arg(long, value_name = "COLUMNSxROWS", default_value = "1x1", value_parser = values::parse_grid)]
    pub(crate) tiles: [usize; 2],
    #[command(flatten)]
    pub(crate) products: ProductArgs,
    /// Contact sheet of N frames that are spread over the shot.
    #[arg(long, value_name = "N", help_heading = "At the end")]
    pub(crate) contact_sheet: Option<usize>,
    /// Options of `bansho render` for all frames.
    #[arg(last = true, value_name = "OPTIONS")]
    pub(crate) options: Vec<String>,
}

/// What is made when all frames are whole.
#[derive(Args, Debug)]
pub(crate) struct ProductArgs {
    /// Film of the frames (.mp4 .mov .webm .apng .gif).
    #[arg(long, value_name = "PATH", help_heading = "At the end")]
    film: Option<PathBuf>,
    /// Flipbook of the shot, as `bansho flipbook` makes it with the same seed, loop, view, bits and alpha: NAME.png or NAME.exr.
    #[arg(long, value_name = "PATH", requires = "flipbook_grid", help_heading = "At the end")]
    flipbook: Option<PathBuf>,
    /// Columns and rows of the flipbook, whose product is the number of its frames.
    #[arg(long, value_name = "COLUMNSxROWS", requires = "flipbook", value_parser = values::parse_grid, help_heading = "At the end")]
    flipbook_grid: Option<[usize; 2]>,
    /// Size of one frame of the flipbook. [default: cropped to what is lit; the sheet is up to 2048 pixels wide or high]
    #[arg(long, value_name = "WIDTHxHEIGHT", requires = "flipbook", value_parser = values::parse_size, help_heading = "At the end")]
    flipbook_size: Option<[usize; 2]>,
}

impl ProductArgs {
    /// What is made, with a contact sheet of `contact_sheet` frames.
    pub(crate) fn products(&self, contact_sheet: Option<usize>) -> Products {
        let flipbook = self.flipbook.clone().zip(self.flipbook_grid);
        let flipbook = flipbook.map(|(path, grid)| FlipbookRequest { path, grid, tile: self.flipbook_size });
        Products { film: self.film.clone(), contact_sheet, flipbook }
    }
}

/// `bansho farm finish`
#[derive(Args, Debug)]
pub(crate) struct FinishArgs {
    #[command(flatten)]
    pub(crate) render: RenderArgs,
    /// Join this many tiles of each picture.
    #[arg(long, value_name = "COLUMNSxROWS", default_value = "1x1", value_parser = values::parse_grid, conflicts_with = "crop", help_heading = "Farm")]
    pub(crate) tiles: [usize; 2],
    #[command(flatten)]
    pub(crate) products: ProductArgs,
}

/// `bansho farm snapshots`
#[derive(Args, Debug)]
pub(crate) struct SnapshotsArgs {
    #[command(flatten)]
    pub(crate) render: RenderArgs,
    /// Frames of a chunk, counted from the first frame of the scene.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), requires = "snapshots", help_heading = "Farm")]
    pub(crate) chunk: u32,
    /// Columns and rows of the tiles in which each picture is drawn.
    #[arg(long, value_name = "COLUMNSxROWS", default_value = "1x1", value_parser = values::parse_grid, conflicts_with = "crop", help_heading = "Farm")]
    pub(crate) tiles: [usize; 2],
}

/// `bansho farm tile`
#[derive(Args, Debug)]
pub(crate) struct TileArgs {
    #[command(flatten)]
    pub(crate) render: RenderArgs,
    /// Columns and rows of the tiles of a picture.
    #[arg(long, value_name = "COLUMNSxROWS", value_parser = values::parse_grid, conflicts_with = "crop", help_heading = "Farm")]
    pub(crate) tiles: [usize; 2],
    /// Number of the tile, counted row by row from 0.
    #[arg(long, value_name = "N", help_heading = "Farm")]
    pub(crate) tile: usize,
}

/// `bansho farm check`
#[derive(Args, Debug)]
pub(crate) struct CheckMachineArgs {
    /// The output of the frames.
    #[arg(short, long, value_name = "PATH")]
    pub(crate) out: PathBuf,
    /// The token by which machines recognize the folder of the frames.
    #[arg(long, value_name = "TOKEN")]
    pub(crate) token: String,
    /// The program and its version.
    #[arg(long, value_name = "PROGRAM")]
    pub(crate) made_by: String,
    /// Digest of results of the arithmetic of the machine that wrote the template.
    #[arg(long, value_name = "DIGEST")]
    pub(crate) arithmetic: String,
    /// Write the token to the folder, for the other machines.
    #[arg(long)]
    pub(crate) leave_token: bool,
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
    /// Write snapshots at the beginning of chunks.
    Snapshots {
        /// The frame at which the last of these chunks is cut.
        #[arg(long, value_name = "FRAME", allow_hyphen_values = true)]
        last: i64,
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
    /// Check that all frames are whole, join tiles, and make what was asked for.
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
