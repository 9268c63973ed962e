//! The shadows of obstacles on sixteen points of the ground.

use bansho_base::{
    color::luminance,
    math::{
        DVec3,
        simd::{LANES, Lanes},
    },
    phenomenon::{
        light_batch::{ArrivingLight, RelativeLight},
        surroundings::Occluder,
    },
    world::shadow::{mean_visibility, sky_visibility, visibility},
};
use fearless_simd::prelude::*;

/// Radius of lamps for the width of half shadows, m; and the angular radius of sun and moon.
const SOURCE_RADIUS: f64 = 0.08;
const SUN_RADIUS: f64 = 0.004_65;
/// Distance that stands for infinity, m.
const FAR: f64 = 1e3;
/// What casts shadows on sixteen points.
pub(super) struct Shadows<'a> {
    pub(super) casters: &'a [Occluder],
    /// Position of the camera, m.
    pub(super) camera: DVec3,
    /// Components of the points relative to it, m.
    pub(super) points: [[f32; LANES]; 3],
    /// Pixels per radian.
    pub(super) focal_pixels: f64,
}

impl Shadows<'_> {
    fn point(&self, lane: usize) -> DVec3 {
        self.camera + DVec3::from([0, 1, 2].map(|axis| f64::from(self.points[axis][lane])))
    }

    /// The sides of the part of the ground that a pixel shows, m: across the line of sight, and along it.
    fn pixel_sides(&self, lane: usize) -> [DVec3; 2] {
        /// Least sine of the angle between line of sight and ground. Nearer to the horizon a pixel is longer than most shadows.
        const LEAST_SINE: f64 = 0.02;
        let line = DVec3::from([0, 1, 2].map(|axis| f64::from(self.points[axis][lane])));
        let distance = line.length();
        let ahead = DVec3::new(line.x, 0.0, line.z).normalize_or_zero();
        let width = distance / self.focal_pixels;
        let length = width / (-line.y / distance).max(LEAST_SINE);
        [DVec3::new(-ahead.z, 0.0, ahead.x) * width, ahead * length]
    }

    /// Fraction of a light that reaches each point where its luminance on a plane that faces it is more than next to nothing of `whole`, that of all
    /// lights; 1 elsewhere.
    pub(super) fn visibility<S: Simd>(
        &self,
        light: &RelativeLight,
        arriving: &ArrivingLight<S>,
        whole: &[f32; LANES],
    ) -> [f32; LANES] {
        /// Fraction of all light.
        const NEGLIGIBLE: f32 = 1e-3;
        let (factors, distances) = (array(arriving.factor), array(arriving.distance));
        let toward = [0, 1, 2].map(|axis| array(arriving.toward[axis]));
        let strength = luminance(light.intensity);
        std::array::from_fn(|lane| {
            // Lane by lane: rays take different numbers of steps, and distances to solids are lookups in double precision. So first what needs no
            // ray.
            if toward[1][lane] <= 0.0 || factors[lane] * strength <= NEGLIGIBLE * whole[lane] {
                return 1.0;
            }
            let toward = DVec3::from([0, 1, 2].map(|axis| f64::from(toward[axis][lane]))).normalize_or_zero();
            let distance = f64::from(distances[lane]);
            let reach = if distance > 0.0 { distance - SOURCE_RADIUS } else { f64::INFINITY };
            let size = if distance > 0.0 { SOURCE_RADIUS / distance } else { SUN_RADIUS };
            mean_visibility(self.casters, self.point(lane), self.pixel_sides(lane), toward, reach, size) as f32
        })
    }

    /// Fraction of the sky's light that reaches each point.
    pub(super) fn sky_visibility(&self) -> [f32; LANES] {
        std::array::from_fn(|lane| sky_visibility(self.casters, self.point(lane)) as f32)
    }

    /// Fraction of what is far away that each point sees in a direction (unit vectors), with the blur of a mean slope.
    pub(super) fn far_visibility<S: Simd>(&self, toward: &[Lanes<S>; 3], slope: Lanes<S>) -> [f32; LANES] {
        let (toward, slope) = ([0, 1, 2].map(|axis| array(toward[axis])), array(slope));
        std::array::from_fn(|lane| {
            let toward = DVec3::from([0, 1, 2].map(|axis| f64::from(toward[axis][lane]))).normalize_or_zero();
            visibility(self.casters, self.point(lane), toward, FAR, f64::from(slope[lane]).max(0.02)) as f32
        })
    }
}

/// The lanes of a vector.
#[inline(always)]
pub(super) fn array<S: Simd>(lanes: Lanes<S>) -> [f32; LANES] {
    let mut values = [0.0; LANES];
    lanes.store_slice(&mut values);
    values
}
