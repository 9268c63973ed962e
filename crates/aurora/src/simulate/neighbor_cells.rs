//! Repulsion over the 3 x 3 cells around the cell of a particle, as the thesis programs it (2.5.1): what lies outside these cells is missed, whatever
//! the reach of the kernel.
//!
//! Cells are as wide as the smoothing length h and aligned with the grid of the field. The sums of a particle are in the order of cells and of
//! particles within them, whatever the number of threads.

use bansho_base::{host::parallel::prelude::*, math::simd::Real};
use bansho_sph::{CubicSpline, KernelShape, Poly6, SmoothingKernel, Spiky};
use fearless_simd::dispatch;

/// Squared distance, in support radii, below which two particles coincide and do not repel each other.
const COINCIDENCE: f32 = 1e-12;

/// Particles sorted by cell, row by row, so that three neighboring cells of a row are one range of particles.
#[derive(Clone, Debug)]
pub(super) struct NeighborCells {
    /// Support radius in smoothing lengths.
    reach: f32,
    support: f32,
    /// Cells along x and z.
    size: [usize; 2],
    /// First particle of each cell, and the total.
    starts: Vec<u32>,
    /// Index of each sorted particle in the order of the arguments.
    order: Vec<u32>,
    positions: [Vec<f32>; 2],
    masses: Vec<f32>,
}

/// A sum over neighbors: values of the neighbor are `[x, z, a, b]`, sums are two numbers.
trait CellTerm: Sync {
    /// Adds the term of a neighbor at `offset` (from it to the particle) with its two values to the sums of a particle with a `value`.
    fn add(&self, offset: [f32; 2], distance_squared: f32, value: f32, other: [f32; 2], sums: [f32; 2]) -> [f32; 2];
}

/// `m_j W`, (2.11).
struct Density<K>(K);

impl<K: SmoothingKernel<2>> CellTerm for Density<K> {
    #[inline(always)]
    fn add(&self, _: [f32; 2], distance_squared: f32, _: f32, other: [f32; 2], sums: [f32; 2]) -> [f32; 2] {
        [self.0.value(distance_squared).fma(other[0], sums[0]), 0.0]
    }
}

/// `(p_i + p_j) m_j / delta_j grad W`, (2.14).
struct Pressure<K>(K);

impl<K: SmoothingKernel<2>> CellTerm for Pressure<K> {
    #[inline(always)]
    fn add(
        &self,
        [x, z]: [f32; 2],
        distance_squared: f32,
        pressure: f32,
        [other_pressure, volume]: [f32; 2],
        sums: [f32; 2],
    ) -> [f32; 2] {
        let factor = (pressure + other_pressure) * volume * self.0.gradient_factor(distance_squared);
        [x.fma(factor, sums[0]), z.fma(factor, sums[1])]
    }
}

impl NeighborCells {
    /// For kernels whose support radius is so many smoothing lengths.
    pub(super) fn new(reach: f64) -> Self {
        let (starts, order, positions, masses) = Default::default();
        Self { reach: reach as f32, support: 1.0, size: [0; 2], starts, order, positions, masses }
    }

    /// Sorts particles into cells, for kernels of a support radius in km.
    pub(super) fn assign(&mut self, positions: &[Vec<f32>; 2], masses: &[f32], support: f32) {
        self.support = support;
        let per_km = self.reach / support;
        // Column or row of each particle: cells are aligned at the origin, as those of the field.
        let [columns, rows]: [Vec<i64>; 2] =
            positions.each_ref().map(|values| values.iter().map(|value| (value * per_km).floor() as i64).collect());
        // One empty cell on each side.
        let bounds = [&columns, &rows].map(|indices| {
            let (first, last) = (indices.iter().min(), indices.iter().max());
            [first.copied().unwrap_or(0) - 1, last.copied().unwrap_or(0) + 1]
        });
        self.size = bounds.map(|[first, last]| (last - first + 1) as usize);
        let mut cells = Vec::with_capacity(columns.len());
        for (column, row) in columns.iter().zip(&rows) {
            cells.push((row - bounds[1][0]) as usize * self.size[0] + (column - bounds[0][0]) as usize);
        }
        self.starts.clear();
        self.starts.resize(self.size[0] * self.size[1] + 1, 0);
        cells.iter().for_each(|cell| self.starts[cell + 1] += 1);
        for cell in 1..self.starts.len() {
            self.starts[cell] += self.starts[cell - 1];
        }
        let mut next = self.starts.clone();
        self.order.resize(cells.len(), 0);
        for (index, cell) in cells.iter().enumerate() {
            self.order[next[*cell] as usize] = index as u32;
            next[*cell] += 1;
        }
        self.positions = positions.each_ref().map(|values| self.in_cell_order(values));
        self.masses = self.in_cell_order(masses);
    }

