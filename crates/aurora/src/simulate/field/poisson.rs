//! Solvers of the screened Poisson equation: direct (sine transform along x, tridiagonal systems along z) and
//! Gauss-Seidel. The sine transform is a discrete one of type I (DST-I), of two rows at a time.

use std::{f64::consts::PI, sync::Arc};

use bansho_base::{host::parallel::prelude::*, math};
use fearless_simd::{Level, dispatch};
use rustfft::{Fft, FftPlanner, num_complex::Complex};

use super::grid::Grid2;

/// Rows per task of the transform, an even number.
const TASK_ROWS: usize = 16;
/// Columns per task of the elimination.
const TASK_COLUMNS: usize = 64;

/// Direct solver of the five-point equation `laplacian(phi) - phi / l^2 = source` with phi = 0 in the ghost cells
/// around the grid.
///
/// The sine transform along x decouples the equation into one tridiagonal system along z per wave number (Thomas
/// algorithm). The solution equals converged relaxation (2.6) to rounding. The transform is fast if columns + 1 has
/// small prime factors: 255 columns are fast; 256 columns take twice as long, because 257 is prime. The number of rows is
/// arbitrary.
#[derive(Clone)]
pub struct PoissonSolver {
    size: [usize; 2],
    area: f64,
    transform: Arc<SineTransform>,
    /// Elimination factors, one per cell, row by row.
    factors: Vec<f64>,
}

impl std::fmt::Debug for PoissonSolver {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter
            .debug_struct("PoissonSolver")
            .field("size", &self.size)
            .field("area", &self.area)
            .finish_non_exhaustive()
    }
}

impl PoissonSolver {
    /// For grids of that many columns and rows of cells `spacing` wide; `screening` is `1 / l^2`, not below 0.
    ///
    /// l is the screening length (Debye length); a `screening` of 0 is Poisson's equation.
    #[must_use]
    pub fn new(size: [usize; 2], spacing: f64, screening: f64) -> Self {
        let [columns, rows] = size;
        let area = spacing * spacing;
        // Eigenvalues of the equation along x, for wave number k + 1: 2 + area / l^2 + 4 sin^2(pi (k + 1) / (2 (columns + 1))).
        let mut diagonals = vec![0.0; columns];
        for (k, diagonal) in diagonals.iter_mut().enumerate() {
            let sine = math::sin(PI * (k + 1) as f64 / (2 * (columns + 1)) as f64);
            *diagonal = (4.0 * sine).mul_add(sine, area.mul_add(screening, 2.0));
        }
        let mut factors = Vec::with_capacity(columns * rows);
        // The factors of the elimination depend on the matrix only, so that a solve needs no division.
        let mut above = vec![0.0; columns];
        for _ in 0..rows {
            above.iter_mut().zip(&diagonals).for_each(|(factor, diagonal)| *factor = 1.0 / (diagonal - *factor));
            factors.extend_from_slice(&above);
        }
        Self { size, area, transform: Arc::new(SineTransform::new(columns)), factors }
    }

    /// Replaces the source `rho / eps` in the grid with the potential.
    ///
    /// # Panics
    ///
    /// If the grid has another size than the solver.
    pub fn solve(&self, grid: &mut Grid2) {
        assert_eq!(grid.size(), self.size, "a solver is built for one size");
        if grid.values().is_empty() {
            return;
        }
        // The transform applied twice is (columns + 1) / 2 times the identity.
        let scale = -self.area * 2.0 / (self.size[0] + 1) as f64;
        self.transform_rows(grid);
        self.eliminate(grid, scale);
        self.transform_rows(grid);
    }

    fn transform_rows(&self, grid: &mut Grid2) {
        let columns = self.size[0];
        let tasks = grid.values_mut().par_chunks_mut(TASK_ROWS * columns);
        tasks.for_each_init(
            || self.transform.scratch(),
            |scratch, rows| {
                rows.chunks_mut(2 * columns).for_each(|pair| self.transform.apply(pair, scratch));
            },
        );
    }

    /// Solves `-phi_(j-1) + b phi_j - phi_(j+1) = scale * source_j` for every wave number.
    fn eliminate(&self, grid: &mut Grid2, scale: f64) {
        let scale = if cfg!(feature = "broken-kernel") { -scale } else { scale };
        let columns = self.size[0];
        // The elimination goes row by row, but wave numbers are independent: a task takes some columns through all rows, which vectorizes along them.
        let mut blocks: Vec<Vec<&mut [f64]>> = Vec::new();
        blocks.resize_with(columns.div_ceil(TASK_COLUMNS), Vec::new);
        for row in grid.values_mut().chunks_mut(columns) {
            row.chunks_mut(TASK_COLUMNS).zip(&mut blocks).for_each(|(chunk, block)| block.push(chunk));
        }
        let level = bansho_base::math::simd::level();
        blocks.into_par_iter().enumerate().for_each(|(number, mut block)| {
            let factors: Vec<&[f64]> =
                self.factors.chunks(columns).map(|row| &row[number * TASK_COLUMNS..][..block[0].len()]).collect();
            dispatch!(level, _simd => eliminate_block(&mut block, &factors, scale));
        });
    }
}

