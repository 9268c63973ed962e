//! Why a job cannot be done.

use std::path::PathBuf;

use bansho_base::host::{observer::Cancelled, plural::counted};
use bansho_media::{
    MediaError,
    files::{input::InputError, naming::NamingError},
    imageops::sprite_sheet::SheetError,
};
use bansho_render::{PlanError, RenderError};
use bansho_scene::{LoopError, SceneError, edit::EditError};

use super::frames::ranges;
#[cfg(feature = "rain")]
use super::streaks::StreaksError;

/// Why a job cannot be done.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum JobError {
    /// The scene cannot be read.
    #[error("{path}: the scene cannot be read: {source}{}", did_you_mean(.near), path = .path.display())]
    Unreadable {
        /// The scene's file.
        path: PathBuf,
        /// Why.
        source: InputError,
        /// The scene in that folder whose name is most like it, where there is no such file.
        near: Option<PathBuf>,
    },
    /// The scene is not text.
    #[error("{path}:{line}: the scene is not UTF-8 from this line on; allowed: text in UTF-8", path = .path.display())]
    NotUtf8 {
        /// The scene's file.
        path: PathBuf,
        /// The first line that is not, from 1 on.
        line: usize,
    },
    /// The scene is faulty.
    #[error(transparent)]
    Scene(Box<SceneError>),
    /// A change of the scene's text cannot be made.
    #[error("{assignment}: {source}")]
    Edit {
        /// The assignment.
        assignment: String,
        /// What is wrong with it.
        source: EditError,
    },
    /// The scene is faulty only because of the assignments.
    #[error(transparent)]
    SetScene(Box<SceneError>),
    /// What was asked for does not fit the scene.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// The scene is no loop of the length that was asked for.
    #[error(transparent)]
    Loop(#[from] LoopError),
    /// Options that do not go together.
    #[error(transparent)]
    Conflict(#[from] Conflict),
    /// The name of the output cannot be used.
    #[error(transparent)]
    Naming(#[from] NamingError),
    /// Drawing failed.
    #[error(transparent)]
    Render(RenderError),
    /// Writing failed.
    #[error(transparent)]
    Media(#[from] MediaError),
    /// Frames that were finished, and were removed or changed before all were.
    #[error(
        "{files}: {} missing, or not as written; something removed or changed {} while the others were made",
        is_or_are(frames), if frames.len() == 1 { "it" } else { "them" }, files = .files.display()
    )]
    FramesLost {
        /// Their numbers, ascending.
        frames: Vec<i64>,
        /// Their name, with `#` for the number.
        files: PathBuf,
    },
    /// Files that were finished, and were removed or changed before all were.
    #[error("{}: missing, or not as written; something removed or changed {} while the others were made",
        listed(files), if files.len() == 1 { "it" } else { "them" })]
    FilesLost {
        /// The files.
        files: Vec<PathBuf>,
    },
    /// Tiles that make no sheet.
    #[error(transparent)]
    Tiles(#[from] SheetError),
    /// Streak textures that cannot be made.
    #[cfg(feature = "rain")]
    #[error(transparent)]
    Streaks(#[from] StreaksError),
    /// The observer asked to stop while streak textures were made.
    #[cfg(feature = "rain")]
    #[error("stopped; whole textures stay, without an index")]
    StreaksCancelled,
    /// The observer asked to stop before a film or a sheet, which holds all frames, was whole.
    #[error("stopped; nothing stays, since {what} is written only when all its frames are drawn")]
    WholeCancelled {
        /// What it is.
        what: &'static str,
    },
    /// The observer asked to stop while particles were simulated.
    #[error("stopped; whole files of particles stay")]
    ParticlesCancelled,
    /// The observer asked to stop.
    #[error("stopped; whole frames stay")]
    Cancelled,
}

/// Channels beside the picture's own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Channels {
    /// One picture of each phenomenon.
    #[error("layers")]
    Layers,
    /// Temperature, motion and the like.
    #[error("AOVs")]
    Aovs,
}

/// Sheets of many frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SheetKind {
    /// Thumbnails in order.
    Contact,
    /// A flipbook's tiles.
    Flipbook,
}

