//! Smoke: a second sheet above the flame, cut softly from the same texture; it takes light away and scatters what falls on it.

use bansho_base::{
    camera::upright_quad::UprightQuad,
    math::{
        self, DVec2, DVec3, approximations,
        simd::{LANES, Lanes, Real, any_positive, evenly_spaced},
    },
    phenomenon::{strip::View, surroundings::Surroundings},
};

use super::{
    flame::{FilteredSource, Flame, pixels_per_metre},
    projection::{Batch, Mapping, bounds},
    shade::{Sample, Shade, State},
};
use crate::sheet::{
    FlameSheet,
    animate::moment::{Moment, Motion, Push},
    texture::FractalLayers,
};
use fearless_simd::{Simd, prelude::*};

/// Heights at which the light that falls on smoke is known.
const LIT: usize = 17;

/// What smoke is made of at one moment.
#[derive(Clone, Debug)]
pub(crate) struct SmokeState {
    /// Greatest optical depth.
    depth: f32,
    /// Half width at the base beside that at the top.
    narrow: f32,
    /// What it scatters toward the viewer where it hides everything, at `LIT` heights; ACEScg, cd/m^2.
    lit: [[f32; 3]; LIT],
}

impl SmokeState {
    fn lit_at(&self, y: f32) -> [f32; 3] {
        let place = y.simd_clamp01() * (LIT - 1) as f32;
        let below = (place as usize).min(LIT - 2);
        let part = place - below as f32;
        std::array::from_fn(|k| math::f32::lerp(self.lit[below][k], self.lit[below + 1][k], part))
    }
}

/// Light and opacity of sixteen pixels of smoke.
#[inline(always)]
pub(crate) fn shade_smoke<S: Simd>(state: &State, smoke: &SmokeState, batch: &Batch<S>) -> Option<Shade<S>> {
    let (x, y) = state.moment.straighten(batch.x, batch.y);
    let (zero, one, two) = (x.broadcast(0.0), x.broadcast(1.0), x.broadcast(2.0));
    // A plume widens as it rises; its density falls smoothly to nothing at all its edges.
    let width = y.simd_max(zero).simd_sqrt().fma(one - one.broadcast(smoke.narrow), one.broadcast(smoke.narrow));
    let across = (two * (x - one.broadcast(0.5))).simd_abs() / width;
    let soft = |place: Lanes<S>| {
        let held = place.simd_clamp01();
        held * held * (one.broadcast(3.0) - two * held)
    };
    let side = soft(one - across);
    let ends = soft(y * one.broadcast(4.0)) * soft((one - y) * one.broadcast(1.6));
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
    let (low, high) = (smoke.lit_at(first), smoke.lit_at(last));
    let scattered = |k: usize| evenly_spaced(x.simd, low[k], high[k]) * opacity;
    let light = [scattered(0), scattered(1), scattered(2), opacity];
    Some(Shade { t1: density, light })
}

impl FlameSheet {
    /// The layers and waves of a flame's smoke; `None` where it makes none.
    pub(crate) fn smoke_layers(&self, flame: &Flame) -> Option<(FractalLayers, Motion)> {
        let smoke = &self.parameters.smoke;
        let still =
            crate::sheet::parameters::ShapeParameters { flicker: 0.0, sway: 0.08, ..self.parameters.shape.clone() };
        (smoke.optical_depth > 0.0).then(|| {
            let layers = FractalLayers::new([1.0, 0.35], smoke.speed, flame.key, &self.clock);
            (layers, Motion::new(&still, flame.key, &self.clock))
        })
    }

    /// A flame's smoke over the exposure, and the pixels it may touch.
    pub(crate) fn smoke_sample(
        &self,
        flame: &Flame,
        view: &View,
        surroundings: &Surroundings,
    ) -> Option<(Sample, bansho_base::image::Rect)> {
        let (layers, motion) = self.smoke_layers(flame)?;
        let smoke = &self.parameters.smoke;
        let t = view.shutter.middle();
        let size = self.sheet_size(flame);
        let base = self.base(flame, t);
        let right = self.right(flame, &view.camera, base);
        let plume = DVec2::new(size.x * smoke.width, size.y * smoke.height);
        let start = base + DVec3::Y * (smoke.start * size.y);
        let speed = (self.rise_speed(flame, t) * smoke.speed).max(0.3);
        let push = Push::new(surroundings.wind, start, t, right, speed, self.parameters.wind_response);
        let stand = UprightQuad::new(start, right, plume, push.toward);
        let across = Push { across: push.across * plume.y / plume.x * size.x / size.y, ..push };
        let time = self.flame_time(flame, t);
        let moment = Moment::new(&self.parameters, self.shape(), &motion, &self.clock, time, across);
        let mapping = Mapping::new(&view.camera, &stand)?;
        let scale = pixels_per_metre(&view.camera, &stand);
        let source = FilteredSource::fractal(layers, scale * plume.y);
        let [low, high] = moment.centre_range;
        let rect = bounds(&view.camera, &stand, low.min(0.0), 1.0 + high.max(0.0), 1.0, view.size);
        let state = State {
            texture: source.texture(moment.scroll),
            pixel: [2.0 / (scale * plume.x) as f32, 1.0 / (scale * plume.y) as f32],
            moment,
        };
        let smoke_state = SmokeState {
            depth: smoke.optical_depth as f32,
            narrow: (0.8 / smoke.width).min(1.0) as f32,
            lit: self.smoke_light(flame, &stand, t, surroundings),
        };
        Some((Sample { mapping, state, stand, luminance: 1.0, smoke: Some(smoke_state) }, rect))
    }

    /// What smoke scatters at each height: isotropic single scattering of the fire beneath and of all other lights.
    fn smoke_light(&self, flame: &Flame, stand: &UprightQuad, t: f64, surroundings: &Surroundings) -> [[f32; 3]; LIT] {
        let smoke = &self.parameters.smoke;
        let rows = self.row_intensities(flame, t);
        let fire: [f32; 3] = std::array::from_fn(|k| rows.iter().map(|row| row[k]).sum());
        let size = self.sheet_size(flame);
        let hearth = self.base(flame, t) + DVec3::Y * (0.3 * size.y);
        let near = 0.16 * size.length_squared();
        let scatter = smoke.albedo / (4.0 * std::f64::consts::PI);
        let tint = bansho_base::color::acescg_from_srgb(smoke.colour.map(|value| value as f32));
        std::array::from_fn(|i| {
            let point = stand.point(0.5, i as f64 / (LIT - 1) as f64);
            let falloff = smoke.fire_light / ((point - hearth).length_squared() + near);
            let mut light = fire.map(|value| value * falloff as f32);
            for other in &surroundings.others.lights {
                let (illuminance, _) = other.illuminance(point);
                light.iter_mut().zip(illuminance).for_each(|(sum, value)| *sum += value);
            }
            std::array::from_fn(|k| light[k] * tint[k] * scatter as f32)
        })
    }
}
