//! A picture of an effect, and how it is written into the caller's buffers.

use std::fmt;

use bansho_base::{
    color::{AlphaMode, ColorSpace, View},
    frame::Frame,
    image::Rect,
};
use bansho_render::pixels::{self, BufferLengthError, ChannelError, f16};

use super::Pool;

/// A picture of an effect at one time: scene-linear light, exposed so that 1.0 is display white. Rows run from the top.
pub struct Picture<'a> {
    pub(super) frame: &'a Frame,
    pub(super) time_s: f64,
    pub(super) owed_s: f64,
    pub(super) pool: &'a Pool,
}

impl fmt::Debug for Picture<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut picture = f.debug_struct("Picture");
        picture.field("size", &self.size()).field("time_s", &self.time_s).field("owed_s", &self.owed_s);
        picture.finish_non_exhaustive()
    }
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

    /// Rectangle outside of which every pixel that is written is 0. A texture that still holds the picture before needs the union with its rectangle.
    pub fn content(&self) -> Rect {
        pixels::nonzero_rect(self.frame)
    }

    /// Writes premultiplied linear sRGB as half floats, what engines blend (`Rgba16Float`): see [`pixels::write_rgba16f`].
    ///
    /// # Errors
    /// `pixels` does not have width x height x 4 values.
    pub fn write_rgba16f(&self, pixels: &mut [f16]) -> Result<(), BufferLengthError> {
        self.pool.run(|| pixels::write_rgba16f(self.frame, pixels))
    }

    /// Writes premultiplied light as floats in a space: see [`pixels::write_rgba32f`].
    ///
    /// # Errors
    /// `pixels` does not have width x height x 4 values.
    pub fn write_rgba32f(&self, space: ColorSpace, pixels: &mut [f32]) -> Result<(), BufferLengthError> {
        self.pool.run(|| pixels::write_rgba32f(self.frame, space, pixels))
    }

    /// Writes 8-bit display codes with a view transform and the alpha that the program blends with: see [`pixels::write_rgba8`].
    ///
    /// # Errors
    /// `pixels` does not have width x height x 4 values.
    pub fn write_rgba8(&self, view: &View, alpha: AlphaMode, pixels: &mut [u8]) -> Result<(), BufferLengthError> {
        self.pool.run(|| pixels::write_rgba8(self.frame, view, alpha, pixels))
    }

    /// Writes the depth of the nearest object drawn, m; infinity where there is none.
    ///
    /// # Errors
    /// `depth_m` does not have width x height values.
    pub fn write_depth32f(&self, depth_m: &mut [f32]) -> Result<(), BufferLengthError> {
        pixels::write_depth32f(self.frame, depth_m)
    }

    /// Writes a channel of a layer or an AOV, such as `rain.streak_opacity`; they are drawn with [`Effect::aovs`](super::Effect::aovs) and
    /// [`Effect::layers`](super::Effect::layers).
    ///
    /// # Errors
    /// There is no channel of that name, or `values` does not have width x height values.
    pub fn write_channel32f(&self, name: &str, values: &mut [f32]) -> Result<(), ChannelError> {
        pixels::write_channel32f(self.frame, name, values)
    }

    /// The picture itself: premultiplied ACEScg, depth, layers and AOVs.
    pub fn frame(&self) -> &'a Frame {
        self.frame
    }
}
