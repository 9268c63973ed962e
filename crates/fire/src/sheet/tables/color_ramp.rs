//! Color ramp: sharpening, eq. (6), and color, eq. (7), tabulated over T1.

use bansho_base::{
    color,
    math::{
        self,
        simd::{Lanes, Real, gather, round_to_u32},
    },
    parameters::ParameterError,
};
use fearless_simd::Simd;

use crate::{
    chemiluminescence_color,
    sheet::{
        parameters::{ColorParameters, Coloring, SheetStage, TextureParameters},
        tables::{curve_pair::CurvePair, shape_tables::from_origin},
    },
};

/// Entries over T1: finer than a display can resolve, so that nearest-neighbor lookup suffices.
const ENTRIES: usize = 4096;

/// Light, opacity and temperature over T1.
#[derive(Clone, Debug)]
pub(crate) struct ColorRamp {
    /// Red, green, blue (ACEScg, normalized to a maximum luminance of 1) and opacity over T1.
    light: Box<[[f32; 4]; ENTRIES]>,
    /// Soot temperature in K over T1.
    pub(crate) temperature: CurvePair,
    /// Whether it absorbs light from behind.
    pub(crate) absorbs: bool,
    /// Color of the blue zone at the base: ACEScg of luminance 1, times the parameter `base_blue`.
    pub(crate) base_blue: [f32; 3],
}

/// Soot temperature at T2, K.
pub(crate) fn temperature(color: &ColorParameters, t2: f64) -> f64 {
    math::lerp(color.edge_temperature_k, color.core_temperature_k, t2)
}

/// Opacity, which is also the emissivity, of soot at T2.
fn opacity(color: &ColorParameters, t2: f64) -> f64 {
    -math::exp_m1(-color.soot_optical_depth * t2)
}

/// ACEScg of T2 before normalization.
fn unscaled_color(color: &ColorParameters, t2: f64) -> [f64; 3] {
    match color.kind {
        Coloring::BlackBody => {
            // Emission of optically thin soot is proportional to its depth; at zero depth the color is that of the thin limit.
            let emissivity = if color.soot_optical_depth > 1e-6 { opacity(color, t2) } else { t2 };
            color::black_body().radiance(temperature(color, t2) as f32).map(|value| f64::from(value) * emissivity)
        }
        Coloring::RgbCurves => {
            let display =
                [&color.red, &color.green, &color.blue].map(|curve| color::decode_srgb(curve.eval(t2) as f32));
            color::acescg_from_srgb(display).map(f64::from)
        }
    }
}

/// The factor that gives the brightest color luminance 1.
fn luminance_scale(color: &ColorParameters) -> f64 {
    let mut max_luminance = 0.0_f64;
    for i in 0..=256 {
        let rgb = unscaled_color(color, f64::from(i) / 256.0).map(|value| value as f32);
        max_luminance = max_luminance.max(f64::from(color::luminance(rgb)));
    }
    if max_luminance > 0.0 { 1.0 / max_luminance } else { 0.0 }
}

impl ColorParameters {
    /// Color over T2, eq. (7), as linear ACEScg whose brightest value has luminance 1.
    pub fn light(&self) -> impl Fn(f64) -> [f64; 3] + '_ {
        let scale = luminance_scale(self);
        move |t2| unscaled_color(self, t2).map(|value| value * scale)
    }
}

impl ColorRamp {
    /// Checks the parameters.
    ///
    /// # Errors
    /// The sharpening curve does not start at the origin.
    pub(crate) fn check(texture: &TextureParameters) -> Result<(), ParameterError> {
        from_origin(&texture.sharpen, "texture.sharpen").map(drop)
    }

    /// The table for parameters that were [checked](Self::check).
    pub(crate) fn new(texture: &TextureParameters, color: &ColorParameters, stage: SheetStage) -> Self {
        let sharpen = from_origin(&texture.sharpen, "texture.sharpen").unwrap_or_else(|_| texture.sharpen.clone());
        let scale = luminance_scale(color);
        let mut light = Box::new([[0.0; 4]; ENTRIES]);
        for (i, entry) in light.iter_mut().enumerate() {
            let t1 = i as f64 / (ENTRIES - 1) as f64;
            let t2 = sharpen.eval(t1);
            let [r, g, b] = match stage {
                SheetStage::Flame | SheetStage::Colored => unscaled_color(color, t2).map(|value| value * scale),
                SheetStage::Sharpened => [t2; 3],
                SheetStage::FlameTexture | SheetStage::Thresholded => [t1; 3],
            };
            let opacity = if stage == SheetStage::Flame { opacity(color, t2) } else { 1.0 };
            *entry = [r, g, b, opacity].map(|value| value as f32);
        }
        Self {
            light,
            temperature: CurvePair::new(|t1| [temperature(color, sharpen.eval(t1)), 0.0]),
            absorbs: color.soot_optical_depth > 0.0 || stage != SheetStage::Flame,
            base_blue: chemiluminescence_color().map(|value| value * color.base_blue as f32),
        }
    }
}

impl ColorRamp {
    /// Red, green and blue, of luminance up to 1, and opacity at T1.
    #[inline(always)]
    pub(crate) fn light<S: Simd>(&self, t1: Lanes<S>) -> [Lanes<S>; 4] {
        let scaled = t1.simd_clamp01() * t1.broadcast((ENTRIES - 1) as f32);
        gather(t1.simd, &self.light, round_to_u32(scaled))
    }
}
