//! The gas as a fluid: density, pressure force, and sums over neighbors.

use bansho_base::{host::parallel::prelude::*, math::simd::Real};
use bansho_sph::{
    Cells, KernelShape, Pair, PairTerm, Poly6, PressureForce, SmoothingKernel, StateEquation, compute_densities,
    max_stable_step, mixing_weights, substep_count,
};

use super::{derived::DerivedConstants, particle_lanes::PARTICLES_PER_TASK, particles::GasParticles};
use crate::particles::parameters::{FluidParameters, NegativePressure};

/// Speed of gas relative to its neighbors, as a fraction of its speed.
const RELATIVE_SPEED: f32 = 0.15;

/// SPH solver: neighbor search, density, equation of state, pressure force and neighbor sums, with their buffers.
#[derive(Clone, Debug)]
pub(crate) struct FluidSolver {
    equation_of_state: StateEquation,
    stiffness_per_kelvin: f32,
    max_substeps: u32,
    cells: Cells<3>,
    force: PressureForce,
    pressure: Vec<f32>,
    /// Accelerations by pressure, m/s^2.
    pub(crate) acceleration: [Vec<f32>; 3],
    pub(crate) neighbor_sums: NeighborSums,
    /// Exposure of each particle to air at the beginning of this step, 0 to 1.
    pub(crate) air_exposure: Vec<f32>,
}

impl FluidSolver {
    pub(crate) fn new(fluid: &FluidParameters, constants: &DerivedConstants) -> Self {
        let negative_pressure = fluid.negative_pressure == NegativePressure::Allowed;
        Self {
            equation_of_state: StateEquation { rest_density: constants.rest_density, negative_pressure },
            stiffness_per_kelvin: constants.stiffness_per_kelvin,
            max_substeps: fluid.max_substeps as u32,
            cells: Cells::new(constants.support_radius),
            force: PressureForce::new(fluid.pressure_kernel),
            pressure: Vec::new(),
            acceleration: Default::default(),
            neighbor_sums: NeighborSums::default(),
            air_exposure: Vec::new(),
        }
    }

    /// The support radius d, m.
    pub(crate) fn support_radius(&self) -> f32 {
        self.cells.support_radius()
    }

    /// Number of sub-steps by the Courant-Friedrichs-Lewy condition, for gas that moves relative to its neighbors.
    ///
    /// Gas that would need more sub-steps than allowed is made more compressible: `compute_pressure_forces` limits k such that
    /// sound travels at most a fifth of d in a sub-step, and the integration limits every acceleration.
    ///
    /// Accelerations do not enter the condition: buoyancy and wind accelerate neighbors equally, acceleration by pressure is bounded by the speed of sound,
    /// and the integration limits the remaining ones. If they did, forces of the last step would also have to be part of every snapshot.
    pub(crate) fn substep_count(&self, particles: &GasParticles, seconds: f32) -> u32 {
        let [u, v, w] = &particles.velocity;
        let max_speed_squared = max_over_particles(particles.len(), |index| {
            u[index] * u[index] + v[index] * v[index] + w[index] * w[index]
        });
        let speed = max_speed_squared.sqrt();
        let hottest = max_over_particles(particles.len(), |index| particles.temperature[index]);
        let max_step =
            max_stable_step(self.support_radius(), self.stiffness_per_kelvin * hottest, RELATIVE_SPEED * speed);
        substep_count(seconds, max_step, self.max_substeps)
    }

    /// Sorts the particles and computes density (3), pressure (11) and pressure force (12) for a sub-step of `seconds`; k is
    /// limited such that sound stays within a fifth of d.
    pub(crate) fn compute_pressure_forces(&mut self, particles: &mut GasParticles, seconds: f32) {
        self.air_exposure.resize(particles.len(), 0.0);
        particles.sort(&mut self.cells, &mut self.air_exposure);
        let GasParticles { density, temperature, mass, .. } = particles;
        compute_densities(&self.cells, KernelShape::Poly6, mass, density);
        let max_sound_speed = 0.2 * self.support_radius() / seconds;
        let (equation_of_state, per_kelvin, max_stiffness) =
            (self.equation_of_state, self.stiffness_per_kelvin, max_sound_speed * max_sound_speed);
        density
            .par_iter()
            .zip(&*temperature)
            .with_min_len(PARTICLES_PER_TASK)
            .map(|(density, temperature)| {
                equation_of_state.pressure((per_kelvin * temperature).min(max_stiffness), *density)
            })
            .collect_into_vec(&mut self.pressure);
        self.force.compute_accelerations(&self.cells, mass, density, &self.pressure, &mut self.acceleration);
    }

    /// Sums over the neighbors of every particle, which [`compute_pressure_forces`](Self::compute_pressure_forces) has sorted.
    pub(crate) fn sum_over_neighbors(&mut self, particles: &GasParticles) {
        self.neighbor_sums.compute(&self.cells, particles);
    }
}

/// The maximum of `value` over particles of the indices below `count`, at least 0. It is the same for any order of the tasks.
fn max_over_particles(count: usize, value: impl Fn(usize) -> f32 + Sync) -> f32 {
    let tasks = (0..count).into_par_iter().step_by(PARTICLES_PER_TASK);
    let max_of_tasks = tasks.map(|first| {
        let mut max = 0.0_f32;
        for index in first..(first + PARTICLES_PER_TASK).min(count) {
            max = max.max(value(index));
        }
        max
    });
    max_of_tasks.reduce_with(f32::max).unwrap_or(0.0)
}

/// `w_j W` times 1, the differences of velocity and temperature, and the offset to the neighbor.
///
/// The weights `m / sqrt(rho)` are symmetric for each pair, so that smoothing conserves momentum and heat.
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

/// Neighbor sums of one particle, or of several in SIMD lanes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Neighborhood<R> {
    /// Sum of weights, the particle's own included.
    pub(crate) weight: R,
    /// Weighted differences of the neighbors' velocities.
    pub(crate) velocity: [R; 3],
    /// Weighted differences of the neighbors' temperatures.
    pub(crate) temperature: R,
    /// Weighted offsets to the neighbors.
    pub(crate) offset: [R; 3],
}

impl<R> From<[R; 8]> for Neighborhood<R> {
    #[inline(always)]
    fn from([weight, u, v, w, temperature, x, y, z]: [R; 8]) -> Self {
        Self { weight, velocity: [u, v, w], temperature, offset: [x, y, z] }
    }
}

/// Sums over the neighbors of every particle, in sorted order.
#[derive(Clone, Debug, Default)]
pub(crate) struct NeighborSums {
    /// `m / sqrt(rho)`.
    pub(crate) weights: Vec<f32>,
    /// The components of each particle's [`Neighborhood`].
    pub(crate) sums: [Vec<f32>; 8],
}

impl NeighborSums {
    pub(crate) fn compute(&mut self, cells: &Cells<3>, particles: &GasParticles) {
        let GasParticles { mass, density, temperature, velocity: [u, v, w], .. } = particles;
        mixing_weights(mass, density, &mut self.weights);
        let fields = [&self.weights, u, v, w, temperature].map(Vec::as_slice);
        cells.sum(&NeighborSumsTerm(Poly6::new(cells.support_radius())), fields, self.sums.each_mut());
    }
}
