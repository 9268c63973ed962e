//! Combustion and thermochemistry of particles: heating, fuel consumption, entrainment of air, soot formation, radiative cooling;
//! and XSPH smoothing of velocity and temperature.
//!
//! Sixteen particles at a time.

use std::ops::Range;

use bansho_base::math::simd::Real;
use bansho_sph::KernelShape;
use fearless_simd::Simd;

use crate::particles::{
    parameters::{CombustionParameters, TemperatureLaw},
    simulate::{
        fluid::{NeighborSums, Neighborhood},
        forces::external_forces::{BurnerForces, ExternalForces},
        particle_lanes::{BatchUpdate, RowBatch, SharedColumns, for_each_burner_batch},
        particles::GasParticles,
        vectors::{add_scaled, length, linear, scaled},
    },
};

/// Specific heat of hot air at constant pressure, J/(kg K).
const SPECIFIC_HEAT: f32 = 1200.0;
/// Stefan-Boltzmann constant, W/(m^2 K^4).
const STEFAN_BOLTZMANN: f32 = 5.670_374e-8;
/// Planck-mean absorption of soot, 1/(m K), per volume fraction (Tien 1968): `kappa = 1862 f_v T`.
const PLANCK_MEAN_SOOT_ABSORPTION: f32 = 1862.0;
/// Temperature in the interior of the flame, where gas lacks air, relative to that at the flame front.
pub(crate) const INNER_TEMPERATURE: f32 = 0.72;
/// Factor by which burnt gas cools faster by mixing than burning gas, in which heat release compensates for mixing.
const BURNT_MIXING_FACTOR: f32 = 2.5;
/// Range of the fuel fraction in which soot exists: below the first it oxidizes, above the second it has not yet formed.
const SOOT_FUEL_RANGE: [f32; 2] = [0.16, 0.97];
/// Interval of the fuel fraction over which soot forms.
const SOOT_FORMATION_WIDTH: f32 = 0.17;
/// Maximum growth factor of the support radius with which a particle is drawn.
const MAX_RADIUS_GROWTH: f32 = 3.0;

/// Thermochemical state of a particle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct ParticleState<R> {
    /// Temperature, K.
    pub(crate) temperature: R,
    /// Fraction of fuel left.
    pub(crate) fuel: R,
    /// Volume fraction of soot.
    pub(crate) soot: R,
    /// Support radius with which it is drawn, m.
    pub(crate) support_radius: R,
}

/// Conditions that a particle is exposed to during a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct AmbientConditions<R> {
    /// Fraction of the particle that is exposed to air: 0 inside the gas, 1 isolated.
    pub(crate) air_exposure: R,
    /// Entrainment rate: mass of air taken up per own mass, 1/s.
    pub(crate) mixing: R,
    /// Fuel consumption rate of a mean particle, 1/s.
    pub(crate) burning: R,
    /// Density of air at the particle's temperature, kg/m^3.
    pub(crate) density: R,
    /// Temperature of the air, K.
    pub(crate) air_temperature: f32,
    /// Support radius d at spawning, m.
    pub(crate) spawn_radius: f32,
}

/// Parameters of the combustion model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CombustionModel {
    /// Whether temperatures are simulated.
    simulates_temperature: bool,
    flame_temperature: f32,
    heating_time_s: f32,
    oxygen_dependence: f32,
    /// Volume fraction of soot in burning gas.
    soot_fraction: f32,
    /// Fraction of the soot that is not burned.
    smoke_fraction: f32,
    radiative_cooling: f32,
}

impl From<&CombustionParameters> for CombustionModel {
    fn from(parameters: &CombustionParameters) -> Self {
        Self {
            simulates_temperature: parameters.temperature_model == TemperatureLaw::Simulated,
            flame_temperature: parameters.flame_temperature_k as f32,
            heating_time_s: parameters.heating_time_s as f32,
            oxygen_dependence: parameters.oxygen_dependence as f32,
            soot_fraction: parameters.soot_ppm as f32 * 1e-6,
            smoke_fraction: parameters.smoke_fraction as f32,
            radiative_cooling: parameters.radiative_cooling as f32,
        }
    }
}

