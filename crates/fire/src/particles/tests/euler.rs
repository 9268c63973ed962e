//! The paper's algorithm, section 4.3, against the same equations summed over all pairs in double precision.

use bansho_base::{
    math,
    parameters::{Auto, animated::Animated},
    phenomenon::{
        Phenomenon,
        surroundings::{OtherPhenomena, PublishedByAll},
    },
    world::sky::Sky,
};
use bansho_sph::KernelShape;

use super::*;
use crate::particles::{
    FlameParticles, Particle,
    parameters::{
        BurnerParameters, CombustionParameters, FluidParameters, ForceParameters, GasModel, NegativePressure, WindForce,
    },
};

const STEP: f64 = 1.0 / 60.0;
const WIND: [f64; 3] = [0.03, 0.0, -0.01];

/// Ten particles a step, which rise for forty steps.
fn paper() -> FlameParticlesParameters {
    let burner = BurnerParameters {
        diameter: 0.3,
        height: Auto::Set(0.8),
        speed: Auto::Set(1.2),
        temperature_k: 1900.0,
        ..Default::default()
    };
    FlameParticlesParameters {
        gas_model: GasModel::Euler,
        burners: vec![burner],
        particles: 400,
        fluid: FluidParameters {
            support_radius: 2.5,
            rest_density: 0.6,
            stiffness: 0.25,
            pressure_kernel: KernelShape::Poly6,
            negative_pressure: NegativePressure::Allowed,
            ..FluidParameters::default()
        },
        forces: ForceParameters { wind_model: WindForce::BodyForce, ..ForceParameters::default() },
        step_s: STEP,
        ..FlameParticlesParameters::default()
    }
}

fn world() -> World {
    let velocity = Animated::from(WIND);
    World { wind: WindParameters { velocity, gust: 0.0, ..WindParameters::default() }, ..World::default() }
}

fn all(simulation: &Simulation) -> Vec<Particle> {
    let mut particles: Vec<_> =
        (0..simulation.particles.len()).filter_map(|index| simulation.particles.get(index)).collect();
    particles.sort_by_key(|particle| particle.id);
    particles
}

/// Positions and velocities after the paper's step, by eqs. (2), (3), (11), (12) and (8) as printed.
fn reference_step(simulation: &Simulation, particles: &[Particle]) -> Vec<[[f64; 3]; 2]> {
    let d = f64::from(simulation.constants().support_radius);
    let (poly6, rho_0) = (315.0 / (64.0 * std::f64::consts::PI), f64::from(simulation.constants().rest_density));
    let k = f64::from(simulation.constants().stiffness_per_kelvin) * 1900.0;
    let offset = |i: usize, j: usize| {
        [0, 1, 2].map(|c| f64::from(particles[i].position[c]) - f64::from(particles[j].position[c]))
    };
    let squared = |[x, y, z]: [f64; 3]| x * x + y * y + z * z;
    let rest = |r2: f64| (d * d - r2).max(0.0);
    let normalization = poly6 / math::pow(d, 9.0);
    let masses: Vec<f64> = particles.iter().map(|particle| particle.mass.into()).collect();
    let everyone = || 0..particles.len();
    let density = |i: usize| -> f64 {
        everyone().map(|j| masses[j] * normalization * math::pow(rest(squared(offset(i, j))), 3.0)).sum()
    };
    let densities: Vec<f64> = everyone().map(density).collect();
    let pressure = |i: usize| k * (densities[i] - rho_0);
    let step = |i: usize| {
        let mut force = WIND;
        for j in everyone() {
            let by = offset(i, j);
            let gradient = -6.0 * normalization * math::pow(rest(squared(by)), 2.0);
            let factor = masses[j] * (pressure(i) + pressure(j)) / (2.0 * densities[j]) * gradient;
            (0..3).for_each(|c| force[c] -= factor * by[c]);
        }
        let velocity = [0, 1, 2].map(|c| f64::from(particles[i].velocity[c]) + force[c] / densities[i] * STEP);
        let position = [0, 1, 2].map(|c| f64::from(particles[i].position[c]) + velocity[c] * STEP);
        [position, velocity]
    };
    everyone().map(step).collect()
}

#[test]
fn a_step_is_the_papers_equations_summed_over_all_pairs() {
    let mut simulation = simulation(&paper());
    let mut before: Vec<Particle> = Vec::new();
    let (mut compared, mut moved, mut largest) = (0, 0.0_f64, 0.0_f64);
    world().run(&mut simulation, 0.2, |simulation, t| {
        let after = all(simulation);
        if t > 0.0 {
            // What was added in this step is where it was before the step, at its initial velocity.
            let added = after.iter().filter(|particle| !before.iter().any(|old| old.id == particle.id));
            let burner = &simulation.constants().burners[0];
            let added = added.map(|particle| {
                let spawn_point = burner.spawn_point(simulation.shared.key, particle.id, 0.0);
                let velocity = [0.0, burner.speed as f32, 0.0];
                Particle { position: spawn_point.position.as_vec3().to_array(), velocity, ..*particle }
            });
            let alive = |particle: &&Particle| after.iter().any(|other| other.id == particle.id);
            let mut start: Vec<Particle> = before.iter().filter(alive).copied().chain(added).collect();
            start.sort_by_key(|particle| particle.id);
            for (particle, [position, velocity]) in after.iter().zip(reference_step(simulation, &start)) {
                for c in 0..3 {
                    let off = [
                        f64::from(particle.position[c]) - position[c],
                        STEP * (f64::from(particle.velocity[c]) - velocity[c]),
                    ];
                    largest = off.iter().fold(largest, |largest, off| largest.max(off.abs()));
                }
                moved = moved.max(f64::from(particle.velocity[0]).abs());
                compared += 1;
            }
        }
        before = after;
    });
    // Twelve steps of 400; pressure and wind do something.
    assert!(compared == 12 * 400 && moved > 0.1, "{compared} {moved}");
    bansho_base::assert_measured!(
        "equation (1) & equation (3) & equation (11) & equation (12) & section 4.3, step 2 & section 4.3, step 3: difference, m",
        largest,
        0.0,
        2e-6
    );
}

