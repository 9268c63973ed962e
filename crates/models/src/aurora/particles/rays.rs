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
        dispatch!(level, _simd => self.lanes(places, time))
    }

    #[inline(always)]
    fn lanes(&self, places: &Places, time: f64) -> Pattern {
        let rays = &self.rays;
        let way = rays.shear_km_per_s * time;
        // Groups of rays are four rays long.
        let scale = 4.0 * rays.scale_km;
        let left = values(&self.noise[0], &places.along, [way, scale], time / rays.life_s);
        let right = values(&self.noise[1], &places.along, [-way, scale], time / rays.life_s);
        let mut pattern = Pattern { brightness: [1.0; LANES], dimming: [1.0; LANES], hardness: [1.0; LANES] };
        for i in 0..LANES {
            let share = places.side[i].mul_add(0.5, 0.5).clamp(0.0, 1.0);
            // Two patterns mix to less than the variance of one.
            let variance = share.mul_add(share, (1.0 - share) * (1.0 - share));
            let mixed = share.mul_add(right[i] - left[i], left[i]) / (self.deviation * variance.sqrt());
            pattern.brightness[i] = lanes::exp(rays.contrast as f32 * mixed);
            pattern.hardness[i] = lanes::exp(rays.energy as f32 * mixed);
        }
        self.darken(&mut pattern, places, time);
        self.pulsate(&mut pattern, places, time);
        pattern
    }

    /// Black rays are where a noise passes 0; they run against the rays of the one side.
    #[inline(always)]
    fn darken(&self, pattern: &mut Pattern, places: &Places, time: f64) {
        let rays = &self.rays;
        if rays.black_rays == 0.0 {
            return;
        }
        let way = -rays.shear_km_per_s * time;
        let noise = values(&self.black, &places.along, [way, rays.black_scale_km], time / rays.life_s);
        for (dimming, noise) in pattern.dimming.iter_mut().zip(noise) {
            let depth = (1.0 - (noise / BLACK_WIDTH).abs()).max(0.0);
            *dimming *= 1.0 - rays.black_rays as f32 * depth.sqrt();
        }
    }

    /// Patches that go bright and dark, each in its own time.
    #[inline(always)]
    fn pulsate(&self, pattern: &mut Pattern, places: &Places, time: f64) {
        let pulsation = &self.pulsation;
        if pulsation.depth == 0.0 {
            return;
        }
        let turns = time / pulsation.period_s;
        let turns = (turns - turns.floor()) as f32;
        let phases = values(&self.patches, &places.along, [0.0, pulsation.patch_km], 0.0);
        for (dimming, phase) in pattern.dimming.iter_mut().zip(phases) {
            let dark = lanes::cos_turns(turns + 2.0 * phase).mul_add(-0.5, 0.5);
            *dimming *= 1.0 - pulsation.depth as f32 * dark;
        }
    }
}

/// Noise along the sheets, moved by `way` and `scale` km to a cell, at a time.
#[inline(always)]
fn values(noise: &Noise<2>, along: &[f64; LANES], [way, scale]: [f64; 2], time: f64) -> [f32; LANES] {
    let (mut cells, mut fractions) = ([[0; LANES]; 2], [[0.0; LANES]; 2]);
    let time = Coordinate::from_f64(time);
    for i in 0..LANES {
        let place = Coordinate::from_f64((along[i] - way) / scale);
        (cells[0][i], fractions[0][i]) = (place.cell, place.fraction);
        (cells[1][i], fractions[1][i]) = (time.cell, time.fraction);
    }
    noise.lanes(&cells, &fractions)
}
