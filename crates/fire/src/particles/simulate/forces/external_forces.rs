//! External forces of a step: wind, eddies, vortex rings and inflow toward the plume axis, for each burner; sixteen particles at a
//! time.

use std::ops::Range;

use bansho_base::{
    host::parallel::prelude::*,
    math::{
        DVec3, Vec3,
        random::Key,
        simd::{Lanes, Real},
    },
    phenomenon::surroundings::{Occluder, Surroundings},
    world::gravity::STANDARD_GRAVITY,
};
use fearless_simd::{Simd, prelude::*};

use super::{
    entrainment_axis::{PlumeAxis, plume_axes},
    turbulence::{EddyField, TurbulenceTile},
    vortex_rings::{VortexRing, active_rings},
    wind_field::WindField,
};
use crate::particles::{
    parameters::{FlameParticlesParameters, WindForce},
    simulate::{
        derived::DerivedConstants,
        particles::GasParticles,
        vectors::{add_scaled, length, linear, scaled, subtract},
    },
};

/// Age at which turbulence has grown to half its strength, as a fraction of the rise time.
const TURBULENT_AGE: f32 = 0.1;

/// Drift velocity of eddies as a fraction of the wind's, since the gas around them takes on the velocity of the wind only gradually.
const EDDY_DRIFT: f64 = 0.5;

/// Drag coefficient of a fire in cross wind.
const CROSS_DRAG: f64 = 0.25;

/// Mean fraction of its fuel that gas burns per flame height of travel, and per rise time.
const BURNED_PER_HEIGHT: f64 = 1.02;
const BURNED_PER_RISE_TIME: f64 = 0.25;

/// Particles per task of the thread pool.
const PARTICLES_PER_TASK: usize = 8192;

/// Inputs of a step that do not change over time.
#[derive(Clone, Copy)]
pub(crate) struct StepConstants<'a> {
    pub(crate) parameters: &'a FlameParticlesParameters,
    pub(crate) constants: &'a DerivedConstants,
    pub(crate) turbulence: &'a TurbulenceTile,
    pub(crate) key: Key,
}

/// The external forces of one step.
pub(crate) struct ExternalForces<'a> {
    step: StepConstants<'a>,
    surroundings: &'a Surroundings<'a>,
    pub(crate) origin: DVec3,
    pub(crate) occluders: &'a [Occluder],
    pub(crate) air_temperature: f32,
    /// Gravity times the buoyancy parameter, m/s^2.
    pub(crate) buoyancy: f32,
    pub(crate) wind: WindForce,
    pub(crate) wind_response: f32,
    /// Density of air at 1 K, kg K/m^3.
    pub(crate) density_at_1_k: f32,
    /// The forces on the gas of each burner.
    pub(crate) burner_forces: Vec<BurnerForces<'a>>,
}

impl<'a> ExternalForces<'a> {
    /// The external forces of a step that begins at `t`.
    pub(crate) fn new(
        step: StepConstants<'a>,
        particles: &GasParticles,
        surroundings: &'a Surroundings,
        t: f64,
    ) -> Self {
        let StepConstants { parameters: flame, constants, .. } = step;
        let plume_axes =
            plume_axes(&constants.burners, particles.positions(), &particles.burner, flame.forces.plume_contraction, t);
        let bounds = bounds(particles, constants.burners.len());
        let burner_forces = plume_axes.into_iter().zip(bounds).enumerate().map(|(index, (axis, bounds))| {
            let wind_field = WindField::new(surroundings.wind, particles.origin, bounds, t);
            step.burner_forces(index, axis, wind_field, surroundings, t)
        });
        Self {
            burner_forces: burner_forces.collect(),
            step,
            surroundings,
            origin: particles.origin,
            occluders: &surroundings.others.occluders,
            air_temperature: surroundings.air.temperature_k as f32,
            buoyancy: (STANDARD_GRAVITY * flame.forces.buoyancy) as f32,
            wind: flame.forces.wind_model,
            wind_response: flame.forces.wind_response as f32,
            density_at_1_k: surroundings.air.density_at(1.0) as f32,
        }
    }

    /// Advances vortex rings and eddies to `t`; plume axes and wind stay the same for the whole step.
    pub(crate) fn advance_rings_and_eddies(&mut self, t: f64) {
        for (index, burner) in self.burner_forces.iter_mut().enumerate() {
            burner.rings = self.step.rings(index, &burner.axis, t);
            burner.eddies = self.step.eddies(index, self.surroundings, t);
        }
    }
}

