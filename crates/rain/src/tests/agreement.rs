//! Billboards compared with individual drops.

use bansho_base::phenomenon::surroundings::Surroundings;

use super::{METHODS, draw, opacity, rain, streaks, view_at, wind};

const SIZE: [usize; 2] = [320, 180];
/// Rows that are measured together.
const BANDS: usize = 6;

/// Mean and variance of streak opacity within groups of rows, over frames of several rains.
fn statistics(method: super::Method, rate: f64, frames: u64) -> [[f64; 2]; BANDS] {
    let calm = wind([0.0; 3], 0.0);
    let mut sums = [[0.0; 2]; BANDS];
    for frame in 0..frames {
        let rain = rain(streaks(method, rate), 100 + frame / 4);
        let strip = draw(&rain, &view_at(1.7 * (frame % 4) as f64, 1.0 / 60.0, SIZE), &Surroundings::from_wind(&calm));
        for (index, opacity) in opacity(&strip).into_iter().enumerate() {
            let band = index / SIZE[0] * BANDS / SIZE[1];
            sums[band][0] += f64::from(opacity);
            sums[band][1] += f64::from(opacity) * f64::from(opacity);
        }
    }
    let pixels = (frames as usize * SIZE[0] * SIZE[1] / BANDS) as f64;
    sums.map(|[sum, squares]| [sum / pixels, squares / pixels - (sum / pixels) * (sum / pixels)])
}

#[test]
fn rows_have_the_mean_and_variance_of_the_reference() {
    // Noise of the reference itself falls with the number of streaks: weak rain needs more frames.
    for (rate, frames) in [(1.0, 120), (5.0, 72), (20.0, 36), (100.0, 18)] {
        let [billboards, drops] = METHODS.map(|method| statistics(method, rate, frames));
        let ratio = |k: usize, band: usize| billboards[band][k] / drops[band][k] - 1.0;
        let most = [0.03, 0.05];
        for k in 0..2 {
            let mean = (0..BANDS).map(|band| ratio(k, band)).sum::<f64>() / BANDS as f64;
            assert!(mean.abs() < 0.03, "R {rate}: {mean}");
            for band in 0..BANDS {
                assert!(ratio(k, band).abs() < most[k], "R {rate}, rows {band}: {}", ratio(k, band));
            }
        }
    }
}

/// Correlation of a picture of `width` columns with one that lies `lag` columns to the right in it, both about the means of their rows.
fn correlation(picture: &[f32], shifted: &[f32], width: usize, lag: usize) -> f64 {
    let (mut product, mut power) = (0.0, [0.0; 2]);
    for (row, other) in picture.chunks(width).zip(shifted.chunks(width)) {
        let mean = |values: &[f32]| values.iter().sum::<f32>() / values.len() as f32;
        let (row, other) = (&row[..width - lag], &other[lag..]);
        let means = [mean(row), mean(other)];
        for (a, b) in row.iter().zip(other) {
            let (a, b) = (f64::from(a - means[0]), f64::from(b - means[1]));
            product += a * b;
            power = [power[0] + a * a, power[1] + b * b];
        }
    }
    product / (power[0] * power[1]).sqrt()
}

#[test]
fn nothing_repeats_at_the_distance_of_cells() {
    const LARGE: [usize; 2] = [1920, 1080];
    let calm = wind([0.0; 3], 0.0);
    let surroundings = Surroundings::from_wind(&calm);
    let rain = rain(streaks(super::Method::Billboards, 20.0), 3);
    let picture = opacity(&draw(&rain, &view_at(0.7, 1.0 / 60.0, LARGE), &surroundings));
    // A cell is 1883 / depth pixels wide: from the end of the region at 5.5 m up to 1.2 m.
    let worst = (330..1570).step_by(5).map(|lag| correlation(&picture, &picture, LARGE[0], lag)).fold(0.0, f64::max);
    assert!(worst < 0.1, "{worst}");
}

#[test]
fn a_cell_that_has_fallen_by_its_height_holds_other_drops() {
    let calm = wind([0.0; 3], 0.0);
    let surroundings = Surroundings::from_wind(&calm);
    let parameters = super::RainParameters { diameters_mm: vec![1.4], ..streaks(super::Method::Billboards, 50.0) };
    let rain = rain(parameters, 3);
    let speed = rain.classes.states(&rain.parameters, 0.0, &surroundings, 0.0, 0.0..=1.0)[0].speed;
    let at = |t: f64| opacity(&draw(&rain, &view_at(t, 1.0 / 60.0, SIZE), &surroundings));
    let first = at(1.0);
    assert!(correlation(&first, &first, SIZE[0], 0) > 0.999);
    for cells in 1..=3 {
        let later = at(1.0 + f64::from(cells) / speed);
        let found = correlation(&first, &later, SIZE[0], 0);
        assert!(found < 0.1, "{cells} cells: {found}");
    }
}
