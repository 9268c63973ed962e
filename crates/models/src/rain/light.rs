//! The light that drops send to the camera.

use bansho_base::{
    math::{self, DVec3},
    surroundings::{Emitter, Light},
};

use super::lens::DropLens;

/// What falls on drops from lamps and fires.
#[derive(Clone, Copy)]
pub(crate) struct Lighting<'a> {
    pub(crate) lens: &'a DropLens,
    pub(crate) lights: &'a [Light],
    /// What rain takes on the way from a light to a drop, 1/m.
    pub(crate) extinction: f64,
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
            let through = math::exp(-self.extinction * distance(light, point)) as f32;
            let phase = self.lens.phase(toward.dot(line) as f32);
            let scale = through * (0.25 / std::f32::consts::PI);
            std::array::from_fn(|c| (illuminance[c] * scale).mul_add(phase[c], sum[c]))
        })
    }
}