    /// Values of the particles of [`Self::assign`], sorted by cell.
    fn in_cell_order(&self, values: &[f32]) -> Vec<f32> {
        self.order.iter().map(|index| values[*index as usize]).collect()
    }

    /// Densities (2.11), in the order of the particles of [`Self::assign`].
    pub(super) fn compute_densities(&self, kernel: KernelShape, densities: &mut Vec<f32>) {
        let (none, values) = (vec![0.0; self.order.len()], [self.masses.as_slice(), &self.masses]);
        let sums = match kernel {
            KernelShape::Poly6 => self.sum(&Density(Poly6::new(self.support)), &none, values),
            KernelShape::Spiky => self.sum(&Density(Spiky::new(self.support)), &none, values),
            KernelShape::CubicSpline => self.sum(&Density(CubicSpline::new(self.support)), &none, values),
        };
        densities.resize(self.order.len(), 0.0);
        for (index, [density, _]) in self.order.iter().zip(sums) {
            densities[*index as usize] = density;
        }
    }

    /// Accelerations (2.14), divided by both densities, in the order of the particles of [`Self::assign`], as are densities and pressures.
    pub(super) fn compute_accelerations(
        &self,
        kernel: KernelShape,
        densities: &[f32],
        pressures: &[f32],
        accelerations: &mut [Vec<f32>; 2],
    ) {
        let (sorted_pressures, sorted_densities) = (self.in_cell_order(pressures), self.in_cell_order(densities));
        let volumes: Vec<f32> =
            self.masses.iter().zip(&sorted_densities).map(|(mass, density)| mass / density).collect();
        let values = [sorted_pressures.as_slice(), &volumes];
        let sums = match kernel {
            KernelShape::Poly6 => self.sum(&Pressure(Poly6::new(self.support)), &sorted_pressures, values),
            KernelShape::Spiky => self.sum(&Pressure(Spiky::new(self.support)), &sorted_pressures, values),
            KernelShape::CubicSpline => self.sum(&Pressure(CubicSpline::new(self.support)), &sorted_pressures, values),
        };
        for values in accelerations.iter_mut() {
            values.resize(self.order.len(), 0.0);
        }
        for ((index, sum), density) in self.order.iter().zip(sums).zip(&sorted_densities) {
            for (values, sum) in accelerations.iter_mut().zip(sum) {
                values[*index as usize] = -0.5 * sum / density;
            }
        }
    }

    /// Sums of all particles, in sorted order; `values` and `others` are sorted too.
    fn sum<T: CellTerm>(&self, term: &T, values: &[f32], others: [&[f32]; 2]) -> Vec<[f32; 2]> {
        let (columns, level) = (self.size[0], bansho_base::math::simd::level());
        // Only cells with particles: sheets are thin, and most of the square is empty.
        let occupied = (0..self.starts.len() - 1).filter(|cell| self.starts[*cell] < self.starts[cell + 1]);
        let occupied: Vec<usize> = occupied.collect();
        occupied
            .into_par_iter()
            .with_max_len(1)
            .flat_map_iter(|cell| {
                let mut sums = [Vec::new(), Vec::new()];
                dispatch!(level, _simd => self.sum_cell(term, cell, columns, values, others, &mut sums));
                let [first, second] = sums;
                first.into_iter().zip(second).map(|(first, second)| [first, second])
            })
            .collect()
    }

