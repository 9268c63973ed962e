//! Time integration of a sub-step: pressure, buoyancy, wind, and advection by the air; sixteen particles at a time.

use std::ops::Range;

use bansho_base::math::{
    Vec3,
    simd::{LANES, Lanes, Real},
};
use fearless_simd::{Simd, prelude::*};

use super::{
    collision::Colliders,
    particle_lanes::{BatchUpdate, RowBatch, SharedColumns, for_each_burner_batch},
    particles::GasParticles,
};
use crate::particles::{
    parameters::WindForce,
    simulate::{
        forces::external_forces::{BurnerForces, ExternalForces},
        vectors::{add_scaled, clamp_length, length, scaled, subtract},
    },
};

/// Maximum speed of gas, m/s.
pub(crate) const MAX_SPEED: f32 = 150.0;
/// Distance that gas keeps from solids, in support radii.
pub(crate) const CLEARANCE: f32 = 0.2;
/// Minimum density by which a force per volume is divided, kg/m^3.
const MIN_DENSITY: f32 = 1e-6;

/// Maximum acceleration by pressure, m/s^2: it moves a particle by at most d/4 in `seconds`.
pub(crate) fn max_acceleration(radius: f32, seconds: f32) -> f32 {
    0.25 * radius / (seconds * seconds)
}

/// One sub-step of `seconds`.
pub(crate) struct IntegrationStep<'a> {
    pub(crate) forces: &'a ExternalForces<'a>,
    /// Accelerations by pressure, m/s^2.
    pub(crate) acceleration: [&'a [f32]; 3],
    /// Exposure to air of each particle, 0 to 1.
    pub(crate) air_exposure: &'a [f32],
    /// Support radius d, m.
    pub(crate) radius: f32,
    pub(crate) seconds: f32,
}

/// Inputs of the forces on a particle.
#[derive(Clone, Copy, Debug)]
struct ForceInputs<R> {
    velocity: [R; 3],
    /// Velocity without `drift`, the velocity by which the air's motion advects the particle.
    own_velocity: [R; 3],
    acceleration: [R; 3],
    temperature: R,
    density: R,
    air_exposure: R,
}

/// Particle columns that the integration reads.
#[derive(Clone, Copy)]
struct IntegrationInputs<'a> {
    acceleration: [&'a [f32]; 3],
    temperature: &'a [f32],
    density: &'a [f32],
    air_exposure: &'a [f32],
}

impl SharedColumns for IntegrationInputs<'_> {
    fn slice(self, range: Range<usize>) -> Self {
        Self {
            acceleration: self.acceleration.map(|values| &values[range.clone()]),
            temperature: &self.temperature[range.clone()],
            density: &self.density[range.clone()],
            air_exposure: &self.air_exposure[range],
        }
    }
}

impl<'a> BatchUpdate<IntegrationInputs<'a>, 10> for IntegrationStep<'_> {
    #[inline(always)]
    fn update<S: Simd>(
        &self,
        simd: S,
        burner: &BurnerForces,
        rows: RowBatch,
        inputs: IntegrationInputs<'a>,
        [x, y, z, u, v, w, d, e, f, age]: &mut [&mut [f32]; 10],
    ) {
        let position = rows.load_all(simd, [x, y, z]);
        let velocity = rows.load_all(simd, [u, v, w]);
        let gas = ForceInputs {
            velocity,
            own_velocity: subtract(&velocity, &rows.load_all(simd, [d, e, f])),
            acceleration: rows.load_all(simd, inputs.acceleration),
            temperature: rows.load(simd, inputs.temperature),
            density: rows.load(simd, inputs.density),
            air_exposure: rows.load(simd, inputs.air_exposure),
        };
        let wind = burner.wind_field.at(simd, &position);
        let own_velocity = self.apply_forces(burner, &gas, &wind);
        let age_before = rows.load(simd, age);
        let drift = burner.advection_velocity(&burner.air_velocity(simd, &position), length(&own_velocity), age_before);
        let velocity = clamp_length(&add_scaled(&own_velocity, &drift, age_before.broadcast(1.0)), MAX_SPEED);
        let after = self.advect(simd, position, [velocity, drift], rows.0.len());
        for (values, arrays) in after.into_iter().zip([[x, y, z], [u, v, w], [d, e, f]]) {
            for (batch, array) in values.into_iter().zip(arrays) {
                rows.store(batch, array);
            }
        }
        rows.store(age_before + age_before.broadcast(self.seconds), age);
    }
}

