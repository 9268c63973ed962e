//! Rays through the gas, and what all rays of a frame share.

use bansho_base::{
    camera::{Camera, Lens},
    math::{DVec2, DVec3, Vec3},
};
use fearless_simd::Simd;

use super::{
    field::GasField,
    optics::{GasOptics, GasSample},
    smoke::SmokeLight,
};

/// Steps of a stride: where there is only smoke, a stride is crossed at once, and the light on smoke is that in the middle of a stride.
pub(crate) const STRIDE: usize = 4;
/// Most time samples of an exposure.
pub(crate) const MOST_TIME_SAMPLES: usize = 8;
/// Transmittance below which nothing behind is seen.
pub(crate) const OPAQUE: f32 = 1e-3;
/// Longest way of gas in one time sample, cells.
const STREAK_CELLS: f64 = 2.5;

/// A ray in cells: `origin + depth * direction`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ray {
    pub(crate) origin: DVec3,
    pub(crate) direction: DVec3,
    /// Meters along the ray for each meter of depth.
    pub(crate) stretch: f64,
}

impl Ray {
    pub(crate) fn new(field: &GasField, origin: DVec3, direction: DVec3) -> Self {
        Self {
            origin: field.point_in_grid(origin),
            direction: direction / field.grid.spacing,
            stretch: direction.length(),
        }
    }

    /// The point at a depth, m.
    pub(crate) fn at(&self, depth: f64) -> Vec3 {
        (self.origin + self.direction * depth).as_vec3()
    }

    /// Depths at which it enters and leaves a box, within those of `range`; `None` if it misses it.
    pub(crate) fn clipped(&self, low: DVec3, high: DVec3, [near, far]: [f64; 2]) -> Option<[f64; 2]> {
        let inverse = DVec3::ONE / self.direction;
        let (first, second) = ((low - self.origin) * inverse, (high - self.origin) * inverse);
        let enter = first.min(second);
        let leave = first.max(second);
        let near = near.max(if enter.is_nan() { near } else { enter.max_element() });
        let far = far.min(if leave.is_nan() { far } else { leave.min_element() });
        (near < far).then_some([near, far])
    }
}

impl Ray {
    /// The part of `range` (depths, m) above the bottom of the grid, which gas does not cross; `None` if there is none. Elsewhere gas fades out before its end.
    #[inline(always)]
    pub(crate) fn above_bottom(&self, [near, far]: [f64; 2]) -> Option<[f64; 2]> {
        let (height, slope) = (self.origin.y + 0.5, self.direction.y);
        let crossing = -height / slope;
        let range = match (height > 0.0, slope < 0.0) {
            (true, true) => [near, far.min(crossing)],
            (true, false) => [near, far],
            (false, true) => [far, far],
            (false, false) => [near.max(crossing), far],
        };
        (range[0] < range[1]).then_some(range)
    }
}

/// The parts of an exposure over which rays are averaged, and the times between which each of them sees the gas move.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TimeSamples {
    pub(crate) count: usize,
    /// Times from the state of the gas to the beginning of each part and to the end of the last one, s.
    times: [f32; MOST_TIME_SAMPLES + 1],
}

impl TimeSamples {
    /// An exposure of that duration (s) whose middle is `offset` seconds after the state of the gas, in as many parts as gas of a speed (cells per second) needs.
    pub(crate) fn new(offset: f64, exposure: f64, speed: f64) -> Self {
        let count = (speed * exposure / STREAK_CELLS).ceil().clamp(1.0, MOST_TIME_SAMPLES as f64) as usize;
        let time = |index: usize| offset + exposure * (index as f64 / count as f64 - 0.5);
        Self { count, times: std::array::from_fn(|index| time(index) as f32) }
    }

    /// Longest time from the state, s.
    pub(crate) fn longest(&self) -> f32 {
        self.times[..=self.count].iter().fold(0.0, |longest, time| longest.max(time.abs()))
    }

    fn is_still(&self) -> bool {
        self.longest() == 0.0
    }
}

/// What all rays of a frame share.
pub(crate) struct GasRays<'a> {
    pub(crate) field: &'a GasField,
    pub(crate) optics: GasOptics,
    pub(crate) smoke_light: Option<&'a SmokeLight>,
    pub(crate) times: TimeSamples,
    pub(crate) camera: &'a Camera,
    /// Length of a step, cells.
    pub(crate) step: f64,
    /// Distance between the rays along which gas is looked up, pixels: others are interpolated from these.
    pub(crate) node_pixels: usize,
}

