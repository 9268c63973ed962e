//! Smoke: a second sheet above the flame with the same texture and a soft threshold, which absorbs light and scatters it once.

use bansho_base::{
    camera::upright_quad::UprightQuad,
    math::{
        self, DVec2, DVec3, approximations,
        simd::{LANES, Lanes, Real, any_positive, linspace},
    },
    phenomenon::{strip::View, surroundings::Surroundings},
};
use fearless_simd::{Simd, prelude::*};

use super::{
    projection::{PixelToSheet, SheetCoordinates, bounds},
    shade::{ShadedBatch, SheetState, TimeSample},
};
use crate::sheet::{
    FlameSheet,
    animate::warp::{FlameWaves, WarpState, WindLean},
    render::flame_instance::{FilteredTexture, FlameInstance, pixels_per_meter},
    texture::FractalLayers,
};

/// Heights at which the light on the smoke is sampled.
const LIGHT_SAMPLES: usize = 17;

/// Properties of smoke at one time.
#[derive(Clone, Debug)]
pub(crate) struct SmokeState {
    /// Greatest optical depth.
    depth: f32,
    /// Width at the base relative to that at the top.
    base_width: f32,
    /// Radiance scattered toward the viewer where the smoke is opaque, at `LIGHT_SAMPLES` heights; ACEScg, cd/m^2.
    scattered: [[f32; 3]; LIGHT_SAMPLES],
}

impl SmokeState {
    fn scattered_at(&self, y: f32) -> [f32; 3] {
        let scaled = y.simd_clamp01() * (LIGHT_SAMPLES - 1) as f32;
        let below = (scaled as usize).min(LIGHT_SAMPLES - 2);
        let fraction = scaled - below as f32;
        std::array::from_fn(|k| math::f32::lerp(self.scattered[below][k], self.scattered[below + 1][k], fraction))
    }
}

/// Light and opacity of sixteen pixels of smoke.
#[inline(always)]
pub(crate) fn shade_smoke<S: Simd>(
    state: &SheetState,
    smoke: &SmokeState,
    batch: &SheetCoordinates<S>,
) -> Option<ShadedBatch<S>> {
    let (x, y) = state.warp.unwarp(batch.x, batch.y);
    let (zero, one, two) = (x.broadcast(0.0), x.broadcast(1.0), x.broadcast(2.0));
    // A plume widens as it rises; its density falls smoothly to 0 at all edges.
    let width =
        y.simd_max(zero).simd_sqrt().fma(one - one.broadcast(smoke.base_width), one.broadcast(smoke.base_width));
    let across = (two * (x - one.broadcast(0.5))).simd_abs() / width;
    let smoothstep = |scaled: Lanes<S>| {
        let held = scaled.simd_clamp01();
        held * held * (one.broadcast(3.0) - two * held)
    };
    let side = smoothstep(one - across);
    let ends = smoothstep(y * one.broadcast(4.0)) * smoothstep((one - y) * one.broadcast(1.6));
    let envelope = side * ends;
    if !any_positive(envelope) {
        return None;
    }
    let u = x.select_lt(one.broadcast(0.5), zero - across, across).fma(one.broadcast(0.5), one.broadcast(0.5));
    let gas = state.texture.sample(u, y);
    let density = (gas - (one - envelope)).simd_max(zero) * envelope;
    let mut opacity = [0.0; LANES];
    for lane in 0..LANES {
        opacity[lane] = 1.0 - approximations::exp(-smoke.depth * density[lane]);
    }
    let opacity = Lanes::from_slice(x.simd, &opacity);
    let (first, last) = (y[0], y[LANES - 1]);
    let (low, high) = (smoke.scattered_at(first), smoke.scattered_at(last));
    let scattered = |k: usize| linspace(x.simd, low[k], high[k]) * opacity;
    let light = [scattered(0), scattered(1), scattered(2), opacity];
    Some(ShadedBatch { t1: density, light })
}

