//! Gas without a burner: momentum, rest, free fall, solids.

use bansho_base::{
    math::{DVec3, random::uniform},
    parameters::{Auto, animated::Animated},
    world::gravity::STANDARD_GRAVITY,
};

use super::*;
use crate::particles::{
    Particle,
    parameters::{BurnerParameters, CombustionParameters, ForceParameters, TemperatureLaw, WindForce},
};

/// Only pressure and viscosity act, and no gas is spawned.
fn quiet() -> FlameParticlesParameters {
    FlameParticlesParameters {
        burners: vec![BurnerParameters { flow: Animated::from(0.0), ..Default::default() }],
        forces: ForceParameters {
            buoyancy: 0.0,
            wind_response: 0.0,
            entrainment: 0.0,
            plume_contraction: 0.0,
            puffing: 0.0,
            turbulence: 0.0,
            ..Default::default()
        },
        combustion: CombustionParameters { temperature_model: TemperatureLaw::Constant, ..Default::default() },
        domain_min: Auto::Set([-1e4; 3]),
        domain_max: Auto::Set([1e4; 3]),
        ..Default::default()
    }
}

fn particle(constants: &DerivedConstants, id: u64, position: [f32; 3], velocity: [f32; 3]) -> Particle {
    Particle {
        id,
        position,
        velocity,
        mass: constants.mass,
        density: constants.rest_density,
        temperature: 1500.0,
        support_radius: constants.support_radius,
        age: 0.0,
        max_age: 1e9,
        fuel: 0.0,
        soot: 0.0,
    }
}

/// Sum of m v and of m |v|.
fn momentum(simulation: &Simulation) -> (DVec3, f64) {
    let particles = &simulation.particles;
    (0..particles.len()).fold((DVec3::ZERO, 0.0), |(sum, size), index| {
        let velocity = Vec3::from(particles.velocities().map(|values| values[index])).as_dvec3();
        let mass = f64::from(particles.masses()[index]);
        (sum + mass * velocity, size + mass * velocity.length())
    })
}

fn center(simulation: &Simulation) -> DVec3 {
    let count = simulation.particles.len();
    (0..count).map(|index| position(simulation, index).as_dvec3()).sum::<DVec3>() / count as f64
}

#[test]
fn a_free_cloud_keeps_its_momentum_and_its_center_goes_straight() {
    let mut simulation = simulation(&quiet());
    let d = simulation.constants().support_radius;
    for id in 0..400 {
        let words = Key::new(2, "cloud").words(id, 0, bansho_base::math::random::Purpose(0)).map(uniform);
        let position = [words[0], words[1], words[2]].map(|u| (u - 0.5) * 3.0 * d);
        let velocity = [0.3 + words[3] - words[0], words[1] - words[2], words[0] * words[3] - 0.2];
        simulation.particles.push(particle(simulation.constants(), id, position, velocity));
    }
    let (before, size) = momentum(&simulation);
    let (start, mean) = (center(&simulation), before / (400.0 * f64::from(simulation.constants().mass)));
    World::default().run_steps(&mut simulation, 0, 1000, |simulation, t| {
        let off = (center(simulation) - start - mean * t).length();
        assert!(off < 1e-5 * (1.0 + mean.length() * t), "center {off} m off its line after {t} s");
    });
    let drift = (momentum(&simulation).0 - before).length() / size;
    assert!(drift < 1e-6, "momentum drifts by {drift}");
}

#[test]
fn a_lattice_at_rest_stays_at_rest() {
    let mut parameters = quiet();
    parameters.fluid.support_radius = 2.6;
    parameters.fluid.rest_density = 1.0;
    let mut simulation = simulation(&parameters);
    let spacing = simulation.constants().support_radius / 2.6;
    let start = |id: u64| [id % 9, id / 9 % 9, id / 81].map(|step| step as f32 * spacing);
    for id in 0..729 {
        simulation.particles.push(particle(simulation.constants(), id, start(id), [0.0; 3]));
    }
    World::default().run_steps(&mut simulation, 0, 1000, |_, _| {});
    for index in 0..729 {
        let moved = (position(&simulation, index) - Vec3::from(start(simulation.particles.ids()[index]))).length();
        assert!(moved < 1e-3 * spacing, "moved by {} spacings", moved / spacing);
    }
}

#[test]
fn eddies_at_a_wall_give_the_gas_no_speed_of_its_own() {
    let mut parameters = quiet();
    parameters.forces = ForceParameters { turbulence: 2.0, wind_model: WindForce::BodyForce, ..parameters.forces };
    let mut simulation = simulation(&parameters);
    let d = simulation.constants().support_radius;
    for id in 0..100 {
        // Too far from each other to meet.
        let position = [3.0 * d * (id % 10) as f32, 0.5 * d, 3.0 * d * (id / 10) as f32];
        simulation.particles.push(particle(simulation.constants(), id, position, [0.3, -1.0, 0.2]));
    }
    let floor = Occluder::HalfSpace { point: DVec3::ZERO, normal: DVec3::Y };
    World { occluders: vec![floor], ..World::default() }.run_steps(&mut simulation, 0, 300, |simulation, _| {
        let particles = &simulation.particles;
        for index in 0..particles.len() {
            let [velocity, drift] = [&particles.velocity, &particles.drift]
                .map(|all| Vec3::from(all.each_ref().map(|values| values[index])));
            let own = (velocity - drift).length();
            assert!(own < 1.1, "{own} m/s, with which it came at 1.06");
        }
    });
}

