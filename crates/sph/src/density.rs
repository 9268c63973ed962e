//! Density, and pressure from it.

use bansho_base::math::simd::Real;

use super::{
    cells::Cells,
    kernel::{KernelShape, SmoothingKernel, with_kernel},
    neighbor_sums::{Pair, PairTerm},
};

/// `m_j W(|x_i - x_j|)`.
struct DensityTerm<K>(K);

impl<K: SmoothingKernel<D>, const D: usize> PairTerm<D, 1, 1> for DensityTerm<K> {
    const DIRECTED: bool = false;

    #[inline(always)]
    fn add<R: Real>(&self, pair: &Pair<R, D>, _own: &[R; 1], other: &[R; 1], sums: &mut [R; 1]) {
        sums[0] = self.0.value(pair.distance_squared).fma(other[0], sums[0]);
    }
}

/// Densities `rho_i = sum_j m_j W(|x_i - x_j|)`, the particle itself included: Inagaki et al. (3), the aurora thesis (2.11).
///
/// # Panics
/// If `masses` are not one a particle.
pub fn compute_densities<const D: usize>(
    cells: &Cells<D>,
    kernel: KernelShape,
    masses: &[f32],
    densities: &mut Vec<f32>,
) {
    with_kernel!(kernel, cells.support_radius(), D, |kernel| cells.sum(&DensityTerm(kernel), [masses], [densities]))
}

/// How pressure follows from density: `p = k (rho - rho_0)`, Inagaki et al. (11), the aurora thesis (2.13).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StateEquation {
    /// Rest density rho_0.
    pub rest_density: f32,
    /// Whether gas thinner than at rest pulls together, as in the papers; if not, its pressure is 0.
    pub negative_pressure: bool,
}

impl StateEquation {
    /// Pressure at a density; `stiffness` is k, which grows with temperature.
    #[must_use]
    #[inline]
    pub fn pressure(&self, stiffness: f32, density: f32) -> f32 {
        let pressure = stiffness * (density - self.rest_density);
        if self.negative_pressure { pressure } else { pressure.max(0.0) }
    }
}
