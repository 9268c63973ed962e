//! The pattern of the ground: albedo, puddles and films of water.

use bansho_base::{
    color::acescg_from_srgb,
    math::{
        self, DVec2, MulAdd,
        random::{Key, Purpose},
    },
    noise::{Coordinate, Fractal, Noise, VARIANCE},
};

use super::{parameters::GroundParameters, wet_reflection::Microfacets};

/// Octaves of the ground's texture, each of half the size of the one before.
const OCTAVES: usize = 8;
/// Amplitude of the largest octave, and the ratio of successive amplitudes. Soil and asphalt have most of their
/// contrast at the scale of grains: with as much at large scales, bright ground would look like clouds.
const BASE_AMPLITUDE: f64 = 0.2;
const AMPLITUDE_GAIN: f64 = 1.24;
/// Ratio of successive heights in the relief.
const RELIEF_GAIN: f64 = 0.6;
/// Standard deviation of the relief, which is approximately normal.
const RELIEF_DEVIATION: f64 = 0.34;
/// Octaves are evaluated one by one, so that each fades out where a pixel cannot resolve it.
const SINGLE_OCTAVE: Fractal = Fractal { octaves: 1, lacunarity: 2, gain: 0.5 };

/// Bumps of a film of water: size of the largest, m, octaves of half the size each, and the fraction of the film's
/// slope variance that they carry.
const BUMP_SIZE: f64 = 0.15;
const BUMP_OCTAVES: usize = 3;
const BUMP_VARIANCE_FRACTION: f64 = 0.4;
/// Slope of grains that protrude from the film, relative to that of the film.
const GRAIN_SLOPE_RATIO: f64 = 3.0;
/// Largest fraction of wet ground that is film between the grains.
const MAX_FILM_FRACTION: f64 = 0.6;

/// The pattern of the ground.
pub(super) struct Surface {
    albedo: [f32; 3],
    texture: f64,
    size: f64,
    octaves: Vec<Noise<2>>,
    puddles: f64,
    roughness: f64,
}

/// The ground at one position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SurfaceSample {
    /// Albedo when dry.
    pub(super) albedo: [f32; 3],
    /// Fraction covered by puddles when wet.
    pub(super) puddle: f64,
    /// Fraction of the rest with an unbroken film of water; high ground has grains that protrude from it.
    pub(super) film: f64,
}

impl Surface {
    pub(super) fn new(parameters: &GroundParameters, key: Key) -> Self {
        let words = [0, 1].map(|id| key.words(id, 0, Purpose::named("ground")));
        let octaves =
            words.as_flattened().iter().take(OCTAVES).filter_map(|&seed| Noise::new(seed, SINGLE_OCTAVE, [0, 0]).ok());
        Self {
            albedo: acescg_from_srgb(parameters.color.map(|value| value as f32)),
            texture: parameters.texture,
            size: parameters.texture_size,
            octaves: octaves.collect(),
            puddles: parameters.puddles,
            roughness: parameters.roughness,
        }
    }

    /// The ground at a position (x, z), filtered with a pixel's `footprint`, m.
    pub(super) fn at(&self, position: DVec2, footprint: f64) -> SurfaceSample {
        let (mut grain, mut relief) = (0.0, 0.0);
        let (mut size, mut amplitude, mut height) = (self.size, BASE_AMPLITUDE, 1.0_f64);
        for octave in &self.octaves {
            let visibility = math::smoothstep(1.0, 3.0, size / footprint.max(1e-9));
            if visibility <= 0.0 {
                break;
            }
            let coordinates = [position.x / size, position.y / size].map(Coordinate::from_f64);
            let value = visibility * f64::from(octave.at(coordinates));
            (grain, relief) = (amplitude.fma(value, grain), height.fma(value, relief));
            (size, amplitude, height) = (0.5 * size, AMPLITUDE_GAIN * amplitude, RELIEF_GAIN * height);
        }
        let shade = math::exp(self.texture * grain) as f32;
        let albedo = self.albedo.map(|value| (value * shade).min(1.0));
        let pixels = self.size / footprint.max(1e-9);
        let visibility = |first: f64, whole: f64| math::smoothstep(first, whole, pixels);
        SurfaceSample {
            albedo,
            puddle: math::lerp(self.puddles, self.puddle_fraction(relief), visibility(1.0, 3.0)),
            // Films have sharp edges and strong highlights: filtered earlier, so that the horizon has no flicker of
            // dashes.
            film: math::lerp(0.5, film_fraction(relief), visibility(2.0, 8.0)),
        }
    }

