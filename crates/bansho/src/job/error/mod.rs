//! The error that all jobs return. It names no type of a job, so that every job can use it.

mod options;
#[cfg(feature = "rain")]
mod streaks;

use std::path::PathBuf;

use bansho_base::host::{observer::Cancelled, plural::counted};
use bansho_media::{
    MediaError,
    files::{input::InputError, naming::NamingError},
    imageops::sprite_sheet::SheetError,
};
use bansho_render::{PlanError, RenderError};
use bansho_scene::{LoopError, SceneError, edit::EditError};

use super::frames::format_ranges;

pub use options::{ChannelKind, OptionError, SheetKind};
#[cfg(feature = "rain")]
pub(crate) use streaks::MAX_DROPS;
#[cfg(feature = "rain")]
pub use streaks::{StreakList, StreaksError};

/// Why a job failed or cannot start.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum JobError {
    /// The scene cannot be read.
    #[error("{path}: the scene cannot be read: {source}{}", did_you_mean(.suggestion), path = .path.display())]
    Unreadable {
        /// The scene's file.
        path: PathBuf,
        /// Why.
        source: InputError,
        /// If there is no such file: the scene in the same folder with the most similar name.
        suggestion: Option<PathBuf>,
    },
    /// The scene is not UTF-8.
    #[error("{path}:{line}: is not valid UTF-8 from this line on; allowed: UTF-8", path = .path.display())]
    NotUtf8 {
        /// The scene's file.
        path: PathBuf,
        /// The first line that is not UTF-8, counted from 1.
        line: usize,
    },
    /// The scene is invalid.
    #[error(transparent)]
    Scene(Box<SceneError>),
    /// The text of the scene cannot be changed as requested.
    #[error("{assignment}: {source}")]
    Edit {
        /// The assignment.
        assignment: String,
        /// What is wrong with it.
        source: EditError,
    },
    /// The scene is valid, but not with the assignments.
    #[error(transparent)]
    ChangedScene(Box<SceneError>),
    /// The options of the plan do not fit the scene.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// The scene cannot loop with the requested length.
    #[error(transparent)]
    Loop(#[from] LoopError),
    /// An option is invalid, or contradicts another or the scene.
    #[error(transparent)]
    Option(#[from] OptionError),
    /// The name of the output cannot be used.
    #[error(transparent)]
    Naming(#[from] NamingError),
    /// A frame could not be drawn, encoded or written.
    #[error("frame {number}: {source}")]
    Frame {
        /// Its number.
        number: i64,
        /// Why.
        source: Box<Self>,
    },
    /// Drawing failed.
    #[error(transparent)]
    Render(RenderError),
    /// Writing failed.
    #[error(transparent)]
    Media(MediaError),
    /// Finished frames were removed or changed before the job ended.
    #[error(
        "{files}: {} missing, or changed after this job wrote {}",
        frames_are(frames), it_or_them(frames.len()), files = .files.display()
    )]
    FramesLost {
        /// Their numbers, ascending.
        frames: Vec<i64>,
        /// Their name, with `#` for the number.
        files: PathBuf,
    },
    /// Finished files were removed or changed before the job ended.
    #[error("{}: missing, or changed after this job wrote {}", file_list(files), it_or_them(files.len()))]
    FilesLost {
        /// The files.
        files: Vec<PathBuf>,
    },
    /// The tiles do not form a sheet.
    #[error(transparent)]
    Tiles(#[from] SheetError),
    /// The parameters of streak textures are invalid.
    #[cfg(feature = "rain")]
    #[error(transparent)]
    Streaks(#[from] StreaksError),
    /// The observer canceled the job while streak textures were made.
    #[cfg(feature = "rain")]
    #[error("stopped; finished textures are kept, without an index")]
    StreaksCancelled,
    /// The observer canceled the job before a video or a sheet, which contains all frames, was complete.
    #[error("stopped; nothing is kept, because {output} is written only when all its frames are drawn")]
    SingleFileCancelled {
        /// What the output is, such as "a video".
        output: &'static str,
    },
    /// The observer canceled the job while particles were simulated.
    #[error("stopped; finished files of particles are kept")]
    ParticlesCancelled,
    /// The observer canceled the job.
    #[error("stopped; finished frames are kept")]
    Cancelled,
}

/// Maximum number of file names in a message; the others are counted.
const MAX_LISTED_FILES: usize = 8;

fn file_list(files: &[PathBuf]) -> String {
    let names: Vec<String> = files.iter().take(MAX_LISTED_FILES).map(|file| file.display().to_string()).collect();
    match files.len().saturating_sub(MAX_LISTED_FILES) {
        0 => names.join(", "),
        others => format!("{} and {}", names.join(", "), counted(others, "other")),
    }
}

fn frames_are(frames: &[i64]) -> String {
    match frames {
        [frame] => format!("frame {frame} is"),
        _ => format!("frames {} are", format_ranges(frames)),
    }
}

fn it_or_them(count: usize) -> &'static str {
    if count == 1 { "it" } else { "them" }
}

fn did_you_mean(suggestion: &Option<PathBuf>) -> String {
    suggestion.as_ref().map(|path| format!(", did you mean `{}`?", path.display())).unwrap_or_default()
}

impl From<MediaError> for JobError {
    fn from(error: MediaError) -> Self {
        match error {
            MediaError::Cancelled(Cancelled) => Self::Cancelled,
            other => Self::Media(other),
        }
    }
}

impl From<RenderError> for JobError {
    fn from(error: RenderError) -> Self {
        match error {
            RenderError::Cancelled(Cancelled) => Self::Cancelled,
            other => Self::Render(other),
        }
    }
}

/// What an error is about, from which programs choose their exit codes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ErrorCategory {
    /// The options of the job.
    Usage,
    /// The scene, or an asset that it names.
    Scene,
    /// A failure during the job.
    Work,
    /// The observer canceled the job.
    Cancelled,
}