impl FlameSheet {
    /// Texture layers and fluctuations of a flame's smoke; `None` where it makes none.
    pub(crate) fn smoke_layers(&self, flame: &FlameInstance) -> Option<(FractalLayers, FlameWaves)> {
        let smoke = &self.parameters.smoke;
        let still_shape =
            crate::sheet::parameters::ShapeParameters { flicker: 0.0, sway: 0.08, ..self.parameters.shape.clone() };
        (smoke.optical_depth > 0.0).then(|| {
            let layers = FractalLayers::new([1.0, 0.35], smoke.speed, flame.key, &self.clock);
            (layers, FlameWaves::new(&still_shape, flame.key, &self.clock))
        })
    }

    /// A flame's smoke over the exposure, and the pixels it may touch.
    pub(crate) fn smoke_sample(
        &self,
        flame: &FlameInstance,
        view: &View,
        surroundings: &Surroundings,
    ) -> Option<(TimeSample, bansho_base::image::Rect)> {
        let (layers, waves) = self.smoke_layers(flame)?;
        let smoke = &self.parameters.smoke;
        let t = view.shutter.middle();
        let size = self.sheet_size(flame);
        let base = self.base(flame, t);
        let right = self.right(flame, &view.camera, base);
        let plume = DVec2::new(size.x * smoke.width, size.y * smoke.height);
        let start = base + DVec3::Y * (smoke.base_height * size.y);
        let speed = (self.rise_speed(flame, t) * smoke.speed).max(0.3);
        let lean = WindLean::new(surroundings.wind, start, t, right, speed, self.parameters.wind_response);
        let quad = UprightQuad::new(start, right, plume, lean.toward);
        let across = WindLean { across: lean.across * plume.y / plume.x * size.x / size.y, ..lean };
        let time = self.flame_time(flame, t);
        let warp = WarpState::new(&self.parameters, self.shape(), &waves, &self.clock, time, across);
        let pixel_to_sheet = PixelToSheet::new(&view.camera, &quad)?;
        let scale = pixels_per_meter(&view.camera, &quad);
        let source = FilteredTexture::fractal(layers, scale * plume.y);
        let [low, high] = warp.center_range;
        let rect = bounds(&view.camera, &quad, low.min(0.0), 1.0 + high.max(0.0), 1.0, view.size);
        let state = SheetState {
            texture: source.texture(warp.scroll),
            pixel: [2.0 / (scale * plume.x) as f32, 1.0 / (scale * plume.y) as f32],
            warp,
        };
        let smoke_state = SmokeState {
            depth: smoke.optical_depth as f32,
            base_width: (0.8 / smoke.width).min(1.0) as f32,
            scattered: self.smoke_light(flame, &quad, t, surroundings),
        };
        Some((TimeSample { pixel_to_sheet, state, quad, luminance: 1.0, smoke: Some(smoke_state) }, rect))
    }

    /// Radiance scattered at each height: isotropic single scattering of the fire below and of all other lights.
    fn smoke_light(
        &self,
        flame: &FlameInstance,
        quad: &UprightQuad,
        t: f64,
        surroundings: &Surroundings,
    ) -> [[f32; 3]; LIGHT_SAMPLES] {
        let smoke = &self.parameters.smoke;
        let rows = self.row_intensities(flame, t);
        let fire: [f32; 3] = std::array::from_fn(|k| rows.iter().map(|row| row[k]).sum());
        let size = self.sheet_size(flame);
        let flame_center = self.base(flame, t) + DVec3::Y * (0.3 * size.y);
        let near = 0.16 * size.length_squared();
        let scatter = smoke.albedo / (4.0 * std::f64::consts::PI);
        let tint = bansho_base::color::acescg_from_srgb(smoke.color.map(|value| value as f32));
        std::array::from_fn(|i| {
            let point = quad.point(0.5, i as f64 / (LIGHT_SAMPLES - 1) as f64);
            let falloff = smoke.fire_light / ((point - flame_center).length_squared() + near);
            let mut light = fire.map(|value| value * falloff as f32);
            for other in &surroundings.others.lights {
                let (illuminance, _) = other.illuminance(point);
                light.iter_mut().zip(illuminance).for_each(|(sum, value)| *sum += value);
            }
            std::array::from_fn(|k| light[k] * tint[k] * scatter as f32)
        })
    }
}