    /// The microfacets of wet ground at a position (x, z), filtered with a pixel's `footprint`, m; `film` is the
    /// fraction with a film.
    pub(super) fn microfacets(&self, position: DVec2, footprint: f64, film: f64) -> Microfacets {
        let amplitude = math::sqrt(BUMP_VARIANCE_FRACTION / BUMP_OCTAVES as f64) * self.roughness;
        let deviation = math::sqrt(VARIANCE[0]);
        let (mut tilt, mut unresolved_variance, mut size) = (DVec2::ZERO, self.roughness * self.roughness, BUMP_SIZE);
        for pair in self.octaves.chunks_exact(2).take(BUMP_OCTAVES) {
            let visibility = math::smoothstep(1.5, 5.0, size / footprint.max(1e-9));
            if visibility <= 0.0 {
                break;
            }
            // Offset, because the texture uses the same noise.
            let coordinates = [position.x / size + 61.3, position.y / size - 17.7].map(Coordinate::from_f64);
            let slope = [0, 1].map(|axis| f64::from(pair[axis].at(coordinates)) / deviation);
            tilt += DVec2::from(slope) * (visibility * amplitude);
            unresolved_variance -= visibility * visibility * amplitude * amplitude;
            size *= 0.5;
        }
        let grain = GRAIN_SLOPE_RATIO * self.roughness;
        Microfacets { tilt, slopes: [math::sqrt(unresolved_variance), grain], film: MAX_FILM_FRACTION * film }
    }

    /// Mean slope of wet ground, films and grains together.
    pub(super) fn mean_slope(&self) -> f64 {
        math::lerp(GRAIN_SLOPE_RATIO, 1.0, 0.5 * MAX_FILM_FRACTION) * self.roughness
    }

    /// Fraction of puddles: water collects where the relief is low.
    fn puddle_fraction(&self, relief: f64) -> f64 {
        // The normal quantile at a probability p is approximately the logistic one.
        let fraction = self.puddles.clamp(1e-6, 1.0 - 1e-6);
        let level = RELIEF_DEVIATION * math::ln(fraction / (1.0 - fraction)) / 1.7;
        1.0 - math::smoothstep(level - 0.12, level + 0.12, relief)
    }
}

/// Fraction of film: half of the ground, with soft edges.
fn film_fraction(relief: f64) -> f64 {
    1.0 - math::smoothstep(-RELIEF_DEVIATION, RELIEF_DEVIATION, relief)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn puddles_cover_the_share_asked_for_and_films_half_of_the_ground() {
        for fraction in [0.0, 0.2, 0.6, 1.0] {
            let parameters = GroundParameters { puddles: fraction, ..GroundParameters::default() };
            let surface = Surface::new(&parameters, Key::new(3, "ground"));
            let count = 40_000;
            let at = |i: i32| surface.at(DVec2::new(f64::from(i % 200) * 0.31, f64::from(i / 200) * 0.37), 1e-3);
            let mean = |of: fn(SurfaceSample) -> f64| (0..count).map(|i| of(at(i))).sum::<f64>() / f64::from(count);
            let (puddle, film) = (mean(|sample| sample.puddle), mean(|sample| sample.film));
            assert!((puddle - fraction).abs() < 0.07, "{fraction}: {puddle}");
            assert!((film - 0.5).abs() < 0.07, "{film}");
            assert!((surface.at(DVec2::ZERO, 1e3).puddle - fraction).abs() < 1e-9);
        }
    }

    #[test]
    fn ground_has_its_contrast_in_its_grain_not_in_clouds() {
        let surface = Surface::new(&GroundParameters::default(), Key::new(5, "ground"));
        let shade = |x: f64, z: f64| math::ln(f64::from(surface.at(DVec2::new(x, z), 1e-3).albedo[1]));
        // Squares of 0.4 m, each seen at 64 places.
        let (squares, side) = (900, 0.4);
        let (mut coarse, mut all) = (Vec::new(), Vec::new());
        for square in 0..squares {
            let corner = [square % 30, square / 30].map(|step| 1.7 * f64::from(step));
            let within = (0..64)
                .map(|i| shade(corner[0] + side / 8.0 * f64::from(i % 8), corner[1] + side / 8.0 * f64::from(i / 8)));
            let within: Vec<f64> = within.collect();
            coarse.push(within.iter().sum::<f64>() / 64.0);
            all.extend(within);
        }
        let variance = |values: &[f64]| {
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            values.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>() / values.len() as f64
        };
        let fraction = variance(&coarse) / variance(&all);
        assert!(fraction < 0.15, "{fraction}");
    }
}
