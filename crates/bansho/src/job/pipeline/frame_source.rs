//! What a job draws its frames from.

use bansho_base::{
    frame::Frame,
    host::observer::{Cancelled, Observer},
    phenomenon::SnapshotError,
};
use bansho_render::{
    RenderError, Shot,
    display::{DisplayFrame, DisplayOptions},
    snapshot,
};

/// A source of frames: a [`Shot`], or in tests a source with a known state and known pictures. The methods are those of [`Shot`].
pub(crate) trait FrameSource: Send {
    fn advance(&mut self, number: i64, observer: &dyn Observer) -> Result<(), RenderError>;
    fn draw(&mut self, observer: &dyn Observer) -> Result<(), RenderError>;
    fn read(&mut self) -> Option<Frame>;

    fn draw_display(&mut self, options: &DisplayOptions, observer: &dyn Observer) -> Result<DisplayFrame, RenderError> {
        self.draw(observer)?;
        let mut frame = self.read().ok_or(Cancelled)?;
        Ok(DisplayFrame::of_frame(&mut frame, options))
    }

    fn recycle(&mut self, recycled: Frame);
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

    fn draw(&mut self, observer: &dyn Observer) -> Result<(), RenderError> {
        Self::draw(self, observer)
    }

    fn read(&mut self) -> Option<Frame> {
        Self::read(self)
    }

    fn draw_display(&mut self, options: &DisplayOptions, observer: &dyn Observer) -> Result<DisplayFrame, RenderError> {
        Self::draw_display(self, options, observer)
    }

    fn recycle(&mut self, recycled: Frame) {
        Self::recycle(self, recycled);
    }

    fn snapshot(&self) -> Vec<u8> {
        Self::snapshot(self)
    }

    fn restore(&mut self, snapshot: &[u8]) -> Result<(), RenderError> {
        Self::restore(self, snapshot)
    }
}
