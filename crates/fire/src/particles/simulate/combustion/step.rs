//! What a step makes of gas beside moving it: it evens out with its neighbours, mixes with air, burns and cools; sixteen particles at a time.

use std::ops::Range;

use fearless_simd::Simd;

use bansho_base::math::simd::Real;

use super::{AmbientConditions, CombustionModel, ParticleState};
use crate::particles::simulate::{
    forces::{burner_forces::BurnerForces, external_forces::ExternalForces},
    neighbor_sums::{NeighborSums, Neighborhood},
    particle_lanes::{BatchUpdate, RowBatch, SharedColumns, for_each_burner_batch},
    particles::Particles,
    vector_lanes::{add_scaled, length},
};
use bansho_sph::KernelShape;

/// Time in which `viscosity` and `conduction` say how far neighbours even out, s.
const SMOOTHING_TIME: f32 = 0.01;
/// Share of the difference to the neighbours that a step evens out at most: a particle among thinner gas has more than its share of them,
/// and shall not come out beyond them all.
const MAX_SMOOTHING: f32 = 0.5;
/// Mean distance of the neighbours from a particle on a flat surface of the gas, in support radii.
const SURFACE_OFFSET: f32 = 0.2;
/// Share of its own in a particle's density: from there on it counts as isolated, fully after as much more.
const ISOLATED_FRACTION: [f32; 2] = [0.2, 0.5];

/// What acts on the gas for `seconds`.
pub(crate) struct CombustionStep<'a> {
    pub(crate) combustion: &'a CombustionModel,
    pub(crate) forces: &'a ExternalForces<'a>,
    pub(crate) neighbor_sums: &'a NeighborSums,
    /// How far neighbours even out velocity and temperature in [`SMOOTHING_TIME`].
    pub(crate) smoothing: [f32; 2],
    /// How long burnt gas stays, s.
    pub(crate) afterlife: f32,
    /// Support radius d, m.
    pub(crate) radius: f32,
    pub(crate) seconds: f32,
}

/// What living reads of particles and does not change.
#[derive(Clone, Copy)]
struct CombustionInputs<'a> {
    position: [&'a [f32]; 3],
    age: &'a [f32],
    burn_rate: &'a [f32],
    density: &'a [f32],
    /// The particle's own weight among its neighbours', and the sums over all.
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
    fn rows<S: Simd>(
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
    /// Lets the particles live, and writes down how much of each lies at the edge of the gas.
    pub(crate) fn update_thermochemistry(&self, particles: &mut Particles, air_exposure: &mut Vec<f32>) {
        air_exposure.resize(particles.len(), 0.0);
        let Particles { velocity: [u, v, w], temperature, fuel, soot, support_radius, max_age, .. } = particles;
        let inputs = CombustionInputs {
            position: particles.position.each_ref().map(Vec::as_slice),
            age: &particles.age,
            burn_rate: &particles.burn_rate,
            density: &particles.density,
            weight: &self.neighbor_sums.weights,
            sums: self.neighbor_sums.sums.each_ref().map(Vec::as_slice),
        };
        let living = [u, v, w, temperature, fuel, soot, support_radius, max_age, air_exposure];
        for_each_burner_batch(self, &self.forces.burner_forces, &particles.burner, inputs, living);
    }

    /// How much of a particle lies at the edge of the gas: neighbours all on one side, or none.
    #[inline(always)]
    fn air_exposure<R: Real>(&self, weight: R, neighborhood: &Neighborhood<R>) -> R {
        let splat = |value: f32| weight.broadcast(value);
        let one_over_sum = splat(1.0) / neighborhood.weight.simd_max(splat(f32::MIN_POSITIVE));
        let offset = length(&neighborhood.offset) * one_over_sum * splat(1.0 / (self.radius * SURFACE_OFFSET));
        let own = weight * one_over_sum * splat(KernelShape::Poly6.at_center::<3>(self.radius));
        let isolated = (own - splat(ISOLATED_FRACTION[0])) * splat(1.0 / ISOLATED_FRACTION[1]);
        offset.simd_max(isolated).simd_clamp01()
    }

    /// What of the difference to the neighbours is smoothing_weights out in velocity and temperature.
    #[inline(always)]
    fn smoothing_weights<R: Real>(&self, density: R) -> [R; 2] {
        let fraction = |smoothing: f32| (smoothing * self.seconds / SMOOTHING_TIME).min(MAX_SMOOTHING);
        let per_weight = density.simd_rsqrt();
        [
            per_weight * density.broadcast(fraction(self.smoothing[0])),
            per_weight * density.broadcast(fraction(self.smoothing[1])),
        ]
    }

    /// Share of a mean particle's fuel that burns at a speed, 1/s.
    #[inline(always)]
    fn burn_rate_at_speed<R: Real>(&self, burner: &BurnerForces, speed: R) -> R {
        speed.fma(speed.broadcast(burner.burning[0]), speed.broadcast(burner.burning[1]))
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
        AmbientConditions { air_exposure, mixing, burning, density, air_temperature, smallest_radius: self.radius }
    }

    /// Age at which a particle is removed: that which it had, or where it has just burnt out after its afterlife.
    #[inline(always)]
    fn removal_age<R: Real>(&self, old: &ParticleState<R>, new: &ParticleState<R>, age: R, removal_age: R) -> R {
        let none = age.broadcast(f32::MIN_POSITIVE);
        let burnt_out = old.fuel.select_lt(none, removal_age, age + age.broadcast(self.afterlife));
        new.fuel.select_lt(none, burnt_out, removal_age)
    }
}
