//! What the night sky shines from each direction, but for its stars.

use bansho_base::{
    camera::directions::Directions,
    color,
    math::{
        self, DVec3,
        simd::{FourLanes, LANES, Real},
    },
    world::sky::{Night, Sky},
};

use super::stars;
use fearless_simd::prelude::*;

/// Steps of elevation from the horizon to the zenith, even in the root of its sine.
const STEPS: usize = 512;
/// Luminance of the Milky Way's middle, cd/m^2, its width in sines, and its colour's temperature, K.
const MILKY_WAY: f64 = 1.6e-4;
const MILKY_WAY_WIDTH: f64 = 0.14;
const MILKY_WAY_K: f32 = 5200.0;

/// The night by elevation.
pub(super) struct NightSky {
    parallels: Vec<Parallel>,
    /// What comes from below the horizon.
    ground: [f32; 4],
    /// Unit vectors to the sun below the horizon and to the pole of the galaxy.
    sunward: [f32; 3],
    pole: [f32; 3],
}

/// All directions of an elevation: red, green, blue and nothing.
struct Parallel {
    even: [f32; 4],
    /// By the fourth power of how far a direction turns to the sun, and in proportion to it.
    glow: [f32; 4],
    blue: [f32; 4],
    /// Light of the Milky Way's middle.
    milky_way: [f32; 4],
}

fn four([red, green, blue]: [f32; 3]) -> [f32; 4] {
    [red, green, blue, 0.0]
}

impl NightSky {
    pub(super) fn new(sky: &Sky, night: &Night, milky_way: f64) -> Self {
        let colour = color::black_body().radiance(MILKY_WAY_K);
        let scale = milky_way * MILKY_WAY / f64::from(color::luminance(colour));
        let parallel = |step: usize| {
            let root = step as f64 / STEPS as f64;
            let elevation = math::asin(root * root);
            let dimmed = (scale * night.transmittance(elevation)) as f32;
            let [even, glow, blue] = night.parallel(elevation).terms().map(four);
            Parallel { even, glow, blue, milky_way: four(colour.map(|value| value * dimmed)) }
        };
        Self {
            parallels: (0..=STEPS).map(parallel).collect(),
            ground: four(sky.radiance(-DVec3::Y)),
            sunward: night.sunward().as_vec3().to_array(),
            pole: stars::galactic_pole().as_vec3().to_array(),
        }
    }

    /// Radiance from directions of length 1.
    #[inline(always)]
    pub(super) fn radiance<S: Simd>(&self, simd: S, directions: &Directions) -> [[f32; 4]; LANES] {
        let [xs, ys, zs] = &directions.axes;
        let (mut steps, mut toward, mut shares) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
        for i in 0..LANES {
            let held = if ys[i] > 0.0 { ys[i] } else { 0.0 };
            steps[i] = held.sqrt().fma(STEPS as f32, 0.5);
            let level = xs[i].fma(xs[i], zs[i] * zs[i]);
            let turned = xs[i].fma(self.sunward[0], zs[i] * self.sunward[2]) / level.sqrt().max(1e-9);
            toward[i] = turned.fma(0.5, 0.5);
            let height = self.pole[0].fma(xs[i], self.pole[1].fma(ys[i], self.pole[2] * zs[i]));
            let across = height * (1.0 / MILKY_WAY_WIDTH) as f32;
            let squared = across * across;
            // A band with soft edges; what lies far from it gives a little.
            shares[i] = 1.0 / squared.fma(squared, 1.0);
        }
        let mut colours = [self.ground; LANES];
        for i in 0..LANES {
            if ys[i] >= 0.0 {
                let parallel = &self.parallels[(steps[i] as usize).min(STEPS)];
                colours[i] = parallel.radiance(simd, toward[i], shares[i]);
            }
        }
        colours
    }
}

impl Parallel {
    /// Radiance where a direction turns toward the sun by `toward`, with that share of the Milky Way.
    #[inline(always)]
    fn radiance<S: Simd>(&self, simd: S, toward: f32, share: f32) -> [f32; 4] {
        let squared = toward * toward;
        let lanes = |values: [f32; 4]| FourLanes::simd_from(simd, values);
        let mut sum = lanes(self.even);
        sum = lanes(self.blue).fma(sum.broadcast(toward), sum);
        sum = lanes(self.glow).fma(sum.broadcast(squared * squared), sum);
        lanes(self.milky_way).fma(sum.broadcast(share), sum).into()
    }
}