#[test]
fn the_same_number_is_added_in_each_step_and_the_oldest_are_removed() {
    let mut simulation = simulation(&paper());
    let (mut newest, mut added, mut alive) = (0, 0.0, 0.0);
    let speed = simulation.constants().burners[0].speed as f32;
    World::default().run(&mut simulation, 1.0, |simulation, t| {
        let particles = all(simulation);
        let (first, last) = (particles[0].id, particles[particles.len() - 1].id);
        (added, alive) = ((last + 1 - newest) as f64, particles.len() as f64);
        assert_eq!(last + 1 - newest, 10, "at {t} s");
        newest = last + 1;
        // None is missing between the oldest and the newest.
        assert_eq!(last + 1 - first, particles.len() as u64);
        assert_eq!(particles.len() as u64, newest.min(400));
        let same = |particle: &Particle| {
            (particle.temperature, particle.mass, particle.fuel) == (1900.0, simulation.constants().mass, 1.0)
        };
        assert!(particles.iter().all(same));
        // Those of this step have moved by little else than their initial speed.
        let new = particles.iter().filter(|particle| particle.age < 1.5 * STEP as f32);
        assert_eq!(new.clone().count(), 10);
        assert!(new.clone().all(|particle| (particle.velocity[1] - speed).abs() < 0.3 * speed));
    });
    assert!(newest > 1000);
    bansho_base::assert_measured!("section 4.3, step 1: added", added, 10.0, 0.0);
    bansho_base::assert_measured!("section 4.3, step 1: alive", alive, 400.0, 0.0);
}

#[test]
fn the_wind_is_a_force_per_volume_and_is_divided_by_the_density() {
    let mut simulation = simulation(&FlameParticlesParameters {
        particles: 1,
        fluid: FluidParameters { stiffness: 0.0, ..paper().fluid },
        ..paper()
    });
    let mut checked = 0;
    world().run_steps(&mut simulation, 0, 3, |simulation, _| {
        let [particle] = all(simulation)[..] else { panic!("one particle is alive") };
        // Alone it has the density m W(0) of itself.
        let d = f64::from(simulation.constants().support_radius);
        let density =
            f64::from(simulation.constants().mass) * 315.0 / (64.0 * std::f64::consts::PI * math::pow(d, 3.0));
        for c in [0, 2] {
            let expected = WIND[c] / density * STEP;
            let difference = f64::from(particle.velocity[c]) / expected - 1.0;
            bansho_base::assert_measured!("equation (8) & section 4.3, step 4: difference", difference, 0.0, 1e-5);
        }
        checked += 1;
    });
    assert_eq!(checked, 3);
}

#[test]
fn gas_of_a_burner_that_is_turned_off_rises_out_of_the_domain() {
    let mut parameters = paper();
    let flow = vec![(0.19, 1.0), (0.2, 0.0)];
    parameters.burners[0].flow = Animated::keyed(flow, math::curve::Interpolation::Linear).unwrap();
    let mut simulation = simulation(&parameters);
    let mut counts = Vec::new();
    World::default().run(&mut simulation, 3.5, |simulation, t| counts.push((t, simulation.particles.len())));
    let at = |time: f64| counts.iter().find(|(t, _)| *t > time).unwrap().1;
    // Nothing is added, so nothing is too many.
    assert_eq!((at(0.1), at(0.5), at(3.4)), (400, 400, 0), "{counts:?}");
}

#[test]
fn keys_without_effect_are_remarked() {
    let nothing = Publication::default();
    let all = PublishedByAll::new(vec![Publication::default()]);
    let published = || &all;
    let neighbors = OtherPhenomena { scene: &nothing, published: &published, own_index: 0, sky: &Sky::DARK };
    let remark = |parameters: FlameParticlesParameters| {
        let flame = FlameParticles::new(parameters, "flame", 1, None, &MemoryAssets::default()).unwrap();
        flame.remark(&neighbors).map(|remark| remark.key.unwrap())
    };
    assert_eq!(remark(paper()), None);
    let turbulent = ForceParameters { turbulence: 0.5, ..paper().forces };
    assert_eq!(remark(FlameParticlesParameters { forces: turbulent.clone(), ..paper() }).as_deref(), Some("forces"));
    let viscous = FluidParameters { viscosity: 0.5, ..paper().fluid };
    assert_eq!(remark(FlameParticlesParameters { fluid: viscous, ..paper() }).as_deref(), Some("fluid"));
    let hot = CombustionParameters { flame_temperature_k: 2000.0, ..CombustionParameters::default() };
    assert_eq!(remark(FlameParticlesParameters { combustion: hot, ..paper() }).as_deref(), Some("combustion"));
    let burning = FlameParticlesParameters { gas_model: GasModel::Combustion, forces: turbulent, ..paper() };
    assert_eq!(remark(burning), None);
}
