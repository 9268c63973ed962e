//! Direct solver of Poisson's equation on the grid, with the pressure 0 at the open sides.

use std::ops::Range;

use bansho_base::{
    host::parallel::prelude::*,
    math::simd::{LANES, Lanes},
};
use fearless_simd::{Simd, dispatch, prelude::*};

use super::transform::SineTransform;
use crate::grid::Grid;

/// Solver of the seven-point equation `laplacian(p) = source` in a box whose sides and top are open, with p = 0 on them, half a cell beyond the outermost
/// centers. The bottom is open too, or a floor with no gradient across it.
///
/// Sine transforms along x and z leave a tridiagonal system along y for every pair of wave numbers (Thomas algorithm).
pub(crate) struct PoissonSolver {
    grid: Grid,
    /// Along x and along z.
    transforms: [SineTransform; 2],
    has_floor: bool,
    /// Eigenvalues along x and along z, in cells.
    eigenvalues: [Vec<f32>; 2],
}

/// Some layers of the box. Where sources are within them alone, the solution within them needs no other layer: those above and below are eliminated.
pub(crate) struct Slab {
    pub(crate) layers: Range<usize>,
    /// For every pair of wave numbers, what is added to the diagonal of the lowest and of the uppermost layer.
    ends: [Vec<f32>; 2],
}

impl PoissonSolver {
    pub(crate) fn new(grid: Grid, has_floor: bool) -> Self {
        let transforms = [0, 2].map(|axis| SineTransform::new(grid.size[axis]));
        let eigenvalues = [0, 1].map(|of| {
            let transform: &SineTransform = &transforms[of];
            (0..grid.size[2 * of]).map(|k| transform.eigenvalue(k) as f32).collect()
        });
        Self { grid, transforms, has_floor, eigenvalues }
    }

    /// These layers of the box.
    pub(crate) fn slab(&self, layers: Range<usize>) -> Slab {
        // A side with p = 0 on the face adds its own value with the other sign, a floor with the same.
        let sides = [if self.has_floor { -1.0 } else { 1.0 }, 1.0];
        let outside = [layers.start, self.grid.size[1] - layers.end];
        let ends = [0, 1].map(|end| {
            let of_pair = |z: usize, x: usize| {
                let diagonal = self.eigenvalues[0][x] + self.eigenvalues[1][z] + 2.0;
                (0..outside[end]).fold(sides[end], |added, _| -1.0 / (diagonal + added))
            };
            (0..self.grid.size[2]).flat_map(|z| (0..self.grid.size[0]).map(move |x| of_pair(z, x))).collect()
        });
        Slab { layers, ends }
    }

    /// Replaces the source in the layers of a slab by the solution there; beyond them there is no source. Values are those of cells alone, x first, then z,
    /// then y.
    pub(crate) fn solve(&self, slab: &Slab, values: &mut [f32]) {
        let plane = self.grid.size[0] * self.grid.size[2];
        values.par_chunks_mut(plane).for_each_init(
            || self.transforms.each_ref().map(SineTransform::scratch),
            |[along_x, along_z], plane| {
                let [width, _, depth] = self.grid.size;
                pairs(depth).for_each(|z| self.transforms[0].analyze(&mut plane[z * width..], width, 1, along_x));
                pairs(width).for_each(|x| self.transforms[1].analyze(&mut plane[x..], 1, width, along_z));
            },
        );
        self.eliminate(slab, values);
        values.par_chunks_mut(plane).for_each_init(
            || self.transforms.each_ref().map(SineTransform::scratch),
            |[along_x, along_z], plane| {
                let [width, _, depth] = self.grid.size;
                pairs(width).for_each(|x| self.transforms[1].synthesize(&mut plane[x..], 1, width, along_z));
                pairs(depth).for_each(|z| self.transforms[0].synthesize(&mut plane[z * width..], width, 1, along_x));
            },
        );
    }

    /// Solves the tridiagonal systems along y.
    fn eliminate(&self, slab: &Slab, values: &mut [f32]) {
        let [width, _, depth] = self.grid.size;
        let height = slab.layers.len();
        // A task takes one row of wave numbers through all layers.
        let mut columns: Vec<Vec<&mut [f32]>> = Vec::new();
        columns.resize_with(depth, || Vec::with_capacity(height));
        for (number, row) in values.chunks_mut(width).enumerate() {
            columns[number % depth].push(row);
        }
        let level = bansho_base::math::simd::level();
        columns.into_par_iter().enumerate().for_each_init(
            || vec![0.0; width * height],
            |factors, (z, mut rows)| dispatch!(level, simd => self.eliminate_rows(simd, slab, z, &mut rows, factors)),
        );
    }

