//! Drawing many frames from a [`FrameSource`]: from the nearest snapshot, in order, while earlier ones are finished by other threads of the pool.

pub(crate) mod draw_frames;
pub(crate) mod in_flight;
pub(crate) mod snapshots;

use bansho_base::{frame::Frame, host::observer::Observer, phenomenon::SnapshotError};
use bansho_render::{RenderError, Shot, Target, snapshot};

/// A source of frames: a [`Shot`], or in tests a source with a known state and known pictures. The methods are those of [`Shot`].
pub(crate) trait FrameSource: Send {
    fn advance(&mut self, number: i64, observer: &dyn Observer) -> Result<(), RenderError>;
    fn draw<T: Target>(&mut self, target: &T, observer: &dyn Observer) -> Result<T::Frame, RenderError>
    where
        Self: Sized;
    fn recycle(&mut self, recycled: Frame);
    /// Another source of the same frames, which may be drawn at the same time; `None` where frames follow from those before.
    fn independent(&self) -> Option<Self>
    where
        Self: Sized;
    fn snapshot(&self) -> Vec<u8>;
    fn restore(&mut self, snapshot: &[u8]) -> Result<(), RenderError>;
    /// Whether a snapshot is whole, of whatever scene.
    fn check_snapshot(&self, bytes: &[u8]) -> Result<(), SnapshotError> {
        snapshot::check(bytes)
    }
}

impl FrameSource for Shot {
    fn advance(&mut self, number: i64, observer: &dyn Observer) -> Result<(), RenderError> {
        Self::advance(self, number, observer)
    }

    fn draw<T: Target>(&mut self, target: &T, observer: &dyn Observer) -> Result<T::Frame, RenderError> {
        Self::draw(self, target, observer)
    }

    fn recycle(&mut self, recycled: Frame) {
        Self::recycle(self, recycled);
    }

    fn independent(&self) -> Option<Self> {
        Self::independent(self)
    }

    fn snapshot(&self) -> Vec<u8> {
        Self::snapshot(self)
    }

    fn restore(&mut self, snapshot: &[u8]) -> Result<(), RenderError> {
        Self::restore(self, snapshot)
    }
}
