//! What a job tells its caller on the way.

use std::path::PathBuf;

use bansho_base::{
    host::{
        observer::{Observer, Unobserved},
        plural::counted,
    },
    phenomenon::Remark,
};
use bansho_media::format::OutputKind;
use bansho_render::RenderError;

/// Watches a job. Called from several threads.
pub trait JobObserver: Observer {
    /// The work is about to begin.
    fn started(&self, _outline: &Outline) {}

    /// A frame is whole where it belongs. Frames may be finished in another order than that of their numbers.
    fn frame_done(&self, _frame: &FrameDone) {}

    /// Something that the user should know and that stops nothing.
    fn note(&self, _note: &Note) {}
}

impl JobObserver for Unobserved {}

/// What a job is about to do.
#[derive(Clone, Debug, PartialEq)]
pub struct Outline {
    /// Frames that were asked for.
    pub total: usize,
    /// Frames that are there already and stay as they are.
    pub kept: usize,
    /// Size of each, pixels.
    pub size: [usize; 2],
}

/// A finished frame.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameDone {
    /// Its number.
    pub number: i64,
    /// The file it is in; `None` where many frames share one.
    pub path: Option<PathBuf>,
    /// Frames drawn and written so far, this one too.
    pub drawn: usize,
}

/// A place in a scene file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Spot {
    /// What errors call the file.
    pub file: String,
    /// One-based line and column (in characters).
    pub position: (usize, usize),
}

fn at(place: &Option<Spot>) -> String {
    let shown = |spot: &Spot| format!("{}:{}:{}: ", spot.file, spot.position.0, spot.position.1);
    place.as_ref().map(shown).unwrap_or_default()
}

/// So many frames lie somewhere.
fn lie(count: usize) -> String {
    format!("{} {}", counted(count, "frame"), if count == 1 { "lies" } else { "lie" })
}

/// Something that the user should know and that stops nothing.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Note {
    /// Frames beyond those of the scene.
    #[error("{} outside the scene's own, {first} to {last}; drawn as if the scene went on", lie(*.count))]
    OutsideScene {
        /// How many.
        count: usize,
        /// The scene's first frame.
        first: i64,
        /// Its last.
        last: i64,
    },
    /// Frames beyond one turn of a loop.
    #[error("{} outside the loop's own, {first} to {last}; the loop is repeated", lie(*.count))]
    OutsideLoop {
        /// How many.
        count: usize,
        /// The loop's first frame.
        first: i64,
        /// Its last.
        last: i64,
    },
    /// 16 bits in a format that has other ideas.
    #[error("the number of bits has no effect on .{}", .kind.extension())]
    BitsUnused {
        /// The format.
        kind: OutputKind,
    },
    /// A picture that cannot be transparent.
    #[error(
        "the picture is not transparent: the scene states what is behind its phenomena, a plate, a sky or a ground"
    )]
    TransparentUnused,
    /// A convention of alpha where there is none.
    #[error("the alpha convention has no effect: the pictures have no straight alpha")]
    AlphaUnused,
    /// A view in a scene-linear format.
    #[error("a view has no effect on .exr, which is scene-linear")]
    ViewUnused,
    /// A film is made as a whole.
    #[error("resuming has no effect on .{}, which is made as a whole", .kind.extension())]
    ResumeUnused {
        /// The format.
        kind: OutputKind,
    },
    /// A contact sheet is made as a whole.
    #[error("resuming has no effect on a sheet, which is made as a whole")]
    ResumeSheet,
    /// Nothing in the scene has a state.
    #[error("snapshots have no effect: nothing in this scene is simulated in steps")]
    SnapshotsUnused,
    /// A snapshot that cannot be used.
    #[error("{path}: not used: {reason}; it is made anew", path = .path.display())]
    SnapshotRefused {
        /// Its file.
        path: PathBuf,
        /// Why.
        reason: RenderError,
    },
    /// A snapshot that cannot be read.
    #[error("{path}: not used: it cannot be read: {reason}", path = .path.display())]
    SnapshotUnreadable {
        /// Its file, or the folder.
        path: PathBuf,
        /// What the system said.
        reason: String,
    },
    /// A phenomenon will look other than one may expect.
    #[error("{}{name}: {remark}", at(.place))]
    Remark {
        /// Where the scene says it.
        place: Option<Spot>,
        /// Its name in the scene.
        name: String,
        /// What is to be said.
        remark: Remark,
    },
    /// A flipbook without motion.
    #[error("nothing in this scene writes its motion; the motion sheet is empty")]
    NoMotion,
}