impl JobError {
    /// As the failure of frame `number`. A canceled job is not the failure of a frame.
    pub fn in_frame(self, number: i64) -> Self {
        match self {
            Self::Cancelled | Self::Frame { .. } => self,
            error => Self::Frame { number, source: Box::new(error) },
        }
    }

    /// The number of the frame that failed, if it was one.
    pub fn frame(&self) -> Option<i64> {
        match self {
            Self::Frame { number, .. } => Some(*number),
            _ => None,
        }
    }

    /// The error without the number of its frame.
    pub fn without_frame(&self) -> &Self {
        match self {
            Self::Frame { source, .. } => source.without_frame(),
            error => error,
        }
    }

    /// For an `output` that contains all frames and is written at the end: its own message for a canceled job. Other errors are unchanged.
    pub(crate) fn for_single_file(self, output: &'static str) -> Self {
        if matches!(self, Self::Cancelled) { Self::SingleFileCancelled { output } } else { self }
    }

    /// What the error is about.
    pub fn category(&self) -> ErrorCategory {
        match self {
            Self::Frame { source, .. } => source.category(),
            Self::Unreadable { .. } | Self::NotUtf8 { .. } | Self::Scene(_) => ErrorCategory::Scene,
            Self::Edit { .. }
            | Self::ChangedScene(_)
            | Self::Plan(_)
            | Self::Loop(_)
            | Self::Option(_)
            | Self::Naming(_) => ErrorCategory::Usage,
            Self::Render(RenderError::Plate(_)) => ErrorCategory::Scene,
            #[cfg(feature = "rain")]
            Self::Streaks(_) => ErrorCategory::Usage,
            Self::Cancelled | Self::SingleFileCancelled { .. } => ErrorCategory::Cancelled,
            Self::ParticlesCancelled => ErrorCategory::Cancelled,
            #[cfg(feature = "rain")]
            Self::StreaksCancelled => ErrorCategory::Cancelled,
            Self::Render(_) | Self::Media(_) | Self::Tiles(_) => ErrorCategory::Work,
            Self::FramesLost { .. } | Self::FilesLost { .. } => ErrorCategory::Work,
        }
    }

    /// The problems of the scene, if these are the reason.
    pub fn scene(&self) -> Option<&SceneError> {
        match self.without_frame() {
            Self::Scene(error) | Self::ChangedScene(error) => Some(error),
            _ => None,
        }
    }
}