/// Forward elimination and back substitution.
#[inline(always)]
fn eliminate_block(rows: &mut [&mut [f64]], factors: &[&[f64]], scale: f64) {
    let mut above = [0.0; TASK_COLUMNS];
    for (row, factors) in rows.iter_mut().zip(factors) {
        for ((value, factor), above) in row.iter_mut().zip(*factors).zip(&mut above) {
            *value = *factor * scale.mul_add(*value, *above);
            *above = *value;
        }
    }
    let mut below = [0.0; TASK_COLUMNS];
    for (row, factors) in rows.iter_mut().zip(factors).rev() {
        for ((value, factor), below) in row.iter_mut().zip(*factors).zip(&mut below) {
            *value = factor.mul_add(*below, *value);
            *below = *value;
        }
    }
}

/// One Gauss-Seidel sweep for `laplacian(phi) - phi / l^2 = source`, row by row; phi is 0 in the ghost cells.
///
/// Eq. (2.6) of the thesis with `source = rho / eps`; `screening` is `1 / l^2`, 0 in the thesis. Returns the maximum
/// change.
///
/// # Panics
///
/// If potential and source differ in size.
pub fn gauss_seidel_sweep(potential: &mut Grid2, source: &Grid2, screening: f64) -> f64 {
    assert_eq!(potential.size(), source.size(), "one source per cell");
    let [columns, rows] = potential.size();
    let area = potential.spacing() * potential.spacing();
    let scale = 1.0 / area.mul_add(screening, 4.0);
    let mut change = 0.0_f64;
    for j in 0..rows {
        for i in 0..columns {
            let (x, z) = (i as isize, j as isize);
            let around =
                (potential.at(x - 1, z) + potential.at(x + 1, z)) + (potential.at(x, z - 1) + potential.at(x, z + 1));
            let index = j * columns + i;
            let value = scale * (around - area * source.values()[index]);
            change = change.max((value - potential.values()[index]).abs());
            potential.values_mut()[index] = value;
        }
    }
    change
}

/// Relative residual: RMS of `laplacian(phi) - phi / l^2 - source` over RMS of the source; 0 if the residual is 0.
///
/// # Panics
///
/// If potential and source differ in size.
#[must_use]
pub fn relative_residual(potential: &Grid2, source: &Grid2, screening: f64) -> f64 {
    assert_eq!(potential.size(), source.size(), "one source per cell");
    let columns = potential.size()[0];
    let inverse = 1.0 / (potential.spacing() * potential.spacing());
    let (mut residual, mut norm) = (0.0, 0.0);
    for (index, source) in source.values().iter().enumerate() {
        let (i, j) = ((index % columns) as isize, (index / columns) as isize);
        let around =
            (potential.at(i - 1, j) + potential.at(i + 1, j)) + (potential.at(i, j - 1) + potential.at(i, j + 1));
        let error = inverse * (around - 4.0 * potential.at(i, j)) - screening * potential.at(i, j) - source;
        residual += error * error;
        norm += source * source;
    }
    if residual == 0.0 { 0.0 } else { (residual / norm).sqrt() }
}

/// `F_k = sum_j f_j sin(pi j k / (n + 1))`, j and k from 1 to n; applied twice it is `(n + 1) / 2`.
///
/// A row of n values is folded into n + 1 values whose Fourier transform yields the even and the odd wave numbers (Press et al. 2007,
/// section 12.4.1). Two rows are transformed at once, as real and imaginary part. `rustfft` selects its code by the instruction set; on
/// machines with AVX and FMA it is always the same.
struct SineTransform {
    fourier: Arc<dyn Fft<f64>>,
    /// `sin(pi j / (n + 1))`, j from 0 to n.
    sines: Vec<f64>,
    level: Level,
}

/// Scratch buffers of a thread.
struct TransformScratch {
    spectrum: Vec<Complex<f64>>,
    inner: Vec<Complex<f64>>,
}

impl SineTransform {
    /// For rows of `length` values.
    fn new(length: usize) -> Self {
        let whole = length + 1;
        let sines = (0..whole).map(|j| math::sin(PI * j as f64 / whole as f64)).collect();
        Self { fourier: FftPlanner::new().plan_fft_forward(whole), sines, level: bansho_base::math::simd::level() }
    }

