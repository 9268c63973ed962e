//! The whole simulation: its physics, determinism, exposures, and the gas of the paper.

mod determinism;
mod euler;
mod exposures;
mod fire;
mod gas;
mod random;

use std::sync::Arc;

use bansho_base::{
    host::assets::MemoryAssets,
    math::{DVec2, DVec3, Vec3, random::Key},
    phenomenon::surroundings::{Occluder, Publication, Surroundings},
    world::{
        air::Air,
        wind::{Wind, WindParameters},
    },
};

use super::{
    parameters::FlameParticlesParameters,
    render::{BufferPool, FadeOut, Gas},
};
use crate::particles::simulate::{Simulation, SimulationConstants, derived::DerivedConstants};

fn simulation(parameters: &FlameParticlesParameters) -> Simulation {
    let constants = DerivedConstants::new(parameters, None, &MemoryAssets::default()).unwrap();
    Simulation::new(Arc::new(SimulationConstants::new(parameters.clone(), constants, Key::new(1, "flame"))))
}

/// What a simulation stands among.
#[derive(Default)]
struct World {
    wind: WindParameters,
    occluders: Vec<Occluder>,
}

impl World {
    /// Steps from the beginning of the preroll to `end`; `each` sees the simulation after every step, and the time then.
    fn run(&self, simulation: &mut Simulation, end: f64, each: impl FnMut(&Simulation, f64)) {
        let first = -(simulation.constants().preroll / simulation.step_s()).round() as i64;
        self.run_steps(simulation, first, (end / simulation.step_s()).round() as i64, each);
    }

    fn run_steps(&self, simulation: &mut Simulation, first: i64, last: i64, mut each: impl FnMut(&Simulation, f64)) {
        let (wind, air) = (Wind::new(self.wind.clone(), 1, None), Air::default());
        let others = Publication { occluders: self.occluders.clone(), ..Publication::default() };
        let around = Surroundings { air: &air, others, ..Surroundings::from_wind(&wind) };
        let seconds = simulation.step_s();
        for step in first..last {
            simulation.step(step as f64 * seconds, &around);
            each(simulation, (step + 1) as f64 * seconds);
        }
    }
}

fn position(simulation: &Simulation, index: usize) -> Vec3 {
    Vec3::from(simulation.particles.positions().map(|values| values[index]))
}

/// Particles that the eye sees: hot enough to glow, with soot to glow with.
fn lit(simulation: &Simulation) -> Vec<usize> {
    let particles = &simulation.particles;
    let shines = |index: &usize| particles.soot_fractions()[*index] > 3e-7 && particles.temperatures()[*index] > 900.0;
    (0..particles.len()).filter(shines).collect()
}

/// The gas as the drawing sees it.
fn gas<'a>(simulation: &'a Simulation, buffers: &'a BufferPool) -> Gas<'a> {
    Gas {
        particles: &simulation.particles,
        time: 0.0,
        air_temperature_k: Air::default().temperature_k,
        detail_speed: 1.0,
        base: DVec3::ZERO,
        size: DVec2::ONE,
        key: Key::new(1, "flame"),
        fade_out: FadeOut::NEVER,
        buffers,
    }
}
