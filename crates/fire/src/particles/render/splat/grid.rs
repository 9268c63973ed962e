//! A grid of cells over the picture, with several values per cell.

use bansho_base::{host::parallel::prelude::*, image::Rect};
use fearless_simd::dispatch;

use super::spline;
use crate::particles::render::buffer_pool::{BufferPool, PooledVec};

/// Margin around the covered area, in cells: two are read by interpolation, one by differences, two by the prefilter.
const MARGIN: i32 = 5;
/// Margin if coarser grids are added, each of which is read beyond the finer one.
const NESTED_MARGIN: i32 = 7;

/// Layout of cells over the picture: the center of cell (i, j) is at `(i + 1/2) size` pixels of the whole picture, independent of
/// the window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Raster {
    /// Side of a cell, pixels.
    pub(crate) size: usize,
    /// First column and row, counted from the picture's corner.
    pub(crate) first: [i32; 2],
    pub(crate) columns: usize,
    pub(crate) rows: usize,
}

impl Raster {
    /// The cells of `size` pixels that cover `rect`, with a margin; `nested` where coarser grids are added.
    pub(crate) fn around(rect: Rect, size: usize, nested: bool) -> Self {
        let margin = if nested { NESTED_MARGIN } else { MARGIN };
        let low = [rect.x, rect.y].map(|value| (value / size) as i32 - margin);
        let high = [rect.right(), rect.bottom()].map(|value| (value / size) as i32 + 1 + margin);
        Self { size, first: low, columns: (high[0] - low[0]) as usize, rows: (high[1] - low[1]) as usize }
    }

    /// The cells that are in both.
    pub(crate) fn intersection(self, other: &Self) -> Self {
        let [ends, other_ends] =
            [&self, other].map(|cells| [cells.first[0] + cells.columns as i32, cells.first[1] + cells.rows as i32]);
        let first = [0, 1].map(|axis| self.first[axis].max(other.first[axis]));
        let [columns, rows] = [0, 1].map(|axis| (ends[axis].min(other_ends[axis]) - first[axis]).max(0) as usize);
        Self { first, columns, rows, ..self }
    }

    /// Its columns, counted from the picture's corner.
    pub(crate) fn picture_columns(&self) -> std::ops::Range<i32> {
        self.first[0]..self.first[0] + self.columns as i32
    }

    /// The pixels of the picture that the cells cover.
    pub(crate) fn covered(&self) -> Rect {
        let [[x, right], [y, bottom]] =
            [(self.first[0], self.columns), (self.first[1], self.rows)].map(|(first, count)| {
                [i64::from(first), i64::from(first) + count as i64].map(|cell| cell.max(0) as usize * self.size)
            });
        Rect { x, y, width: right - x, height: bottom - y }
    }

    /// The first pixel of a column of cells, counted from the first column; 0 for columns beyond the left edge of the picture.
    #[inline(always)]
    pub(crate) fn left_of_column(&self, column: i64) -> usize {
        ((column + i64::from(self.first[0])) * self.size as i64).max(0) as usize
    }

    /// Center of the cell at an index along an axis, pixels from the picture's corner.
    pub(crate) fn center(&self, axis: usize, index: usize) -> f64 {
        (f64::from(self.first[axis]) + index as f64 + 0.5) * self.size as f64
    }

    /// Pixel coordinates in cells; cell centers are integers.
    #[inline(always)]
    pub(crate) fn cell_coordinates(&self, pixel: [f32; 2]) -> [f32; 2] {
        let scale = 1.0 / self.size as f32;
        [pixel[0].mul_add(scale, -0.5), pixel[1].mul_add(scale, -0.5)]
    }

    /// The cell whose center precedes that of a pixel along an axis, and the pixel's phase between it and the next.
    #[inline(always)]
    pub(crate) fn cell_before(&self, axis: usize, pixel: usize) -> (i32, usize) {
        // In half pixels, since cell centers may be between pixels.
        let size = self.size as i32;
        let half_pixels = 2 * pixel as i32 + 1 - size;
        (half_pixels.div_euclid(2 * size) - self.first[axis], (half_pixels.rem_euclid(2 * size) / 2) as usize)
    }