impl<'a> StepConstants<'a> {
    fn burner_forces(
        self,
        index: usize,
        axis: PlumeAxis,
        wind_field: WindField,
        surroundings: &Surroundings,
        t: f64,
    ) -> BurnerForces<'a> {
        let (burner, forces) = (&self.constants.burners[index], &self.parameters.forces);
        BurnerForces {
            wind_field,
            rings: self.rings(index, &axis, t),
            axis,
            eddies: self.eddies(index, surroundings, t),
            turbulence: forces.turbulence as f32,
            turbulent_age: TURBULENT_AGE * burner.rise_time() as f32,
            entrainment: (forces.entrainment / (0.5 * burner.diameter)) as f32,
            drag: (CROSS_DRAG * forces.wind_response / (0.5 * burner.diameter)) as f32,
            burned_per_meter: (BURNED_PER_HEIGHT / burner.height) as f32,
            burned_per_second: (BURNED_PER_RISE_TIME / burner.rise_time()) as f32,
        }
    }

    fn rings(self, index: usize, axis: &PlumeAxis, t: f64) -> Vec<VortexRing> {
        active_rings(&self.constants.burners[index], self.parameters, self.key, index as u32, t, axis)
    }

    fn eddies(self, index: usize, surroundings: &Surroundings, t: f64) -> EddyField<'a> {
        let (burner, forces) = (&self.constants.burners[index], &self.parameters.forces);
        let drift = surroundings.wind.travel(0.0, t) * (EDDY_DRIFT * forces.wind_response);
        self.turbulence.at(t, forces.eddy_size * burner.diameter, burner.axis_speed(0.5 * burner.height), drift)
    }
}

/// Bounding box of the particles of each burner.
fn bounds(particles: &GasParticles, burners: usize) -> Vec<[Vec3; 2]> {
    let tasks = (0..particles.len()).into_par_iter().step_by(PARTICLES_PER_TASK);
    let bounds_of_tasks =
        tasks.map(|first| bounds_of(particles, burners, first..(first + PARTICLES_PER_TASK).min(particles.len())));
    let mut bounds = bounds_of_tasks.reduce_with(unite_bounds).unwrap_or_else(|| vec![NO_BOUNDS; burners]);
    for [low, high] in &mut bounds {
        // A burner without particles gets a unit box: its wind is not used.
        let has_particles = low.x <= high.x;
        if !has_particles {
            (*low, *high) = (Vec3::ZERO, Vec3::ONE);
        }
    }
    bounds
}

/// Bounds that contain nothing.
const NO_BOUNDS: [Vec3; 2] = [Vec3::INFINITY, Vec3::NEG_INFINITY];

/// Bounding box of the particles of each burner among those of a range.
fn bounds_of(particles: &GasParticles, burners: usize, range: Range<usize>) -> Vec<[Vec3; 2]> {
    let [x, y, z] = particles.positions();
    let mut bounds = vec![NO_BOUNDS; burners];
    for index in range {
        let position = Vec3::new(x[index], y[index], z[index]);
        let [low, high] = &mut bounds[particles.burner[index] as usize];
        (*low, *high) = (low.min(position), high.max(position));
    }
    bounds
}

/// The boxes around both boxes of each burner.
fn unite_bounds(mut bounds: Vec<[Vec3; 2]>, others: Vec<[Vec3; 2]>) -> Vec<[Vec3; 2]> {
    for ([low, high], [other_low, other_high]) in bounds.iter_mut().zip(others) {
        (*low, *high) = (low.min(other_low), high.max(other_high));
    }
    bounds
}

/// The forces on the gas of one burner.
pub(crate) struct BurnerForces<'a> {
    /// The wind around it.
    pub(crate) wind_field: WindField,
    pub(crate) rings: Vec<VortexRing>,
    pub(crate) axis: PlumeAxis,
    pub(crate) eddies: EddyField<'a>,
    pub(crate) turbulence: f32,
    /// Age at which turbulence has grown to half its strength, s.
    pub(crate) turbulent_age: f32,
    /// Entrainment coefficient divided by the radius of the fire, 1/m.
    pub(crate) entrainment: f32,
    /// Drag coefficient of cross wind divided by the radius of the fire, 1/m.
    pub(crate) drag: f32,
    /// Fraction of its fuel that gas burns per meter of travel.
    pub(crate) burned_per_meter: f32,
    /// Fraction of its fuel that gas burns per second.
    pub(crate) burned_per_second: f32,
}

