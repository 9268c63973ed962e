//! Reflection in waves too short to be resolved: an anisotropic blur of the mirrored picture.

use bansho_base::{
    host::parallel::prelude::*,
    image::Image,
    math::{self, DVec2, MulAdd},
    phenomenon::strip::View,
};
use fearless_simd::dispatch;

use super::sample::SampledImage;

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
}
