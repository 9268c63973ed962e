//! Billboards against every drop by itself.

use super::{METHODS, draw, opacity, rain, streaks, view_at, wind};
use bansho_base::surroundings::Surroundings;

const SIZE: [usize; 2] = [320, 180];
/// Rows that are measured together.
const BANDS: usize = 6;

/// Mean and variance of streak opacity within groups of rows, over frames of several rains.
fn statistics(method: super::Method, rate: f64, frames: u64) -> Vec<[f64; 2]> {
    let calm = wind([0.0; 3], 0.0);
    let mut sums = [[0.0; 2]; BANDS];
    for frame in 0..frames {
        let rain = rain(streaks(method, rate), 100 + frame / 4);
        let strip = draw(&rain, &view_at(1.7 * (frame % 4) as f64, 1.0 / 60.0, SIZE), &Surroundings::of_wind(&calm));
        for (index, opacity) in opacity(&strip).into_iter().enumerate() {
            let band = index / SIZE[0] * BANDS / SIZE[1];
            sums[band][0] += f64::from(opacity);
            sums[band][1] += f64::from(opacity) * f64::from(opacity);
        }
    }
    let pixels = (frames as usize * SIZE[0] * SIZE[1] / BANDS) as f64;
    sums.iter().map(|[sum, squares]| [sum / pixels, squares / pixels - (sum / pixels) * (sum / pixels)]).collect()
}

#[test]
fn rows_have_the_mean_and_variance_of_the_reference() {
    // Noise of the reference itself falls with the number of streaks: weak rain needs more frames.
    for (rate, frames) in [(1.0, 40), (5.0, 24), (20.0, 12), (100.0, 6)] {
        let [billboards, drops] = METHODS.map(|method| statistics(method, rate, frames));
        let ratio = |k: usize, band: usize| billboards[band][k] / drops[band][k];
        let mean = |k: usize| (0..BANDS).map(|band| ratio(k, band)).sum::<f64>() / BANDS as f64;
        for k in 0..2 {
            assert!((mean(k) - 1.0).abs() < 0.05, "R {rate}: {}", mean(k));
        }
    }
}

/// Autocorrelation of a picture at a lag across, its rows' means taken out.
fn autocorrelation(picture: &[f32], lag: usize) -> f64 {
    let (mut product, mut power, mut count) = (0.0, 0.0, 0.0);
    for row in picture.chunks(SIZE[0]) {
        let mean = row.iter().sum::<f32>() / row.len() as f32;
        for x in 0..SIZE[0] - lag {
            product += f64::from((row[x] - mean) * (row[x + lag] - mean));
            count += 1.0;
        }
        power += row.iter().map(|value| f64::from((value - mean) * (value - mean))).sum::<f64>();
    }
    product / count / (power / picture.len() as f64)
}

#[test]
fn nothing_repeats_at_the_distance_of_cells() {
    let calm = wind([0.0; 3], 0.0);
    for rate in [5.0, 50.0] {
        let rain = rain(streaks(super::Method::Billboards, rate), 3);
        let surroundings = Surroundings::of_wind(&calm);
        let frame = |i: u32| opacity(&draw(&rain, &view_at(0.7 * f64::from(i), 1.0 / 60.0, SIZE), &surroundings));
        let pictures: Vec<Vec<f32>> = (0..8).map(frame).collect();
        // A cell is 314 / depth pixels wide: from 5.5 m up to 1.2 m. Chance is averaged away, a grid would stay.
        let mean = |lag| pictures.iter().map(|picture| autocorrelation(picture, lag)).sum::<f64>() / 8.0;
        let worst = (50..260).map(mean).fold(0.0, f64::max);
        assert!(worst < 0.1, "R {rate}: {worst}");
    }
}
