//! From a scene file to pictures on disk: what `bansho render`, `bansho flipbook`, `bansho simulate` and `bansho streaks` do,
//! for any program.
//!
//! [`Job`] contains the options; [`Job::prepare`] checks all of them and writes nothing; [`PreparedJob::run`] draws each frame while the
//! threads of the caller's rayon pool compress and write earlier ones. The number of frames in memory is bounded, however long the shot
//! is. Files are written atomically: each is complete or does not exist.

mod checks;
mod error;
mod export;
mod flipbook;
pub mod frames;
mod observer;
mod pipeline;
mod render;
mod scene_file;
mod sheet;
#[cfg(feature = "rain")]
mod streaks;
#[cfg(test)]
pub(crate) mod testing;

use std::path::PathBuf;

use bansho_base::{
    color::{AlphaConvention, View},
    image::Rect,
};
use bansho_render::display::BitDepth;

pub use error::{ChannelKind, ErrorCategory, JobError, OptionError, SheetKind};
#[cfg(feature = "rain")]
pub use error::{StreakList, StreaksError};
pub use export::point_clouds::{PreparedSimulation, Simulate};
pub use flipbook::{Flipbook, FlipbookCrop, FlipbookSummary, PreparedFlipbook};
pub use observer::{FilePosition, FrameDone, JobObserver, JobStarted, Warning};
pub use render::{
    Summary,
    contact_sheet::{ContactBackground, compose_contact_sheet},
    prepare::{PreparedJob, check_scene, check_view, remarks},
    resume::FrameState,
};
pub use scene_file::{MAX_SCENE_BYTES, SceneFile};
#[cfg(feature = "rain")]
pub use streaks::{PreparedStreaks, StreakFormat, Streaks};

/// Renders a scene to files. Create it with [`Job::new`], which takes everything from the scene.
#[derive(Clone, Debug)]
pub struct Job {
    /// The scene.
    pub scene: SceneFile,
    /// Frame numbers, ascending; `None` for the whole shot, or for one pass through the loop.
    pub frames: Option<Vec<i64>>,
    /// Replaces the scene's picture size, pixels.
    pub size: Option<[usize; 2]>,
    /// Draws only this rectangle of the picture, with the same pixels as in the whole picture.
    pub crop: Option<Rect>,
    /// Replaces the scene's seed.
    pub seed: Option<u64>,
    /// Makes a seamless loop of this length, rounded to whole frames, s.
    pub loop_s: Option<f64>,
    /// Whether the implied backdrop (sky, ground and lamps that the scene does not state) is invisible, so that the picture keeps its alpha.
    pub transparent: bool,
    /// Whether each phenomenon is written as a layer (EXR).
    pub layers: bool,
    /// Whether AOVs such as temperature and motion are written (EXR).
    pub aovs: bool,
    /// Whether a JSON file with the metadata of the frame is written beside each picture (PNG and EXR).
    pub metadata: bool,
    /// The view transform of display formats; `None` for that of the scene.
    pub view: Option<View>,
    /// Whether scene-linear files (EXR) have the glare of the camera too; as a layer `glare`, if they have layers.
    pub scene_linear_glare: bool,
    /// Bits of each channel, where the format supports both depths.
    pub bits: BitDepth,
    /// Convention of straight alpha. `None` is [`AlphaConvention::Encoded`], but linear for the view `raw`, which encodes nothing.
    pub alpha: Option<AlphaConvention>,
    /// The output, such as `shot/frame.####.exr` or `fire.mp4`; `None` is `out/STEM/STEM.####.png`.
    pub out: Option<PathBuf>,
    /// Draws this number of frames into one picture: the first of several `frames`, or consecutive ones from a single frame on.
    pub contact_sheet: Option<usize>,
    /// Background of the frames of a contact sheet.
    pub contact_background: ContactBackground,
    /// Whether existing complete frames of this job are kept.
    pub resume: bool,
    /// Whether files that Bansho did not make may be overwritten. Files that the scene is read from never are.
    pub overwrite: bool,
    /// How many frames are drawn at once.
    pub frames_in_flight: FramesInFlight,
    /// Folder of snapshots of phenomena that are simulated in steps.
    pub snapshots: Option<PathBuf>,
    /// Frames between snapshots; `None` for one snapshot a second.
    pub snapshot_every: Option<u64>,
}

/// How many frames of a shot are drawn at once, where they do not follow from each other as in simulations. The files are the same for any number.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FramesInFlight {
    /// One with fewer than 8 threads or over a plate, else up to one for each thread, as far as memory and the number of frames suggest.
    #[default]
    Auto,
    /// As many.
    Count(usize),
}

impl Job {
    /// Writes all frames of `scene` to PNG files.
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
            metadata: false,
            view: None,
            scene_linear_glare: false,
            bits: BitDepth::Eight,
            alpha: None,
            out: None,
            contact_sheet: None,
            contact_background: ContactBackground::Black,
            resume: false,
            overwrite: false,
            frames_in_flight: FramesInFlight::Auto,
            snapshots: None,
            snapshot_every: None,
        }
    }
}