impl IntegrationStep<'_> {
    /// Advances velocities, positions and ages.
    pub(crate) fn advance(&self, particles: &mut GasParticles) {
        let GasParticles { position: [x, y, z], velocity: [u, v, w], drift: [d, e, f], age, .. } = particles;
        let inputs = IntegrationInputs {
            acceleration: self.acceleration,
            temperature: &particles.temperature,
            density: &particles.density,
            air_exposure: self.air_exposure,
        };
        let columns = [x, y, z, u, v, w, d, e, f, age];
        for_each_burner_batch(self, &self.forces.burner_forces, &particles.burner, inputs, columns);
    }

    /// Velocity without drift after pressure, buoyancy and wind.
    #[inline(always)]
    fn apply_forces<R: Real>(&self, burner: &BurnerForces, gas: &ForceInputs<R>, wind: &[R; 3]) -> [R; 3] {
        let Self { forces, seconds, .. } = *self;
        let one = gas.density.broadcast(1.0);
        let mut acceleration = clamp_length(&gas.acceleration, max_acceleration(self.radius, seconds));
        let density_ratio = scaled(gas.temperature, 1.0 / forces.air_temperature);
        acceleration[1] = (density_ratio - one).fma(one.broadcast(forces.buoyancy), acceleration[1]);
        let per_volume = forces.wind == WindForce::BodyForce;
        if per_volume {
            let density = gas.density.simd_max(one.broadcast(MIN_DENSITY));
            acceleration = add_scaled(&acceleration, wind, one.broadcast(forces.wind_response) / density);
        }
        let accelerated = add_scaled(&gas.own_velocity, &acceleration, one.broadcast(seconds));
        // Entrained air adds its momentum.
        let gain = if per_volume { 0.0 } else { forces.wind_response };
        let air = [scaled(wind[0], gain), scaled(wind[1], gain), scaled(wind[2], gain)];
        let rate = scaled(burner.mixing(&gas.velocity, wind, gas.air_exposure), seconds);
        let mix_weight = one / (rate + one);
        let mut mixed = add_scaled(&accelerated, &air, rate);
        for c in 0..3 {
            mixed[c] = mixed[c] * mix_weight;
        }
        let mixed = clamp_length(&mixed, MAX_SPEED);
        if per_volume { mixed } else { self.apply_cross_drag(burner, &mixed, &air, density_ratio) }
    }

    /// Velocity after the drag of cross wind, horizontal and implicit: `C rho_air / (rho r) |w - u| (w - u)`.
    ///
    /// Hot gas is several times less dense than air, so that wind deflects it even where little air is entrained.
    #[inline(always)]
    fn apply_cross_drag<R: Real>(
        &self,
        burner: &BurnerForces,
        velocity: &[R; 3],
        air: &[R; 3],
        density_ratio: R,
    ) -> [R; 3] {
        let mut across = subtract(air, velocity);
        across[1] = density_ratio.broadcast(0.0);
        let rate = density_ratio * length(&across) * density_ratio.broadcast(burner.drag * self.seconds);
        add_scaled(velocity, &across, rate / (rate + rate.broadcast(1.0)))
    }

    /// Positions, velocities and drift velocities after advection and collisions; the first `count` lanes are valid.
    #[inline(always)]
    fn advect<S: Simd>(
        &self,
        simd: S,
        position: [Lanes<S>; 3],
        [velocity, drift]: [[Lanes<S>; 3]; 2],
        count: usize,
    ) -> [[Lanes<S>; 3]; 3] {
        if self.forces.occluders.is_empty() {
            return [add_scaled(&position, &velocity, position[0].broadcast(self.seconds)), velocity, drift];
        }
        let mut vectors = [position, velocity, drift];
        let mut lanes = [[[0.0; LANES]; 3]; 3];
        for (batches, lanes) in vectors.iter().zip(&mut lanes) {
            for c in 0..3 {
                batches[c].store_slice(&mut lanes[c]);
            }
        }
        self.resolve_collisions(&mut lanes, count);
        for (batches, lanes) in vectors.iter_mut().zip(&lanes) {
            for c in 0..3 {
                batches[c] = Lanes::from_slice(simd, &lanes[c]);
            }
        }
        vectors
    }

    /// Moves the first `count` lanes, one by one, with collisions.
    #[inline(never)]
    fn resolve_collisions(&self, vectors: &mut [[[f32; LANES]; 3]; 3], count: usize) {
        let ExternalForces { occluders, origin, .. } = *self.forces;
        let colliders = Colliders { occluders, origin, clearance: CLEARANCE * self.radius };
        for lane in 0..count {
            let [position, velocity, drift] = vectors.map(|all| Vec3::from(all.map(|values| values[lane])));
            let (position, [new_velocity, own_velocity]) =
                colliders.collide(position, velocity * self.seconds, [velocity, velocity - drift]);
            // A collision that removes drift must not increase the velocity without drift, to which eddies are proportional.
            let drift = if new_velocity == velocity { drift } else { new_velocity - own_velocity };
            for (all, vector) in vectors.iter_mut().zip([position, new_velocity, drift]) {
                for c in 0..3 {
                    all[c][lane] = vector[c];
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::{
        host::assets::MemoryAssets,
        math::random::{Key, Purpose, uniform},
        phenomenon::surroundings::Surroundings,
        world::wind::{Wind, WindParameters},
    };

    use super::*;
    use crate::particles::{
        parameters::{FlameParticlesParameters, ForceParameters},
        simulate::{
            derived::DerivedConstants,
            forces::{external_forces::StepConstants, turbulence::TurbulenceTile},
        },
    };

    /// Inputs of particle `number`, and the wind at it.
    fn accelerated(number: u64) -> (ForceInputs<f32>, [f32; 3]) {
        let key = Key::new(4, "pushed");
        let vector = |step: u32| {
            let [x, y, z, _] = key.words(number, step, Purpose(0)).map(|word| 8.0 * uniform(word) - 4.0);
            [x, y, z]
        };
        let [temperature, density, air_exposure, _] = key.words(number, 9, Purpose(0)).map(uniform);
        let acceleration = vector(2).map(|component| component * 300.0);
        let (temperature, density) = (300.0 + 1500.0 * temperature, 0.1 + density);
        (
            ForceInputs {
                velocity: vector(0),
                own_velocity: vector(1),
                acceleration,
                temperature,
                density,
                air_exposure,
            },
            vector(3),
        )
    }

    #[test]
    fn one_particle_and_sixteen_are_pushed_alike() {
        for wind in [WindForce::Entrainment, WindForce::BodyForce] {
            let motion = ForceParameters { wind_model: wind, ..ForceParameters::default() };
            let parameters = FlameParticlesParameters { forces: motion, ..FlameParticlesParameters::default() };
            let constants = DerivedConstants::new(&parameters, None, &MemoryAssets::default()).unwrap();
            let (key, wind_field) = (Key::new(1, "flame"), Wind::new(WindParameters::default(), 1, None));
            let turbulence = TurbulenceTile::new(key);
            let step = StepConstants { parameters: &parameters, constants: &constants, turbulence: &turbulence, key };
            let around = Surroundings::from_wind(&wind_field);
            let forces = ExternalForces::new(step, &GasParticles::default(), &around, 0.0);
            let motion = IntegrationStep {
                forces: &forces,
                acceleration: [&[]; 3],
                air_exposure: &[],
                radius: 0.05,
                seconds: 0.005,
            };
            let burner = &forces.burner_forces[0];
            let all: Vec<_> = (0..LANES as u64).map(accelerated).collect();
            let together = bansho_base::dispatch_baseline!(simd => {
                let batch = |value: &dyn Fn(usize) -> f32| {
                    let values: [f32; LANES] = std::array::from_fn(value);
                    Lanes::from_slice(simd, &values)
                };
                let vector = |value: &dyn Fn(usize) -> [f32; 3]| [0, 1, 2].map(|c| batch(&|lane| value(lane)[c]));
                let gas = ForceInputs {
                    velocity: vector(&|lane| all[lane].0.velocity),
                    own_velocity: vector(&|lane| all[lane].0.own_velocity),
                    acceleration: vector(&|lane| all[lane].0.acceleration),
                    temperature: batch(&|lane| all[lane].0.temperature),
                    density: batch(&|lane| all[lane].0.density),
                    air_exposure: batch(&|lane| all[lane].0.air_exposure),
                };
                motion.apply_forces(burner, &gas, &vector(&|lane| all[lane].1)).map(|values| values.as_slice().to_vec())
            });
            for (lane, (gas, wind)) in all.iter().enumerate() {
                let alone = motion.apply_forces(burner, gas, wind);
                assert_eq!(together.each_ref().map(|values| values[lane]), alone);
                assert!(alone != gas.own_velocity);
            }
        }
    }
}
