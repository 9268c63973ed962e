//! The pressure around solids by the capacitance matrix method (Buzbee, Dorr, George and Golub 1971; Proskurowski and Widlund 1976).
//!
//! The equation around solids differs from that of the empty box only in cells beside a solid. Sources in those cells are sought with which the solution of the
//! empty box has no gradient across the faces of solids. With the equation of the empty box `L p = b` (p in Pa, b in Pa/m^2) and the terms that it has across
//! these faces, `(B p)_i = (1 / h^2) sum(p_solid - p_i)`, gas obeys `(L - B) p = b`: sources `q = B p` in `L p = b + q`. All that iterates is as small as the
//! surface of the solids, and the box is solved in their layers alone.

use std::ops::Range;

use super::poisson::{PoissonSolver, Slab};
use crate::{grid::Grid, solids::Solids};

/// Largest residual of the equation, relative to its right side.
const TOLERANCE: f64 = 1e-3;
/// Most iterations.
const MAX_ITERATIONS: usize = 30;

/// A cell of gas beside solids.
struct BoundaryCell {
    /// Its place among all cells.
    place: usize,
    /// The solid cells beside it, in [`SolidBoundary::solid_places`].
    solids: Range<usize>,
}

/// The cells of gas beside solids.
pub(crate) struct SolidBoundary {
    grid: Grid,
    slab: Slab,
    cells: Vec<BoundaryCell>,
    solid_places: Vec<usize>,
    /// Of all cells of the slab.
    values: Vec<f32>,
}

/// Values of the solution of the empty box in the cells beside solids.
struct Sample {
    own: Vec<f32>,
    /// `(1 / h^2) sum(p_solid - p)` over the faces of solids: what the empty box has there and the gas has not.
    across: Vec<f32>,
}

impl SolidBoundary {
    /// The boundary of some solids; `None` if no gas touches them.
    pub(crate) fn new(solver: &PoissonSolver, grid: Grid, solids: &Solids) -> Option<Self> {
        let (mut cells, mut solid_places) = (Vec::new(), Vec::new());
        for place in 0..grid.cells() {
            let cell = cell_at(&grid, place);
            if solids.contains(grid.index(cell)) {
                continue;
            }
            let first = solid_places.len();
            solid_places.extend(
                grid.neighbors(cell)
                    .filter(|near| solids.contains(grid.index(*near)))
                    .map(|near| place_of(&grid, near)),
            );
            if solid_places.len() > first {
                cells.push(BoundaryCell { place, solids: first..solid_places.len() });
            }
        }
        let plane = grid.size[0] * grid.size[2];
        let places = || cells.iter().map(|cell| cell.place).chain(solid_places.iter().copied());
        let layers = places().min()? / plane..places().max()? / plane + 1;
        let values = vec![0.0; layers.len() * plane];
        Some(Self { grid, slab: solver.slab(layers), cells, solid_places, values })
    }

    /// Replaces `values`, the right side of the equation in all cells (0 in solids), by the pressure; in solids it is that of the empty box. `last` is the
    /// pressure of the last step, with ghost cells.
    pub(crate) fn solve(&mut self, solver: &PoissonSolver, whole: &Slab, values: &mut [f32], last: &[f32]) {
        let square_sum = |values: &[f32]| values.iter().map(|value| f64::from(*value) * f64::from(*value)).sum::<f64>();
        let target = TOLERANCE * TOLERANCE * square_sum(values);
        let right_side = values.to_vec();
        let mut sources = self.sample(|place| last[self.grid.index(cell_at(&self.grid, place))]).across;
        self.add_sources(&sources, values);
        solver.solve(whole, values);
        let sample = self.sample(|place| values[place]);
        let mut residual: Vec<f32> =
            sample.across.iter().zip(&sources).map(|(across, source)| across - source).collect();
        if square_sum(&residual) <= target {
            return;
        }
        self.conjugate_gradients(solver, &mut residual, &mut sources, target);
        values.copy_from_slice(&right_side);
        self.add_sources(&sources, values);
        solver.solve(whole, values);
    }

    /// Conjugate gradients with the solution of the empty box as preconditioner (Hestenes and Stiefel 1952): changes the sources until the residual is small.
    fn conjugate_gradients(&mut self, solver: &PoissonSolver, residual: &mut [f32], sources: &mut [f32], target: f64) {
        let count = self.cells.len();
        let [mut own, mut across, mut source] = [0; 3].map(|_| vec![0.0_f32; count]);
        let mut steepness = 0.0;
        for _ in 0..MAX_ITERATIONS {
            let preconditioned = self.respond(solver, residual);
            let next = dot(residual, &preconditioned.own);
            let weight = if steepness == 0.0 { 0.0 } else { (next / steepness) as f32 };
            steepness = next;
            for i in 0..count {
                own[i] = preconditioned.own[i] + weight * own[i];
                across[i] = preconditioned.across[i] + weight * across[i];
                source[i] = residual[i] + weight * source[i];
            }
            let curvature: f64 = (0..count).map(|i| f64::from(own[i]) * f64::from(source[i] - across[i])).sum();
            if curvature == 0.0 || !curvature.is_finite() {
                break;
            }
            let length = (steepness / curvature) as f32;
            for i in 0..count {
                sources[i] += length * source[i];
                residual[i] -= length * (source[i] - across[i]);
            }
            if dot(residual, residual) <= target {
                break;
            }
        }
    }

    /// The solution of the empty box for sources in the cells beside solids.
    fn respond(&mut self, solver: &PoissonSolver, sources: &[f32]) -> Sample {
        let first = self.slab.layers.start * self.grid.size[0] * self.grid.size[2];
        let mut values = std::mem::take(&mut self.values);
        values.fill(0.0);
        for (cell, source) in self.cells.iter().zip(sources) {
            values[cell.place - first] = *source;
        }
        solver.solve(&self.slab, &mut values);
        let sample = self.sample(|place| values[place - first]);
        self.values = values;
        sample
    }

    fn sample(&self, value_at: impl Fn(usize) -> f32) -> Sample {
        let per_area = (1.0 / (self.grid.spacing * self.grid.spacing)) as f32;
        let own: Vec<f32> = self.cells.iter().map(|cell| value_at(cell.place)).collect();
        let across = self.cells.iter().zip(&own).map(|(cell, own)| {
            let solids = self.solid_places[cell.solids.clone()].iter();
            per_area * solids.map(|place| value_at(*place) - own).sum::<f32>()
        });
        let across = across.collect();
        Sample { own, across }
    }

    fn add_sources(&self, sources: &[f32], values: &mut [f32]) {
        for (cell, source) in self.cells.iter().zip(sources) {
            values[cell.place] += source;
        }
    }
}

/// Inner product.
fn dot(a: &[f32], b: &[f32]) -> f64 {
    a.iter().zip(b).map(|(a, b)| f64::from(*a) * f64::from(*b)).sum()
}

/// Place of a cell among all cells: x first, then z, then y.
fn place_of(grid: &Grid, [x, y, z]: [usize; 3]) -> usize {
    (y * grid.size[2] + z) * grid.size[0] + x
}

fn cell_at(grid: &Grid, place: usize) -> [usize; 3] {
    let [width, _, depth] = grid.size;
    [place % width, place / (width * depth), place / width % depth]
}
