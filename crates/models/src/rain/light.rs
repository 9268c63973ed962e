//! The light that drops send to the camera.

use bansho_base::{
    math::{self, DVec3, lanes},
    surroundings::{Arrival, Emitter, Light},
};

use super::{lens::DropLens, tiles::mix};

/// Steps of [`Scattering`].
const STEPS: usize = 2048;

/// The radiance of a drop for the illuminance on it, `p / (4 pi)`, by the sine of half the angle that it turns light by: quick to look
/// up from a cosine, and finest where a drop turns light least.
#[derive(Debug)]
pub(crate) struct Scattering {
    table: Vec<[f32; 3]>,
    /// Greatest of all colours and deviations, 1/sr.
    greatest: f32,
}

impl Scattering {
    pub(crate) fn new(lens: &DropLens) -> Self {
        let at = |step: usize| {
            let half_sine = step as f32 / STEPS as f32;
            lens.phase(1.0 - 2.0 * half_sine * half_sine).map(|phase| phase * (0.25 / std::f32::consts::PI))
        };
        let table: Vec<[f32; 3]> = (0..=STEPS).map(at).collect();
        let greatest = table.iter().flatten().copied().fold(0.0, f32::max);
        Self { table, greatest }
    }

    /// For a deviation of the light whose cosine is given, 1/sr.
    #[inline(always)]
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
}

impl Lighting<'_> {
    /// Mean radiance of a drop at `point` by lights, seen along `line` (unit vector from the eye), ACEScg, cd/m^2: `sum of E p / (4 pi)`.
    #[inline(always)]
    pub(crate) fn radiance(&self, point: DVec3, line: DVec3) -> [f32; 3] {
        let mut sum = [0.0; 3];
        for light in self.lights {
            let Arrival { illuminance, toward, distance } = light.arriving(point);
            if illuminance == [0.0; 3] {
                continue;
            }
            let through = lanes::exp(-(self.extinction * distance) as f32);
            let scattered = self.scattering.at(toward.dot(line) as f32);
            (0..3).for_each(|c| sum[c] += illuminance[c] * through * scattered[c]);
        }
        sum
    }

    /// No drop within `radius` (m) of a point has a greater radiance in any colour, cd/m^2.
    pub(crate) fn brightest(&self, centre: DVec3, radius: f64) -> f32 {
        let brightest = |light: &Light| {
            let intensity = light.intensity.into_iter().fold(0.0, f32::max) * self.scattering.greatest;
            let nearest = (light.arriving(centre).distance - radius).max(f64::MIN_POSITIVE);
            match light.emitter {
                Emitter::Directional { .. } => intensity,
                Emitter::Spot { position, axis, cos_outer, .. }
                    if misses(centre - position, radius, axis, cos_outer) =>
                {
                    0.0
                }
                Emitter::Point { radius: lamp, .. } => intensity / (nearest * nearest).max(lamp * lamp) as f32,
                Emitter::Spot { .. } => intensity / (nearest * nearest) as f32,
            }
        };
        self.lights.iter().map(brightest).sum()
    }
}

/// Whether a cone around `axis` misses a ball that lies at `offset` from its apex.
fn misses(offset: DVec3, radius: f64, axis: DVec3, cos_outer: f64) -> bool {
    let away = offset.length();
    if away <= radius {
        return false;
    }
    let turned = math::acos((offset.dot(axis) / away).clamp(-1.0, 1.0));
    turned - math::asin(radius / away) > math::acos(cos_outer.clamp(-1.0, 1.0))
}
