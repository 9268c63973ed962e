//! What draws a plan: a backend opens a shot, and the shot owns its state and its pictures.

use std::sync::Arc;

use bansho_base::{
    geometry::point_cloud::PointCloud,
    host::observer::{Cancelled, Observer},
    image::Frame,
    phenomenon::SnapshotError,
};

use crate::{
    plan::{Plan, PlanError},
    scene::OpeningFault,
};

/// Why a frame cannot be drawn.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RenderError {
    /// The caller stopped it.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// The plan cannot be carried out.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// The plate of a frame cannot be had: its picture or its depth, which the fault names.
    #[error("plate.{}: {}", .0.key, .0.kind)]
    Plate(Box<OpeningFault>),
    /// A snapshot does not fit.
    #[error(transparent)]
    Snapshot(#[from] SnapshotError),
    /// The snapshot belongs to another scene, seed or version.
    #[error("the snapshot belongs to another scene, seed or version")]
    ForeignSnapshot,
}

/// Draws plans.
pub trait Backend: Send + Sync {
    /// Its name on the command line.
    fn name(&self) -> &'static str;

    /// Opens a shot at its beginning.
    ///
    /// # Errors
    /// The plan cannot be carried out.
    fn open(&self, plan: Arc<Plan>) -> Result<Box<dyn Shot>, RenderError>;
}

/// A shot that is being drawn: `advance` to a frame, `draw` it, `read` it.
pub trait Shot: Send {
    /// Steps every phenomenon to frame `number`; begins anew where that lies in the past.
    ///
    /// # Errors
    /// The observer asked to stop; the shot then stands at some earlier step and may be advanced again.
    fn advance(&mut self, number: i64, observer: &dyn Observer) -> Result<(), RenderError>;

    /// Draws the frame that the shot was advanced to.
    ///
    /// # Errors
    /// The observer asked to stop, or the plate cannot be had.
    fn draw(&mut self, observer: &dyn Observer) -> Result<(), RenderError>;

    /// Takes the frame that was drawn; `None` where none was since the last.
    fn read(&mut self) -> Option<Frame>;

    /// Gives back a frame that nobody needs any more, so that the next is drawn into its memory.
    fn recycle(&mut self, _spent: Frame) {}

    /// Goes on with another plan of the scene, as an editor does while it is played. What is simulated keeps the state
    /// that it came to under the old plan, where it can; what cannot begins anew.
    ///
    /// # Errors
    /// The plan cannot be carried out; the shot then goes on with its own.
    fn replan(&mut self, plan: Arc<Plan>) -> Result<(), RenderError>;

    /// Whether the state is the one that the plan leads to from its beginning. After [`replan`](Self::replan) it need not
    /// be, until the shot begins anew.
    fn is_exact(&self) -> bool;

    /// The particles of everything that has any, at the frame that the shot was advanced to.
    fn particles(&self) -> PointCloud;

    /// The state of every phenomenon, for [`restore`](Self::restore).
    fn snapshot(&self) -> Vec<u8>;

    /// Returns to the state of a snapshot.
    ///
    /// # Errors
    /// The bytes are damaged or belong to another scene; the shot is then unchanged.
    fn restore(&mut self, snapshot: &[u8]) -> Result<(), RenderError>;
}
