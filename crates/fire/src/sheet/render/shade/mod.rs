//! Shading of sixteen pixels: from sheet coordinates to light and opacity, for whatever a sheet shows.

use bansho_base::{camera::upright_quad::UprightQuad, math::simd::Lanes};
use fearless_simd::Simd;

use super::{
    cells::ProjectedCells,
    projection::{PixelToSheet, SheetCoordinates},
};
use crate::sheet::{
    animate::warp::WarpState,
    eddies::EddyState,
    tables::{color_ramp::ColorRamp, shape_tables::ShapeTables},
    texture::FlameTexture,
};

pub(crate) mod flame;
pub(crate) mod smoke;

use flame::{shade, shade_flat};
use smoke::{SmokeState, shade_smoke};

/// The state of a sheet at one time.
pub(crate) struct SheetState {
    /// Edges, center line and scroll.
    pub(crate) warp: WarpState,
    /// T0.
    pub(crate) texture: FlameTexture,
    /// Eddies that displace outline and texture.
    pub(crate) eddies: Option<EddyState>,
    /// Size of a pixel, or of a cell, in x' and in y.
    pub(crate) pixel: [f32; 2],
}

impl SheetState {
    /// Texels per unit of u and of w, of the finer layer; for a texture that is filtered to a lower resolution at most one texel per pixel.
    #[inline(always)]
    pub(crate) fn texels(&self) -> [f32; 2] {
        let [across, up] = self.texture.texels();
        let filter_factor = (1.0 / (self.pixel[1] * up)).min(1.0);
        [across * filter_factor, up * filter_factor]
    }
}

/// A sheet at one time of the exposure, seen by the camera at that time.
pub(crate) struct TimeSample {
    /// Mapping from pixels to the sheet.
    pub(crate) pixel_to_sheet: PixelToSheet,
    /// The sheet's quad in the world.
    pub(crate) quad: UprightQuad,
    /// Its state at that time.
    pub(crate) state: SheetState,
    /// Properties of smoke; `None` for a flame.
    pub(crate) smoke: Option<SmokeState>,
    /// Its cells in the picture if it is small; its state is then that of cells instead of pixels.
    pub(crate) cells: Option<ProjectedCells>,
    /// Luminance of the brightest color divided by the number of time samples, cd/m^2.
    pub(crate) luminance: f32,
}

/// Sixteen shaded pixels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ShadedBatch<S: Simd> {
    /// T1, eq. (5); for smoke its density.
    pub(crate) t1: Lanes<S>,
    /// Red, green, blue of luminance up to 1, and opacity.
    pub(crate) light: [Lanes<S>; 4],
}

/// Light and opacity of a batch of pixels of a time sample; `None` if all pixels are empty.
pub(crate) fn shade_sample<S: Simd>(
    shape: &ShapeTables,
    ramp: &ColorRamp,
    sample: &TimeSample,
    content: SheetContent,
    batch: &SheetCoordinates<S>,
) -> Option<ShadedBatch<S>> {
    let state = &sample.state;
    match (&sample.smoke, content) {
        (None, SheetContent::Flame | SheetContent::Smoke) => shade(shape, ramp, state, batch),
        (None, SheetContent::FlatTexture | SheetContent::FlatThresholded) => batch.x.simd.vectorize(
            #[inline(always)]
            || shade_flat(shape, ramp, state, batch, content == SheetContent::FlatThresholded),
        ),
        (Some(smoke), _) => batch.x.simd.vectorize(
            #[inline(always)]
            || shade_smoke(state, smoke, batch),
        ),
    }
}

/// Content of a sheet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SheetContent {
    /// The mapped flame.
    Flame,
    /// The texture square before the threshold.
    FlatTexture,
    /// The texture square after the threshold.
    FlatThresholded,
    /// Smoke.
    Smoke,
}