#[test]
fn a_lattice_has_its_density_and_its_middle_rests_until_sound_arrives() {
    let mut parameters = quiet();
    parameters.fluid.support_radius = 2.6;
    // Under pressure everywhere: what rests is pushed alike from all sides.
    parameters.fluid.rest_density = 0.9;
    let mut simulation = simulation(&parameters);
    let spacing = simulation.constants().support_radius / 2.6;
    let (side, steps) = (20_u64, 8);
    let start = |id: u64| [id % side, id / side % side, id / (side * side)].map(|step| step as f32);
    for id in 0..side * side * side {
        let position = start(id).map(|step| step * spacing);
        simulation.particles.push(particle(simulation.constants(), id, position, [0.0; 3]));
    }
    let expected = simulation.constants().mass / (spacing * spacing * spacing);
    World::default().run_steps(&mut simulation, 0, steps, |_, _| {});
    let sound = (simulation.constants().stiffness_per_kelvin * 1500.0).sqrt() / spacing;
    let reached = sound * steps as f32 * simulation.step_s() as f32 + 2.6;
    let (mut resting, mut given_way) = (0, 0.0_f32);
    for index in 0..simulation.particles.len() {
        let start = Vec3::from(start(simulation.particles.ids()[index]));
        let moved = (position(&simulation, index) / spacing - start).length();
        let depth = start.min(Vec3::splat((side - 1) as f32) - start).min_element();
        let density = simulation.particles.densities()[index];
        if depth > reached {
            resting += 1;
            assert!(moved < 1e-3, "{depth} deep, beyond {reached}, it moved by {moved}");
            assert!((density / expected - 1.0).abs() < 0.01, "density {density} for {expected}");
        } else if depth == 0.0 {
            given_way = given_way.max(moved);
        }
    }
    assert!(resting >= 8 && given_way > 0.02, "{resting} rest, the surface moved by {given_way}");
}

#[test]
fn a_thin_plate_lets_nothing_through() {
    for thickness in [0.005, 0.02] {
        let mut parameters = FlameParticlesParameters { particles: 2200, ..Default::default() };
        parameters.preroll_s = Auto::Set(0.0);
        let half_extents = DVec3::new(3.0, 0.5 * thickness, 3.0);
        let center = DVec3::Y * 0.6;
        let plate = Occluder::Cuboid { center, half_extents, rotation: bansho_base::math::DQuat::IDENTITY };
        let world = World { occluders: vec![plate], ..World::default() };
        let mut simulation = simulation(&parameters);
        let mut reached = 0;
        world.run_steps(&mut simulation, 0, 150, |simulation, _| {
            for index in 0..simulation.particles.len() {
                let height = position(simulation, index).y;
                assert!(height < 0.6, "{height} m high, behind a plate of {thickness} m");
                reached = reached.max(usize::from(height > 0.55));
            }
        });
        assert!(reached > 0, "it comes there");
    }
}

#[test]
fn one_particle_falls_and_rises_as_buoyancy_says() {
    // At 0 K gas weighs all that it would in a vacuum; five times as hot as air it rises at 4 g.
    for (share, acceleration) in [(0.0, -STANDARD_GRAVITY), (5.0, 4.0 * STANDARD_GRAVITY)] {
        let mut parameters = quiet();
        parameters.forces.buoyancy = 1.0;
        let mut simulation = simulation(&parameters);
        let mut single = particle(simulation.constants(), 0, [0.0; 3], [0.0; 3]);
        single.temperature = (share * Air::default().temperature_k) as f32;
        simulation.particles.push(single);
        World::default().run_steps(&mut simulation, 0, 60, |simulation, t| {
            let expected = 0.5 * acceleration * t * t;
            // The position is a step ahead of the parabola at most.
            let step = acceleration.abs() * t * simulation.step_s();
            assert!((f64::from(position(simulation, 0).y) - expected).abs() < 0.51 * step + 1e-6);
        });
    }
}

#[test]
fn gas_flows_around_a_ball() {
    let mut parameters = FlameParticlesParameters { particles: 800, ..Default::default() };
    parameters.forces.turbulence = 0.1;
    let ball = Occluder::Sphere { center: DVec3::new(0.0, 0.4, 0.0), radius: 0.12 };
    let world = World { occluders: vec![ball.clone()], ..World::default() };
    let mut above = 0;
    world.run(&mut simulation(&parameters), 0.3, |simulation, _| {
        for index in 0..simulation.particles.len() {
            let position = position(simulation, index).as_dvec3();
            assert!(ball.signed_distance(position) > 0.0, "{position} lies in the ball");
            above += usize::from(position.y > 0.6);
        }
    });
    assert!(above > 100, "it gets past");
}