/// Velocity of the air at the positions of particles, m/s.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AirVelocity<R> {
    /// Velocity of vortex rings and of the inflow toward the axis.
    pub(crate) steady: [R; 3],
    /// Velocity of eddies of unit strength.
    pub(crate) eddies: [R; 3],
}

impl BurnerForces<'_> {
    /// Entrainment rate, mass of entrained air per mass of gas, 1/s: `alpha |u - w| / (D / 2)`, half of that for enclosed gas.
    #[inline(always)]
    pub(crate) fn mixing<R: Real>(&self, velocity: &[R; 3], wind: &[R; 3], air_exposure: R) -> R {
        length(&subtract(velocity, wind)) * linear(air_exposure, self.entrainment, 0.5 * self.entrainment)
    }

    /// Velocity by which the air advects gas of that speed and age, m/s. Turbulence grows with age and is proportional to the speed.
    #[inline(always)]
    pub(crate) fn advection_velocity<R: Real>(&self, air: &AirVelocity<R>, speed: R, age: R) -> [R; 3] {
        let growth = age / (age + age.broadcast(self.turbulent_age));
        add_scaled(&air.steady, &air.eddies, scaled(speed * growth, self.turbulence))
    }

    /// Velocity of the air at sixteen positions.
    #[inline(always)]
    pub(crate) fn air_velocity<S: Simd>(&self, simd: S, position: &[Lanes<S>; 3]) -> AirVelocity<Lanes<S>> {
        let mut steady = self.axis.velocity(simd, position);
        for ring in &self.rings {
            ring.add_velocity(position, &mut steady);
        }
        let none = [Lanes::splat(simd, 0.0); 3];
        let eddies = if self.turbulence > 0.0 { self.eddies.velocity(simd, position) } else { none };
        AirVelocity { steady, eddies }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use bansho_base::{
        host::assets::MemoryAssets,
        math::{random::Key, simd::Lanes},
        world::{
            air::Air,
            wind::{Wind, WindParameters},
        },
    };

    use super::*;
    use crate::particles::{
        parameters::BurnerParameters,
        simulate::{Simulation, SimulationConstants},
    };

    #[test]
    fn each_burner_feels_the_wind_that_blows_where_it_stands() {
        let burners = [0.0, 50.0].map(|x| BurnerParameters { position: [x, 0.0, 0.0].into(), ..Default::default() });
        let parameters = FlameParticlesParameters {
            burners: burners.to_vec(),
            particles: 600,
            ..FlameParticlesParameters::default()
        };
        let constants = DerivedConstants::new(&parameters, None, &MemoryAssets::default()).unwrap();
        let shared = SimulationConstants::new(parameters, constants, Key::new(1, "flame"));
        let mut simulation = Simulation::new(Arc::new(shared));
        let gusty = WindParameters { velocity: [2.0, 0.0, 0.0].into(), gust: 1.5, ..WindParameters::default() };
        let (wind, air) = (Wind::new(gusty, 3, None), Air::default());
        let surroundings = Surroundings { air: &air, ..Surroundings::from_wind(&wind) };
        (0..30).for_each(|step| simulation.step(f64::from(step) * simulation.step_s(), &surroundings));
        let SimulationConstants { parameters, derived: constants, turbulence, key, .. } = &*simulation.shared;
        let step = StepConstants { parameters, constants, turbulence, key: *key };
        let forces = ExternalForces::new(step, &simulation.particles, &surroundings, 0.25);
        let at = |burner: usize, position: Vec3| {
            bansho_base::dispatch_baseline!(simd => {
                let lanes = position.to_array().map(|x| Lanes::splat(simd, x));
                Vec3::from(forces.burner_forces[burner].wind_field.at(simd, &lanes).map(|values| values.as_slice()[0]))
            })
        };
        let (particles, mut off, mut apart) = (&simulation.particles, 0.0_f32, 0.0_f32);
        for index in 0..particles.len() {
            let position = Vec3::from(particles.positions().map(|values| values[index]));
            let exact = wind.at(position.as_dvec3(), 0.25).as_vec3();
            let [own, other] = [0, 1].map(|swap| at(particles.burner[index] as usize ^ swap, position));
            off = off.max((own - exact).length());
            apart = apart.max((other - exact).length());
        }
        assert!(off < 0.4 && apart > 4.0, "{off} m/s off the wind, that of the other burner {apart}");
    }
}
