//! The pattern of the ground: albedo, puddles and films of water.

use bansho_base::{
    color::acescg_from_srgb,
    math::{
        self, DVec2, approximations,
        random::{Key, Purpose},
        simd::{LANES, Real},
    },
    noise::{Coordinate, Fractal, Noise, VARIANCE},
};

use super::parameters::GroundParameters;

/// Octaves of the ground's texture, each of half the size of the one before.
const OCTAVES: usize = 8;
/// Amplitude of the largest octave, and the ratio of successive amplitudes. Soil and asphalt have most of their
/// contrast at the scale of grains: with as much at large scales, bright ground would look like clouds.
const BASE_AMPLITUDE: f64 = 0.2;
const AMPLITUDE_GAIN: f64 = 1.24;
/// Ratio of successive heights in the relief.
const RELIEF_GAIN: f64 = 0.6;
/// Standard deviation of the relief, which is approximately normal.
const RELIEF_DEVIATION: f32 = 0.34;
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
    /// Mean albedo when dry.
    pub(super) albedo: [f32; 3],
    texture: f64,
    size: f64,
    octaves: Vec<Noise<2>>,
    puddles: f64,
    roughness: f64,
}

/// The ground seen by sixteen pixels.
#[derive(Clone, Copy, Debug)]
pub(super) struct SurfaceSamples {
    /// Albedo relative to the mean one when dry.
    pub(super) shade: [f32; LANES],
    /// Fraction covered by puddles when wet.
    pub(super) puddle: [f32; LANES],
    /// Fraction of the rest with an unbroken film of water; high ground has grains that protrude from it.
    pub(super) film: [f32; LANES],
    /// Mean slope of the film along x and z: that of the bumps that are resolved.
    pub(super) tilt: [[f32; LANES]; 2],
    /// R.m.s. slope of the film along each axis without those bumps.
    pub(super) film_slope: [f32; LANES],
}

impl SurfaceSamples {
    /// Where there is no ground.
    pub(super) const NONE: Self = Self {
        shade: [0.0; LANES],
        puddle: [0.0; LANES],
        film: [0.0; LANES],
        tilt: [[0.0; LANES]; 2],
        film_slope: [0.0; LANES],
    };
}

/// Positions on the ground that sixteen pixels see: cells and fractions of noise at an exact origin, and offsets from it.
#[derive(Clone, Copy)]
pub(super) struct GroundPositions<'a> {
    /// x and z below the camera, m.
    pub(super) origin: DVec2,
    /// x and z from there, m.
    pub(super) offset: [&'a [f32; LANES]; 2],
    /// Lengths that the pixels cover, m.
    pub(super) footprint: &'a [f32; LANES],
}

impl GroundPositions<'_> {
    /// Noise at `position / size + shift`, for lanes with a `visibility`; those resolve the noise, so that their offsets are few cells.
    #[inline(always)]
    fn noise(self, noise: &Noise<2>, size: f64, shift: [f64; 2], visibility: &[f32; LANES]) -> [f32; LANES] {
        /// Cells at which offsets are cut: beyond any that a pixel resolves.
        const FAR: f32 = 4e6;
        let per_meter = (1.0 / size) as f32;
        let origin = [self.origin.x / size + shift[0], self.origin.y / size + shift[1]];
        let (mut cells, mut fractions) = ([[0; LANES]; 2], [[0.0; LANES]; 2]);
        for axis in 0..2 {
            // The camera's own cell and fraction are exact; lanes add their small distances to it in single precision, so that the pattern is as fine
            // a thousand kilometers from the origin.
            let Coordinate { cell, fraction } = Coordinate::from_f64(origin[axis]);
            for i in 0..LANES {
                // Lanes without visibility may be a million cells away, where the cast would overflow.
                let distance = if visibility[i] > 0.0 { self.offset[axis][i] } else { 0.0 };
                let moved = distance.fma(per_meter, fraction).clamp(-FAR, FAR);
                let whole = moved.floor();
                cells[axis][i] = cell.wrapping_add(approximations::round_to_i32(whole));
                fractions[axis][i] = moved - whole;
            }
        }
        noise.lanes(&cells, &fractions)
    }

    /// How well the pixels resolve details of a size: not at all below `first` pixels, wholly from `whole` pixels on.
    #[inline(always)]
    fn visibility(self, size: f64, first: f32, whole: f32) -> [f32; LANES] {
        let mut visibility = [0.0; LANES];
        for i in 0..LANES {
            let footprint = if self.footprint[i] > 1e-9 { self.footprint[i] } else { 1e-9 };
            visibility[i] = smoothstep(first, whole, size as f32 / footprint);
        }
        visibility
    }
}

