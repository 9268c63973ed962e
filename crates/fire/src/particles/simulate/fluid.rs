//! The gas as a fluid: its order in space, its density, and the pressure that drives it apart.

use rayon::prelude::*;

use super::{derived::Design, neighbor_sums::Beside, particle_lanes::PARTICLES_OF_TASK, particles::Particles};
use crate::particles::parameters::{FluidParameters, Tension};
use bansho_sph::{Cells, KernelShape, PressureForce, StateEquation, densities, longest_step, sub_steps};

/// Speed of gas against the gas beside it, as a share of its speed.
const RELATIVE_SPEED: f32 = 0.15;

/// What sums over neighbours are made with, and what they find.
#[derive(Clone, Debug)]
pub(crate) struct Fluid {
    state: StateEquation,
    stiffness_per_kelvin: f32,
    most_sub_steps: u32,
    cells: Cells<3>,
    force: PressureForce,
    pressure: Vec<f32>,
    /// Accelerations by pressure, m/s^2.
    pub(crate) acceleration: [Vec<f32>; 3],
    pub(crate) beside: Beside,
    /// How much of each particle lies at the edge of the gas, as of this step's beginning.
    pub(crate) to_air: Vec<f32>,
}

impl Fluid {
    pub(crate) fn new(fluid: &FluidParameters, design: &Design) -> Self {
        let tension = fluid.tension == Tension::Unclamped;
        Self {
            state: StateEquation { rest_density: design.rest_density, tension },
            stiffness_per_kelvin: design.stiffness_per_kelvin,
            most_sub_steps: fluid.sub_steps as u32,
            cells: Cells::new(design.support_radius),
            force: PressureForce::new(fluid.force_kernel),
            pressure: Vec::new(),
            acceleration: Default::default(),
            beside: Beside::default(),
            to_air: Vec::new(),
        }
    }

    /// The support radius d, m.
    pub(crate) fn support_radius(&self) -> f32 {
        self.cells.support_radius()
    }

    /// Sub-steps by the condition of Courant, Friedrichs and Lewy, for gas that moves with the gas beside it.
    ///
    /// Gas that would need more than are allowed keeps its time and loses stiffness: `press` holds k where sound goes no further than a
    /// fifth of d in a sub-step, and the motion holds every force there.
    ///
    /// No acceleration shortens them: buoyancy and wind move neighbours alike, pressure's is bounded by the sound that counts here, and
    /// the motion holds what is left. The forces of the last step would also have to be part of every snapshot.
    pub(crate) fn sub_steps(&self, particles: &Particles, seconds: f32) -> u32 {
        let [u, v, w] = &particles.velocity;
        let square = |index: usize| u[index] * u[index] + v[index] * v[index] + w[index] * w[index];
        let greatest = |values: &(dyn Fn(usize) -> f32 + Sync)| {
            let parts = (0..u.len()).into_par_iter().step_by(PARTICLES_OF_TASK);
            let of_part =
                |first: usize| (first..(first + PARTICLES_OF_TASK).min(u.len())).map(values).fold(0.0, f32::max);
            parts.map(of_part).reduce(|| 0.0, f32::max)
        };
        let speed = greatest(&square).sqrt();
        let hottest = greatest(&|index| particles.temperature[index]);
        let longest = longest_step(self.support_radius(), self.stiffness_per_kelvin * hottest, RELATIVE_SPEED * speed);
        sub_steps(seconds, longest, self.most_sub_steps)
    }

    /// Sorts the particles, and finds their density (3), pressure (11) and its force (12) for a sub-step of `seconds`, with k held where
    /// sound does not outrun it.
    pub(crate) fn press(&mut self, particles: &mut Particles, seconds: f32) {
        self.to_air.resize(particles.len(), 0.0);
        particles.sort(&mut self.cells, &mut self.to_air);
        let Particles { density, temperature, mass, .. } = particles;
        densities(&self.cells, KernelShape::Poly6, mass, density);
        let fastest_sound = 0.2 * self.support_radius() / seconds;
        let (state, per_kelvin, most) = (self.state, self.stiffness_per_kelvin, fastest_sound * fastest_sound);
        let pressure =
            |(density, temperature): (&f32, &f32)| state.pressure((per_kelvin * temperature).min(most), *density);
        density
            .par_iter()
            .zip(&*temperature)
            .with_min_len(PARTICLES_OF_TASK)
            .map(pressure)
            .collect_into_vec(&mut self.pressure);
        self.force.accelerations(&self.cells, mass, density, &self.pressure, &mut self.acceleration);
    }

    /// Lets every particle look around; [`press`](Self::press) has sorted them.
    pub(crate) fn look(&mut self, particles: &Particles) {
        self.beside.look(&self.cells, particles);
    }
}