impl CombustionModel {
    /// The state after `seconds`.
    #[inline(always)]
    pub(crate) fn advance<R: Real>(
        &self,
        state: ParticleState<R>,
        conditions: &AmbientConditions<R>,
        seconds: f32,
    ) -> ParticleState<R> {
        // Exposed gas burns faster than the mean, enclosed gas slower; gas with an exposure of 1/3 burns at the mean rate.
        let air_factor =
            linear(conditions.air_exposure, 2.4 * self.oxygen_dependence, 1.0 - 0.8 * self.oxygen_dependence);
        let burned = scaled(conditions.burning * air_factor, seconds);
        let fuel = (state.fuel - burned).simd_max(burned.broadcast(0.0));
        // The volume grows by the entrained air: a radius by a third of that.
        let growth = linear(conditions.mixing, seconds * (1.0 / 3.0), 1.0);
        let max_radius = growth.broadcast(MAX_RADIUS_GROWTH * conditions.spawn_radius);
        ParticleState {
            fuel,
            temperature: if self.simulates_temperature {
                self.temperature(state, conditions, seconds)
            } else {
                state.temperature
            },
            soot: scaled(self.relative_soot(fuel), self.soot_fraction),
            support_radius: (state.support_radius * growth).simd_min(max_radius),
        }
    }

    /// Temperature after heating, mixing and radiation. Each is integrated implicitly, so that time steps of any length are stable.
    #[inline(always)]
    fn temperature<R: Real>(&self, state: ParticleState<R>, conditions: &AmbientConditions<R>, seconds: f32) -> R {
        let fuel = state.fuel;
        let air = fuel.broadcast(conditions.air_temperature);
        let front = linear(conditions.air_exposure.simd_sqrt(), 1.0 - INNER_TEMPERATURE, INNER_TEMPERATURE);
        let flame = scaled(front, self.flame_temperature);
        // Burning gas approaches the flame temperature, burnt gas that of the air.
        let none = fuel.broadcast(f32::MIN_POSITIVE);
        let target = fuel.select_lt(none, air, flame);
        let (heating, cooling) =
            (fuel.broadcast(seconds / self.heating_time_s), scaled(conditions.mixing, BURNT_MIXING_FACTOR * seconds));
        let temperature = relax_implicit(state.temperature, target, fuel.select_lt(none, cooling, heating));
        // 4 sigma kappa (T^4 - T_air^4) / (rho c_p), as a relaxation rate toward the temperature of the air: T^4 - T_air^4 is (T - T_air) times
        // (T^2 + T_air^2) (T + T_air).
        let absorption = scaled(state.soot * temperature, PLANCK_MEAN_SOOT_ABSORPTION);
        let fourth = temperature.fma(temperature, air * air) * (temperature + air);
        let power =
            scaled(absorption * fourth, self.radiative_cooling * 4.0 * STEFAN_BOLTZMANN * seconds / SPECIFIC_HEAT);
        relax_implicit(temperature, air, power / conditions.density)
    }

    /// Soot relative to that of burning gas: 0 in fresh gas, the smoke fraction in burnt gas.
    #[inline(always)]
    pub(crate) fn relative_soot<R: Real>(&self, fuel: R) -> R {
        let formed = scaled(fuel.broadcast(SOOT_FUEL_RANGE[1]) - fuel, 1.0 / SOOT_FORMATION_WIDTH).simd_smoothstep();
        let unburnt = scaled(fuel, 1.0 / SOOT_FUEL_RANGE[0]).simd_smoothstep();
        formed * linear(unburnt, 1.0 - self.smoke_fraction, self.smoke_fraction)
    }
}

/// One implicit Euler step of relaxation toward `target`; `rate` is the rate times the time step.
#[inline(always)]
fn relax_implicit<R: Real>(value: R, target: R, rate: R) -> R {
    rate.fma(target, value) / (rate + rate.broadcast(1.0))
}

/// Time to which the parameters `viscosity` and `conduction` refer, s.
const SMOOTHING_TIME: f32 = 0.01;
/// Maximum fraction of the difference to its neighbors that a step removes, so that particles next to gas of lower density, which have larger weights,
/// do not overshoot.
const MAX_SMOOTHING: f32 = 0.5;
/// Mean offset of the neighbors of a particle at a flat surface of the gas, in support radii.
const SURFACE_OFFSET: f32 = 0.2;
/// A particle starts to count as isolated where its own contribution to its density exceeds the first fraction, and is fully isolated where it exceeds
/// that by the second.
const ISOLATED_FRACTION: [f32; 2] = [0.2, 0.5];

