//! From a scene file to pictures on disk: what `bansho render`, `bansho flipbook`, `bansho simulate` and `bansho streaks` do,
//! for any program.
//!
//! [`Job`] says what is wanted; [`Job::prepare`] checks all of it and writes nothing; [`PreparedJob::run`] draws each
//! frame while those before are compressed and written by whichever thread of the caller's rayon pool is free. A few
//! frames are in memory at once, however many there are. Every file is whole or not there at all.

mod checks;
mod error;
mod export;
mod flipbook;
pub mod frames;
mod observer;
mod render;
mod scene_file;
mod snapshots;
#[cfg(feature = "rain")]
mod streaks;
#[cfg(test)]
mod testing;

use std::path::PathBuf;

use bansho_base::{
    color::{AlphaConvention, View},
    image::Rect,
};
use bansho_render::display::BitDepth;

pub use error::{Cause, Channels, Conflict, JobError, SheetKind};
pub use export::point_clouds::{PreparedSimulation, Simulate};
pub use flipbook::{Flipbook, FlipbookCrop, FlipbookSummary, PreparedFlipbook, contact_sheet::ContactBackground};
pub use observer::{FrameDone, JobObserver, Note, Outline, Spot};
pub use render::{
    Summary,
    prepare::{PreparedJob, check_scene, remarks},
};
pub use scene_file::{SCENE_BYTES, SceneFile};
#[cfg(feature = "rain")]
pub use streaks::{ListKind, PreparedStreaks, StreakFormat, Streaks, StreaksError};

/// What is to be drawn, and where it goes. Begin with [`Job::new`], which takes everything from the scene.
#[derive(Clone, Debug)]
pub struct Job {
    /// The scene.
    pub scene: SceneFile,
    /// Frame numbers, ascending; the whole shot (or one turn of the loop) when left out.
    pub frames: Option<Vec<i64>>,
    /// Another picture size than the scene's, pixels.
    pub size: Option<[usize; 2]>,
    /// Only this part of the picture, identical to the same part of the whole.
    pub crop: Option<Rect>,
    /// Another seed than the scene's.
    pub seed: Option<u64>,
    /// A seamless loop of about so many seconds.
    pub loop_s: Option<f64>,
    /// Whether the sky, ground and lamps that the scene does not state are left out of the picture, so that it keeps its alpha.
    pub transparent: bool,
    /// Whether each phenomenon gets a layer of its own (EXR).
    pub layers: bool,
    /// Whether phenomena write temperature, motion and the like (EXR).
    pub aovs: bool,
    /// Whether a JSON file beside each picture tells the figures of its frame (PNG and EXR).
    pub figures: bool,
    /// How display formats show the light.
    pub view: View,
    /// Bits of each channel, where the format has a choice.
    pub bits: BitDepth,
    /// What straight alpha is made for; left out it is [`AlphaConvention::Encoded`], but linear for the view `raw`, which encodes nothing.
    pub alpha: Option<AlphaConvention>,
    /// Where frames go, such as `shot/frame.####.exr` or `fire.mp4`; `out/STEM/STEM.####.png` when left out.
    pub out: Option<PathBuf>,
    /// One picture of so many frames: the first of several `frames`, or consecutive ones from a single frame on.
    pub contact_sheet: Option<usize>,
    /// What the frames of that picture are laid over.
    pub contact_background: ContactBackground,
    /// Whether whole frames of this very job that are there already stay.
    pub resume: bool,
    /// Whether files that Bansho did not make may be written over. What the scene is read from never is.
    pub overwrite: bool,
    /// Folder of snapshots of what is simulated in steps.
    pub snapshots: Option<PathBuf>,
    /// Frames between snapshots; a second's worth when left out.
    pub snapshot_every: Option<u64>,
}

impl Job {
    /// All frames of `scene` as it is, to PNG files.
    pub fn new(scene: SceneFile) -> Self {
        Self {
            scene,
            frames: None,
            size: None,
            crop: None,
            seed: None,
            loop_s: None,
            transparent: false,
            layers: false,
            aovs: false,
            figures: false,
            view: View::DISPLAY,
            bits: BitDepth::Eight,
            alpha: None,
            out: None,
            contact_sheet: None,
            contact_background: ContactBackground::Black,
            resume: false,
            overwrite: false,
            snapshots: None,
            snapshot_every: None,
        }
    }
}
