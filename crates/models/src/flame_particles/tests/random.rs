//! Whatever valid parameters say, gas stays finite, bounded in speed and in number.

use std::time::{Duration, Instant};

use bansho_base::parameters::{Parameters, Reader, sample};

use super::*;
use crate::flame_particles::simulation::GREATEST_SPEED;

/// Parameter sets with `BANSHO_RANDOM_FLAMES` set; as many as fit in [`BUDGET`] without.
fn count() -> Option<u64> {
    std::env::var("BANSHO_RANDOM_FLAMES").ok()?.parse().ok()
}

const BUDGET: Duration = Duration::from_secs(3);
const STEPS: i64 = 300;

fn uniforms(seed: u64) -> impl FnMut() -> f64 {
    let (key, mut drawn) = (Key::new(seed, "random flames"), 0);
    move || {
        drawn += 1;
        f64::from(key.uniforms(drawn, 0, bansho_base::random::Purpose(0))[0])
    }
}

/// Parameters and wind that a scene could say, few enough particles to be quick.
fn draw(seed: u64) -> Option<(FlameParticlesParameters, WindParameters)> {
    let mut uniform = uniforms(seed);
    let mut reader = Reader::new();
    let table = sample(FlameParticlesParameters::table(), &mut uniform);
    let mut parameters = FlameParticlesParameters::read_table(&table, &mut reader, &[]);
    let wind = sample(WindParameters::table(), &mut uniform);
    let wind = WindParameters::read_table(&wind, &mut reader, &[]);
    assert!(reader.problems().is_empty(), "{:?}", reader.problems());
    parameters.particles = 1 + (uniform() * 250.0) as i64;
    Design::new(&parameters, None, &MemoryAssets::default()).ok().map(|_| (parameters, wind))
}

fn check(seed: u64, simulation: &Simulation) {
    let particles = &simulation.particles;
    assert!(particles.len() <= simulation.design.most, "seed {seed}: {} particles", particles.len());
    for values in particles.numbers() {
        assert!(values.iter().all(|value| value.is_finite()), "seed {seed}: not a number");
    }
    for index in 0..particles.len() {
        let speed = Vec3::from(particles.velocities().map(|values| values[index])).length();
        assert!(speed <= 1.001 * GREATEST_SPEED, "seed {seed}: {speed} m/s");
    }
}

#[test]
fn no_valid_flame_blows_up() {
    let (count, start, mut flames) = (count(), Instant::now(), 0);
    for seed in 0.. {
        if count.map_or(start.elapsed() > BUDGET, |count| flames >= count) {
            break;
        }
        let Some((parameters, wind)) = draw(seed) else { continue };
        let mut simulation = simulation(&parameters);
        let world = World { wind, ..World::default() };
        let first = -(simulation.design.preroll / simulation.step_s()).round().min(200.0) as i64;
        world.run_steps(&mut simulation, first, first + STEPS, |simulation, _| check(seed, simulation));
        flames += 1;
    }
    assert!(flames >= 1, "no parameter set in {BUDGET:?}");
}
