//! What a job reports to its caller while it runs.

use std::path::PathBuf;

use bansho_base::{
    host::{
        observer::{Observer, Unobserved},
        plural::counted,
    },
    phenomenon::Remark,
};
use bansho_media::{files::naming::LiteralPart, format::OutputKind};
use bansho_render::RenderError;
use bansho_scene::LineColumn;

/// Observes a job. Its methods are called from several threads.
pub trait JobObserver: Observer {
    /// The job begins.
    fn started(&self, _started: &JobStarted) {}

    /// A frame is complete in its file. Frames may be finished in another order than that of their numbers.
    fn frame_done(&self, _frame: &FrameDone) {}

    /// Something that the user should know; the job continues.
    fn warning(&self, _warning: &Warning) {}
}

impl JobObserver for Unobserved {}

/// What a job is about to do.
#[derive(Clone, Debug, PartialEq)]
pub struct JobStarted {
    /// Number of frames, those that are kept included.
    pub frames: usize,
    /// Number of frames that exist already and are kept.
    pub kept: usize,
    /// Size of each frame, pixels.
    pub size: [usize; 2],
}

/// A finished frame.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameDone {
    /// Its number.
    pub number: i64,
    /// Its file; `None` where one file contains many frames.
    pub path: Option<PathBuf>,
    /// Number of frames drawn and written so far, including this one.
    pub drawn: usize,
}

/// A position in a scene file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FilePosition {
    /// The name of the file in messages.
    pub file: String,
    /// Line and column in it.
    pub position: LineColumn,
}

/// The position before a message, with a colon.
fn prefix(position: &Option<FilePosition>) -> String {
    position.as_ref().map(|FilePosition { file, position }| format!("{file}:{position}: ")).unwrap_or_default()
}

/// `1 frame is` or `2 frames are`.
fn frames_are(count: usize) -> String {
    format!("{} {}", counted(count, "frame"), if count == 1 { "is" } else { "are" })
}

/// Something that the user should know and that does not stop the job.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Warning {
    /// Frames outside the scene's range.
    #[error("{} outside the scene's range, {first} to {last}; the scene continues beyond its range", frames_are(*.count))]
    OutsideScene {
        /// How many.
        count: usize,
        /// The scene's first frame.
        first: i64,
        /// Its last.
        last: i64,
    },
    /// Frames outside one pass through the loop.
    #[error("{} outside the loop's range, {first} to {last}; the loop is repeated there", frames_are(*.count))]
    OutsideLoop {
        /// How many.
        count: usize,
        /// The loop's first frame.
        first: i64,
        /// Its last.
        last: i64,
    },
    /// A part of the name of the output looks like a frame number.
    #[error("{path}: {part}", path = .path.display())]
    LiteralName {
        /// The output.
        path: PathBuf,
        /// The part.
        part: LiteralPart,
    },
    /// 16 bits in a format that does not support them.
    #[error("the number of bits has no effect on .{}", .kind.extension())]
    BitsUnused {
        /// The format.
        kind: OutputKind,
    },
    /// The picture cannot be transparent.
    #[error("the picture is not transparent: the scene states its background, a plate, a sky or a ground")]
    TransparentUnused,
    /// An alpha convention for pictures without straight alpha.
    #[error("the alpha convention has no effect: the pictures have no straight alpha")]
    AlphaUnused,
    /// A view for a scene-linear format.
    #[error("a view has no effect on .exr, which is scene-linear")]
    ViewUnused,
    /// A video cannot be resumed.
    #[error("resuming has no effect on .{}, which is written as a whole", .kind.extension())]
    ResumeUnused {
        /// The format.
        kind: OutputKind,
    },
    /// A contact sheet cannot be resumed.
    #[error("resuming has no effect on a sheet, which is written as a whole")]
    ResumeSheet,
    /// Nothing in the scene has a state.
    #[error("snapshots have no effect: nothing in this scene is simulated in steps")]
    SnapshotsUnused,
    /// A snapshot that does not fit the scene, or is damaged.
    #[error("{path}: not used: {reason}; it is replaced", path = .path.display())]
    SnapshotRejected {
        /// Its file.
        path: PathBuf,
        /// Why.
        reason: RenderError,
    },
    /// A snapshot, or the folder of snapshots, cannot be read.
    #[error("{path}: not used: it cannot be read: {reason}", path = .path.display())]
    SnapshotUnreadable {
        /// The file or folder.
        path: PathBuf,
        /// The message of the system.
        reason: String,
    },
    /// A phenomenon may look different from what the user expects.
    #[error("{}{name}: {remark}", prefix(.position))]
    Remark {
        /// Where the scene states the phenomenon, or the parameter.
        position: Option<FilePosition>,
        /// Name of the phenomenon in the scene.
        name: String,
        /// The remark.
        remark: Remark,
    },
    /// A flipbook without motion.
    #[error("no phenomenon of this scene has a motion AOV; the motion sheet is empty")]
    NoMotion,
}
