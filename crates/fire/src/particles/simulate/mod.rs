//! The state of the flame, and its time steps.
//!
//! `derived` has the constants, `burner` and `spawning` the sources of particles, `fluid` density and pressure, `forces` the external forces,
//! `combustion` thermochemistry, `integrate` and `collision` motion, `snapshot` serialization. `particles` is the state. `particle_lanes` and `vectors` are
//! SIMD utilities. `euler` is the paper's own algorithm, which a scene can select.

use std::sync::Arc;

use bansho_base::{
    host::parallel::prelude::*,
    math::{Vec3, random::Key},
    phenomenon::surroundings::Surroundings,
};

use crate::particles::{
    parameters::{FlameParticlesParameters, GasModel},
    simulate::{
        combustion::{CombustionModel, CombustionStep},
        derived::DerivedConstants,
        euler::EulerStep,
        fluid::FluidSolver,
        forces::{
            external_forces::{ExternalForces, StepConstants},
            turbulence::TurbulenceTile,
        },
        integrate::IntegrationStep,
        particle_lanes::PARTICLES_PER_TASK,
        particles::GasParticles,
        spawning::Spawner,
    },
};

pub(crate) mod burner;
pub(crate) mod collision;
pub(crate) mod combustion;
pub(crate) mod derived;
mod euler;
pub(crate) mod fluid;
pub(crate) mod forces;
pub(crate) mod integrate;
pub(crate) mod particle_lanes;
pub mod particles;
pub(crate) mod snapshot;
pub(crate) mod spawning;
pub(crate) mod vectors;

/// What the simulation of a flame depends on and never changes; all of its runs share it.
#[derive(Debug)]
pub(crate) struct SimulationConstants {
    pub(crate) parameters: FlameParticlesParameters,
    pub(crate) derived: DerivedConstants,
    pub(crate) turbulence: TurbulenceTile,
    pub(crate) key: Key,
    combustion: CombustionModel,
}

impl SimulationConstants {
    pub(crate) fn new(parameters: FlameParticlesParameters, derived: DerivedConstants, key: Key) -> Self {
        Self {
            combustion: CombustionModel::from(&parameters.combustion),
            turbulence: TurbulenceTile::new(key),
            parameters,
            derived,
            key,
        }
    }
}

/// The simulation of one flame: particles, and the solver that moves them.
#[derive(Clone, Debug)]
pub(crate) struct Simulation {
    pub(crate) shared: Arc<SimulationConstants>,
    pub(crate) particles: GasParticles,
    solver: FluidSolver,
}

impl Simulation {
    /// The flame before its preroll, without gas.
    pub(crate) fn new(shared: Arc<SimulationConstants>) -> Self {
        Self {
            particles: GasParticles::new(shared.parameters.position.into()),
            solver: FluidSolver::new(&shared.parameters.fluid, &shared.derived),
            shared,
        }
    }

    /// Constants derived from the parameters.
    pub(crate) fn constants(&self) -> &DerivedConstants {
        &self.shared.derived
    }

    /// Length of a step, s.
    pub(crate) fn step_s(&self) -> f64 {
        self.shared.parameters.step_s
    }

    /// Advances from `time` by one step.
    pub(crate) fn step(&mut self, time: f64, surroundings: &Surroundings) {
        match self.shared.parameters.gas_model {
            GasModel::Combustion => self.step_combustion(time, surroundings),
            GasModel::Euler => {
                let SimulationConstants { parameters, derived: constants, key, .. } = &*self.shared;
                EulerStep { parameters, constants, key: *key, surroundings, time }
                    .advance(&mut self.particles, &mut self.solver);
            }
        }
    }

    /// Advances burning gas from `time` by one step.
    ///
    /// Pressure and advection run in sub-steps. Processes that are slow compared with sound run once, at the beginning of the step:
    /// viscosity and conduction, mixing, burning and cooling, and changes of wind and plume axes.
    fn step_combustion(&mut self, time: f64, surroundings: &Surroundings) {
        let Self { shared, particles, solver } = self;
        let SimulationConstants { parameters, derived: constants, turbulence, key, combustion } = &**shared;
        let step = StepConstants { parameters, constants, turbulence, key: *key };
        let mut forces = ExternalForces::new(step, particles, surroundings, time);
        let step_seconds = parameters.step_s as f32;
        let substeps = solver.substep_count(particles, step_seconds);
        let (substep_s, radius) = (parameters.step_s / f64::from(substeps), solver.support_radius());
        let spawner = Spawner {
            constants,
            turbulence,
            key: *key,
            burnt_gas_lifetime_s: parameters.combustion.burnt_gas_lifetime_s,
        };
        for substep in 0..substeps {
            let (t, seconds) = (time + substep_s * f64::from(substep), substep_s as f32);
            solver.compute_pressure_forces(particles, seconds);
            if substep == 0 {
                solver.sum_over_neighbors(particles);
                let (viscosity, conduction) = (parameters.fluid.viscosity as f32, parameters.fluid.conduction as f32);
                let neighbor_sums = &solver.neighbor_sums;
                let combustion_step = CombustionStep {
                    combustion,
                    forces: &forces,
                    neighbor_sums,
                    viscosity,
                    conduction,
                    burnt_gas_lifetime_s: parameters.combustion.burnt_gas_lifetime_s as f32,
                    radius,
                    seconds: step_seconds,
                };
                combustion_step.update_thermochemistry(particles, &mut solver.air_exposure);
            } else {
                forces.advance_rings_and_eddies(t);
            }
            let (acceleration, air_exposure) =
                (solver.acceleration.each_ref().map(Vec::as_slice), &solver.air_exposure);
            IntegrationStep { forces: &forces, acceleration, air_exposure, radius, seconds }.advance(particles);
            spawner.spawn(particles, t, substep_s);
        }
        self.remove_expired();
    }

    /// Removes particles that have reached their maximum age, have left the domain, or are not finite.
    fn remove_expired(&mut self) {
        let [min, max] = self.constants().domain.map(|corner| corner.as_vec3());
        let GasParticles { position, velocity, temperature, age, max_age, .. } = &self.particles;
        let keep: Vec<bool> = (0..age.len())
            .into_par_iter()
            .with_min_len(PARTICLES_PER_TASK)
            .map(|index| {
                let position = Vec3::from(position.each_ref().map(|values| values[index]));
                let speed = Vec3::from(velocity.each_ref().map(|values| values[index])).length_squared();
                let inside = position.cmpge(min).all() && position.cmple(max).all();
                inside && age[index] < max_age[index] && speed.is_finite() && temperature[index].is_finite()
            })
            .collect();
        self.particles.retain(&keep);
    }
}