/// Gas at a point of a ray, for each time sample.
pub(crate) type GasSamples = [GasSample<f32>; MOST_TIME_SAMPLES];

impl GasRays<'_> {
    /// Distance in pixels between rays that are at most 0.65 cells apart as far as `farthest` (m): the cubic convolution of waves of four cells is then right to 2.5 %, and
    /// splines hold hardly anything shorter. Lenses whose picture ends in a circle have no rays beyond it
    /// from which those inside could be interpolated.
    pub(crate) fn node_pixels(field: &GasField, camera: &Camera, farthest: f64) -> usize {
        const MOST: f64 = 8.0;
        if camera.lens != Lens::Perspective {
            return 1;
        }
        let cell_pixels = field.grid.spacing * camera.focal_pixels / farthest.max(camera.near);
        (0.65 * cell_pixels).clamp(1.0, MOST) as usize
    }

    /// The ray through a place in the picture; `None` where the lens shows nothing.
    pub(crate) fn ray(&self, pixel: DVec2) -> Option<Ray> {
        self.camera.direction(pixel).map(|direction| Ray::new(self.field, self.camera.position, direction))
    }

    /// Length of a step, m.
    pub(crate) fn step_m(&self) -> f64 {
        self.step * self.field.grid.spacing
    }

    /// Gas at a point in cells for each time sample. Gas moves along its velocity there; smoke alone, which is smooth, is drawn as it is in the state.
    #[inline(always)]
    pub(crate) fn gas_samples<S: Simd>(&self, simd: S, point: Vec3, is_sheet: bool) -> GasSamples {
        let samples = self.times.count;
        if !is_sheet || self.times.is_still() {
            let [mixture, deficit] = self.field.gas(simd, point);
            return [GasSample { mixtures: [mixture; 2], deficit }; MOST_TIME_SAMPLES];
        }
        let cells_per_meter = 1.0 / self.field.grid.spacing as f32;
        let velocity = self.field.velocity(simd, point) * cells_per_meter;
        let mut result = [GasSample { mixtures: [0.0; 2], deficit: 0.0 }; MOST_TIME_SAMPLES];
        let mut before = self.field.gas(simd, point - velocity * self.times.times[0]);
        for sample in 0..samples {
            let after = self.field.gas(simd, point - velocity * self.times.times[sample + 1]);
            result[sample] = GasSample { mixtures: [before[0], after[0]], deficit: 0.5 * (before[1] + after[1]) };
            before = after;
        }
        result
    }

    /// Extinction coefficient of smoke at a point in cells, 1/m.
    #[inline(always)]
    pub(crate) fn smoke<S: Simd>(&self, simd: S, point: Vec3) -> f32 {
        let [mixture, deficit] = self.field.gas(simd, point);
        self.optics.smoke(mixture, deficit)
    }

    /// Radiance of opaque smoke at a point in cells, ACEScg.
    #[inline(always)]
    pub(crate) fn smoke_radiance<S: Simd>(&self, simd: S, point: Vec3) -> [f32; 3] {
        // A match rather than a closure, which would be compiled for the baseline.
        match self.smoke_light {
            Some(light) => light.at(simd, point),
            None => [0.0; 3],
        }
    }
}

/// What a ray has gathered.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Gathered {
    /// Luminance of soot, cd/m^2, and that times its temperature.
    pub(crate) luminance: f32,
    pub(crate) luminance_kelvin: f32,
    /// Luminance of blue light, cd/m^2.
    pub(crate) blue: f32,
    /// Radiance that smoke scatters, ACEScg.
    pub(crate) scattered: [f32; 3],
    /// Fraction of the light from behind that is absorbed.
    pub(crate) opacity: f32,
    /// Depth of the first gas that is seen, m; infinite if none is.
    pub(crate) depth: f32,
    /// Optical depth of soot and smoke.
    pub(crate) optical_depth: f32,
    /// Sum of luminance times velocity, and of luminance times depth.
    pub(crate) motion: [f32; 4],
}

impl Gathered {
    /// Whether there is anything to draw.
    pub(crate) fn is_visible(&self) -> bool {
        self.opacity > 0.0 || self.blue > 0.0
    }
}
