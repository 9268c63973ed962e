//! Physics of the whole simulation.

use bansho_base::{
    air::Air,
    assets::MemoryAssets,
    random::Key,
    surroundings::{Publication, Surroundings},
    wind::{Wind, WindParameters},
};

use super::{design::Design, parameters::FlameParticlesParameters, simulation::Simulation};

mod fire;

/// A simulation of `parameters`.
pub(super) fn simulation(parameters: &FlameParticlesParameters, seed: u64) -> Simulation {
    let design = Design::new(parameters, &MemoryAssets::default()).unwrap();
    Simulation::new(parameters, design, Key::new(seed, "flame"))
}

/// Runs from the preroll to `end`; `each` sees the simulation after every step at the step's end.
pub(super) fn run(simulation: &mut Simulation, wind: WindParameters, end: f64, mut each: impl FnMut(&Simulation, f64)) {
    let wind = Wind::new(wind, 1, None);
    let air = Air::default();
    let around = Surroundings { wind: &wind, air: &air, others: Publication::default() };
    let seconds = simulation.step_s();
    let first = -(simulation.design.preroll / seconds).round() as i64;
    for step in first.. {
        let time = step as f64 * seconds;
        if time >= end {
            return;
        }
        simulation.step(time, seconds, &around);
        each(simulation, time + seconds);
    }
}