    #[inline(always)]
    fn eliminate_rows<S: Simd>(&self, simd: S, slab: &Slab, z: usize, rows: &mut [&mut [f32]], factors: &mut [f32]) {
        let width = self.grid.size[0];
        let area = Lanes::splat(simd, -(self.grid.spacing * self.grid.spacing) as f32);
        let last = rows.len() - 1;
        let splat = |value: f32| Lanes::splat(simd, value);
        for x in (0..width).step_by(LANES) {
            let diagonal =
                Lanes::from_slice(simd, &self.eigenvalues[0][x..x + LANES]) + splat(self.eigenvalues[1][z] + 2.0);
            let (mut factor, mut value) = (splat(0.0), splat(0.0));
            let ends = slab.ends.each_ref().map(|end| Lanes::from_slice(simd, &end[z * width + x..][..LANES]));
            for (y, row) in rows.iter_mut().enumerate() {
                let mut own = diagonal;
                if y == 0 {
                    own += ends[0];
                }
                if y == last {
                    own += ends[1];
                }
                factor = splat(1.0) / (own - factor);
                value = factor * (area * Lanes::from_slice(simd, &row[x..x + LANES]) + value);
                value.store_slice(&mut row[x..x + LANES]);
                factor.store_slice(&mut factors[y * width + x..][..LANES]);
            }
            for y in (0..last).rev() {
                let factor = Lanes::from_slice(simd, &factors[y * width + x..][..LANES]);
                value = factor * value + Lanes::from_slice(simd, &rows[y][x..x + LANES]);
                value.store_slice(&mut rows[y][x..x + LANES]);
            }
        }
    }
}

/// The first of every two rows; grids have an even number of them.
fn pairs(count: usize) -> impl Iterator<Item = usize> {
    (0..count).step_by(2)
}

#[cfg(test)]
mod tests {
    use bansho_base::math::DVec3;

    use super::*;

    #[test]
    fn the_equation_holds_in_every_cell() {
        for has_floor in [false, true] {
            let grid = Grid::new([32, 11, 18], 0.25, DVec3::ZERO);
            let [width, height, depth] = grid.size;
            let source: Vec<f32> =
                (0..grid.cells()).map(|i| ((i * i * 31 + 7 * i) % 101) as f32 / 50.0 - 1.0).collect();
            let mut pressure = source.clone();
            let solver = PoissonSolver::new(grid, has_floor);
            solver.solve(&solver.slab(0..height), &mut pressure);
            let at = |x: usize, y: usize, z: usize| pressure[(y * depth + z) * width + x];
            for (index, source) in source.iter().enumerate() {
                let (x, y, z) = (index % width, index / (width * depth), index / width % depth);
                let here = at(x, y, z);
                let side = |is_inside: bool, value: f32| if is_inside { value } else { -here };
                let mut sum = -6.0 * here;
                sum +=
                    side(x > 0, at(x.saturating_sub(1), y, z)) + side(x + 1 < width, at((x + 1).min(width - 1), y, z));
                sum +=
                    side(z > 0, at(x, y, z.saturating_sub(1))) + side(z + 1 < depth, at(x, y, (z + 1).min(depth - 1)));
                sum += side(y + 1 < height, at(x, (y + 1).min(height - 1), z));
                sum += if y > 0 {
                    at(x, y - 1, z)
                } else if has_floor {
                    here
                } else {
                    -here
                };
                assert!((sum / 0.0625 - source).abs() < 2e-4, "{has_floor} {x} {y} {z}: {} {source}", sum / 0.0625);
            }
        }
    }

    #[test]
    fn layers_with_all_sources_are_solved_without_the_others() {
        for has_floor in [false, true] {
            let grid = Grid::new([16, 12, 18], 0.25, DVec3::ZERO);
            let plane = grid.size[0] * grid.size[2];
            let solver = PoissonSolver::new(grid, has_floor);
            for layers in [0..5, 4..9, 8..12] {
                let part: Vec<f32> =
                    (0..layers.len() * plane).map(|i| ((i * i * 31 + 7 * i) % 101) as f32 / 50.0 - 1.0).collect();
                let within = layers.start * plane..layers.end * plane;
                let mut whole = vec![0.0; grid.cells()];
                whole[within.clone()].copy_from_slice(&part);
                solver.solve(&solver.slab(0..grid.size[1]), &mut whole);
                let mut alone = part;
                solver.solve(&solver.slab(layers.clone()), &mut alone);
                let worst = alone.iter().zip(&whole[within]).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
                let largest = alone.iter().map(|value| value.abs()).fold(0.0, f32::max);
                assert!(worst < 1e-5 * largest, "{has_floor} {layers:?}: {worst} of {largest}");
            }
        }
    }
}