/// Whether any lane is above 0.
#[inline(always)]
fn any(values: &[f32; LANES]) -> bool {
    let mut largest = 0.0;
    for value in values {
        largest = if *value > largest { *value } else { largest };
    }
    largest > 0.0
}

/// Smooth step from 0 at `low` to 1 at `high`.
#[inline(always)]
pub(super) fn smoothstep(low: f32, high: f32, x: f32) -> f32 {
    ((x - low) / (high - low)).simd_smoothstep()
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

    /// The ground at some positions; the film only if it `is_wet`.
    #[inline(always)]
    pub(super) fn samples(&self, positions: GroundPositions, is_wet: bool) -> SurfaceSamples {
        let mut samples = self.pattern(positions);
        // A film under puddles is not seen.
        let mut film = [0.0; LANES];
        for i in 0..LANES {
            film[i] = 1.0 - samples.puddle[i];
        }
        if is_wet && any(&film) {
            self.add_bumps(positions, &mut samples);
        }
        samples
    }

    /// Albedo, puddles and films, filtered with the pixels' footprints.
    #[inline(always)]
    fn pattern(&self, positions: GroundPositions) -> SurfaceSamples {
        let (mut grain, mut relief) = ([0.0; LANES], [0.0; LANES]);
        let (mut size, mut amplitude, mut height) = (self.size, BASE_AMPLITUDE, 1.0_f64);
        for octave in &self.octaves {
            let visibility = positions.visibility(size, 1.0, 3.0);
            if !any(&visibility) {
                break;
            }
            let noise = positions.noise(octave, size, [0.0; 2], &visibility);
            for i in 0..LANES {
                let value = visibility[i] * noise[i];
                grain[i] = value.fma(amplitude as f32, grain[i]);
                relief[i] = value.fma(height as f32, relief[i]);
            }
            (size, amplitude, height) = (0.5 * size, AMPLITUDE_GAIN * amplitude, RELIEF_GAIN * height);
        }
        let (patches, edges) = (positions.visibility(self.size, 1.0, 3.0), positions.visibility(self.size, 2.0, 8.0));
        let (texture, puddles, level) = (self.texture as f32, self.puddles as f32, self.puddle_level() as f32);
        let mut samples = SurfaceSamples { film_slope: [self.roughness as f32; LANES], ..SurfaceSamples::NONE };
        for i in 0..LANES {
            samples.shade[i] = approximations::exp(texture * grain[i]);
            // Water collects where the relief is low.
            let puddle = 1.0 - smoothstep(level - 0.12, level + 0.12, relief[i]);
            // Faded to the mean, so that ground too far to be resolved is as wet as near ground.
            samples.puddle[i] = (puddle - puddles).fma(patches[i], puddles);
            // Films have sharp edges and strong highlights: filtered earlier, so that the horizon has no flicker of
            // dashes.
            let film = 1.0 - smoothstep(-RELIEF_DEVIATION, RELIEF_DEVIATION, relief[i]);
            samples.film[i] = MAX_FILM_FRACTION as f32 * (film - 0.5).fma(edges[i], 0.5);
        }
        samples
    }

    /// Adds the bumps of wet ground, filtered with the pixels' footprints.
    #[inline(always)]
    fn add_bumps(&self, positions: GroundPositions, samples: &mut SurfaceSamples) {
        let amplitude = math::sqrt(BUMP_VARIANCE_FRACTION / BUMP_OCTAVES as f64) * self.roughness;
        let per_deviation = (amplitude / math::sqrt(VARIANCE[0])) as f32;
        let mut variance = [(self.roughness * self.roughness) as f32; LANES];
        let mut size = BUMP_SIZE;
        for pair in self.octaves.chunks_exact(2).take(BUMP_OCTAVES) {
            let visibility = positions.visibility(size, 1.5, 5.0);
            if !any(&visibility) {
                break;
            }
            for axis in 0..2 {
                // Shifted, because the texture uses the same noise.
                let slope = positions.noise(&pair[axis], size, [61.3, -17.7], &visibility);
                for i in 0..LANES {
                    samples.tilt[axis][i] = (slope[i] * per_deviation).fma(visibility[i], samples.tilt[axis][i]);
                }
            }
            for i in 0..LANES {
                // The bumps that are resolved tilt the film, all others roughen it: the variance of the slope is the same at all distances.
                let resolved = visibility[i] * amplitude as f32;
                variance[i] = (-resolved).fma(resolved, variance[i]);
            }
            size *= 0.5;
        }
        for i in 0..LANES {
            samples.film_slope[i] = (if variance[i] > 0.0 { variance[i] } else { 0.0 }).sqrt();
        }
    }

    /// R.m.s. slope of the grains that protrude from the film.
    pub(super) fn grain_slope(&self) -> f64 {
        GRAIN_SLOPE_RATIO * self.roughness
    }

    /// Mean slope of wet ground, films and grains together.
    pub(super) fn mean_slope(&self) -> f64 {
        math::lerp(GRAIN_SLOPE_RATIO, 1.0, 0.5 * MAX_FILM_FRACTION) * self.roughness
    }

    /// Relief up to which there are puddles. The normal quantile at a probability p is approximately the logistic one.
    fn puddle_level(&self) -> f64 {
        let fraction = self.puddles.clamp(1e-6, 1.0 - 1e-6);
        f64::from(RELIEF_DEVIATION) * math::ln(fraction / (1.0 - fraction)) / 1.7
    }
}