    fn scratch(&self) -> TransformScratch {
        TransformScratch {
            spectrum: vec![Complex::default(); self.sines.len()],
            inner: vec![Complex::default(); self.fourier.get_inplace_scratch_len()],
        }
    }

    /// Transforms one or two rows, one after the other in `rows`.
    fn apply(&self, rows: &mut [f64], scratch: &mut TransformScratch) {
        let (first, second) = rows.split_at_mut(self.sines.len() - 1);
        let spectrum = &mut scratch.spectrum;
        dispatch!(self.level, _simd => self.fold(first, second, spectrum));
        // Two real rows in one complex transform: their spectra are the Hermitian and the anti-Hermitian part of its result.
        self.fourier.process_with_scratch(spectrum, &mut scratch.inner);
        unfold(first, |k, mirror| {
            let (one, other) = (spectrum[k], spectrum[mirror]);
            [0.5 * (one.re + other.re), 0.5 * (other.im - one.im)]
        });
        unfold(second, |k, mirror| {
            let (one, other) = (spectrum[k], spectrum[mirror]);
            [0.5 * (one.im + other.im), 0.5 * (one.re - other.re)]
        });
    }

    /// Folds rows: `sin(pi j / N) (f_j + f_(N-j)) + (f_j - f_(N-j)) / 2` with N = n + 1, whose cosine sums are `F_(2k+1) - F_(2k-1)`
    /// and whose sine sums are `F_2k`. The first row is the real part, the second, if there is one, the imaginary part.
    #[inline(always)]
    fn fold(&self, first: &[f64], second: &[f64], spectrum: &mut [Complex<f64>]) {
        spectrum.fill(Complex::default());
        let folded = &mut spectrum[1..];
        for ((value, sine), (one, other)) in
            folded.iter_mut().zip(&self.sines[1..]).zip(first.iter().zip(first.iter().rev()))
        {
            value.re = sine.mul_add(one + other, 0.5 * (one - other));
        }
        for ((value, sine), (one, other)) in
            folded.iter_mut().zip(&self.sines[1..]).zip(second.iter().zip(second.iter().rev()))
        {
            value.im = sine.mul_add(one + other, 0.5 * (one - other));
        }
    }
}

