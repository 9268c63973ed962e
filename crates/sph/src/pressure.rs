//! Accelerations by pressure.

use rayon::prelude::*;

use bansho_base::math::simd::Real;

use super::{
    cells::Cells,
    kernel::{KernelShape, SmoothingKernel, with_kernel},
    neighbor_sums::{Pair, PairTerm},
    sorting::MIN_PARTICLES_PER_TASK,
};

/// `(p_i + p_j) m_j / rho_j` times the gradient of W: Inagaki et al. (12) with (8), but for a factor of i's own.
struct PressureTerm<K>(K);

impl<K: SmoothingKernel<D>, const D: usize> PairTerm<D, 2, D> for PressureTerm<K> {
    const DIRECTED: bool = true;

    #[inline(always)]
    fn add<R: Real>(&self, pair: &Pair<R, D>, own: &[R; 2], other: &[R; 2], sums: &mut [R; D]) {
        let pull = (own[0] + other[0]) * other[1] * self.0.gradient_factor(pair.distance_squared);
        for c in 0..D {
            sums[c] = pair.offset[c].fma(pull, sums[c]);
        }
    }
}

/// Accelerations by pressure, from masses, densities and pressures in sorted order; buffers are kept from step to step.
#[derive(Clone, Debug)]
pub struct PressureForce {
    /// Kernel whose gradient pushes; one that is pointed at the centre keeps particles apart.
    pub kernel: KernelShape,
    /// `m / rho`.
    volume: Vec<f32>,
}

impl PressureForce {
    /// The force by that kernel.
    #[must_use]
    pub fn new(kernel: KernelShape) -> Self {
        Self { kernel, volume: Vec::new() }
    }

    /// Accelerations `a_i = -sum_j m_j (p_i + p_j) / (2 rho_i rho_j) grad W`.
    ///
    /// Each pair is computed from both sides with the same operations on the same numbers, so that momentum is kept to rounding.
    ///
    /// # Panics
    /// If there is not one mass, density and pressure a particle.
    pub fn compute_accelerations<const D: usize>(
        &mut self,
        cells: &Cells<D>,
        masses: &[f32],
        densities: &[f32],
        pressures: &[f32],
        accelerations: &mut [Vec<f32>; D],
    ) {
        assert!(masses.len() == densities.len() && densities.len() == pressures.len(), "one value a particle");
        let volume = |(mass, density): (&f32, &f32)| mass / density;
        masses
            .par_iter()
            .zip(densities)
            .with_min_len(MIN_PARTICLES_PER_TASK)
            .map(volume)
            .collect_into_vec(&mut self.volume);
        let fields = [pressures, self.volume.as_slice()];
        let results = accelerations.each_mut();
        with_kernel!(self.kernel, cells.support_radius(), D, |kernel| {
            cells.sum(&PressureTerm(kernel), fields, results);
        });
        for component in accelerations {
            component.par_iter_mut().zip(densities).with_min_len(MIN_PARTICLES_PER_TASK).for_each(
                |(value, density)| {
                    *value *= -0.5 / density;
                },
            );
        }
    }
}
