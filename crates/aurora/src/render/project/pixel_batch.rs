//! Directions of a batch of pixels, as longitude and colatitude on the chart.

use bansho_base::{
    camera::{Camera, directions::Directions},
    math::{MulAdd, approximations},
};

use super::field_lines::{FieldLines, dot};

/// Pixels per batch.
pub(crate) const PIXEL_BATCH: usize = 16;

/// Directions of a batch of pixels in the field frame.
#[derive(Default)]
pub(crate) struct PixelBatch {
    /// Colatitude and longitude about the magnetic zenith.
    pub(crate) colatitude: [f32; PIXEL_BATCH],
    pub(crate) longitude: [f32; PIXEL_BATCH],
    /// Sine of the elevation.
    pub(crate) sine: [f32; PIXEL_BATCH],
    /// Length of the direction that [`Camera::direction`] gives.
    pub(crate) length: [f32; PIXEL_BATCH],
    /// Whether the lens maps the pixel to a direction.
    pub(crate) in_view: [bool; PIXEL_BATCH],
}

impl PixelBatch {
    /// Pixels from `x` on in row `y`.
    #[inline(always)]
    pub(crate) fn new(camera: &Camera, field: &FieldLines, x: usize, y: usize) -> Self {
        let mut directions = Directions::new(camera, x, y);
        let mut batch = Self { length: directions.normalize(), in_view: directions.visible, ..Self::default() };
        let [xs, ys, zs] = directions.components;
        let [along, first, second] = field.axes_f32();
        for i in 0..PIXEL_BATCH {
            let direction = [xs[i], ys[i], zs[i]];
            let (x, y) = (dot(first, direction), dot(second, direction));
            batch.colatitude[i] = approximations::atan2(x.fma(x, y * y).sqrt(), dot(along, direction));
            batch.longitude[i] = approximations::atan2(y, x);
        }
        batch.sine = ys;
        batch
    }
}