/// Options that do not go together.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Conflict {
    /// Layers or AOVs in a format that has only one picture.
    #[error("{what} need a format that holds many channels, and {path} is not one; allowed: .exr", path = .path.display())]
    NoChannels {
        /// Which of them.
        what: Channels,
        /// The output.
        path: PathBuf,
    },
    /// Figures of a film or a sheet, which holds many frames.
    #[error(
        "figures are written beside each frame's own picture, and {path} holds many frames; allowed: .png, .exr, one a frame",
        path = .path.display()
    )]
    NoFigures {
        /// The output.
        path: PathBuf,
    },
    /// Pictures larger than there is memory for.
    #[error(
        "{} x {} pixels{} {would}; allowed: up to {} x {}",
        .size[0], .size[1], with_channels(*.channels), .most[0], .most[1]
    )]
    Memory {
        /// Width and height of what is drawn.
        size: [usize; 2],
        /// Channels of layers and AOVs beside the picture.
        channels: usize,
        /// How much it would take.
        would: String,
        /// Width and height that there is memory for, in the same proportions.
        most: [usize; 2],
    },
    /// An output that the scene is read from.
    #[error("{path}: is a file that the scene is read from; allowed: any other name", path = .path.display())]
    OverInput {
        /// The output.
        path: PathBuf,
    },
    /// An output that is there and that Bansho did not make.
    #[error(
        "{path}{} there already and without the mark of files that Bansho made; allowed: another name",
        and_others(*.others), path = .path.display()
    )]
    Unmarked {
        /// The first of them.
        path: PathBuf,
        /// How many others there are.
        others: usize,
    },
    /// A sheet of tiles in a format that is not for it.
    #[error("{path}: a sheet is one picture; allowed: {allowed}", path = .path.display())]
    Sheet {
        /// The output.
        path: PathBuf,
        /// Extensions that will do.
        allowed: &'static str,
    },
    /// A sheet without tiles or with too many.
    #[error("a sheet of {tiles} tiles; allowed: 1 to {most}")]
    Tiles {
        /// Which sheet.
        of: SheetKind,
        /// How many were asked for.
        tiles: usize,
        /// Most that are possible.
        most: usize,
    },
    /// A sheet with more tiles than frames are listed.
    #[error("a sheet of {tiles} tiles for {frames} frames; allowed: 1 to {frames}, or one frame from which on it goes")]
    FewFrames {
        /// How many tiles were asked for.
        tiles: usize,
        /// How many frames.
        frames: usize,
    },
    /// A sheet larger than pictures may be.
    #[error(
        "the sheet would have {width} x {height} pixels; allowed: up to {most} on a side, so choose smaller or fewer tiles"
    )]
    SheetSize {
        /// Which sheet.
        of: SheetKind,
        /// Its width.
        width: usize,
        /// Its height.
        height: usize,
        /// Largest side.
        most: usize,
    },
    /// Encoded alpha of pixels that are not encoded.
    #[error("the view `raw` encodes nothing, so that its alpha is linear; allowed: linear, or another view")]
    RawAlpha,
    /// No frame is left to draw.
    #[error("no frame is asked for")]
    NoFrames,
    /// A simulation of a scene in which nothing has particles.
    #[error("nothing in this scene has particles to write; allowed: a scene with flame_particles or aurora")]
    NoParticles,
    /// Snapshots of no frame.
    #[error("snapshots every {0} frames; allowed: 1 or more")]
    SnapshotStep(u64),
    /// A loop of a length that its frames cannot fill.
    #[error("a flipbook loop of {0} s; allowed: 0.01 to 3600 s")]
    LoopLength(f64),
}

/// So many file names are listed, and the rest counted.
const LISTED_FILES: usize = 8;

fn listed(files: &[PathBuf]) -> String {
    let names: Vec<String> = files.iter().take(LISTED_FILES).map(|file| file.display().to_string()).collect();
    match files.len().saturating_sub(LISTED_FILES) {
        0 => names.join(", "),
        others => format!("{} and {}", names.join(", "), counted(others, "other")),
    }
}

fn is_or_are(frames: &[i64]) -> String {
    match frames {
        [frame] => format!("frame {frame} is"),
        _ => format!("frames {} are", ranges(frames)),
    }
}

fn and_others(others: usize) -> String {
    match others {
        0 => ": is".to_owned(),
        _ => format!(" and {}: are", counted(others, "other file")),
    }
}

fn did_you_mean(near: &Option<PathBuf>) -> String {
    near.as_ref().map(|path| format!(", did you mean `{}`?", path.display())).unwrap_or_default()
}

fn with_channels(channels: usize) -> String {
    if channels == 0 { String::new() } else { format!(" with {}", counted(channels, "more channel")) }
}

impl From<RenderError> for JobError {
    fn from(error: RenderError) -> Self {
        match error {
            RenderError::Cancelled(Cancelled) => Self::Cancelled,
            other => Self::Render(other),
        }
    }
}

/// Whose fault an error is, for exit codes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cause {
    /// What was asked for.
    Usage,
    /// The scene, or an asset that it names.
    Scene,
    /// The work failed on the way.
    Work,
    /// The observer asked to stop.
    Cancelled,
}

impl JobError {
    /// What a wish to stop means where nothing is written before `what` is whole; any other error as it is.
    pub(crate) fn of_whole(self, what: &'static str) -> Self {
        if matches!(self, Self::Cancelled) { Self::WholeCancelled { what } } else { self }
    }

    /// Whose fault it is.
    pub fn cause(&self) -> Cause {
        match self {
            Self::Unreadable { .. } | Self::NotUtf8 { .. } | Self::Scene(_) => Cause::Scene,
            Self::Edit { .. }
            | Self::SetScene(_)
            | Self::Plan(_)
            | Self::Loop(_)
            | Self::Conflict(_)
            | Self::Naming(_) => Cause::Usage,
            Self::Render(RenderError::Plate(_)) => Cause::Scene,
            #[cfg(feature = "rain")]
            Self::Streaks(_) => Cause::Usage,
            Self::Cancelled | Self::WholeCancelled { .. } => Cause::Cancelled,
            Self::ParticlesCancelled => Cause::Cancelled,
            #[cfg(feature = "rain")]
            Self::StreaksCancelled => Cause::Cancelled,
            Self::Render(_) | Self::Media(_) | Self::Tiles(_) => Cause::Work,
            Self::FramesLost { .. } | Self::FilesLost { .. } => Cause::Work,
        }
    }

    /// The faults of the scene, where those are the reason.
    pub fn scene(&self) -> Option<&SceneError> {
        match self {
            Self::Scene(error) | Self::SetScene(error) => Some(error),
            _ => None,
        }
    }
}
