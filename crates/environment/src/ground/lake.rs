//! A lake: its waves, a sum of deep-water gravity waves in closed form, and the reflection in waves too short to be resolved, which is an anisotropic blur
//! of the mirrored picture.

use std::f64::consts::{PI, TAU};

use bansho_base::{
    host::parallel::prelude::*,
    image::Image,
    math::{
        self, DVec2, MulAdd, approximations,
        random::{Key, Purpose, uniform_f64},
        simd::LANES,
    },
    phenomenon::strip::View,
    world::gravity::STANDARD_GRAVITY,
};
use fearless_simd::dispatch;

use super::{sample::SampledImage, surface::smoothstep};

/// Columns that are blurred together.
const COLUMNS: usize = 8;

/// The reflection in facets with Gaussian slopes of r.m.s. `slope`, exact for distant objects. Alpha is unused in the
/// result, which has the pixels and rows of the reflection.
///
/// A facet tilted toward the viewer by s displaces the reflection by 2 s in elevation, one tilted sideways by 2 s times
/// the sine of the viewing elevation. So the vertical blur is the same everywhere, and the horizontal one vanishes at
/// the horizon.
pub(super) fn blurred_reflection(reflection: SampledImage, view: &View, slope: f64) -> Image<4> {
    let SampledImage { image, pixel_size, first_row } = reflection;
    let (width, height) = (image.width(), image.height());
    let side = pixel_size as f64;
    let sigma = 2.0 * slope * view.camera.focal_pixels / side;
    let elevation_sines: Vec<f64> =
        (0..height).map(|y| elevation_sine(view, ((first_row + y) as f64 + 0.5) * side)).collect();
    let level = bansho_base::math::simd::level();
    let columns: Vec<Vec<[f32; 4 * COLUMNS]>> = (0..width.div_ceil(COLUMNS))
        .into_par_iter()
        .map(|block| {
            // Down the picture, eight columns are two cache lines wide: a single one would load each line of cache four times.
            let mut column = columns_with_coverage(image, block * COLUMNS, &elevation_sines);
            dispatch!(level, _simd => blur(&mut column, sigma));
            column
        })
        .collect();
    let mut result = Image::filled(width, height, [0.0; 4]);
    result.pixels_mut().par_chunks_mut(width.max(1)).enumerate().for_each(|(y, row)| {
        for (pixels, column) in row.chunks_mut(COLUMNS).zip(&columns) {
            let (values, _) = column[y].as_chunks();
            pixels.copy_from_slice(&values[..pixels.len()]);
        }
        dispatch!(level, _simd => blur(row, sigma * elevation_sines[y]));
        row.iter_mut().for_each(|pixel| *pixel = pixel.map(|value| value / pixel[3].max(f32::MIN_POSITIVE)));
    });
    result
}

/// Columns from `first` on, row by row, with coverage in alpha. It is 0 above the horizon and outside of the picture, where the reflection is undefined;
/// the blur is normalized by the blurred coverage.
fn columns_with_coverage(image: &Image<4>, first: usize, elevation_sines: &[f64]) -> Vec<[f32; 4 * COLUMNS]> {
    let count = COLUMNS.min(image.width() - first);
    let mut rows = vec![[0.0; 4 * COLUMNS]; elevation_sines.len()];
    for (y, (row, sine)) in rows.iter_mut().zip(elevation_sines).enumerate() {
        if *sine > 0.0 {
            let (pixels, _) = row.as_chunks_mut();
            for (value, pixel) in pixels.iter_mut().zip(&image.row(y)[first..first + count]) {
                let [red, green, blue, _] = *pixel;
                *value = [red, green, blue, 1.0];
            }
        }
    }
    rows
}

/// Sine of the angle between the plane and the line of sight through the picture's center column, `y` pixels from its top;
/// 0 above the horizon.
fn elevation_sine(view: &View, y: f64) -> f64 {
    let direction = view.camera.direction(DVec2::new(0.5 * view.size[0] as f64, y));
    direction.map_or(0.0, |direction| (-direction.y / direction.length()).clamp(0.0, 1.0))
}

