//! Strain of the detail coordinates: where it is large, detail would be too fine and is faded out.
//!
//! Detail coordinates are mean Lagrangian coordinates along the line of sight. Where streams of different origin meet, or gas has been
//! compressed, they change by many noise cells within one support radius, which would alias. There detail is faded out, so that only the smooth sum is
//! drawn.

use bansho_base::{host::parallel::prelude::*, math::simd::LANES};
use fearless_simd::dispatch;

use crate::particles::render::{
    resolve::{ColumnExtents, DETAIL_OFFSET, PLANES, TAU},
    splat::grid::Grid,
};

/// Strain, relative to undeformed detail, at which the fade-out of detail starts and ends.
const FADE_RANGE: [f32; 2] = [1.0, 3.0];
/// Optical depth below which a cell is empty.
const MIN_DEPTH: f32 = 1e-6;
/// Minimum optical depth of a neighboring cell, relative to the cell's own, for it to be considered.
const MIN_NEIGHBOR_DEPTH: f32 = 0.02;

/// Gradient of the detail coordinates in each cell of each layer, relative to that of undeformed detail.
pub(crate) struct Strain {
    layers: usize,
    columns: usize,
    rows: usize,
    values: Vec<f32>,
}

impl Strain {
    /// The strain of all cells; `cell` is the size of an undeformed noise cell, pixels.
    pub(crate) fn new(grid: &Grid, extents: &ColumnExtents, layers: usize, cell: f32) -> Self {
        let (columns, rows, level) = (grid.cells.columns, grid.cells.rows, bansho_base::math::simd::level());
        let scale = cell / grid.cells.size as f32;
        let mut values = vec![0.0; rows * layers * columns];
        values.par_chunks_mut(columns).enumerate().for_each(|(index, out)| {
            let (row, layer) = (index / layers, index % layers);
            if let Some([first, last]) = extents.of(row, layer) {
                let rows = [-1, 0, 1].map(|by| grid.row(row as i32 + by));
                let range = first.max(1) as usize..(last as usize + 1).min(columns - 1);
                dispatch!(level, _simd => {
                    for column in range {
                        let start = column * grid.depth + layer * PLANES;
                        let own = DetailCoordinates::from_sums(&rows[1][start..]);
                        if own.tau > MIN_DEPTH {
                            let neighbors = [
                                DetailCoordinates::from_sums(&rows[0][start..]),
                                DetailCoordinates::from_sums(&rows[2][start..]),
                                DetailCoordinates::from_sums(&rows[1][start - grid.depth..]),
                                DetailCoordinates::from_sums(&rows[1][start + grid.depth..]),
                            ];
                            out[column] = scale * own.max_distance(&neighbors);
                        }
                    }
                });
            }
        });
        Self { layers, columns, rows, values }
    }

    /// Values along a row of cells of a layer; rows beyond the grid repeat its edge.
    pub(crate) fn row(&self, row: i32, layer: usize) -> &[f32] {
        let row = row.clamp(0, self.rows as i32 - 1) as usize;
        &self.values[(row * self.layers + layer) * self.columns..][..self.columns]
    }
}

/// Fraction of the detail that is visible at a strain.
#[inline(always)]
pub(crate) fn visible_fraction(strain: &[f32; LANES]) -> [f32; LANES] {
    let [start, end] = FADE_RANGE;
    let mut visible_fraction = [0.0; LANES];
    for lane in 0..LANES {
        let t = ((end - strain[lane]) * (1.0 / (end - start))).clamp(0.0, 1.0);
        visible_fraction[lane] = t * t * 2.0_f32.mul_add(-t, 3.0);
    }
    visible_fraction
}

/// Mean detail coordinates of a cell, in noise cells.
struct DetailCoordinates {
    tau: f32,
    position: [f32; 3],
}

impl DetailCoordinates {
    #[inline(always)]
    fn from_sums(sums: &[f32]) -> Self {
        let tau = sums[TAU];
        let inverse_depth = 1.0 / tau.max(MIN_DEPTH);
        let mut position = [0.0; 3];
        for axis in 0..3 {
            position[axis] = sums[DETAIL_OFFSET + axis] * inverse_depth;
        }
        Self { tau, position }
    }

    /// Maximum distance in the noise to a neighboring cell.
    #[inline(always)]
    fn max_distance(&self, neighbors: &[Self; 4]) -> f32 {
        let mut max_squared = 0.0_f32;
        for other in neighbors {
            let mut square = 0.0;
            for axis in 0..3 {
                let step = other.position[axis] - self.position[axis];
                square = step.mul_add(step, square);
            }
            if other.tau > MIN_NEIGHBOR_DEPTH * self.tau {
                max_squared = max_squared.max(square);
            }
        }
        max_squared.sqrt()
    }
}
