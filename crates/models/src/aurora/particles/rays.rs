//! How bright and how hard the precipitation is along the sheets: rays, black rays, pulsation.

use bansho_base::{
    math::lanes,
    noise::{Coordinate, Fractal, LANES, Noise, VARIANCE},
    random::{Key, Purpose},
};
use fearless_simd::{Level, dispatch};

use crate::aurora::{AuroraParameters, PulsationParameters, RayParameters};

/// Octaves of the rays: groups of rays, rays, and streaks in them.
const RAYS: Fractal = Fractal { octaves: 3, lacunarity: 2, gain: 0.7 };
/// Width of a black ray beside the distance between two.
const BLACK_WIDTH: f32 = 0.12;

/// The pattern along the sheets at a moment.
#[derive(Clone, Debug)]
pub(super) struct Rays {
    rays: RayParameters,
    pulsation: PulsationParameters,
    noise: [Noise<2>; 2],
    black: Noise<2>,
    patches: Noise<2>,
    /// What noise is divided by so that its variance is 1.
    deviation: f32,
}

/// Sixteen places on the sheets.
pub(super) struct Places {
    /// Coordinate along the sheets, km.
    pub(super) along: [f64; LANES],
    /// Which side of the sheet, from -1 to 1 within its thickness.
    pub(super) side: [f32; LANES],
}

/// What the pattern does at sixteen places.
pub(super) struct Pattern {
    /// Factor of the power, before it is shared out.
    pub(super) brightness: [f32; LANES],
    /// Factor of the power after it has been shared out: what makes the whole aurora darker.
    pub(super) dimming: [f32; LANES],
    /// Factor of the energy.
    pub(super) hardness: [f32; LANES],
}

impl Rays {
    pub(super) fn new(parameters: &AuroraParameters, key: Key) -> Self {
        let [a, b, c, d] = key.words(0, 0, Purpose::named("aurora rays"));
        let noise = |seed, fractal| Noise::new(seed, fractal, [0; 2]).expect("few octaves without a period are noise");
        let amplitude = |amplitude: &f64| Some(amplitude * f64::from(RAYS.gain));
        let amplitudes = || std::iter::successors(Some(1.0), amplitude).take(RAYS.octaves as usize);
        let (sum, squares): (f64, f64) = (amplitudes().sum(), amplitudes().map(|a| a * a).sum());
        Self {
            rays: parameters.rays.clone(),
            pulsation: parameters.pulsation.clone(),
            noise: [noise(a, RAYS), noise(b, RAYS)],
            black: noise(c, Fractal::SINGLE),
            patches: noise(d, Fractal::SINGLE),
            deviation: ((VARIANCE[0] * squares).sqrt() / sum) as f32,
        }
    }

    /// The pattern at sixteen places at a time.
    pub(super) fn at(&self, level: Level, places: &Places, time: f64) -> Pattern {
        let noises = self.noises(level, places, time);
        dispatch!(level, _simd => self.combined(&noises, &places.side, time))
    }

    #[inline(always)]
    fn combined(&self, noises: &[[f32; LANES]; 4], sides: &[f32; LANES], time: f64) -> Pattern {
        let [left, right, black, patches] = noises;
        let mut pattern = Pattern { brightness: [1.0; LANES], dimming: [1.0; LANES], hardness: [1.0; LANES] };
        for i in 0..LANES {
            let share = (0.5 + 0.5 * sides[i]).clamp(0.0, 1.0);
            // Two patterns mix to less than the variance of one.
            let variance = share * share + (1.0 - share) * (1.0 - share);
            let mixed = (left[i] + share * (right[i] - left[i])) / (self.deviation * variance.sqrt());
            pattern.brightness[i] = lanes::exp(self.rays.contrast as f32 * mixed);
            pattern.hardness[i] = lanes::exp(self.rays.energy as f32 * mixed);
            pattern.dimming[i] = self.darkness(black[i]) * self.pulse(patches[i], time);
        }
        pattern
    }

    /// The noise of the rays on both sides, of black rays and of patches; what is not asked for is 0.
    fn noises(&self, level: Level, places: &Places, time: f64) -> [[f32; LANES]; 4] {
        let rays = &self.rays;
        let (way, age) = (rays.shear_km_per_s * time, time / rays.life_s);
        // Groups of rays are four rays long. Black rays run against the rays of the one side.
        let [group, black, patch] = [4.0 * rays.scale_km, rays.black_scale_km, self.pulsation.patch_km];
        let wanted = [
            (rays.contrast.max(rays.energy), &self.noise[0], way, group, age),
            (rays.contrast.max(rays.energy), &self.noise[1], -way, group, age),
            (rays.black_rays, &self.black, -way, black, age),
            (self.pulsation.depth, &self.patches, 0.0, patch, 0.0),
        ];
        wanted.map(|(strength, noise, way, scale, age)| {
            if strength > 0.0 {
                values(level, noise, places.along.map(|along| (along - way) / scale), age)
            } else {
                [0.0; LANES]
            }
        })
    }

    /// Black rays are where a noise passes 0.
    #[inline(always)]
    fn darkness(&self, noise: f32) -> f32 {
        let depth = (1.0 - (noise / BLACK_WIDTH).abs()).max(0.0);
        1.0 - self.rays.black_rays as f32 * depth.sqrt()
    }

    /// Patches go bright and dark, each in its own time.
    #[inline(always)]
    fn pulse(&self, noise: f32, time: f64) -> f32 {
        let turns = time / self.pulsation.period_s;
        let turns = (turns - turns.floor()) as f32;
        let dark = 0.5 - 0.5 * lanes::cos_turns(turns + 2.0 * noise);
        1.0 - self.pulsation.depth as f32 * dark
    }
}

/// Noise at sixteen places, in cells, and an age, in lives.
fn values(level: Level, noise: &Noise<2>, places: [f64; LANES], age: f64) -> [f32; LANES] {
    let (mut cells, mut fractions) = ([[0; LANES]; 2], [[0.0; LANES]; 2]);
    let age = Coordinate::from_f64(age);
    for i in 0..LANES {
        let place = Coordinate::from_f64(places[i]);
        (cells[0][i], fractions[0][i]) = (place.cell, place.fraction);
        (cells[1][i], fractions[1][i]) = (age.cell, age.fraction);
    }
    dispatch!(level, _simd => noise.lanes(&cells, &fractions))
}
