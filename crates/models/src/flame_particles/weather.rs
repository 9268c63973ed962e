//! All that acts on the gas from outside during a step: wind, eddies, vortex rings, the draw toward the axis.

use bansho_base::{
    air::Air,
    gravity::STANDARD_GRAVITY,
    math::{DVec3, Vec3},
    surroundings::{Occluder, Surroundings},
};
use rayon::prelude::*;

use super::{
    breeze::Breeze,
    draught::Draught,
    narrowing::{Axis, axes},
    parameters::WindForce,
    particles::Particles,
    puffing::rings,
    simulation::Simulation,
};

/// Where turbulence has grown to half its strength, as a share of the time that gas takes to the tip.
const TURBULENT_AGE: f32 = 0.1;

/// Speed at which eddies drift beside the wind: the gas that holds them takes it up as it rises.
const EDDY_DRIFT: f64 = 0.5;

/// Drag coefficient of a fire in wind from the side.
const CROSS_DRAG: f64 = 0.25;

/// Share of its fuel that gas burns on a way as long as the flame is high, on the mean; and in the time that it takes there.
const WAY_SHARE: f64 = 1.02;
const TIME_SHARE: f64 = 0.25;

/// Particles of a task.
const PARTICLES_OF_TASK: usize = 8192;

/// What acts on the gas at one moment.
pub(crate) struct Weather<'a> {
    pub(crate) origin: DVec3,
    pub(crate) occluders: &'a [Occluder],
    /// The wind over the gas of each burner.
    pub(crate) breezes: Vec<Breeze>,
    pub(crate) air_temperature: f32,
    /// Gravity against which gas rises, m/s^2.
    pub(crate) buoyancy: f32,
    pub(crate) wind: WindForce,
    pub(crate) wind_gain: f32,
    /// Density of air at 1 K, kg K/m^3.
    pub(crate) density_kelvin: f32,
    pub(crate) draughts: Vec<Draught<'a>>,
}

impl<'a> Weather<'a> {
    pub(crate) fn new(simulation: &'a Simulation, around: &'a Surroundings, t: f64) -> Self {
        let Simulation { parameters: flame, design, turbulence, key, particles, .. } = simulation;
        let Surroundings { wind, air, others, .. } = around;
        let drift = wind.travel(0.0, t) * (EDDY_DRIFT * flame.motion.wind_gain);
        let axes = axes(&design.burners, particles.positions(), &particles.burner, flame.motion.narrowing, t);
        let draught = |(number, axis): (usize, Axis)| {
            let burner = &design.burners[number];
            let size = flame.motion.eddy_size * burner.diameter;
            let speed = burner.axis_speed(0.5 * burner.height);
            Draught {
                rings: rings(burner, flame, *key, number as u32, t, &axis),
                axis,
                eddies: turbulence.at(t, size, speed, drift),
                turbulence: flame.motion.turbulence as f32,
                turbulent_age: TURBULENT_AGE * burner.rise_time() as f32,
                entrainment: (flame.motion.entrainment / (0.5 * burner.diameter)) as f32,
                drag: (CROSS_DRAG * flame.motion.wind_gain / (0.5 * burner.diameter)) as f32,
                burning: [(WAY_SHARE / burner.height) as f32, (TIME_SHARE / burner.rise_time()) as f32],
            }
        };
        let breeze = |box_around| Breeze::new(wind, particles.origin, box_around, t);
        Self {
            origin: particles.origin,
            occluders: &others.occluders,
            breezes: bounds(particles, design.burners.len()).into_iter().map(breeze).collect(),
            air_temperature: air.temperature_k as f32,
            buoyancy: (STANDARD_GRAVITY * flame.motion.buoyancy) as f32,
            wind: flame.motion.wind,
            wind_gain: flame.motion.wind_gain as f32,
            density_kelvin: density_kelvin(air),
            draughts: axes.into_iter().enumerate().map(draught).collect(),
        }
    }
}

fn density_kelvin(air: &Air) -> f32 {
    air.density_at(1.0) as f32
}

/// Corners of the box around the particles of each burner.
fn bounds(particles: &Particles, burners: usize) -> Vec<[Vec3; 2]> {
    const NOTHING: [Vec3; 2] = [Vec3::INFINITY, Vec3::NEG_INFINITY];
    let [x, y, z] = particles.positions();
    let of_task = |first: usize| {
        let mut bounds = vec![NOTHING; burners];
        for index in first..(first + PARTICLES_OF_TASK).min(particles.len()) {
            let place = Vec3::new(x[index], y[index], z[index]);
            let [low, high] = &mut bounds[particles.burner[index] as usize];
            (*low, *high) = (low.min(place), high.max(place));
        }
        bounds
    };
    let both = |mut one: Vec<[Vec3; 2]>, other: Vec<[Vec3; 2]>| {
        for ([low, high], [other_low, other_high]) in one.iter_mut().zip(other) {
            (*low, *high) = (low.min(other_low), high.max(other_high));
        }
        one
    };
    let parts = (0..particles.len()).into_par_iter().step_by(PARTICLES_OF_TASK);
    let bounds = parts.map(of_task).reduce(|| vec![NOTHING; burners], both);
    // A burner that nothing came from yet has no wind to speak of.
    bounds.into_iter().map(|bounds| if bounds[0].x <= bounds[1].x { bounds } else { [Vec3::ZERO, Vec3::ONE] }).collect()
}

#[cfg(test)]
mod tests {
    use bansho_base::{
        air::Air,
        assets::MemoryAssets,
        random::Key,
        wind::{Wind, WindParameters},
    };

    use super::*;
    use crate::flame_particles::{
        design::Design,
        parameters::{BurnerParameters, FlameParticlesParameters},
    };

    #[test]
    fn each_burner_feels_the_wind_that_blows_where_it_stands() {
        let burners = [0.0, 50.0].map(|x| BurnerParameters { position: [x, 0.0, 0.0].into(), ..Default::default() });
        let parameters = FlameParticlesParameters {
            burners: burners.to_vec(),
            particles: 600,
            ..FlameParticlesParameters::default()
        };
        let design = Design::new(&parameters, None, &MemoryAssets::default()).unwrap();
        let mut simulation = Simulation::new(&parameters, design, Key::new(1, "flame"));
        let gusty = WindParameters { velocity: [2.0, 0.0, 0.0].into(), gust: 1.5, ..WindParameters::default() };
        let (wind, air) = (Wind::new(gusty, 3, None), Air::default());
        let around = Surroundings { air: &air, ..Surroundings::of_wind(&wind) };
        (0..30).for_each(|step| simulation.step(f64::from(step) * simulation.step_s(), &around));
        let weather = Weather::new(&simulation, &around, 0.25);
        let (particles, mut off, mut apart) = (&simulation.particles, 0.0_f32, 0.0_f32);
        for index in 0..particles.len() {
            let place = Vec3::from(particles.positions().map(|values| values[index]));
            let exact = wind.at(place.as_dvec3(), 0.25).as_vec3();
            let [own, other] = [0, 1].map(|swap| &weather.breezes[particles.burner[index] as usize ^ swap]);
            off = off.max((own.at(place) - exact).length());
            apart = apart.max((other.at(place) - exact).length());
        }
        assert!(off < 0.4 && apart > 4.0, "{off} m/s off the wind, that of the other burner {apart}");
    }
}