    /// Distance of pixels of each phase from the preceding cell center, cells.
    pub(crate) fn phases(&self) -> impl Iterator<Item = f32> + use<> {
        let size = self.size;
        // The center of a cell of even size lies between pixels.
        let half = if size.is_multiple_of(2) { 0.5 } else { 0.0 };
        (0..size).map(move |phase| (phase as f32 + half) / size as f32)
    }

    /// Weights of the four surrounding cells for values, for each pixel phase.
    pub(crate) fn spline_weights(&self) -> Vec<[f32; 4]> {
        self.phases().map(spline::value).collect()
    }

    /// Weights of the four surrounding cells for slopes per pixel, for each pixel phase.
    pub(crate) fn spline_slopes(&self) -> Vec<[f32; 4]> {
        self.phases().map(|t| spline::slope(t).map(|weight| weight / self.size as f32)).collect()
    }
}

/// Values over cells. The values of a cell are contiguous, so that one SIMD vector accumulates a whole sprite value.
#[derive(Debug)]
pub(crate) struct Grid<'a> {
    pub(crate) cells: Raster,
    /// Values per cell.
    pub(crate) depth: usize,
    values: PooledVec<'a, f32>,
    /// Start of the values, aligned so that no cell of eight values straddles two cache lines.
    start: usize,
}

impl<'a> Grid<'a> {
    /// A grid with arbitrary values: the caller must fill all rows.
    pub(crate) fn new(cells: Raster, depth: usize, buffers: &'a BufferPool) -> Self {
        /// Cache line, bytes.
        const LINE: usize = 64;
        let count = cells.columns * cells.rows * depth + LINE / size_of::<f32>();
        let mut values = buffers.take(count);
        if values.len() < count {
            // Zero-filled pages of the operating system, which are not touched before they are used.
            *values = vec![0.0; values.capacity()];
        }
        let start = values.as_ptr().align_offset(LINE).min(LINE / size_of::<f32>());
        Self { cells, depth, values, start }
    }