/// Transform of a row from the cosine and sine sums of its folded values at wave number k, whose mirror is `(N - k) mod N`.
fn unfold(row: &mut [f64], sums: impl Fn(usize, usize) -> [f64; 2]) {
    let whole = row.len() + 1;
    let Some(first) = row.first_mut() else { return };
    let mut odd = 0.5 * sums(0, 0)[0];
    *first = odd;
    // In pairs F_2k, F_(2k+1); the last pair is incomplete if the number of values is even.
    for (k, values) in row[1..].chunks_mut(2).enumerate().map(|(k, values)| (k + 1, values)) {
        let [cosine, sine] = sums(k, whole - k);
        odd += cosine;
        values[0] = sine;
        if let Some(value) = values.get_mut(1) {
            *value = odd;
        }
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::math::random::{Key, Purpose};

    use super::*;
    use crate::simulate::field::{gauss_seidel_sweep, relative_residual};

    /// Charges on an arc, as a drawn aurora has them, and a little of a random one everywhere.
    fn charges(size: [usize; 2], spacing: f64) -> Grid2 {
        let mut grid = Grid2::new(size, spacing, [0.0; 2]);
        let key = Key::new(3, "charges");
        for index in 0..size[0] * size[1] {
            let (x, z) = ((index % size[0]) as f64 / size[0] as f64, (index / size[0]) as f64 / size[1] as f64);
            let near = (z - 0.4 - 0.3 * x * (1.0 - x)).abs() < 0.03 && (0.2..0.8).contains(&x);
            let noise = f64::from(key.uniforms(index as u64, 0, Purpose(0))[0]);
            grid.values_mut()[index] = 0.01 * noise + if near { 5.0 } else { 0.0 };
        }
        grid
    }

    #[test]
    fn the_equation_holds_to_rounding() {
        let mut largest = 0.0_f64;
        for size in [[255, 255], [256, 256], [256, 100], [31, 64], [1, 1], [2, 7], [7, 1], [130, 33]] {
            for screening in [0.0, 2.5] {
                let source = charges(size, 0.3);
                let mut potential = source.clone();
                PoissonSolver::new(size, 0.3, screening).solve(&mut potential);
                largest = largest.max(relative_residual(&potential, &source, screening));
            }
        }
        bansho_base::assert_measured!("equation (2.4) & equation (2.5): residual", largest, 0.0, 1e-10);
    }

    #[test]
    fn a_uniform_source_is_no_exception() {
        let mut source = Grid2::new([256, 256], 1.0, [0.0; 2]);
        source.values_mut().fill(1.0);
        let mut potential = source.clone();
        PoissonSolver::new([256, 256], 1.0, 0.0).solve(&mut potential);
        assert!(relative_residual(&potential, &source, 0.0) < 1e-10);
        assert!(potential.values().iter().all(|value| *value < 0.0));
    }

    /// `sin(pi a (i + 1) / (n + 1)) sin(pi b (j + 1) / (m + 1))` is an eigenvector of the five-point equation.
    #[test]
    fn an_eigenvector_is_divided_by_its_eigenvalue() {
        let (size, spacing, screening) = ([20, 33], 0.5, 0.7);
        let wave =
            |count: usize, number: f64, cell: usize| math::sin(PI * number * (cell + 1) as f64 / (count + 1) as f64);
        let half = |count: usize, number: f64| math::sin(0.5 * PI * number / (count + 1) as f64);
        let eigenvalue = -4.0 / 0.25 * (half(20, 3.0) * half(20, 3.0) + half(33, 5.0) * half(33, 5.0)) - screening;
        let mut grid = Grid2::new(size, spacing, [0.0; 2]);
        for index in 0..size[0] * size[1] {
            grid.values_mut()[index] = wave(20, 3.0, index % 20) * wave(33, 5.0, index / 20);
        }
        let source = grid.clone();
        PoissonSolver::new(size, spacing, screening).solve(&mut grid);
        for (value, source) in grid.values().iter().zip(source.values()) {
            assert!((value - source / eigenvalue).abs() < 1e-13);
        }
    }

    #[test]
    fn converged_relaxation_agrees() {
        for screening in [0.0, 0.5] {
            let source = charges([48, 40], 0.3);
            let (mut relaxed, mut solved) = (Grid2::new([48, 40], 0.3, [0.0; 2]), source.clone());
            let sweeps =
                (0..20_000).take_while(|_| gauss_seidel_sweep(&mut relaxed, &source, screening) > 1e-12).count();
            assert!(sweeps < 20_000, "not converged");
            PoissonSolver::new([48, 40], 0.3, screening).solve(&mut solved);
            let greatest = solved.values().iter().fold(0.0, |a: f64, b| a.max(b.abs()));
            for (relaxed, solved) in relaxed.values().iter().zip(solved.values()) {
                assert!((relaxed - solved).abs() < 1e-6 * greatest, "{relaxed} {solved}");
            }
        }
    }

    /// By hand: one cell has `-4 phi / h^2 = source`.
    #[test]
    fn one_cell_is_a_quarter() {
        let mut grid = Grid2::new([1, 1], 0.5, [0.0; 2]);
        grid.values_mut()[0] = 8.0;
        PoissonSolver::new([1, 1], 0.5, 0.0).solve(&mut grid);
        assert!((grid.values()[0] + 0.5).abs() < 1e-15);
    }

    #[test]
    fn screening_shortens_the_reach() {
        let mut source = Grid2::new([63, 63], 1.0, [0.0; 2]);
        source.values_mut()[31 * 63 + 31] = 1.0;
        let reach = |screening: f64| {
            let mut potential = source.clone();
            PoissonSolver::new([63, 63], 1.0, screening).solve(&mut potential);
            potential.at(41, 31) / potential.at(32, 31)
        };
        // Ten cells out, nine of them at a screening length of 3: about exp(-9 / 3) and a little more for the plane.
        let (far, near) = (reach(0.0), reach(1.0 / 9.0));
        assert!(far > 0.3 && near < 0.05 && near > 0.005, "{far} {near}");
    }

    #[test]
    fn threads_change_no_bit() {
        let source = charges([256, 255], 1.0);
        let solve = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let mut potential = source.clone();
            pool.install(|| PoissonSolver::new([256, 255], 1.0, 0.01).solve(&mut potential));
            potential
        };
        let one = solve(1);
        assert!((2..=3).all(|threads| solve(threads) == one));
    }

    #[test]
    fn the_transform_is_its_sum() {
        for length in [1, 2, 3, 8, 16, 31, 100] {
            let transform = SineTransform::new(length);
            let given: Vec<f64> = (0..2 * length).map(|j| ((j * j * 37) % 11) as f64 - 4.0).collect();
            let mut rows = given.clone();
            transform.apply(&mut rows, &mut transform.scratch());
            let mut alone = given[..length].to_vec();
            transform.apply(&mut alone, &mut transform.scratch());
            for (index, value) in rows.iter().enumerate() {
                let (row, k) = (&given[index / length * length..][..length], index % length + 1);
                let term = |j: usize| row[j - 1] * math::sin(PI * (j * k) as f64 / (length + 1) as f64);
                let sum: f64 = (1..=length).map(term).sum();
                assert!((value - sum).abs() < 1e-10, "{length} {index}: {value} {sum}");
                assert!(index >= length || (alone[index] - sum).abs() < 1e-10);
            }
        }
    }
}
