//! How the air's own motion carries the gas of each burner: the draw toward the axis, vortex rings, eddies; sixteen particles at a time.

use fearless_simd::{Simd, prelude::*};

use bansho_base::math::simd::{Lanes, Real};

use super::{entrainment_axis::PlumeAxis, turbulence::EddyField, vortex_rings::VortexRing, wind::WindField};
use crate::particles::simulate::vector_lanes::{add_scaled, length, subtract};

/// What acts on the gas of one burner.
pub(crate) struct BurnerForces<'a> {
    /// The wind over it.
    pub(crate) wind_field: WindField,
    pub(crate) rings: Vec<VortexRing>,
    pub(crate) axis: PlumeAxis,
    pub(crate) eddies: EddyField<'a>,
    pub(crate) turbulence: f32,
    /// Age at which turbulence has grown to half its strength, s.
    pub(crate) turbulent_age: f32,
    /// Entrainment coefficient over the radius of the fire, 1/m.
    pub(crate) entrainment: f32,
    /// Coefficient of the drag of air that blows across, over the radius of the fire, 1/m.
    pub(crate) drag: f32,
    /// Share of its fuel that gas burns in a metre of its way, and in a second.
    pub(crate) burning: [f32; 2],
}

/// The air's motion at the places of particles, m/s.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AirVelocity<R> {
    /// That of rings and of the draw toward the axis.
    pub(crate) steady: [R; 3],
    /// That of eddies of unit strength.
    pub(crate) eddies: [R; 3],
}

impl BurnerForces<'_> {
    /// Share of its own mass that gas of such a velocity takes up from the air, 1/s.
    #[inline(always)]
    pub(crate) fn mixing<R: Real>(&self, velocity: &[R; 3], wind: &[R; 3], air_exposure: R) -> R {
        let splat = |value: f32| air_exposure.broadcast(value);
        length(&subtract(velocity, wind)) * air_exposure.fma(splat(self.entrainment), splat(0.5 * self.entrainment))
    }

    /// Velocity with which the air carries gas of `speed` and `age`, m/s.
    #[inline(always)]
    pub(crate) fn velocity<R: Real>(&self, flow: &AirVelocity<R>, speed: R, age: R) -> [R; 3] {
        let grown = age / (age + age.broadcast(self.turbulent_age));
        add_scaled(&flow.steady, &flow.eddies, speed * grown * age.broadcast(self.turbulence))
    }

    /// The motion at sixteen places.
    #[inline(always)]
    pub(crate) fn flow<S: Simd>(&self, simd: S, position: &[Lanes<S>; 3]) -> AirVelocity<Lanes<S>> {
        let mut steady = self.axis.velocity(simd, position);
        for ring in &self.rings {
            ring.add_velocity(position, &mut steady);
        }
        let none = [Lanes::splat(simd, 0.0); 3];
        let eddies = if self.turbulence > 0.0 { self.eddies.velocity(simd, position) } else { none };
        AirVelocity { steady, eddies }
    }
}
