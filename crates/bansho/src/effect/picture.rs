//! A picture of an effect, and how it is written into the caller's buffers.

use bansho_base::{
    color::{AlphaConvention, View},
    frame::Frame,
    image::Rect,
};

use super::pool::Pool;

/// A picture of an effect at one time: scene-linear light, exposed so that 1.0 is display white. Rows run from the top.
pub struct Picture<'a> {
    pub(super) frame: &'a Frame,
    pub(super) time_s: f64,
    pub(super) owed_s: f64,
    pub(super) pool: &'a Pool,
}

impl<'a> Picture<'a> {
    /// Time at which its shutter opened, s.
    pub fn time_s(&self) -> f64 {
        self.time_s
    }

    /// Time that the last call was asked for but simulations did not reach within their steps, s.
    pub fn owed_s(&self) -> f64 {
        self.owed_s
    }

    /// Width and height, pixels.
    pub fn size(&self) -> [usize; 2] {
        [self.frame.beauty.width(), self.frame.beauty.height()]
    }

    /// Bounding rectangle of the pixels that are not empty: only these need to be uploaded.
    pub fn content(&self) -> Rect {
        self.frame.content
    }

    /// The picture itself: premultiplied ACEScg, depth, layers and AOVs.
    pub fn frame(&self) -> &'a Frame {
        self.frame
    }
}
