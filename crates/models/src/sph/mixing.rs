//! Mixing: what particles carry drifts toward what their neighbours carry, and its total is kept.

use rayon::prelude::*;

use super::{
    cells::{AT_ONCE, Cells},
    kernel::{CubicSpline, KernelShape, Poly6, SmoothingKernel, Spiky},
    particles::Particles,
    sum::{Pair, PairTerm},
};
use crate::lanes::Real;

/// `w_j W` and `w_j (f_j - f_i) W`.
struct MixingTerm<K>(K);

impl<K: SmoothingKernel<D>, const D: usize, const N: usize> PairTerm<D, N, N> for MixingTerm<K> {
    const DIRECTED: bool = false;

    #[inline(always)]
    fn add<R: Real>(&self, pair: &Pair<R, D>, own: &[R; N], other: &[R; N], sums: &mut [R; N]) {
        let weight = other[0] * self.0.value(pair.distance_squared);
        sums[0] = sums[0] + weight;
        for k in 1..N {
            sums[k] = weight.fused(other[k] - own[k], sums[k]);
        }
    }
}

/// Sums `sum_j w_j (f_j - f_i) W` of all fields but the first, which is the weight w and of which the sum is `sum_j w_j W`.
///
/// With [`mixing_weights`] for w, adding a share of `1 / sqrt(rho_i)` of the sum to each `f_i` keeps `sum m f`.
///
/// # Panics
/// If a field does not hold one value a particle.
pub fn mix<const D: usize, const N: usize>(
    cells: &Cells<D>,
    kernel: KernelShape,
    fields: [&[f32]; N],
    results: [&mut Vec<f32>; N],
) {
    let support = cells.support_radius();
    match kernel {
        KernelShape::Poly6 => cells.sum(&MixingTerm(Poly6::<D>::new(support)), fields, results),
        KernelShape::Spiky => cells.sum(&MixingTerm(Spiky::<D>::new(support)), fields, results),
        KernelShape::CubicSpline => cells.sum(&MixingTerm(CubicSpline::<D>::new(support)), fields, results),
    }
}

/// Weights `m / sqrt(rho)`: for a pair they make the geometric mean of both densities.
pub fn mixing_weights(masses: &[f32], densities: &[f32], weights: &mut Vec<f32>) {
    let weight = |(mass, density): (&f32, &f32)| mass / density.sqrt();
    masses.par_iter().zip(densities).with_min_len(AT_ONCE).map(weight).collect_into_vec(weights);
}

/// Velocities that drift toward the neighbours' (XSPH, Monaghan 1989), with the geometric in place of the arithmetic mean of
/// densities; buffers are kept from step to step.
#[derive(Clone, Debug, Default)]
pub struct VelocitySmoothing {
    weights: Vec<f32>,
    sums: [Vec<f32>; 4],
}

impl VelocitySmoothing {
    /// Moves every velocity by `share` (epsilon, 0 to 1) toward the mean of its neighbours': a viscosity that keeps momentum.
    ///
    /// # Panics
    /// If `densities` are not one a particle, or `cells` are of other particles.
    pub fn apply<const D: usize>(
        &mut self,
        cells: &Cells<D>,
        kernel: KernelShape,
        densities: &[f32],
        share: f32,
        particles: &mut Particles<D>,
    ) {
        mixing_weights(&particles.masses, densities, &mut self.weights);
        // In the plane the last of the four is the weights once more, and its sum is not used.
        let component = |k: usize| if k > 0 && k <= D { &particles.velocities[k - 1] } else { &self.weights };
        let fields = std::array::from_fn(|k| component(k).as_slice());
        mix(cells, kernel, fields, self.sums.each_mut());
        for c in 0..D {
            let changes = self.sums[c + 1].iter().zip(densities);
            particles.velocities[c].iter_mut().zip(changes).for_each(|(velocity, (sum, density))| {
                *velocity = (share / density.sqrt()).mul_add(*sum, *velocity);
            });
        }
    }
}
