//! Interpolation along a row, sixteen pixels at a time.
//!
//! The value of each cell is broadcast and multiplied by its weights at the sixteen pixels. This needs no shuffles or gathers, unlike fetching the four cells
//! of each pixel.

use std::ops::Range;

use bansho_base::math::simd::LANES;

use crate::particles::render::splat::grid::Grid;

/// The cells in the support of sixteen pixels.
struct Span {
    /// Index of the first cell.
    first: usize,
    /// Range of their weights.
    weights: Range<usize>,
}

/// Weights of cells for pixels of a row of the whole picture.
pub(crate) struct RowInterpolator {
    /// Number of the first batch of sixteen pixels, counted from the picture's edge.
    first_batch: usize,
    spans: Vec<Span>,
    weights: Vec<[f32; LANES]>,
}

impl RowInterpolator {
    /// An interpolator for the pixels `pixels` of rows, extended to whole batches; `phase_weights` are the weights of the four surrounding cells for
    /// each pixel phase.
    pub(crate) fn new(grid: &Grid, pixels: Range<usize>, phase_weights: &[[f32; 4]]) -> Self {
        let first_batch = pixels.start / LANES;
        let columns = grid.columns(first_batch * LANES, pixels.end.saturating_sub(first_batch * LANES));
        let spans = Vec::with_capacity(columns.len().div_ceil(LANES));
        let mut interpolator = Self { first_batch, spans, weights: Vec::new() };
        for batch in columns.chunks(LANES) {
            let [first, last] = [batch[0].0, batch[batch.len() - 1].0];
            let begin = interpolator.weights.len();
            interpolator.weights.resize(begin + last + 4 - first, [0.0; LANES]);
            for (lane, (column, phase)) in batch.iter().enumerate() {
                for (k, weight) in phase_weights[*phase].iter().enumerate() {
                    interpolator.weights[begin + column - first + k][lane] = *weight;
                }
            }
            interpolator.spans.push(Span { first, weights: begin..interpolator.weights.len() });
        }
        interpolator
    }

    /// Values of `planes` at the sixteen pixels from `x` on, a multiple of sixteen, from a row of cells with `stride` values each; 0 outside the picture.
    #[inline(always)]
    pub(crate) fn at<const N: usize>(
        &self,
        row: &[f32],
        stride: usize,
        x: usize,
        planes: [usize; N],
    ) -> [[f32; LANES]; N] {
        let mut sums = [[0.0; LANES]; N];
        let batch = (x / LANES).checked_sub(self.first_batch);
        let Some(span) = batch.and_then(|batch| self.spans.get(batch)) else { return sums };
        let cells = row[span.first * stride..].chunks_exact(stride);
        for (weights, values) in self.weights[span.weights.clone()].iter().zip(cells) {
            for n in 0..N {
                let value = values[planes[n]];
                for lane in 0..LANES {
                    sums[n][lane] = weights[lane].mul_add(value, sums[n][lane]);
                }
            }
        }
        sums
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::image::Rect;

    use super::*;
    use crate::particles::render::{buffer_pool::BufferPool, splat::grid::Raster};

    #[test]
    fn sixteen_pixels_are_what_each_of_them_is() {
        const DEPTH: usize = 3;
        let buffers = BufferPool::default();
        for (size, width) in [(1, 64), (2, 50), (3, 47), (4, 64), (6, 130), (8, 17), (32, 99)] {
            let cells = Raster::around(Rect { x: 5, y: 0, width: width - 9, height: 4 }, size, false);
            let mut grid = Grid::new(cells, DEPTH, &buffers);
            for (index, value) in grid.values_mut().iter_mut().enumerate() {
                *value = (index * index % 17) as f32;
            }
            let weights = grid.cells.spline_weights();
            let (across, columns, row) =
                (RowInterpolator::new(&grid, 0..width, &weights), grid.columns(0, width), grid.row(2));
            for x in (0..width).step_by(LANES) {
                let found = across.at(row, DEPTH, x, [2, 0]);
                for pixel in x..(x + LANES).min(width) {
                    let (first, phase) = columns[pixel];
                    for (plane, values) in [2, 0].into_iter().zip(&found) {
                        let sum = (0..4)
                            .fold(0.0_f32, |sum, k| weights[phase][k].mul_add(row[(first + k) * DEPTH + plane], sum));
                        assert_eq!(values[pixel - x], sum, "pixel {pixel} of cells of {size}");
                    }
                }
            }
            assert_eq!(across.at(row, DEPTH, width.next_multiple_of(LANES), [1]), [[0.0; LANES]]);
        }
    }
}