/// One combustion step of all particles, over `seconds`.
pub(crate) struct CombustionStep<'a> {
    pub(crate) combustion: &'a CombustionModel,
    pub(crate) forces: &'a ExternalForces<'a>,
    pub(crate) neighbor_sums: &'a NeighborSums,
    /// XSPH smoothing of velocity over [`SMOOTHING_TIME`].
    pub(crate) viscosity: f32,
    /// XSPH smoothing of temperature over [`SMOOTHING_TIME`].
    pub(crate) conduction: f32,
    /// Time for which burnt gas remains, s.
    pub(crate) burnt_gas_lifetime_s: f32,
    /// Support radius d, m.
    pub(crate) radius: f32,
    pub(crate) seconds: f32,
}

/// Particle columns that the step reads.
#[derive(Clone, Copy)]
struct CombustionInputs<'a> {
    position: [&'a [f32]; 3],
    age: &'a [f32],
    burn_rate: &'a [f32],
    density: &'a [f32],
    /// The particle's own weight, and the sums over its neighbors.
    weight: &'a [f32],
    sums: [&'a [f32]; 8],
}

impl SharedColumns for CombustionInputs<'_> {
    fn slice(self, range: Range<usize>) -> Self {
        Self {
            position: self.position.map(|values| &values[range.clone()]),
            age: &self.age[range.clone()],
            burn_rate: &self.burn_rate[range.clone()],
            density: &self.density[range.clone()],
            weight: &self.weight[range.clone()],
            sums: self.sums.map(|values| &values[range.clone()]),
        }
    }
}

impl<'a> BatchUpdate<CombustionInputs<'a>, 9> for CombustionStep<'_> {
    #[inline(always)]
    fn update<S: Simd>(
        &self,
        simd: S,
        burner: &BurnerForces,
        rows: RowBatch,
        inputs: CombustionInputs<'a>,
        [u, v, w, temperature, fuel, soot, support_radius, max_age, exposure]: &mut [&mut [f32]; 9],
    ) {
        let neighborhood = Neighborhood::from(rows.load_all(simd, inputs.sums));
        let air_exposure = self.air_exposure(rows.load(simd, inputs.weight), &neighborhood);
        let velocity = rows.load_all(simd, [u, v, w]);
        let wind = burner.wind_field.at(simd, &rows.load_all(simd, inputs.position));
        let [viscosity, conduction] = self.smoothing_weights(rows.load(simd, inputs.density));
        let old = ParticleState {
            temperature: conduction.fma(neighborhood.temperature, rows.load(simd, temperature)),
            fuel: rows.load(simd, fuel),
            soot: rows.load(simd, soot),
            support_radius: rows.load(simd, support_radius),
        };
        let mixing = burner.mixing(&velocity, &wind, air_exposure);
        let burn_rate_at_speed = rows.load(simd, inputs.burn_rate) * self.burn_rate_at_speed(burner, length(&velocity));
        let state = self.combustion.advance(
            old,
            &self.ambient_conditions(air_exposure, mixing, burn_rate_at_speed, old.temperature),
            self.seconds,
        );
        let [age, removal_age] = rows.load_all(simd, [inputs.age, max_age]);
        rows.store(self.removal_age(&old, &state, age, removal_age), max_age);
        rows.store(state.temperature, temperature);
        rows.store(state.fuel, fuel);
        rows.store(state.soot, soot);
        rows.store(state.support_radius, support_radius);
        rows.store(air_exposure, exposure);
        let velocity = add_scaled(&velocity, &neighborhood.velocity, viscosity);
        for (batch, array) in velocity.into_iter().zip([u, v, w]) {
            rows.store(batch, array);
        }
    }
}

