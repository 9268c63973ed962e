//! Light on smoke: the illuminance of all lights at the points of a coarse lattice, and that of the sky.

use bansho_base::{
    math::{DVec3, Vec3},
    phenomenon::surroundings::{Light, Surroundings},
};

use super::field::GasField;

/// Points of the lattice along x, y and z.
const POINTS: [usize; 3] = [5, 9, 5];

/// Radiance that opaque smoke scatters toward the camera, at the points of a lattice.
pub(crate) struct SmokeLight {
    values: Vec<[f32; 3]>,
    low: Vec3,
    scale: Vec3,
}

impl SmokeLight {
    /// The light on the gas of a field, isotropic single scattering with that albedo.
    pub(crate) fn new(field: &GasField, own: &[Light], surroundings: &Surroundings, albedo: f64) -> Option<Self> {
        let [low, high] = field.seen_bounds?;
        let corner = |corner: [usize; 3]| DVec3::from(corner.map(|c| c as f64));
        let (low, high) = (corner(low), corner(high));
        let factor = (albedo / (4.0 * std::f64::consts::PI)) as f32;
        // A uniform sky of that radiance shines from above and, reflected, from below.
        let sky = surroundings.sky.horizontal_illuminance().map(|value| 2.0 * value * factor);
        let mut values = Vec::with_capacity(POINTS.iter().product());
        for y in 0..POINTS[1] {
            for z in 0..POINTS[2] {
                for x in 0..POINTS[0] {
                    let fraction =
                        DVec3::new(x as f64, y as f64, z as f64) / DVec3::from(POINTS.map(|count| (count - 1) as f64));
                    let point = field.point_in_world(low + (high - low) * fraction);
                    let mut sum = sky;
                    for light in own.iter().chain(&surroundings.others.lights) {
                        let (illuminance, _) = light.illuminance(point);
                        (0..3).for_each(|c| sum[c] += illuminance[c] * factor);
                    }
                    values.push(sum);
                }
            }
        }
        let sides = (high - low).max(DVec3::ONE);
        let scale = (DVec3::from(POINTS.map(|count| (count - 1) as f64)) / sides).as_vec3();
        Some(Self { values, low: low.as_vec3(), scale })
    }

    /// The radiance at a point in cells.
    pub(crate) fn at(&self, point: Vec3) -> [f32; 3] {
        let place = (point - self.low) * self.scale;
        let mut below = [0; 3];
        let mut fraction = [0.0; 3];
        for axis in 0..3 {
            let value = place[axis].clamp(0.0, (POINTS[axis] - 1) as f32);
            below[axis] = (value as usize).min(POINTS[axis] - 2);
            fraction[axis] = value - below[axis] as f32;
        }
        let mut sum = [0.0; 3];
        for corner in 0..8 {
            let [i, j, k] = [corner & 1, corner >> 1 & 1, corner >> 2];
            let index = ((below[1] + j) * POINTS[2] + below[2] + k) * POINTS[0] + below[0] + i;
            let side = |axis: usize, bit: usize| if bit == 1 { fraction[axis] } else { 1.0 - fraction[axis] };
            let weight = side(0, i) * side(1, j) * side(2, k);
            (0..3).for_each(|c| sum[c] += weight * self.values[index][c]);
        }
        sum
    }
}