/// Gaussian blur of standard deviation `sigma` by three extended box filters. Zero beyond the ends.
#[inline(always)]
fn blur<const N: usize>(line: &mut [[f32; N]], sigma: f64) {
    if sigma <= 0.0 {
        return;
    }
    // Boxes of half width `whole` plus a `fraction` of the pixels beside them, so that three of them have the variance
    // (Gwosdek et al. 2011).
    let variance = sigma * sigma / 3.0;
    let whole = (0.5 * (math::sqrt(12.0 * variance + 1.0) - 1.0)).floor();
    let fraction = (2.0 * whole + 1.0) * (whole * (whole + 1.0) - 3.0 * variance)
        / (6.0 * (variance - (whole + 1.0) * (whole + 1.0)));
    let mut source = line.to_vec();
    for _ in 0..3 {
        source.copy_from_slice(line);
        running_mean(&source, line, whole as usize, fraction);
    }
}

/// Box filter over `whole` pixels and a `fraction` of the next one on both sides. Sums are f64: lamps are 1e8 times
/// brighter than their surroundings and must cancel exactly when they leave the sum.
#[inline(always)]
fn running_mean<const N: usize>(source: &[[f32; N]], line: &mut [[f32; N]], whole: usize, fraction: f64) {
    let zero = [0.0; N];
    let per_width = 1.0 / ((2 * whole + 1) as f64 + 2.0 * fraction);
    let mut sums = [0.0_f64; N];
    for pixel in source.iter().take(whole) {
        for c in 0..N {
            sums[c] += f64::from(pixel[c]);
        }
    }
    for (index, pixel) in line.iter_mut().enumerate() {
        let entering = index.checked_add(whole).and_then(|i| source.get(i)).unwrap_or(&zero);
        let leaving = index.checked_sub(whole).and_then(|i| source.get(i)).unwrap_or(&zero);
        let before = index.checked_sub(whole + 1).and_then(|i| source.get(i)).unwrap_or(&zero);
        let after = index.checked_add(whole + 1).and_then(|i| source.get(i)).unwrap_or(&zero);
        for c in 0..N {
            sums[c] += f64::from(entering[c]);
            let edges = f64::from(before[c]) + f64::from(after[c]);
            pixel[c] = (fraction.fma(edges, sums[c]) * per_width) as f32;
            sums[c] -= f64::from(leaving[c]);
        }
    }
}

/// Number of waves in the sum: enough to show no beat, few enough to evaluate at every pixel.
const WAVE_COUNT: usize = 14;
/// Ratio of the longest to the shortest wavelength.
const LENGTH_RATIO: f64 = 40.0;
/// Largest angle between a wave and the wind, radians.
const MAX_ANGLE: f64 = 0.42 * PI;

/// One wave: slope = amplitude * cos(k . x - omega t + phase) along k, with x relative to an origin.
#[derive(Clone, Copy, Debug)]
struct Wave {
    /// k, turns per m along x and z.
    turns_per_meter: [f32; 2],
    length: f32,
    /// Phase at the origin, turns.
    phase: f32,
    slope: [f32; 2],
}

/// The waves at one time.
#[derive(Clone, Debug)]
pub(super) struct Waves {
    waves: Vec<Wave>,
}

/// What determines the waves of a lake.
#[derive(Clone, Copy, Debug)]
pub(super) struct WaveParameters {
    pub(super) key: Key,
    /// R.m.s. slope.
    pub(super) slope: f64,
    /// Maximum wavelength, m.
    pub(super) longest: f64,
    /// Direction of the wind, unit vector along x and z.
    pub(super) heading: DVec2,
    /// In a loop every wave is periodic in this time, s.
    pub(super) loop_s: Option<f64>,
}

/// The slope of the water at sixteen positions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct WaveSlopes {
    /// Slope along x and z, of the waves that a pixel resolves.
    pub(super) resolved: [[f32; LANES]; 2],
    /// Fraction of the slope variance in waves too short to be resolved.
    pub(super) unresolved: [f32; LANES],
}

