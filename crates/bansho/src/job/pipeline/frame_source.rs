//! What a job draws its frames from.

use bansho_base::{frame::Frame, host::observer::Observer};
use bansho_render::{RenderError, Shot};

/// A source of frames: a [`Shot`], or in tests a source with a known state and known pictures. The methods are those of [`Shot`].
pub(crate) trait FrameSource: Send {
    fn advance(&mut self, number: i64, observer: &dyn Observer) -> Result<(), RenderError>;
    fn draw(&mut self, observer: &dyn Observer) -> Result<(), RenderError>;
    fn read(&mut self) -> Option<Frame>;
    fn recycle(&mut self, recycled: Frame);
    fn snapshot(&self) -> Vec<u8>;
    fn restore(&mut self, snapshot: &[u8]) -> Result<(), RenderError>;
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
