//! What a particle learns of its neighbours in one sum: how they move, how hot they are, and on which side they lie.

use bansho_base::math::simd::Real;

use super::particles::Particles;
use bansho_sph::{Cells, Pair, PairTerm, Poly6, SmoothingKernel, mixing_weights};

/// `w_j W` times 1, the differences of velocity and temperature, and the offset to the neighbour.
///
/// Weights `m / sqrt(rho)` make it even from both sides, so that evening out keeps momentum and heat.
struct NeighborSumsTerm(Poly6<3>);

impl PairTerm<3, 5, 8> for NeighborSumsTerm {
    const DIRECTED: bool = false;

    #[inline(always)]
    fn add<R: Real>(&self, pair: &Pair<R, 3>, own: &[R; 5], other: &[R; 5], sums: &mut [R; 8]) {
        let weight = other[0] * self.0.value(pair.distance_squared);
        sums[0] = sums[0] + weight;
        for k in 1..5 {
            sums[k] = weight.fma(other[k] - own[k], sums[k]);
        }
        for axis in 0..3 {
            sums[5 + axis] = weight.fma(weight.broadcast(0.0) - pair.offset[axis], sums[5 + axis]);
        }
    }
}

/// What the sum says of one particle, or of several in the lanes of a vector.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Neighborhood<R> {
    /// Sum of weights, the particle's own included.
    pub(crate) weight: R,
    /// Differences of the neighbours' velocities.
    pub(crate) velocity: [R; 3],
    /// Differences of their temperatures.
    pub(crate) temperature: R,
    /// Ways to them.
    pub(crate) offset: [R; 3],
}

impl<R> From<[R; 8]> for Neighborhood<R> {
    #[inline(always)]
    fn from([weight, u, v, w, temperature, x, y, z]: [R; 8]) -> Self {
        Self { weight, velocity: [u, v, w], temperature, offset: [x, y, z] }
    }
}

/// Sums over the neighbours of every particle, in sorted order.
#[derive(Clone, Debug, Default)]
pub(crate) struct NeighborSums {
    /// `m / sqrt(rho)`.
    pub(crate) weights: Vec<f32>,
    /// The numbers of each particle's [`Neighborhood`].
    pub(crate) sums: [Vec<f32>; 8],
}

impl NeighborSums {
    pub(crate) fn compute(&mut self, cells: &Cells<3>, particles: &Particles) {
        let Particles { mass, density, temperature, velocity: [u, v, w], .. } = particles;
        mixing_weights(mass, density, &mut self.weights);
        let fields = [&self.weights, u, v, w, temperature].map(Vec::as_slice);
        cells.sum(&NeighborSumsTerm(Poly6::new(cells.support_radius())), fields, self.sums.each_mut());
    }
}
