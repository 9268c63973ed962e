//! Cubic B-spline interpolation of values and slopes between cells.
//!
//! B-splines do not interpolate their coefficients; a prefilter of five cells compensates for that. Unlike the exact (recursive)
//! prefilter its support is finite, so that a crop equals the same part of the whole picture.

use fearless_simd::{Level, dispatch};
use rayon::prelude::*;

use crate::particles::render::splat::grid::{Grid, Raster};

/// Prefilter: center, neighbors at 1, neighbors at 2. Times the spectrum of the B-spline, sinc^4, it is `1 + O(w^6)`.
const SHARPEN: [f32; 3] = [181.0 / 120.0, -17.0 / 60.0, 7.0 / 240.0];

/// The grid of spline coefficients for [`weights`] and [`slopes`]: prefiltered along columns and rows.
pub(crate) fn sharpened<'a>(grid: &Grid<'a>) -> Grid<'a> {
    let (length, depth) = (grid.row_length(), grid.depth);
    let (mut sharp, level) = (Grid::new(grid.cells, depth, grid.scratch()), Level::new());
    sharp.values_mut().par_chunks_mut(length).enumerate().for_each_init(
        || vec![0.0; length],
        |down, (row, out)| {
            let rows = [-2, -1, 0, 1, 2].map(|by| grid.row(row as i32 + by));
            // The margin, which lacks two cells on one side, is empty.
            let (margin, inner) = out.split_at_mut(2 * depth);
            let (inner, other_margin) = inner.split_at_mut(length - 4 * depth);
            margin.fill(0.0);
            other_margin.fill(0.0);
            dispatch!(level, _simd => {
                filter(down, rows);
                filter(inner, [0, 1, 2, 3, 4].map(|by| &down[by * depth..]));
            });
        },
    );
    sharp
}

#[inline(always)]
fn filter(out: &mut [f32], [a, b, c, d, e]: [&[f32]; 5]) {
    let count = out.len();
    let (a, b, c, d, e) = (&a[..count], &b[..count], &c[..count], &d[..count], &e[..count]);
    for i in 0..count {
        let (near, far) = (b[i] + d[i], a[i] + e[i]);
        out[i] = SHARPEN[2].mul_add(far, SHARPEN[1].mul_add(near, SHARPEN[0] * c[i]));
    }
}

/// Weights of the four surrounding cells, for each pixel phase.
pub(crate) fn weights(cells: &Raster) -> Vec<[f32; 4]> {
    cells.phases().map(value).collect()
}

/// The same for the slope, per pixel.
pub(crate) fn slopes(cells: &Raster) -> Vec<[f32; 4]> {
    cells.phases().map(|t| slope(t).map(|weight| weight / cells.size as f32)).collect()
}

/// B-spline weights of the cells at -1, 0, 1 and 2 at `t` between 0 and 1.
pub(crate) fn value(t: f32) -> [f32; 4] {
    let (s, t2, t3) = (1.0 - t, t * t, t * t * t);
    [s * s * s, 3.0 * t3 - 6.0 * t2 + 4.0, -3.0 * t3 + 3.0 * t2 + 3.0 * t + 1.0, t3].map(|weight| weight / 6.0)
}

/// Derivatives of [`value`] with respect to `t`.
fn slope(t: f32) -> [f32; 4] {
    let s = 1.0 - t;
    [-0.5 * s * s, (1.5 * t - 2.0) * t, (-1.5 * t + 1.0) * t + 0.5, 0.5 * t * t]
}

#[cfg(test)]
mod tests {
    use bansho_base::{image::Rect, math};

    use super::*;
    use crate::particles::render::splat::scratch_pool::ScratchPool;

    /// Greatest relative error of values and slopes of a sine of `length` cells, over pixels of every phase.
    fn worst(length: f64) -> [f64; 2] {
        let cells = Raster::around(Rect { x: 0, y: 0, width: 128, height: 8 }, 4, false);
        let scratch = ScratchPool::default();
        let mut grid = Grid::new(cells, 1, &scratch);
        let turn = std::f64::consts::TAU / length;
        for (index, value) in grid.values_mut().iter_mut().enumerate() {
            *value = math::sin(turn * (index % cells.columns) as f64) as f32;
        }
        let sharp = sharpened(&grid);
        let (weights, slopes, row) = (weights(&cells), slopes(&cells), sharp.row(4));
        let mut worst = [0.0_f64; 2];
        for x in 16..112 {
            let (cell, phase) = cells.cell_before(0, x);
            let first = grid.first_of_four(cell);
            let sum = |weights: &[f32; 4]| f64::from((0..4).map(|k| weights[k] * row[first + k]).sum::<f32>());
            let (sin, cos) = math::sin_cos(
                turn * (f64::from(cells.cell_coordinates([x as f32 + 0.5, 0.0])[0]) - f64::from(cells.first[0])),
            );
            worst[0] = worst[0].max((sum(&weights[phase]) - sin).abs());
            worst[1] = worst[1].max((4.0 / turn * sum(&slopes[phase]) - cos).abs());
        }
        worst
    }

    #[test]
    fn waves_are_followed_closely_and_the_closer_the_longer_they_are() {
        let ([value, slope], [short_value, short_slope]) = (worst(12.0), worst(6.0));
        assert!(short_value < 8e-3 && short_slope < 2e-2, "{short_value} {short_slope}");
        // Cubic splines: values are accurate to fourth order, slopes to third.
        assert!(value < short_value / 13.0 && slope < short_slope / 7.0, "{value} {slope}");
    }

    #[test]
    fn weights_add_up_and_slopes_cancel() {
        for i in 0..=8 {
            let t = i as f32 / 8.0;
            assert!((value(t).iter().sum::<f32>() - 1.0).abs() < 1e-6);
            assert!(slope(t).iter().sum::<f32>().abs() < 1e-6);
        }
    }
}
