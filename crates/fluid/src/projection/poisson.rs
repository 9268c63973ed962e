//! Direct solver of Poisson's equation on the grid, with the pressure 0 at the open sides.

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

impl PoissonSolver {
    pub(crate) fn new(grid: Grid, has_floor: bool) -> Self {
        let transforms = [0, 2].map(|axis| SineTransform::new(grid.size[axis]));
        let eigenvalues = [0, 1].map(|of| {
            let transform: &SineTransform = &transforms[of];
            (0..grid.size[2 * of]).map(|k| transform.eigenvalue(k) as f32).collect()
        });
        Self { grid, transforms, has_floor, eigenvalues }
    }

    /// Replaces the source by the solution. Values are those of cells alone, x first, then z, then y.
    pub(crate) fn solve(&self, values: &mut [f32]) {
        let plane = self.grid.size[0] * self.grid.size[2];
        values.par_chunks_mut(plane).for_each_init(
            || self.transforms.each_ref().map(SineTransform::scratch),
            |[along_x, along_z], plane| {
                let [width, _, depth] = self.grid.size;
                pairs(depth).for_each(|z| self.transforms[0].analyze(&mut plane[z * width..], width, 1, along_x));
                pairs(width).for_each(|x| self.transforms[1].analyze(&mut plane[x..], 1, width, along_z));
            },
        );
        self.eliminate(values);
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
    fn eliminate(&self, values: &mut [f32]) {
        let [width, height, depth] = self.grid.size;
        // A task takes one row of wave numbers through all layers.
        let mut columns: Vec<Vec<&mut [f32]>> = Vec::new();
        columns.resize_with(depth, || Vec::with_capacity(height));
        for (number, row) in values.chunks_mut(width).enumerate() {
            columns[number % depth].push(row);
        }
        let level = bansho_base::math::simd::level();
        columns.into_par_iter().enumerate().for_each_init(
            || vec![0.0; width * height],
            |factors, (z, mut rows)| dispatch!(level, simd => self.eliminate_rows(simd, z, &mut rows, factors)),
        );
    }

    #[inline(always)]
    fn eliminate_rows<S: Simd>(&self, simd: S, z: usize, rows: &mut [&mut [f32]], factors: &mut [f32]) {
        let width = self.grid.size[0];
        let area = Lanes::splat(simd, -(self.grid.spacing * self.grid.spacing) as f32);
        let last = rows.len() - 1;
        let splat = |value: f32| Lanes::splat(simd, value);
        for x in (0..width).step_by(LANES) {
            let diagonal =
                Lanes::from_slice(simd, &self.eigenvalues[0][x..x + LANES]) + splat(self.eigenvalues[1][z] + 2.0);
            let (mut factor, mut value) = (splat(0.0), splat(0.0));
            for (y, row) in rows.iter_mut().enumerate() {
                // A side with p = 0 on the face adds its own value with the other sign, a floor with the same.
                let mut ends = 0.0;
                if y == 0 {
                    ends += if self.has_floor { -1.0 } else { 1.0 };
                }
                if y == last {
                    ends += 1.0;
                }
                factor = splat(1.0) / (diagonal + splat(ends) - factor);
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
            PoissonSolver::new(grid, has_floor).solve(&mut pressure);
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
}
