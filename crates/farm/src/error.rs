//! Why a shot cannot be cut into tasks, or a task refuses to run.

use std::{io, path::PathBuf};

use bansho::{
    job::{ErrorCategory, JobError, frames::FrameListError},
    media::{MediaError, files::input::InputError, output::frame_file::FrameFileError},
};

/// Why work on many machines cannot be planned, or a task refuses to run.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FarmError {
    /// The job itself is at fault.
    #[error(transparent)]
    Job(#[from] JobError),
    /// A file cannot be written.
    #[error(transparent)]
    Media(#[from] MediaError),
    /// A file or folder cannot be read or written.
    #[error("{path}: {source}", path = .path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The message of the system.
        source: io::Error,
    },
    /// A file cannot be read, or is not a regular file.
    #[error("{path}: {source}", path = .path.display())]
    Input {
        /// The file.
        path: PathBuf,
        /// Why.
        source: InputError,
    },
    /// There is no plan.
    #[error("{path}: there is no plan of tasks; `bansho farm slurm` writes one", path = .path.display())]
    NoPlan {
        /// Where it would be.
        path: PathBuf,
    },
    /// The file is no plan, or one of another version.
    #[error("{path}: cannot be read as a plan of tasks: {reason}", path = .path.display())]
    PlanFormat {
        /// The file.
        path: PathBuf,
        /// Why.
        reason: String,
    },
    /// The plan is not as it was written.
    #[error("{path}: the plan of tasks was changed after it was written, or is damaged; plan the tasks again", path = .path.display())]
    PlanChanged {
        /// The file.
        path: PathBuf,
    },
    /// The list of frames in a plan is damaged.
    #[error("the frames of the plan: {0}")]
    PlanFrames(#[from] FrameListError),
    /// This machine does not see the folder that the tasks were planned in.
    #[error(
        "{path}: this machine sees {found} where the machine that planned the tasks wrote `{expected}`; allowed: one shared folder, at the same path on \
         all machines",
        path = .path.display()
    )]
    Token {
        /// The token file.
        path: PathBuf,
        /// What was expected.
        expected: String,
        /// What is there instead.
        found: String,
    },
    /// The plan was replaced after the task was submitted.
    #[error("the tasks were planned again after this one was submitted; allowed: the tasks of the last plan")]
    PlanReplaced,
    /// The tasks were planned by another version.
    #[error("this machine runs {found}, but the tasks were planned by {expected}; allowed: the same version")]
    Version {
        /// The version of the plan.
        expected: String,
        /// This one.
        found: String,
    },
    /// The processor does not give the same bytes.
    #[error(
        "this machine does not reproduce the bytes of the machine that planned the tasks; allowed: a processor and a program that give the same bytes"
    )]
    Arithmetic,
    /// The scene, or a file that it names, has changed.
    #[error(
        "the scene, or a file that it names, is not what the tasks were planned for, so frames of two scenes would be mixed; \
         plan the tasks again, or restore the scene"
    )]
    SceneChanged,
    /// A task that the plan does not have.
    #[error("there is no task {index}; allowed: 0 to {}", .count.saturating_sub(1))]
    NoSuchTask {
        /// Its number.
        index: usize,
        /// How many there are.
        count: usize,
    },
    /// A tile that a picture does not have.
    #[error("there is no tile {index}; allowed: 0 to {}", .count.saturating_sub(1))]
    NoSuchTile {
        /// Its number.
        index: usize,
        /// How many there are.
        count: usize,
    },
    /// More tiles than tasks are possible.
    #[error("{tiles} tiles, each of which is a task; allowed: up to {max}")]
    TooManyTiles {
        /// Number of tiles.
        tiles: usize,
        /// Largest number of tasks.
        max: usize,
    },
    /// More tasks than one array may have.
    #[error("{tasks} tasks; allowed: up to {max} (chunks of at least {least_chunk} frames)")]
    TooManyTasks {
        /// Number of tasks.
        tasks: usize,
        /// Largest number.
        max: usize,
        /// Shortest chunk that is possible.
        least_chunk: u64,
    },
    /// A film or a contact sheet, whose frames cannot be drawn by different tasks.
    #[error("{path}: one file holds all frames, but tasks write one file per frame; allowed: .png, .exr", path = .path.display())]
    NotASequence {
        /// The output.
        path: PathBuf,
    },
    /// The frames would not fit on the disk.
    #[error("{path}: the frames will take about {required}, but only {available} are free", path = .path.display())]
    Space {
        /// The folder.
        path: PathBuf,
        /// Bytes needed, in words.
        required: String,
        /// Bytes that are free, in words.
        available: String,
    },
    /// A path with a line break or another control character, which scripts cannot hold.
    #[error("{path:?}: scripts cannot contain control characters; allowed: any other name")]
    ControlCharacters {
        /// The path or argument.
        path: String,
    },
    /// A text that Open Job Description would take for an expression.
    #[error("`{text}`: Open Job Description interprets {{{{ }}}} as an expression; allowed: any other name or option")]
    Braces {
        /// The text.
        text: String,
    },
    /// Not every frame is complete.
    #[error("{files}: frames {frames} are missing or incomplete; a film needs all frames", files = .files.display())]
    Incomplete {
        /// The frames, in the syntax of frame lists.
        frames: String,
        /// The name of the files.
        files: PathBuf,
    },
    /// A finished frame cannot be read back.
    #[error("{path}: {source}", path = .path.display())]
    FrameFile {
        /// The frame.
        path: PathBuf,
        /// Why.
        source: FrameFileError,
    },
    /// The film is to be one file a frame.
    #[error("{path}: not a film format; allowed: .mp4, .mov, .webm, .apng, .gif", path = .path.display())]
    NotAFilm {
        /// The name of the film.
        path: PathBuf,
    },
    /// Tiles with files of metadata, which are of whole pictures.
    #[error("tiles have no metadata; allowed: whole pictures, or no metadata")]
    TilesWithMetadata,
    /// Tiles of a picture with overscan.
    #[error("tiles cover the picture without its overscan; allowed: picture.overscan = 0")]
    TilesWithOverscan,
    /// Tiles that are narrower than a pixel.
    #[error("{} x {} tiles of {} x {} pixels; allowed: at most one for each pixel", .tiles[0], .tiles[1], .size[0], .size[1])]
    TilesWithoutPixels {
        /// Columns and rows.
        tiles: [usize; 2],
        /// Size of the picture.
        size: [usize; 2],
    },
}

impl FarmError {
    /// What the error is about.
    pub fn category(&self) -> ErrorCategory {
        match self {
            Self::Job(error) => error.category(),
            Self::TooManyTiles { .. }
            | Self::TooManyTasks { .. }
            | Self::NotASequence { .. }
            | Self::NoSuchTask { .. }
            | Self::NoSuchTile { .. }
            | Self::NoPlan { .. }
            | Self::ControlCharacters { .. }
            | Self::Braces { .. }
            | Self::NotAFilm { .. }
            | Self::TilesWithMetadata
            | Self::TilesWithOverscan
            | Self::TilesWithoutPixels { .. } => ErrorCategory::Usage,
            _ => ErrorCategory::Work,
        }
    }
}