impl Waves {
    /// The waves at time `t` around an `origin` (x, z). Phases are exact there, however far it is.
    pub(super) fn new(parameters: &WaveParameters, t: f64, origin: DVec2) -> Self {
        Self { waves: (0..WAVE_COUNT).map(|index| wave(parameters, index, t, origin)).collect() }
    }

    /// The slopes at positions (x, z) relative to the origin, filtered with the pixels' `footprint`, m.
    #[inline(always)]
    pub(super) fn slopes(&self, [xs, zs]: [&[f32; LANES]; 2], footprint: &[f32; LANES]) -> WaveSlopes {
        let mut slopes = WaveSlopes { resolved: [[0.0; LANES]; 2], unresolved: [0.0; LANES] };
        for wave in &self.waves {
            let (mut visibility, mut largest) = ([0.0; LANES], 0.0);
            for i in 0..LANES {
                // Below two pixels a wave is not resolved, from six pixels on wholly.
                let footprint = if footprint[i] > 1e-9 { footprint[i] } else { 1e-9 };
                let resolved = smoothstep(2.0, 6.0, wave.length / footprint);
                visibility[i] = resolved;
                largest = if resolved > largest { resolved } else { largest };
                // The amplitude is scaled by what is resolved, so the variance that is left is 1 minus its square.
                slopes.unresolved[i] += (-resolved).fma(resolved, 1.0) * (1.0 / WAVE_COUNT as f32);
            }
            // Far from the camera no lane resolves the short waves: their cosines, the dearest part, are left out.
            if largest <= 0.0 {
                continue;
            }
            for i in 0..LANES {
                // Phases are relative to a point below the camera, in turns: near it, where waves are resolved, single precision is enough.
                let turns = xs[i].fma(wave.turns_per_meter[0], zs[i].fma(wave.turns_per_meter[1], wave.phase));
                let height = visibility[i] * approximations::cos_turns(turns);
                slopes.resolved[0][i] = height.fma(wave.slope[0], slopes.resolved[0][i]);
                slopes.resolved[1][i] = height.fma(wave.slope[1], slopes.resolved[1][i]);
            }
        }
        slopes
    }
}

/// The wave with this index, from the longest to the shortest, at time `t` around an `origin` (x, z).
fn wave(parameters: &WaveParameters, index: usize, t: f64, origin: DVec2) -> Wave {
    let WaveParameters { key, slope, longest, heading, loop_s } = *parameters;
    let words = key.words(index as u64, 0, Purpose::named("wave"));
    let [turn, phase] = [uniform_f64(words[0], words[1]), uniform_f64(words[2], words[3])];
    let fraction = index as f64 / (WAVE_COUNT - 1) as f64;
    let length = longest * math::pow(LENGTH_RATIO, -fraction);
    let along = heading.rotate(unit_vector((2.0 * turn - 1.0) * MAX_ANGLE));
    let periods = quantize_frequency(frequency(length), loop_s) * t;
    // The mean square of a cosine is 1/2.
    let amplitude = slope * math::sqrt(2.0 / WAVE_COUNT as f64);
    // Whole turns are left out while the numbers are double: far from the world's origin, or late, single precision would lose the phase.
    let turns = (along.dot(origin) / length).rem_euclid(1.0) + phase - periods.rem_euclid(1.0);
    Wave {
        turns_per_meter: (along / length).as_vec2().to_array(),
        length: length as f32,
        phase: turns.rem_euclid(1.0) as f32,
        slope: (along * amplitude).as_vec2().to_array(),
    }
}

/// Frequency of a deep-water wave of a length in m, 1/s: omega^2 = g k.
fn frequency(length: f64) -> f64 {
    math::sqrt(STANDARD_GRAVITY * TAU / length) / TAU
}

/// Frequency of the shortest waves, 1/s, where the longest have a length of `longest` m.
pub(super) fn highest_frequency(longest: f64) -> f64 {
    frequency(longest / LENGTH_RATIO)
}

