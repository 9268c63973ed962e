//! What a step makes of gas beside moving it: it evens out with its neighbours, mixes with air, burns and cools; sixteen particles at a time.

use std::ops::Range;

use fearless_simd::Simd;

use bansho_base::math::simd::Real;

use super::{Being, Exposure, Laws};
use crate::particles::simulate::{
    forces::{burner_forces::Draught, external_forces::Weather},
    neighbor_sums::{Beside, Neighbourhood},
    particle_lanes::{Rows, Still, Work, burner_by_burner},
    particles::Particles,
    vector_lanes::{length, plus},
};
use bansho_sph::KernelShape;

/// Time in which `viscosity` and `conduction` say how far neighbours even out, s.
const EVENING_TIME: f32 = 0.01;
/// Share of the difference to the neighbours that a step evens out at most: a particle among thinner gas has more than its share of them,
/// and shall not come out beyond them all.
const MOST_EVENED: f32 = 0.5;
/// Mean distance of the neighbours from a particle on a flat surface of the gas, in support radii.
const SURFACE_OFFSET: f32 = 0.2;
/// Share of its own in a particle's density: from there on it counts as alone, fully after as much more.
const ALONE_SHARE: [f32; 2] = [0.2, 0.5];

/// What acts on the gas for `seconds`.
pub(crate) struct Living<'a> {
    pub(crate) laws: &'a Laws,
    pub(crate) weather: &'a Weather<'a>,
    pub(crate) beside: &'a Beside,
    /// How far neighbours even out velocity and temperature in [`EVENING_TIME`].
    pub(crate) evening: [f32; 2],
    /// How long burnt gas stays, s.
    pub(crate) afterlife: f32,
    /// Support radius d, m.
    pub(crate) radius: f32,
    pub(crate) seconds: f32,
}

/// What living reads of particles and does not change.
#[derive(Clone, Copy)]
struct Unlived<'a> {
    position: [&'a [f32]; 3],
    age: &'a [f32],
    hunger: &'a [f32],
    density: &'a [f32],
    /// The particle's own weight among its neighbours', and the sums over all.
    weight: &'a [f32],
    sums: [&'a [f32]; 8],
}

impl Still for Unlived<'_> {
    fn part(self, range: Range<usize>) -> Self {
        Self {
            position: self.position.map(|values| &values[range.clone()]),
            age: &self.age[range.clone()],
            hunger: &self.hunger[range.clone()],
            density: &self.density[range.clone()],
            weight: &self.weight[range.clone()],
            sums: self.sums.map(|values| &values[range.clone()]),
        }
    }
}

impl<'a> Work<Unlived<'a>, 9> for Living<'_> {
    #[inline(always)]
    fn rows<S: Simd>(
        &self,
        simd: S,
        draught: &Draught,
        rows: Rows,
        still: Unlived<'a>,
        [u, v, w, temperature, fuel, soot, support_radius, life, edge]: &mut [&mut [f32]; 9],
    ) {
        let beside = Neighbourhood::from(rows.load_all(simd, still.sums));
        let to_air = self.to_air(rows.load(simd, still.weight), &beside);
        let velocity = rows.load_all(simd, [u, v, w]);
        let wind = draught.breeze.at(simd, &rows.load_all(simd, still.position));
        let [viscosity, conduction] = self.evened(rows.load(simd, still.density));
        let old = Being {
            temperature: conduction.fma(beside.temperature, rows.load(simd, temperature)),
            fuel: rows.load(simd, fuel),
            soot: rows.load(simd, soot),
            support_radius: rows.load(simd, support_radius),
        };
        let mixing = draught.mixing(&velocity, &wind, to_air);
        let burning = rows.load(simd, still.hunger) * self.burning(draught, length(&velocity));
        let being = self.laws.live(old, &self.exposure(to_air, mixing, burning, old.temperature), self.seconds);
        let [age, end] = rows.load_all(simd, [still.age, life]);
        rows.store(self.end(&old, &being, age, end), life);
        rows.store(being.temperature, temperature);
        rows.store(being.fuel, fuel);
        rows.store(being.soot, soot);
        rows.store(being.support_radius, support_radius);
        rows.store(to_air, edge);
        let velocity = plus(&velocity, &beside.velocity, viscosity);
        for (batch, array) in velocity.into_iter().zip([u, v, w]) {
            rows.store(batch, array);
        }
    }
}

impl Living<'_> {
    /// Lets the particles live, and writes down how much of each lies at the edge of the gas.
    pub(crate) fn pass(&self, particles: &mut Particles, to_air: &mut Vec<f32>) {
        to_air.resize(particles.len(), 0.0);
        let Particles { velocity: [u, v, w], temperature, fuel, soot, support_radius, life, .. } = particles;
        let still = Unlived {
            position: particles.position.each_ref().map(Vec::as_slice),
            age: &particles.age,
            hunger: &particles.hunger,
            density: &particles.density,
            weight: &self.beside.weights,
            sums: self.beside.sums.each_ref().map(Vec::as_slice),
        };
        let living = [u, v, w, temperature, fuel, soot, support_radius, life, to_air];
        burner_by_burner(self, &self.weather.draughts, &particles.burner, still, living);
    }

    /// How much of a particle lies at the edge of the gas: neighbours all on one side, or none.
    #[inline(always)]
    fn to_air<R: Real>(&self, weight: R, beside: &Neighbourhood<R>) -> R {
        let like = |value: f32| weight.broadcast(value);
        let one_over_sum = like(1.0) / beside.weight.simd_max(like(f32::MIN_POSITIVE));
        let offset = length(&beside.way) * one_over_sum * like(1.0 / (self.radius * SURFACE_OFFSET));
        let own = weight * one_over_sum * like(KernelShape::Poly6.at_centre::<3>(self.radius));
        let alone = (own - like(ALONE_SHARE[0])) * like(1.0 / ALONE_SHARE[1]);
        offset.simd_max(alone).simd_clamp01()
    }

    /// What of the difference to the neighbours is evened out in velocity and temperature.
    #[inline(always)]
    fn evened<R: Real>(&self, density: R) -> [R; 2] {
        let share = |evening: f32| (evening * self.seconds / EVENING_TIME).min(MOST_EVENED);
        let per_weight = density.simd_rsqrt();
        [per_weight * density.broadcast(share(self.evening[0])), per_weight * density.broadcast(share(self.evening[1]))]
    }

    /// Share of a mean particle's fuel that burns at a speed, 1/s.
    #[inline(always)]
    fn burning<R: Real>(&self, draught: &Draught, speed: R) -> R {
        speed.fma(speed.broadcast(draught.burning[0]), speed.broadcast(draught.burning[1]))
    }

    #[inline(always)]
    fn exposure<R: Real>(&self, to_air: R, mixing: R, burning: R, temperature: R) -> Exposure<R> {
        let density = to_air.broadcast(self.weather.density_kelvin) / temperature.simd_max(to_air.broadcast(1.0));
        let air_temperature = self.weather.air_temperature;
        Exposure { to_air, mixing, burning, density, air_temperature, smallest_radius: self.radius }
    }

    /// Age at which a particle is removed: that which it had, or where it has just burnt out after its afterlife.
    #[inline(always)]
    fn end<R: Real>(&self, old: &Being<R>, new: &Being<R>, age: R, end: R) -> R {
        let none = age.broadcast(f32::MIN_POSITIVE);
        let burnt_out = old.fuel.select_lt(none, end, age + age.broadcast(self.afterlife));
        new.fuel.select_lt(none, burnt_out, end)
    }
}