    /// Sums of the particles of a cell: for each neighbor a loop over them, which vectorizes.
    #[inline(always)]
    fn sum_cell<T: CellTerm>(
        &self,
        term: &T,
        cell: usize,
        columns: usize,
        values: &[f32],
        others: [&[f32]; 2],
        sums: &mut [Vec<f32>; 2],
    ) {
        let range = self.starts[cell] as usize..self.starts[cell + 1] as usize;
        let (xs, zs) = (&self.positions[0][range.clone()], &self.positions[1][range.clone()]);
        let values = &values[range];
        let (max, min) = (self.support * self.support, COINCIDENCE * self.support * self.support);
        let [first, second] = sums;
        first.resize(xs.len(), 0.0);
        second.resize(xs.len(), 0.0);
        let (first, second) = (&mut first[..xs.len()], &mut second[..xs.len()]);
        // The three cells of a row are adjacent in memory, and the border of empty cells has neighbors for all others.
        for row in [cell - columns, cell, cell + columns] {
            for j in self.starts[row - 1] as usize..self.starts[row + 2] as usize {
                let (x, z) = (self.positions[0][j], self.positions[1][j]);
                let other = [others[0][j], others[1][j]];
                for i in 0..xs.len() {
                    let offset = [xs[i] - x, zs[i] - z];
                    let squared = offset[0].fma(offset[0], offset[1] * offset[1]);
                    // Clamped instead of skipped, so that the loop has no branches: the kernels are 0 at the support radius, and the
                    // factor of the gradient need not be finite at 0.
                    let squared = if squared < max { squared } else { max };
                    let squared = if squared > min { squared } else { min };
                    [first[i], second[i]] = term.add(offset, squared, values[i], other, [first[i], second[i]]);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::{
        assert_measured,
        math::random::{Key, Purpose},
    };
    use bansho_sph::{Cells, PressureForce, compute_densities};

    use super::*;

    const COUNT: usize = 600;

    fn particles() -> [Vec<f32>; 2] {
        let uniforms = |id: usize| Key::new(3, "cells").uniforms(id as u64, 0, Purpose(1));
        [0, 1].map(|axis| (0..COUNT).map(|id| 8.0 * (uniforms(id)[axis] - 0.5)).collect())
    }

    /// Densities and accelerations by the plain double loop, in f64, over pairs for which `is_near`.
    fn plain(positions: &[Vec<f32>; 2], support: f64, is_near: impl Fn(usize, usize) -> bool) -> [Vec<f64>; 3] {
        let kernel = bansho_sph::Kernel::<2>::new(KernelShape::CubicSpline, support as f32);
        let offset =
            |i: usize, j: usize| [0, 1].map(|axis| f64::from(positions[axis][i]) - f64::from(positions[axis][j]));
        let distance = |i, j| offset(i, j).into_iter().map(|value| value * value).sum::<f64>().sqrt();
        let near = |i: usize| (0..COUNT).filter(|j| is_near(i, *j)).collect::<Vec<_>>();
        let nears: Vec<Vec<usize>> = (0..COUNT).map(near).collect();
        let value = |i: usize, j: &usize| f64::from(kernel.value(distance(i, *j) as f32));
        let densities: Vec<f64> = (0..COUNT).map(|i| nears[i].iter().map(|j| value(i, j)).sum()).collect();
        let pressure = |i: usize| densities[i] - 5.0;
        let acceleration = |i: usize, axis: usize| {
            let term = |j: &usize| {
                let r = distance(i, *j).max(1e-9);
                let slope = f64::from(kernel.derivative(r as f32));
                (pressure(i) + pressure(*j)) / (2.0 * densities[i] * densities[*j]) * slope * offset(i, *j)[axis] / r
            };
            -nears[i].iter().filter(|j| **j != i).map(term).sum::<f64>()
        };
        let accelerations = [0, 1].map(|axis| (0..COUNT).map(|i| acceleration(i, axis)).collect());
        let [east, south] = accelerations;
        [densities, east, south]
    }

    fn by_cells(positions: &[Vec<f32>; 2], support: f32) -> [Vec<f32>; 3] {
        let mut cells = NeighborCells::new(2.0);
        cells.assign(positions, &[1.0; COUNT], support);
        let (mut densities, mut accelerations) = (Vec::new(), [Vec::new(), Vec::new()]);
        cells.compute_densities(KernelShape::CubicSpline, &mut densities);
        let pressures: Vec<f32> = densities.iter().map(|density| density - 5.0).collect();
        cells.compute_accelerations(KernelShape::CubicSpline, &densities, &pressures, &mut accelerations);
        let [east, south] = accelerations;
        [densities, east, south]
    }

    fn assert_equal(found: &[Vec<f32>; 3], expected: &[Vec<f64>; 3]) {
        let mut largest = 0.0_f64;
        for (found, expected) in found.iter().zip(expected) {
            let scale = expected.iter().map(|value| value.abs()).fold(0.0, f64::max);
            for (found, expected) in found.iter().zip(expected) {
                largest = largest.max((f64::from(*found) - expected).abs() / scale);
            }
        }
        assert_measured!("equation (2.14) & figure 2.17: difference of sums", largest, 0.0, 1e-4);
    }

    #[test]
    fn sums_are_over_the_nine_cells_and_no_others() {
        // h = 0.5: the spline reaches 1.0, and the nine cells half to all of that.
        let positions = particles();
        let cell = |i: usize| positions.each_ref().map(|values| (f64::from(values[i]) / 0.5).floor());
        let is_near = |i: usize, j: usize| {
            let ([a, b], [c, d]) = (cell(i), cell(j));
            let squared: f64 =
                positions.iter().map(|values| f64::from(values[i] - values[j])).map(|apart| apart * apart).sum();
            (a - c).abs() <= 1.0 && (b - d).abs() <= 1.0 && squared < 1.0
        };
        let found = by_cells(&positions, 1.0);
        assert_equal(&found, &plain(&positions, 1.0, is_near));
        // They miss a part of what lies within 2 h.
        let mut cells = Cells::<2>::new(1.0);
        cells.assign(positions.each_ref().map(Vec::as_slice), &(0..COUNT as u64).collect::<Vec<_>>());
        let (mut whole, mut accelerations) = (Vec::new(), [Vec::new(), Vec::new()]);
        compute_densities(&cells, KernelShape::CubicSpline, &[1.0; COUNT], &mut whole);
        PressureForce::new(KernelShape::CubicSpline).compute_accelerations(
            &cells,
            &[1.0; COUNT],
            &whole,
            &[0.0; COUNT],
            &mut accelerations,
        );
        let [of_cells, of_all] =
            [&found[0], &whole].map(|densities| densities.iter().map(|d| f64::from(*d)).sum::<f64>());
        assert!(of_cells < 0.999 * of_all && of_cells > 0.9 * of_all, "{of_cells} of {of_all}");
    }

    /// The example of the thesis: seven particles in the cells 0 to 3 of figure 2.17.
    #[test]
    fn lists_of_cells_are_those_of_tables_2_2_to_2_4() {
        // Table 2.2: the cell of each particle.
        const CELL_INDEX: [usize; 7] = [0, 2, 1, 0, 3, 0, 1];
        let center = |cell: &usize| [0.5 + (cell % 2) as f32, 0.5 + (cell / 2) as f32];
        let positions = [0, 1].map(|axis| CELL_INDEX.iter().map(|cell| center(cell)[axis]).collect());
        let mut cells = NeighborCells::new(2.0);
        cells.assign(&positions, &[1.0; 7], 2.0);
        // Table 2.3: the particles in the order of their cells.
        assert_eq!(cells.order, [0, 3, 5, 2, 6, 1, 4]);
        let sorted_cells: Vec<usize> = cells.order.iter().map(|particle| CELL_INDEX[*particle as usize]).collect();
        assert_eq!(sorted_cells, [0, 0, 0, 1, 1, 2, 3]);
        // Table 2.4: the first and the last place of each cell. There is a border of empty cells.
        assert_eq!(cells.size, [4, 4]);
        let starts = &cells.starts;
        let bounds = [0, 1, 2, 3].map(|cell| {
            let cell = (cell / 2 + 1) * 4 + cell % 2 + 1;
            [starts[cell], starts[cell + 1] - 1]
        });
        assert_eq!(bounds, [[0, 2], [3, 4], [5, 5], [6, 6]]);
        assert_measured!("table 2.2 & table 2.3 & table 2.4: particles", f64::from(bounds[3][1] + 1), 7.0, 0.0);
    }

    #[test]
    fn many_threads_give_the_same_bits() {
        let positions = particles();
        let with_threads = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| by_cells(&positions, 0.7))
        };
        assert_eq!(with_threads(1), with_threads(5));
    }
}
