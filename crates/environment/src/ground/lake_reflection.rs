//! What a lake mirrors in waves too short to be seen: a picture drawn out toward the viewer.

use bansho_base::{
    image::Image,
    math::{self, DVec2, MulAdd},
    phenomenon::strip::View,
};
use rayon::prelude::*;

type Pixel = [f32; 4];

/// The reflection seen in facets whose slopes are Gaussian with an r.m.s. of `slope`, right for what is far away. Alpha is of no use here;
/// the reflection has pixels of `side` times as many of the view's.
///
/// A facet turned toward the viewer by s moves what it shows by 2 s in elevation, one turned sideways by 2 s times the sine of the
/// viewing elevation. So the blur along columns is the same everywhere, the one along rows vanishes at the horizon.
pub(super) fn rough(reflection: &Image<4>, side: usize, view: &View, slope: f64) -> Image<4> {
    let (width, height) = (reflection.width(), reflection.height());
    let side = side as f64;
    let spread = 2.0 * slope * view.camera.focal_pixels / side;
    let sines: Vec<f64> = (0..height).map(|y| sine_of_elevation(view, (y as f64 + 0.5) * side)).collect();
    let columns: Vec<Vec<Pixel>> = (0..width)
        .into_par_iter()
        .map(|x| {
            let mut column: Vec<Pixel> = (0..height).map(|y| masked(reflection.at(x, y), sines[y] > 0.0)).collect();
            blur(&mut column, spread);
            column
        })
        .collect();
    let mut result = Image::filled(width, height, [0.0; 4]);
    result.pixels_mut().par_chunks_mut(width.max(1)).enumerate().for_each(|(y, row)| {
        row.iter_mut().zip(&columns).for_each(|(pixel, column)| *pixel = column[y]);
        blur(row, spread * sines[y]);
        row.iter_mut().for_each(|pixel| *pixel = pixel.map(|value| value / pixel[3].max(f32::MIN_POSITIVE)));
    });
    result
}

/// Alpha counts the light: beyond the horizon and the picture's edges nothing is known, and the rest stands for it.
fn masked([red, green, blue, _]: Pixel, seen: bool) -> Pixel {
    if seen { [red, green, blue, 1.0] } else { [0.0; 4] }
}

/// Sine of the angle at which the picture's middle, `y` pixels from its top, looks down on level ground; 0 above the horizon.
fn sine_of_elevation(view: &View, y: f64) -> f64 {
    let direction = view.camera.direction(DVec2::new(0.5 * view.size[0] as f64, y));
    direction.map_or(0.0, |direction| (-direction.y / direction.length()).clamp(0.0, 1.0))
}

/// Blurs a line of pixels by a Gaussian of standard deviation `sigma`, as three running means. Beyond its ends lies nothing.
fn blur(line: &mut [Pixel], sigma: f64) {
    if sigma <= 0.0 {
        return;
    }
    // Boxes of half width `whole` and a `part` of the pixels beside them, so that three have the variance asked for (Gwosdek et al. 2011).
    let variance = sigma * sigma / 3.0;
    let whole = (0.5 * (math::sqrt(12.0 * variance + 1.0) - 1.0)).floor();
    let part = (2.0 * whole + 1.0) * (whole * (whole + 1.0) - 3.0 * variance)
        / (6.0 * (variance - (whole + 1.0) * (whole + 1.0)));
    (0..3).for_each(|_| running_mean(line, whole as usize, part));
}

/// The mean over `whole` pixels and a `part` of the next on both sides. Sums are f64: lamps are 1e8 times brighter than what
/// lies beside them, and must leave nothing behind when they leave the sum.
fn running_mean(line: &mut [Pixel], whole: usize, part: f64) {
    let source = line.to_vec();
    let width = (2 * whole + 1) as f64 + 2.0 * part;
    let at =
        |index: Option<usize>, c: usize| index.and_then(|i| source.get(i)).map_or(0.0, |pixel| f64::from(pixel[c]));
    for c in 0..4 {
        let mut sum: f64 = source.iter().take(whole).map(|pixel| f64::from(pixel[c])).sum();
        for (index, pixel) in line.iter_mut().enumerate() {
            sum += at(index.checked_add(whole), c);
            let edges = at(index.checked_sub(whole + 1), c) + at(index.checked_add(whole + 1), c);
            pixel[c] = (part.fma(edges, sum) / width) as f32;
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