#[cfg(test)]
mod tests {
    use fearless_simd::dispatch;

    use super::*;

    /// The ground at sixteen positions relative to an origin.
    fn samples(surface: &Surface, origin: DVec2, at: impl Fn(usize) -> [f64; 2], footprint: f32) -> SurfaceSamples {
        let at: [[f64; 2]; LANES] = std::array::from_fn(at);
        let offset = [0, 1].map(|axis| at.map(|position| position[axis] as f32));
        let positions = GroundPositions { origin, offset: [&offset[0], &offset[1]], footprint: &[footprint; LANES] };
        dispatch!(bansho_base::math::simd::level(), _simd => surface.samples(positions, true))
    }

    #[test]
    fn puddles_cover_the_share_asked_for_and_films_half_of_the_ground() {
        for fraction in [0.0, 0.2, 0.6, 1.0] {
            let parameters = GroundParameters { puddles: fraction, ..GroundParameters::default() };
            let surface = Surface::new(&parameters, Key::new(3, "ground"));
            let count = 2_500;
            let at = |batch: usize, i: usize| {
                let index = batch * LANES + i;
                [(index % 200) as f64 * 0.31, (index / 200) as f64 * 0.37]
            };
            let (mut puddle, mut film) = (0.0, 0.0);
            for batch in 0..count {
                let samples = samples(&surface, DVec2::ZERO, |i| at(batch, i), 1e-3);
                puddle += samples.puddle.iter().sum::<f32>() / (count * LANES) as f32;
                film += samples.film.iter().sum::<f32>() / (count * LANES) as f32 / MAX_FILM_FRACTION as f32;
            }
            assert!((f64::from(puddle) - fraction).abs() < 0.07, "{fraction}: {puddle}");
            assert!((film - 0.5).abs() < 0.07, "{film}");
            let far = samples(&surface, DVec2::ZERO, |_| [0.0; 2], 1e3).puddle[0];
            assert!((f64::from(far) - fraction).abs() < 1e-6);
            assert!(fraction > 0.0 || puddle == 0.0, "no trace of puddles where there are none");
        }
    }

    #[test]
    fn ground_has_its_contrast_in_its_grain_not_in_clouds() {
        let surface = Surface::new(&GroundParameters::default(), Key::new(5, "ground"));
        // Squares of 0.4 m, each seen at 64 places.
        let (squares, side) = (900, 0.4);
        let (mut coarse, mut all) = (Vec::new(), Vec::new());
        for square in 0..squares {
            let corner = [square % 30, square / 30].map(|step| 1.7 * f64::from(step));
            let mut within = Vec::new();
            for quarter in 0..4 {
                let at = |i: usize| {
                    let index = LANES * quarter + i;
                    [corner[0] + side / 8.0 * (index % 8) as f64, corner[1] + side / 8.0 * (index / 8) as f64]
                };
                let shades = samples(&surface, DVec2::ZERO, at, 1e-3).shade;
                within.extend(shades.map(|shade| math::ln(f64::from(shade))));
            }
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

    #[test]
    fn the_pattern_does_not_move_with_the_camera_also_far_from_the_origin() {
        let surface = Surface::new(&GroundParameters::default(), Key::new(5, "ground"));
        for far in [0.0, 1e6, -3e7] {
            let at = |i: usize| [0.13 * i as f64, 2.0 - 0.2 * i as f64];
            let here = samples(&surface, DVec2::new(far, -far), at, 0.004);
            let there =
                samples(&surface, DVec2::new(far - 3.0, 1.5 - far), |i| [at(i)[0] + 3.0, at(i)[1] - 1.5], 0.004);
            for i in 0..LANES {
                assert!((here.shade[i] / there.shade[i] - 1.0).abs() < 2e-3, "{far}: {here:?} {there:?}");
                assert!((here.tilt[0][i] - there.tilt[0][i]).abs() < 1e-4);
            }
        }
    }
}