/// Rounds a frequency (1/s) to a whole number of periods in the loop.
fn quantize_frequency(frequency: f64, loop_s: Option<f64>) -> f64 {
    loop_s.map_or(frequency, |seconds| (frequency * seconds).round().max(1.0) / seconds)
}

/// The unit vector at an angle.
fn unit_vector(angle: f64) -> DVec2 {
    let (sin, cos) = math::sin_cos(angle);
    DVec2::new(cos, sin)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_blurred_point_keeps_its_light_and_has_the_spread_asked_for() {
        for sigma in [0.4, 1.0, 3.7, 12.0] {
            let mut line = vec![[0.0; 4]; 201];
            line[100] = [1e6; 4];
            blur(&mut line, sigma);
            let total: f64 = line.iter().map(|pixel| f64::from(pixel[0])).sum();
            let moment = |i: usize| (i as f64 - 100.0) * (i as f64 - 100.0) * f64::from(line[i][0]);
            let variance = (0..201).map(moment).sum::<f64>() / total;
            assert!((total / 1e6 - 1.0).abs() < 1e-6);
            assert!((math::sqrt(variance) / sigma - 1.0).abs() < 1e-3, "{sigma}: {}", math::sqrt(variance));
        }
    }

    #[test]
    fn nothing_remains_where_a_lamp_has_left_the_sum() {
        let mut line = vec![[0.0; 4]; 64];
        line[5] = [1e8; 4];
        blur(&mut line, 2.0);
        assert!(line[40][0].abs() < 1e-3, "{}", line[40][0]);
    }

    fn waves(t: f64, loop_s: Option<f64>, origin: DVec2) -> Waves {
        let parameters =
            WaveParameters { key: Key::new(1, "ground"), slope: 0.05, longest: 4.0, heading: DVec2::X, loop_s };
        Waves::new(&parameters, t, origin)
    }

    /// The slope at one position.
    fn slope(waves: &Waves, x: f64, z: f64, footprint: f32) -> ([f32; 2], f32) {
        let slopes = waves.slopes([&[x as f32; LANES], &[z as f32; LANES]], &[footprint; LANES]);
        (slopes.resolved.map(|lanes| lanes[3]), slopes.unresolved[3])
    }

    #[test]
    fn the_slope_has_the_variance_asked_for() {
        let waves = waves(0.0, None, DVec2::ZERO);
        let positions = 20_000;
        let square = |index: i32| {
            let ([x, z], _) = slope(&waves, f64::from(index % 997) * 1.37, f64::from(index % 611) * 3.11, 0.0);
            f64::from(x * x + z * z)
        };
        let mean = (0..positions).map(square).sum::<f64>() / f64::from(positions);
        assert!((math::sqrt(mean) / 0.05 - 1.0).abs() < 0.1, "{}", math::sqrt(mean));
    }

    #[test]
    fn far_water_has_no_waves_to_be_seen() {
        let (resolved, unresolved) = slope(&waves(0.0, None, DVec2::ZERO), 3.0, 4.0, 10.0);
        assert_eq!(resolved, [0.0; 2]);
        assert!((unresolved - 1.0).abs() < 1e-6);
    }

    #[test]
    fn a_loop_ends_where_it_began() {
        let at = |t| DVec2::from(slope(&waves(t, Some(3.0), DVec2::ZERO), 1.0, 2.0, 0.0).0.map(f64::from));
        assert!((at(0.0) - at(3.0)).length() < 1e-6);
        assert!((at(0.0) - at(1.5)).length() > 1e-4);
    }

    #[test]
    fn waves_do_not_move_with_the_origin() {
        for far in [0.0, 1e7] {
            let here = slope(&waves(0.5, None, DVec2::new(far, 0.0)), 1.0, 2.0, 0.0).0;
            let there = slope(&waves(0.5, None, DVec2::new(far - 7.0, 5.0)), 8.0, -3.0, 0.0).0;
            assert!((here[0] - there[0]).abs() < 1e-5 && (here[1] - there[1]).abs() < 1e-5, "{here:?} {there:?}");
        }
    }
}
