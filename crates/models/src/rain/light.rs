//! The light that drops send to the camera.

use bansho_base::{
    math::{DVec3, lanes},
    surroundings::{Emitter, Light},
};

use super::{lens::DropLens, tiles::mix};

/// Steps of [`Scattering`].
const STEPS: usize = 2048;

/// The radiance of a drop for the illuminance on it, `p / (4 pi)`, by the sine of half the angle that it turns light by: quick to look
/// up from a cosine, and finest where a drop turns light least.
#[derive(Debug)]
pub(crate) struct Scattering {
    table: Vec<[f32; 3]>,
}

impl Scattering {
    pub(crate) fn new(lens: &DropLens) -> Self {
        let at = |step: usize| {
            let half_sine = step as f32 / STEPS as f32;
            lens.phase(1.0 - 2.0 * half_sine * half_sine).map(|phase| phase * (0.25 / std::f32::consts::PI))
        };
        Self { table: (0..=STEPS).map(at).collect() }
    }

    /// For a deviation of the light whose cosine is given, 1/sr.
    pub(crate) fn at(&self, cos_deviation: f32) -> [f32; 3] {
        let place = ((1.0 - cos_deviation) * 0.5).clamp(0.0, 1.0).sqrt() * STEPS as f32;
        let step = (place as usize).min(STEPS - 1);
        mix(self.table[step], self.table[step + 1], place - step as f32)
    }
}

/// What falls on drops from lamps and fires.
#[derive(Clone, Copy)]
pub(crate) struct Lighting<'a> {
    pub(crate) scattering: &'a Scattering,
    pub(crate) lights: &'a [Light],
    /// What rain takes on the way from a light to a drop, 1/m.
    pub(crate) extinction: f64,
    /// Nearer to a lamp than this its light grows no more, m.
    pub(crate) nearest: f64,
}

/// Distance from a point to a light; 0 for one that is infinitely far, whose light is given where it arrives.
pub(crate) fn distance(light: &Light, point: DVec3) -> f64 {
    match light.emitter {
        Emitter::Directional { .. } => 0.0,
        Emitter::Point { position, .. } | Emitter::Spot { position, .. } => (position - point).length(),
    }
}

impl Lighting<'_> {
    /// Mean radiance of a drop at `point` by lights, seen along `line` (unit vector from the eye), ACEScg, cd/m^2: `sum of E p / (4 pi)`.
    pub(crate) fn radiance(&self, point: DVec3, line: DVec3) -> [f32; 3] {
        self.lights.iter().fold([0.0; 3], |sum, light| {
            let (illuminance, toward) = light.illuminance(point);
            if illuminance == [0.0; 3] {
                return sum;
            }
            let away = distance(light, point);
            let held = if away > 0.0 && away < self.nearest { away / self.nearest } else { 1.0 };
            let through = lanes::exp(-(self.extinction * away) as f32) * (held * held) as f32;
            let scattered = self.scattering.at(toward.dot(line) as f32);
            std::array::from_fn(|c| sum[c] + illuminance[c] * through * scattered[c])
        })
    }
}
