//! Renders frames of a document off the window's thread, and keeps the playback time.
//!
//! The window requests a frame ([`FrameRequest`]); only the newest request is served. Natively `ThreadPlayer` serves it on a
//! thread with a rayon pool. In a web page `WorkerPlayer` passes it to a worker, in which [`PolledPlayer`] works in time slices
//! between two messages. All report [`Event`]s.
//!
//! `engine` serves one request: check the text, advance the shot, draw. `snapshot_cache` keeps simulation states, so that scrubbing
//! backwards does not restart the simulation; `preview_size` chooses the preview's resolution by the measured cost.

mod engine;
mod interruption;
mod polled;
mod preview_size;
pub mod render_job;
mod snapshot_cache;
#[cfg(test)]
pub(crate) mod tests;
#[cfg(not(target_arch = "wasm32"))]
mod thread;
mod transport;
pub(crate) mod web;

use std::{sync::Arc, time::Duration};

use bansho::{Assets, Plan, SceneError};

use crate::document::{PhenomenonId, Revision};

pub use polled::PolledPlayer;
pub use preview_size::{FrameTiming, PreviewScale};
#[cfg(not(target_arch = "wasm32"))]
pub use thread::{StartError, ThreadPlayer};
pub use transport::Transport;
#[cfg(target_arch = "wasm32")]
pub use web::worker::{WorkerPlayer, run_worker};

/// The frame that a window wants to show.
#[derive(Clone)]
pub struct FrameRequest {
    /// The revision of the document.
    pub revision: Revision,
    /// The name in error messages.
    pub name: String,
    /// Its text.
    pub text: Arc<str>,
    /// The source of its plates, meshes and drawings.
    pub assets: Arc<dyn Assets>,
    /// The frame number; `None` for the scene's first frame.
    pub number: Option<i64>,
    /// Largest size, pixels. The picture keeps the scene's aspect ratio and is never larger than the scene's own size.
    pub within: [usize; 2],
    /// Whether the simulation state must be exact: the one that the scene leads to from its first frame.
    pub exact: bool,
    /// Whether it may be a draft, which is simulated with fewer particles.
    pub draft: bool,
    /// Whether the full-quality PNG that `bansho render` writes is requested instead of a preview.
    pub full_quality: bool,
    /// The phenomenon whose stages are drawn too.
    pub stages: Option<PhenomenonId>,
}

/// A rendered preview.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// The requested revision. If it has problems, the picture is of the last valid scene.
    pub revision: Revision,
    /// The frame.
    pub number: i64,
    /// Its size, pixels.
    pub size: [usize; 2],
    /// The scene's size, pixels.
    pub scene_size: [usize; 2],
    /// Display pixels over black, row after row from the top.
    pub pixels: Vec<[u8; 4]>,
    /// Whether the simulation state is exact: the one that the scene leads to from its first frame.
    pub exact: bool,
    /// Whether it was simulated with fewer particles than the scene has.
    pub draft: bool,
    /// Time to draw, without the simulation, s.
    pub draw_s: f64,
    /// Time to simulate, s.
    pub advance_s: f64,
}

/// What a player reports.
pub enum Event {
    /// A revision of the document was checked.
    Checked {
        /// The revision.
        revision: Revision,
        /// Its plan, or its problems.
        outcome: Result<Arc<Plan>, SceneError>,
    },
    /// A preview was drawn.
    Drawn(Picture),
    /// A small picture of a stage of the requested phenomenon: its index in [`stages::names`](crate::document::stages::names).
    Stage(usize, Picture),
    /// A full-quality frame was drawn.
    FullQualityFrame {
        /// The frame.
        number: i64,
        /// The file that `bansho render` writes, a PNG.
        png: Vec<u8>,
    },
    /// No picture could be drawn.
    Failed {
        /// The requested revision.
        revision: Revision,
        /// The error.
        reason: String,
    },
    /// A phenomenon panicked, which is a bug in it.
    Panicked {
        /// The requested revision.
        revision: Revision,
        /// The frame; `None` for the scene's first frame.
        number: Option<i64>,
        /// The panic's message.
        message: String,
    },
}

impl Event {
    /// The revision of the document that the event belongs to.
    pub fn revision(&self) -> Option<Revision> {
        match self {
            Self::Checked { revision, .. } | Self::Failed { revision, .. } | Self::Panicked { revision, .. } => {
                Some(*revision)
            }
            Self::Drawn(picture) | Self::Stage(_, picture) => Some(picture.revision),
            Self::FullQualityFrame { .. } => None,
        }
    }
}

/// The message of a panic.
fn panic_message(panic: &(dyn std::any::Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
    text.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_else(|| "no reason given".into())
}

/// Serves frame requests.
pub trait Player {
    /// Requests a frame, which replaces any earlier request.
    fn request(&mut self, request: FrameRequest);

    /// The events since the last call. A player without threads works in this call: it limits the time of simulations, but neither of checks
    /// nor of drawing.
    fn poll(&mut self) -> Vec<Event>;

    /// Waits until there are events to [`poll`](Self::poll), up to `timeout`. Players in web pages do not wait.
    fn wait(&mut self, _timeout: Duration) {}

    /// Whether a request is not finished yet.
    fn is_busy(&self) -> bool;

    /// Adds the content of a file that is in no folder. Only players in another process need it: others find the file in the assets of a
    /// request.
    fn add_file(&mut self, _name: &str, _bytes: &[u8]) {}

    /// Whether it only works while it is polled.
    fn needs_polling(&self) -> bool;
}
