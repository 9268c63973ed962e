//! Density, equation of state, pressure force, mixing weights and the length of a time step.

use crate::{
    cells::Cells,
    kernel::{KernelShape, SmoothingKernel, with_kernel},
    neighbor_sums::{Pair, PairTerm},
    sorting::MIN_PARTICLES_PER_TASK,
};
use bansho_base::{host::parallel::prelude::*, math::simd::Real};

/// Term `m_j W(|x_i - x_j|)` of the density sum.
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
/// If there is not one mass per particle.
pub fn compute_densities<const D: usize>(
    cells: &Cells<D>,
    kernel: KernelShape,
    masses: &[f32],
    densities: &mut Vec<f32>,
) {
    with_kernel!(kernel, cells.support_radius(), D, |kernel| cells.sum(&DensityTerm(kernel), [masses], [densities]));
}

/// Equation of state `p = k (rho - rho_0)`: Inagaki et al. (11), the aurora thesis (2.13).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StateEquation {
    /// Rest density rho_0.
    pub rest_density: f32,
    /// Whether pressure is negative below the rest density, as in the papers. Otherwise it is clamped at 0.
    pub negative_pressure: bool,
}

impl StateEquation {
    /// Pressure at a density. `stiffness` is k, which grows with temperature.
    #[must_use]
    #[inline]
    pub fn pressure(&self, stiffness: f32, density: f32) -> f32 {
        let pressure = stiffness * (density - self.rest_density);
        if self.negative_pressure { pressure } else { pressure.max(0.0) }
    }
}

/// Term `(p_i + p_j) m_j / rho_j grad W` of the pressure force: Inagaki et al. (12) with (8), without the factor `-1 / (2 rho_i)`.
struct PressureTerm<K>(K);

impl<K: SmoothingKernel<D>, const D: usize> PairTerm<D, 2, D> for PressureTerm<K> {
    const DIRECTED: bool = true;

    /// Without pressure: most gas that is as thin as at rest or thinner, unless negative pressure is allowed.
    #[inline(always)]
    fn is_inert([pressure, _volume]: &[f32; 2]) -> bool {
        *pressure == 0.0
    }

    #[inline(always)]
    fn add<R: Real>(&self, pair: &Pair<R, D>, own: &[R; 2], other: &[R; 2], sums: &mut [R; D]) {
        let factor = (own[0] + other[0]) * other[1] * self.0.gradient_factor(pair.distance_squared);
        for c in 0..D {
            sums[c] = pair.offset[c].fma(factor, sums[c]);
        }
    }
}

/// Computes accelerations by pressure from masses, densities and pressures in sorted order. Buffers are reused.
#[derive(Clone, Debug)]
pub struct PressureForce {
    /// Kernel whose gradient gives the force. A kernel with a cusp at its center (spiky) keeps particles apart.
    pub kernel: KernelShape,
    /// `m / rho`.
    volume: Vec<f32>,
}

impl PressureForce {
    /// The pressure force with that kernel.
    #[must_use]
    pub fn new(kernel: KernelShape) -> Self {
        Self { kernel, volume: Vec::new() }
    }

    /// Accelerations `a_i = -sum_j m_j (p_i + p_j) / (2 rho_i rho_j) grad W`.
    ///
    /// Each pair is computed from both sides with the same operations on the same numbers, so momentum is conserved to rounding.
    ///
    /// # Panics
    /// If there is not one mass, density and pressure per particle.
    pub fn compute_accelerations<const D: usize>(
        &mut self,
        cells: &Cells<D>,
        masses: &[f32],
        densities: &[f32],
        pressures: &[f32],
        accelerations: &mut [Vec<f32>; D],
    ) {
        assert!(masses.len() == densities.len() && densities.len() == pressures.len(), "one value per particle");
        masses
            .par_iter()
            .zip(densities)
            .with_min_len(MIN_PARTICLES_PER_TASK)
            .map(|(mass, density)| mass / density)
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

/// XSPH weights `w = m / sqrt(rho)` (Monaghan 1989, with the geometric in place of the arithmetic mean of both densities).
///
/// Adding `c / sqrt(rho_i)` times `sum_j w_j (f_j - f_i) W` to each `f_i` smooths a field and conserves `sum m f`.
///
/// # Panics
/// If there is not one mass and density per particle.
pub fn mixing_weights(masses: &[f32], densities: &[f32], weights: &mut Vec<f32>) {
    assert_eq!(masses.len(), densities.len(), "one mass and density per particle");
    masses
        .par_iter()
        .zip(densities)
        .with_min_len(MIN_PARTICLES_PER_TASK)
        .map(|(mass, density)| mass / density.sqrt())
        .collect_into_vec(weights);
}

/// Courant number, relative to the time in which sound and the fastest particle cross half the support radius.
const COURANT_NUMBER: f32 = 0.4;

/// Longest stable time step, s (Courant, Friedrichs and Lewy 1928; Monaghan 1992).
///
/// The speed of sound of `p = k (rho - rho_0)` is `sqrt(k)`; `stiffness` is the largest k. `max_speed` is relative to the
/// neighboring gas.
#[must_use]
pub fn max_stable_step(support_radius: f32, stiffness: f32, max_speed: f32) -> f32 {
    COURANT_NUMBER * 0.5 * support_radius / (stiffness.max(0.0).sqrt() + max_speed)
}

/// Number of equal sub-steps of `seconds` such that none is longer than `max_step`; at least 1, at most `limit`.
#[must_use]
pub fn substep_count(seconds: f32, max_step: f32, limit: u32) -> u32 {
    let steps = (seconds / max_step).ceil();
    // NaN fails this comparison and gives the limit.
    if steps < limit as f32 { (steps as u32).max(1) } else { limit.max(1) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_shrink_with_sound_and_speed() {
        // Half of 0.2 m at 3 + 2 m/s: 0.4 * 0.1 / 5.
        assert!((max_stable_step(0.2, 9.0, 2.0) - 0.008).abs() < 1e-9);
        assert_eq!(max_stable_step(0.2, 0.0, 0.0), f32::INFINITY);
    }

    #[test]
    fn parts_are_as_few_as_allowed() {
        assert_eq!(substep_count(0.01, 0.004, 10), 3);
        assert_eq!(substep_count(0.01, f32::INFINITY, 10), 1);
        assert_eq!(substep_count(0.01, 1e-9, 10), 10);
        assert_eq!(substep_count(0.01, f32::NAN, 10), 10);
    }
}
