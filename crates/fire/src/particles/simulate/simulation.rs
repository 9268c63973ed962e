//! A step of the simulation, section 4.3, and what Bansho adds to it.

use std::sync::Arc;

use bansho_base::{
    math::{Vec3, random::Key},
    phenomenon::surroundings::Surroundings,
};

use super::{
    combustion::Laws, derived::Design, emission::Births, fluid::Fluid, integrate::Motion,
    particle_lanes::PARTICLES_OF_TASK, particles::Particles,
};
use crate::particles::{
    parameters::FlameParticlesParameters,
    simulate::{
        combustion::step::Living,
        forces::{
            external_forces::{Setting, Weather},
            turbulence::Turbulence,
        },
    },
};
use rayon::prelude::*;

/// The gas and what it needs to move.
#[derive(Clone, Debug)]
pub(crate) struct Simulation {
    /// Shared by all runs.
    pub(crate) design: Arc<Design>,
    laws: Laws,
    pub(crate) parameters: FlameParticlesParameters,
    pub(crate) turbulence: Turbulence,
    pub(crate) key: Key,
    pub(crate) particles: Particles,
    fluid: Fluid,
}

impl Simulation {
    pub(crate) fn new(parameters: &FlameParticlesParameters, design: Design, key: Key) -> Self {
        Self {
            laws: Laws::from(&parameters.life),
            turbulence: Turbulence::new(key),
            particles: Particles::new(parameters.position.into()),
            fluid: Fluid::new(&parameters.fluid, &design),
            parameters: parameters.clone(),
            design: Arc::new(design),
            key,
        }
    }

    /// Length of a step, s.
    pub(crate) fn step_s(&self) -> f64 {
        self.parameters.step_s
    }

    /// Steps from `time` to one step later.
    ///
    /// The gas moves in sub-steps. What is slow beside sound takes the whole step at once, at its beginning: evening out, mixing, burning
    /// and cooling, and how the wind and the axes change.
    pub(crate) fn step(&mut self, time: f64, around: &Surroundings) {
        let Self { design, laws, parameters, turbulence, key, particles, fluid } = self;
        let setting = Setting { parameters, design, turbulence, key: *key };
        let mut weather = Weather::new(setting, particles, around, time);
        let whole = parameters.step_s as f32;
        let parts = fluid.sub_steps(particles, whole);
        let (part_s, radius) = (parameters.step_s / f64::from(parts), fluid.support_radius());
        let births = Births { design, turbulence, key: *key, afterlife_s: parameters.life.afterlife_s };
        for part in 0..parts {
            let (t, seconds) = (time + part_s * f64::from(part), part_s as f32);
            fluid.press(particles, seconds);
            if part == 0 {
                fluid.look(particles);
                let evening = [parameters.fluid.viscosity, parameters.fluid.conduction].map(|share| share as f32);
                let (beside, afterlife) = (&fluid.beside, parameters.life.afterlife_s as f32);
                let living = Living { laws, weather: &weather, beside, evening, afterlife, radius, seconds: whole };
                living.pass(particles, &mut fluid.to_air);
            } else {
                weather.pass(t);
            }
            let (acceleration, to_air) = (fluid.acceleration.each_ref().map(Vec::as_slice), &fluid.to_air);
            Motion { weather: &weather, acceleration, to_air, radius, seconds }.advance(particles);
            births.add(particles, t, part_s);
        }
        self.bury();
    }

    /// Removes what has lived its time or left the domain, and whatever is not a number.
    fn bury(&mut self) {
        let [min, max] = self.design.domain.map(|corner| corner.as_vec3());
        let Particles { position, velocity, temperature, age, life, .. } = &self.particles;
        let keep: Vec<bool> = (0..age.len())
            .into_par_iter()
            .with_min_len(PARTICLES_OF_TASK)
            .map(|index| {
                let place = Vec3::from(position.each_ref().map(|values| values[index]));
                let speed = Vec3::from(velocity.each_ref().map(|values| values[index])).length_squared();
                let inside = place.cmpge(min).all() && place.cmple(max).all();
                inside && age[index] < life[index] && speed.is_finite() && temperature[index].is_finite()
            })
            .collect();
        self.particles.retain(&keep);
    }
}