impl CombustionStep<'_> {
    /// Smooths, burns and cools all particles, and writes the exposure of each to air.
    pub(crate) fn update_thermochemistry(&self, particles: &mut GasParticles, air_exposure: &mut Vec<f32>) {
        air_exposure.resize(particles.len(), 0.0);
        let GasParticles { velocity: [u, v, w], temperature, fuel, soot, support_radius, max_age, .. } = particles;
        let inputs = CombustionInputs {
            position: particles.position.each_ref().map(Vec::as_slice),
            age: &particles.age,
            burn_rate: &particles.burn_rate,
            density: &particles.density,
            weight: &self.neighbor_sums.weights,
            sums: self.neighbor_sums.sums.each_ref().map(Vec::as_slice),
        };
        let columns = [u, v, w, temperature, fuel, soot, support_radius, max_age, air_exposure];
        for_each_burner_batch(self, &self.forces.burner_forces, &particles.burner, inputs, columns);
    }

    /// Exposure to air, from the offset of the mean position of the neighbors (at a surface) or from the lack of neighbors (isolated).
    #[inline(always)]
    fn air_exposure<R: Real>(&self, weight: R, neighborhood: &Neighborhood<R>) -> R {
        let one_over_sum = weight.broadcast(1.0) / neighborhood.weight.simd_max(weight.broadcast(f32::MIN_POSITIVE));
        let offset = scaled(length(&neighborhood.offset) * one_over_sum, 1.0 / (self.radius * SURFACE_OFFSET));
        let own_fraction = scaled(weight * one_over_sum, KernelShape::Poly6.at_center::<3>(self.radius));
        let isolated = scaled(own_fraction - weight.broadcast(ISOLATED_FRACTION[0]), 1.0 / ISOLATED_FRACTION[1]);
        offset.simd_max(isolated).simd_clamp01()
    }

    /// Weights with which differences of velocity and temperature to the neighbors are added.
    #[inline(always)]
    fn smoothing_weights<R: Real>(&self, density: R) -> [R; 2] {
        let per_weight = density.simd_rsqrt();
        [
            scaled(per_weight, self.smoothed_fraction(self.viscosity)),
            scaled(per_weight, self.smoothed_fraction(self.conduction)),
        ]
    }

    /// Fraction of the difference to its neighbors that a step removes; `smoothing` is that over [`SMOOTHING_TIME`].
    #[inline(always)]
    fn smoothed_fraction(&self, smoothing: f32) -> f32 {
        (smoothing * self.seconds / SMOOTHING_TIME).min(MAX_SMOOTHING)
    }

    /// Fuel consumption rate of a mean particle at a speed, 1/s.
    #[inline(always)]
    fn burn_rate_at_speed<R: Real>(&self, burner: &BurnerForces, speed: R) -> R {
        linear(speed, burner.burned_per_meter, burner.burned_per_second)
    }

    #[inline(always)]
    fn ambient_conditions<R: Real>(
        &self,
        air_exposure: R,
        mixing: R,
        burning: R,
        temperature: R,
    ) -> AmbientConditions<R> {
        let density =
            air_exposure.broadcast(self.forces.density_at_1_k) / temperature.simd_max(air_exposure.broadcast(1.0));
        let air_temperature = self.forces.air_temperature;
        AmbientConditions { air_exposure, mixing, burning, density, air_temperature, spawn_radius: self.radius }
    }

    /// Age at which a particle is removed: unchanged, or its age plus the lifetime of burnt gas where it has just burnt out.
    #[inline(always)]
    fn removal_age<R: Real>(&self, old: &ParticleState<R>, new: &ParticleState<R>, age: R, removal_age: R) -> R {
        let none = age.broadcast(f32::MIN_POSITIVE);
        let burnt_out = old.fuel.select_lt(none, removal_age, age + age.broadcast(self.burnt_gas_lifetime_s));
        new.fuel.select_lt(none, burnt_out, removal_age)
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::math::simd::{LANES, Lanes};
    use fearless_simd::prelude::*;

    use super::*;

    const STATE: ParticleState<f32> = ParticleState { temperature: 1200.0, fuel: 0.6, soot: 0.0, support_radius: 0.02 };
    const CONDITIONS: AmbientConditions<f32> = AmbientConditions {
        air_exposure: 1.0,
        mixing: 5.0,
        burning: 2.0,
        density: 0.25,
        air_temperature: 293.0,
        spawn_radius: 0.02,
    };

    fn combustion() -> CombustionModel {
        CombustionModel::from(&CombustionParameters::default())
    }

    fn after(mut state: ParticleState<f32>, conditions: AmbientConditions<f32>, seconds: f32) -> ParticleState<f32> {
        for _ in 0..1000 {
            state = combustion().advance(state, &conditions, seconds / 1000.0);
        }
        state
    }

    #[test]
    fn burning_gas_nears_the_flame_temperature_and_burnt_gas_the_air() {
        let hot = after(STATE, AmbientConditions { burning: 0.0, ..CONDITIONS }, 0.3);
        assert!((1600.0..1900.0).contains(&hot.temperature), "{}", hot.temperature);
        let cold = after(ParticleState { fuel: 0.0, ..STATE }, CONDITIONS, 2.0);
        assert!(cold.temperature < 294.0 && cold.soot == 0.0);
        assert!((cold.support_radius - 0.06).abs() < 1e-6);
    }

    #[test]
    fn the_outside_burns_first() {
        let inside = after(STATE, AmbientConditions { air_exposure: 0.1, ..CONDITIONS }, 0.2);
        let outside = after(STATE, CONDITIONS, 0.2);
        assert!(outside.fuel < inside.fuel);
        let mean = after(STATE, AmbientConditions { air_exposure: 1.0 / 3.0, ..CONDITIONS }, 0.2);
        assert!((mean.fuel - 0.2).abs() < 1e-3);
    }

    #[test]
    fn black_body_cooling_of_dense_soot_follows_the_fourth_power() {
        // dT/dt = -4 sigma kappa T^4 / (rho c_p), worked by hand at 1500 K with 1e-6 of soot.
        let combustion = CombustionModel { heating_time_s: 1e9, radiative_cooling: 1.0, ..combustion() };
        let state = ParticleState { temperature: 1500.0, soot: 1e-6, ..STATE };
        let cooled = combustion.advance(state, &AmbientConditions { mixing: 0.0, ..CONDITIONS }, 1e-5);
        let kappa = 1862.0 * 1e-6 * 1500.0;
        let fourth = |kelvin: f64| kelvin * kelvin * kelvin * kelvin;
        let by_hand = 4.0 * 5.670_374e-8 * kappa * (fourth(1500.0) - fourth(293.0)) / (0.25 * 1200.0) * 1e-5;
        assert!((f64::from(1500.0 - cooled.temperature) / by_hand - 1.0).abs() < 0.02);
    }

    #[test]
    fn one_particle_and_sixteen_live_alike() {
        let fuel_fractions: [f32; LANES] = std::array::from_fn(|lane| (lane as f32 - 2.0).max(0.0) * 0.07);
        let together = bansho_base::dispatch_baseline!(simd => {
            let fuel = Lanes::from_slice(simd, &fuel_fractions);
            let splat = |value: f32| Lanes::splat(simd, value);
            let temperature = fuel.fma(splat(1500.0), splat(400.0));
            let state = ParticleState { temperature, fuel, soot: splat(1e-6), support_radius: splat(0.02) };
            let conditions = AmbientConditions {
                air_exposure: fuel,
                mixing: splat(5.0),
                burning: splat(2.0),
                density: splat(0.25),
                air_temperature: 293.0,
                spawn_radius: 0.02,
            };
            let ParticleState { temperature, fuel, soot, support_radius } = combustion().advance(state, &conditions, 0.02);
            [temperature, fuel, soot, support_radius].map(|values| values.as_slice().to_vec())
        });
        for (lane, fuel) in fuel_fractions.into_iter().enumerate() {
            let state = ParticleState { temperature: fuel.fma(1500.0, 400.0), fuel, soot: 1e-6, ..STATE };
            let alone = combustion().advance(state, &AmbientConditions { air_exposure: fuel, ..CONDITIONS }, 0.02);
            let alone = [alone.temperature, alone.fuel, alone.soot, alone.support_radius];
            assert_eq!(together.each_ref().map(|values| values[lane]), alone, "with {fuel} of its fuel");
        }
    }

    #[test]
    fn constant_temperature_stays() {
        let combustion = CombustionModel { simulates_temperature: false, ..combustion() };
        assert_eq!(combustion.advance(STATE, &CONDITIONS, 0.1).temperature, 1200.0);
    }

    #[test]
    fn soot_forms_in_burning_gas_and_burns_unless_it_is_smoke() {
        let clean = combustion();
        assert_eq!((clean.relative_soot(1.0), clean.relative_soot(0.5), clean.relative_soot(0.0)), (0.0, 1.0, 0.0));
        let smoky = CombustionModel { smoke_fraction: 0.4, ..clean };
        assert!((smoky.relative_soot(0.0) - 0.4).abs() < 1e-6);
    }
}