    /// The pool that its memory came from.
    pub(crate) fn pool(&self) -> &'a BufferPool {
        self.values.pool()
    }

    /// All values.
    pub(crate) fn values_mut(&mut self) -> &mut [f32] {
        let count = self.cells.rows * self.row_length();
        &mut self.values[self.start..][..count]
    }

    /// Values per row.
    pub(crate) fn row_length(&self) -> usize {
        self.cells.columns * self.depth
    }

    /// The pixels of the picture that the cells cover.
    pub(crate) fn covered(&self) -> Rect {
        self.cells.covered()
    }

    /// A row of cells; rows outside the grid are those at its edge, which are empty.
    pub(crate) fn row(&self, row: i32) -> &[f32] {
        let row = row.clamp(0, self.cells.rows as i32 - 1) as usize;
        &self.values[self.start + row * self.row_length()..][..self.row_length()]
    }

    /// For `count` pixels of a row from `x` on, the first of the four surrounding columns and the pixel's phase.
    pub(crate) fn columns(&self, x: usize, count: usize) -> Vec<(usize, usize)> {
        let columns = (x..x + count).map(|x| {
            let (cell, phase) = self.cells.cell_before(0, x);
            (self.first_of_four(cell), phase)
        });
        columns.collect()
    }

    /// The first of the four columns around a position for which `cell` is the preceding cell.
    #[inline(always)]
    pub(crate) fn first_of_four(&self, cell: i32) -> usize {
        (cell - 1).clamp(0, self.cells.columns as i32 - 4) as usize
    }

    /// A grid of one value per cell: plane `plane` of `planes`, summed over layers.
    pub(crate) fn sum_of_plane(&self, plane: usize, planes: usize) -> Self {
        let mut sums = Self::new(self.cells, 1, self.pool());
        sums.values_mut().par_chunks_mut(self.cells.columns).enumerate().for_each(|(row, out)| {
            for (sum, cell) in out.iter_mut().zip(self.row(row as i32).chunks_exact(self.depth)) {
                *sum = cell[plane..].iter().step_by(planes).sum();
            }
        });
        sums
    }

    /// The grid of B-spline coefficients: prefiltered along columns and rows, so that the spline interpolates these values.
    pub(crate) fn prefiltered(&self) -> Self {
        let (length, depth) = (self.row_length(), self.depth);
        let (mut prefiltered, level) = (Self::new(self.cells, depth, self.pool()), bansho_base::math::simd::level());
        prefiltered.values_mut().par_chunks_mut(length).enumerate().for_each_init(
            || vec![0.0; length],
            |column_filtered, (row, out)| {
                let rows = [-2, -1, 0, 1, 2].map(|by| self.row(row as i32 + by));
                // The margin, which lacks two cells on one side, is empty.
                let (margin, inner) = out.split_at_mut(2 * depth);
                let (inner, other_margin) = inner.split_at_mut(length - 4 * depth);
                margin.fill(0.0);
                other_margin.fill(0.0);
                dispatch!(level, _simd => {
                    spline::prefilter(column_filtered, rows);
                    spline::prefilter(inner, [0, 1, 2, 3, 4].map(|by| &column_filtered[by * depth..]));
                });
            },
        );
        prefiltered
    }

    /// Adds a prefiltered grid of cells twice as large, interpolated.
    pub(crate) fn add_coarser(&mut self, coarser: &Grid) {
        let cells = self.cells;
        // Centers of fine cells are at 1/4 and 3/4 between those of coarse cells.
        let quarters = [spline::value(0.75), spline::value(0.25)];
        let (row_length, level) = (self.row_length(), bansho_base::math::simd::level());
        self.values_mut().par_chunks_mut(row_length).enumerate().for_each_init(
            || vec![0.0; coarser.row_length()],
            |column, (row, values)| {
                let fine = cells.first[1] + row as i32;
                let first = (fine - 1).div_euclid(2) - coarser.cells.first[1];
                let rows = [-1, 0, 1, 2].map(|k| coarser.row(first + k));
                let weights = &quarters[fine.rem_euclid(2) as usize];
                dispatch!(level, _simd => {
                    weighted_sum(column, rows, weights);
                    coarser.add_interpolated(column, &quarters, cells.first[0], values);
                });
            },
        );
    }

    /// Adds an interpolated row of these cells to a row of cells half as large whose first is `first`.
    #[inline(always)]
    fn add_interpolated(&self, row: &[f32], quarters: &[[f32; 4]; 2], first: i32, values: &mut [f32]) {
        let depth = self.depth;
        for (index, sums) in values.chunks_exact_mut(depth).enumerate() {
            let cell = first + index as i32;
            let [a, b, c, d] = quarters[cell.rem_euclid(2) as usize];
            let first_column = self.first_of_four((cell - 1).div_euclid(2) - self.cells.first[0]) * depth;
            let (before, rest) = row[first_column..][..4 * depth].split_at(depth);
            let (near, rest) = rest.split_at(depth);
            let (far, beyond) = rest.split_at(depth);
            for i in 0..depth {
                sums[i] += a * before[i] + b * near[i] + c * far[i] + d * beyond[i];
            }
        }
    }
}

/// `out = sum of weights times rows`.
#[inline(always)]
pub(crate) fn weighted_sum(out: &mut [f32], rows: [&[f32]; 4], weights: &[f32; 4]) {
    let count = out.len();
    let (a, b, c, d) = (&rows[0][..count], &rows[1][..count], &rows[2][..count], &rows[3][..count]);
    for i in 0..count {
        let sum = weights[0].mul_add(a[i], weights[1] * b[i]);
        out[i] = weights[3].mul_add(d[i], weights[2].mul_add(c[i], sum));
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::math;

    use super::*;

    /// Greatest relative error of values and slopes of a sine of `length` cells, over pixels of every phase.
    fn worst(length: f64) -> [f64; 2] {
        let cells = Raster::around(Rect { x: 0, y: 0, width: 128, height: 8 }, 4, false);
        let buffers = BufferPool::default();
        let mut grid = Grid::new(cells, 1, &buffers);
        let turn = std::f64::consts::TAU / length;
        for (index, value) in grid.values_mut().iter_mut().enumerate() {
            *value = math::sin(turn * (index % cells.columns) as f64) as f32;
        }
        let prefiltered = grid.prefiltered();
        let (weights, slopes, row) = (cells.spline_weights(), cells.spline_slopes(), prefiltered.row(4));
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
}
