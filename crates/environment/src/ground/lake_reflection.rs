//! Reflection in waves too short to be resolved: an anisotropic blur of the mirrored picture.

use bansho_base::{
    host::parallel::prelude::*,
    image::Image,
    math::{self, DVec2, MulAdd},
    phenomenon::strip::View,
};

type Pixel = [f32; 4];

/// The reflection in facets with Gaussian slopes of r.m.s. `slope`, exact for distant objects. Alpha is unused in the
/// result. `side` is the size of the reflection's pixels in pixels of the view.
///
/// A facet tilted toward the viewer by s displaces the reflection by 2 s in elevation, one tilted sideways by 2 s times
/// the sine of the viewing elevation. So the vertical blur is the same everywhere, and the horizontal one vanishes at
/// the horizon.
pub(super) fn blurred_reflection(reflection: &Image<4>, side: usize, view: &View, slope: f64) -> Image<4> {
    let (width, height) = (reflection.width(), reflection.height());
    let side = side as f64;
    let sigma = 2.0 * slope * view.camera.focal_pixels / side;
    let elevation_sines: Vec<f64> = (0..height).map(|y| elevation_sine(view, (y as f64 + 0.5) * side)).collect();
    let columns: Vec<Vec<Pixel>> = (0..width)
        .into_par_iter()
        .map(|x| {
            let mut column: Vec<Pixel> =
                (0..height).map(|y| with_coverage(reflection.at(x, y), elevation_sines[y] > 0.0)).collect();
            blur(&mut column, sigma);
            column
        })
        .collect();
    let mut result = Image::filled(width, height, [0.0; 4]);
    result.pixels_mut().par_chunks_mut(width.max(1)).enumerate().for_each(|(y, row)| {
        row.iter_mut().zip(&columns).for_each(|(pixel, column)| *pixel = column[y]);
        blur(row, sigma * elevation_sines[y]);
        row.iter_mut().for_each(|pixel| *pixel = pixel.map(|value| value / pixel[3].max(f32::MIN_POSITIVE)));
    });
    result
}

/// Stores coverage in alpha. It is 0 above the horizon and outside of the picture, where the reflection is undefined; the
/// blur is normalized by the blurred coverage.
fn with_coverage([red, green, blue, _]: Pixel, is_defined: bool) -> Pixel {
    if is_defined { [red, green, blue, 1.0] } else { [0.0; 4] }
}

/// Sine of the angle between the plane and the line of sight through the picture's center column, `y` pixels from its top;
/// 0 above the horizon.
fn elevation_sine(view: &View, y: f64) -> f64 {
    let direction = view.camera.direction(DVec2::new(0.5 * view.size[0] as f64, y));
    direction.map_or(0.0, |direction| (-direction.y / direction.length()).clamp(0.0, 1.0))
}

/// Gaussian blur of standard deviation `sigma` by three extended box filters. Zero beyond the ends.
fn blur(line: &mut [Pixel], sigma: f64) {
    if sigma <= 0.0 {
        return;
    }
    // Boxes of half width `whole` plus a `fraction` of the pixels beside them, so that three of them have the variance
    // (Gwosdek et al. 2011).
    let variance = sigma * sigma / 3.0;
    let whole = (0.5 * (math::sqrt(12.0 * variance + 1.0) - 1.0)).floor();
    let fraction = (2.0 * whole + 1.0) * (whole * (whole + 1.0) - 3.0 * variance)
        / (6.0 * (variance - (whole + 1.0) * (whole + 1.0)));
    (0..3).for_each(|_| running_mean(line, whole as usize, fraction));
}

/// Box filter over `whole` pixels and a `fraction` of the next one on both sides. Sums are f64: lamps are 1e8 times
/// brighter than their surroundings and must cancel exactly when they leave the sum.
fn running_mean(line: &mut [Pixel], whole: usize, fraction: f64) {
    let source = line.to_vec();
    let width = (2 * whole + 1) as f64 + 2.0 * fraction;
    let at =
        |index: Option<usize>, c: usize| index.and_then(|i| source.get(i)).map_or(0.0, |pixel| f64::from(pixel[c]));
    for c in 0..4 {
        let mut sum: f64 = source.iter().take(whole).map(|pixel| f64::from(pixel[c])).sum();
        for (index, pixel) in line.iter_mut().enumerate() {
            sum += at(index.checked_add(whole), c);
            let edges = at(index.checked_sub(whole + 1), c) + at(index.checked_add(whole + 1), c);
            pixel[c] = (fraction.fma(edges, sum) / width) as f32;
            sum -= at(index.checked_sub(whole), c);
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
