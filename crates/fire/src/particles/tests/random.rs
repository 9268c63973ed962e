//! Whatever valid parameters say, gas stays finite, bounded in speed and in number.

use bansho_base::{
    math::DQuat,
    parameters::{Parameters, Reader, sample},
    world::gravity::STANDARD_GRAVITY,
};
use bansho_sph::KernelShape;
use rayon::prelude::*;

use super::*;
use crate::particles::{
    parameters::{GasModel, WindForce},
    simulate::{burner::Burner, combustion::INNER_TEMPERATURE},
};

/// How many parameter sets: [`FEW`], or what `BANSHO_RANDOM_FLAMES` says.
fn count() -> u64 {
    std::env::var("BANSHO_RANDOM_FLAMES").ok().and_then(|text| text.parse().ok()).unwrap_or(FEW)
}

const FEW: u64 = 10;
const STEPS: i64 = 300;

fn uniforms(seed: u64) -> impl FnMut() -> f64 {
    let (key, mut drawn) = (Key::new(seed, "random flames"), 0);
    move || {
        drawn += 1;
        f64::from(key.uniforms(drawn, 0, bansho_base::math::random::Purpose(0))[0])
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
    assert!(reader.is_clean(), "{:?}", reader.into_problems());
    parameters.particles = 1 + (uniform() * 250.0) as i64;
    DerivedConstants::new(&parameters, None, &MemoryAssets::default()).ok().map(|_| (parameters, wind))
}

/// What must hold after every step, whatever the parameters say.
fn check(seed: u64, simulation: &Simulation, parameters: &FlameParticlesParameters) {
    let (particles, constants) = (&simulation.particles, simulation.constants());
    assert!(particles.len() <= constants.max_particles, "seed {seed}: {} particles", particles.len());
    for values in particles.float_columns() {
        assert!(values.iter().all(|value| value.is_finite()), "seed {seed}: not a number");
    }
    let unique_ids = particles.ids().iter().collect::<std::collections::BTreeSet<_>>().len();
    assert_eq!(unique_ids, particles.len(), "seed {seed}: two particles have the same id");
    let [low, high] = constants.domain.map(|corner| corner.as_vec3());
    // Temperatures stay between the lowest and the highest of the air, the gas when it is spawned, the inside of its flame, and its flame.
    let spawn_temperatures = constants.burners.iter().map(|burner| burner.parameters.temperature_k);
    let flame = parameters.combustion.flame_temperature_k;
    let (mut coldest, mut hottest) = (Air::default().temperature_k.min(f64::from(INNER_TEMPERATURE) * flame), flame);
    for kelvin in spawn_temperatures {
        (coldest, hottest) = (coldest.min(kelvin), hottest.max(kelvin));
    }
    let most_soot = parameters.combustion.soot_ppm as f32 * 1e-6;
    for index in 0..particles.len() {
        let position = position(simulation, index);
        assert!(
            position.cmpge(low).all() && position.cmple(high).all(),
            "seed {seed}: {position} is outside the domain"
        );
        let kelvin = f64::from(particles.temperature[index]);
        assert!((coldest - 0.1..hottest + 0.1).contains(&kelvin), "seed {seed}: {kelvin} K");
        assert!((0.0..=1.0).contains(&particles.fuel[index]), "seed {seed}: {} of its fuel", particles.fuel[index]);
        assert!((0.0..=1.001 * most_soot).contains(&particles.soot[index]), "seed {seed}: soot");
        assert!(particles.density[index] > 0.0 && particles.mass[index] == constants.mass, "seed {seed}: mass");
        let radius = particles.support_radius[index] / constants.support_radius;
        assert!((0.999..3.001).contains(&radius), "seed {seed}: {radius} support radii");
        assert!(particles.age[index] <= particles.max_age[index], "seed {seed}: older than it may be");
    }
}

/// The speed that parameters and wind could give the gas, m/s.
fn driving_speed(simulation: &Simulation, parameters: &FlameParticlesParameters, wind: &WindParameters) -> f32 {
    let (constants, motion) = (simulation.constants(), &parameters.forces);
    let greatest = |speed: &dyn Fn(&Burner) -> f64| constants.burners.iter().map(speed).fold(0.0, f64::max);
    // On the axis at the top of the domain that a flame has by itself, with its eddies and rings.
    let rise = greatest(&|burner| burner.axis_speed(burner.bounding_radius + 3.0 * burner.height));
    // Air flows in at a share of that, and at the base of a wide fire faster than anything rises.
    let inflow = greatest(&|burner| 0.2 * (STANDARD_GRAVITY * burner.diameter).sqrt());
    let room = constants.domain[1] - constants.domain[0];
    let corner = |corner: [f64; 3]| corner.map(f64::abs).into_iter().fold(0.0, f64::max);
    let blown =
        wind.velocity.bounds().map(corner).into_iter().fold(0.0, f64::max) * (1.0 + wind.gust) * motion.wind_response;
    let blown = match (parameters.gas_model, motion.wind_model) {
        (GasModel::Combustion, WindForce::Entrainment) => blown,
        // A particle by itself has the least density.
        (GasModel::Euler, _) => {
            let density = constants.mass * KernelShape::Poly6.at_center::<3>(constants.support_radius);
            (2.0 * blown / f64::from(density) * room.length()).sqrt()
        }
        // Nothing holds gas back that a force drives, m/s^2 on gas as dense as at the burner.
        (GasModel::Combustion, WindForce::BodyForce) => {
            driven_speed(simulation, parameters, blown / f64::from(constants.density), room.max_element())
        }
    };
    let hottest = constants.burners.iter().map(|burner| burner.parameters.temperature_k);
    let hottest = hottest.fold(parameters.combustion.flame_temperature_k, f64::max);
    // Flames may be far hotter than those of their height are.
    let buoyancy = STANDARD_GRAVITY * motion.buoyancy * (hottest / Air::default().temperature_k - 1.0).max(0.0);
    let upward = rise * (1.0 + motion.turbulence + motion.puffing);
    let inward = motion.plume_contraction * (inflow + 0.2 * rise);
    ((upward * upward + inward * inward).sqrt() + blown).max(driven_speed(simulation, parameters, buoyancy, room.y))
        as f32
}

/// The speed of gas that `acceleration`, m/s^2, drives for as long as it may live, or as `far` as the domain goes.
fn driven_speed(simulation: &Simulation, parameters: &FlameParticlesParameters, acceleration: f64, far: f64) -> f64 {
    let constants = simulation.constants();
    let max_ages =
        (0..constants.burners.len()).map(|index| constants.max_age(index, parameters.combustion.burnt_gas_lifetime_s));
    (acceleration * max_ages.fold(0.0, f64::max)).min((2.0 * acceleration * far).sqrt())
}

/// Speed of the fastest particle, m/s.
fn greatest_speed(simulation: &Simulation) -> f32 {
    let particles = &simulation.particles;
    let speed = |index: usize| Vec3::from(particles.velocities().map(|values| values[index])).length();
    (0..particles.len()).map(speed).fold(0.0, f32::max)
}

/// Mean of the squared speeds, m^2/s^2.
fn mean_square_speed(simulation: &Simulation) -> f32 {
    let particles = &simulation.particles;
    let square = |index: usize| particles.velocities().iter().map(|values| values[index] * values[index]).sum::<f32>();
    (0..particles.len()).map(square).sum::<f32>() / particles.len().max(1) as f32
}

/// What stands in the way of every second flame: a ball, a turned box or a slope, near it or where it burns.
fn obstacle(seed: u64, simulation: &Simulation) -> Option<Occluder> {
    let words = Key::new(seed, "obstacles").uniforms(0, 0, bansho_base::math::random::Purpose(0)).map(f64::from);
    let burner = &simulation.constants().burners[0];
    let size = burner.bounding_radius + burner.height;
    let center = burner.position(0.0) + size * DVec3::new(words[0] - 0.5, words[1], words[2] - 0.5);
    match (seed % 2, (3.0 * words[3]) as u32) {
        (0, _) => None,
        (_, 0) => Some(Occluder::Sphere { center, radius: 0.3 * size * words[0] }),
        (_, 1) => Some(Occluder::Cuboid {
            center,
            half_extents: 0.5 * size * DVec3::new(words[1], 0.1 * words[2], words[0]),
            rotation: DQuat::from_rotation_z(words[3]),
        }),
        _ => {
            let normal = DVec3::new(words[0] - 0.5, 1.0, words[2] - 0.5).normalize();
            Some(Occluder::HalfSpace { point: burner.position(0.0) - 0.2 * size * words[1] * normal, normal })
        }
    }
}

/// Steps the flame of this seed, and checks it after every step.
fn burn(seed: u64, parameters: &FlameParticlesParameters, wind: WindParameters) {
    let mut simulation = simulation(parameters);
    let driven = driving_speed(&simulation, parameters, &wind);
    let world = World { wind, occluders: obstacle(seed, &simulation).into_iter().collect() };
    let first = -(simulation.constants().preroll / simulation.step_s()).round().min(200.0) as i64;
    let (mut mean, mut greatest) = (0.0_f32, 0.0_f32);
    world.run_steps(&mut simulation, first, first + STEPS, |simulation, _| {
        check(seed, simulation, parameters);
        mean = mean.max(mean_square_speed(simulation).sqrt());
        greatest = greatest.max(greatest_speed(simulation));
    });
    // Gas under pressure outruns what drives it, a particle that is pressed out of a crowd most.
    assert!(mean < 1.6 * driven + 0.1, "seed {seed}: the gas moves at {mean} m/s, driven by {driven} m/s");
    assert!(greatest < 3.0 * driven + 0.1, "seed {seed}: a particle moves at {greatest} m/s, driven by {driven} m/s");
}

#[test]
fn no_valid_flame_blows_up() {
    let drawn = (0..).filter_map(|seed| draw(seed).map(|drawn| (seed, drawn)));
    let flames: Vec<_> = drawn.take(count() as usize).collect();
    flames.into_par_iter().for_each(|(seed, (parameters, wind))| burn(seed, &parameters, wind));
}
