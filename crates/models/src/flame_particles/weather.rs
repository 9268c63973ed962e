//! All that acts on the gas from outside during a step: wind, eddies, vortex rings, the draw toward the axis.

use bansho_base::{
    air::Air,
    gravity::STANDARD_GRAVITY,
    math::{DVec3, Vec3},
    random::Key,
    surroundings::{Occluder, Surroundings},
};

use super::{
    breeze::Breeze,
    design::Design,
    draught::Draught,
    narrowing::{Axis, axes},
    parameters::{FlameParticlesParameters, WindForce},
    particles::Particles,
    puffing::rings,
    turbulence::Turbulence,
};

/// Where turbulence has grown to half its strength, as a share of the time that gas takes to the tip.
const TURBULENT_AGE: f32 = 0.1;

/// Speed at which eddies drift beside the wind: the gas that holds them takes it up as it rises.
const EDDY_DRIFT: f64 = 0.5;

/// What acts on the gas at one moment.
pub(crate) struct Weather<'a> {
    pub(crate) origin: DVec3,
    pub(crate) occluders: &'a [Occluder],
    pub(crate) breeze: Breeze,
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
    pub(crate) fn new(
        flame: &FlameParticlesParameters,
        design: &Design,
        turbulence: &'a Turbulence,
        key: Key,
        particles: &Particles,
        around: &'a Surroundings,
        t: f64,
    ) -> Self {
        let Surroundings { wind, air, others, .. } = around;
        let drift = wind.travel(0.0, t) * (EDDY_DRIFT * flame.motion.wind_gain);
        let axes = axes(&design.burners, particles.positions(), &particles.burner, flame.motion.narrowing, t);
        let draught = |(number, axis): (usize, Axis)| {
            let burner = &design.burners[number];
            let size = flame.motion.eddy_size * burner.diameter;
            let speed = burner.axis_speed(0.5 * burner.height);
            Draught {
                rings: rings(burner, flame, key, number as u32, t, &axis),
                axis,
                eddies: turbulence.at(t, size, speed, drift),
                turbulence: flame.motion.turbulence as f32,
                turbulent_age: TURBULENT_AGE * burner.rise_time() as f32,
                entrainment: (flame.motion.entrainment / (0.5 * burner.diameter)) as f32,
                drag: (CROSS_DRAG * flame.motion.wind_gain / (0.5 * burner.diameter)) as f32,
                burning: [(WAY_SHARE / burner.height) as f32, (TIME_SHARE / burner.rise_time()) as f32],
            }
        };
        Self {
            origin: particles.origin,
            occluders: &others.occluders,
            breeze: Breeze::new(wind, particles.origin, bounds(particles), t),
            air_temperature: air.temperature_k as f32,
            buoyancy: (STANDARD_GRAVITY * flame.motion.buoyancy) as f32,
            wind: flame.motion.wind,
            wind_gain: flame.motion.wind_gain as f32,
            density_kelvin: density_kelvin(air),
            draughts: axes.into_iter().enumerate().map(draught).collect(),
        }
    }
}

/// Drag coefficient of a fire in wind from the side.
const CROSS_DRAG: f64 = 0.25;
/// Share of its fuel that gas burns on a way as long as the flame is high, on the mean; and in the time that it takes there.
const WAY_SHARE: f64 = 1.02;
const TIME_SHARE: f64 = 0.25;

fn density_kelvin(air: &Air) -> f32 {
    air.density_at(1.0) as f32
}

/// Corners of the box around all particles.
fn bounds(particles: &Particles) -> [Vec3; 2] {
    let side = |pick: fn(f32, f32) -> f32, start: f32| {
        Vec3::from(particles.positions().map(|values| values.iter().copied().fold(start, pick)))
    };
    if particles.is_empty() {
        return [Vec3::ZERO, Vec3::ONE];
    }
    [side(f32::min, f32::INFINITY), side(f32::max, f32::NEG_INFINITY)]
}
