//! Effective lifetime of the emission and diffusion of the excited atoms.

use bansho_base::math;

use super::{
    emitter::SpectralEmitter,
    quenching::{lifetime, natural_lifetime},
};
use crate::physics::atmosphere::AirLevel;

/// Gyroradius of an electron of 1 eV perpendicular to a field of 50 microtesla, m: sqrt(2 m E) / (e B).
const GYRORADIUS_AT_1_EV: f64 = 0.067_4;
/// States with a shorter lifetime radiate where they are excited, s.
const PROMPT: f64 = 1e-3;

/// Coefficient of diffusion of O through the air, m^2/s (Colegrove et al. 1966: 9.69e16 T^0.774 / n cm^2/s for O in N2).
#[must_use]
pub(crate) fn diffusion_coefficient(air: &AirLevel) -> f64 {
    9.69e18 * math::pow(air.temperature, 0.774) / air.number_density()
}

/// Lifetime of an emitter at an altitude and diffusion of its atoms within it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LifetimeAndDiffusion {
    /// Mean lifetime, s: the light decays as exp(-t / lifetime).
    pub lifetime: f64,
    /// Variance of the displacement from excitation to emission per direction, m^2.
    pub diffusion_variance: f64,
}

impl LifetimeAndDiffusion {
    /// Of an emitter in this air. Excited atoms diffuse during their lifetime, with variance 2 D tau; it is visible in
    /// the red line only.
    #[must_use]
    pub fn new(emitter: SpectralEmitter, air: &AirLevel) -> Self {
        let lifetime = lifetime(emitter, air);
        let moves = natural_lifetime(emitter) > PROMPT;
        Self { lifetime, diffusion_variance: if moves { 2.0 * diffusion_coefficient(air) * lifetime } else { 0.0 } }
    }

    /// Standard deviation of the emission position about the field line of electrons of an energy, per direction, m:
    /// gyration and diffusion. Wind displaces all atoms alike and does not blur.
    #[must_use]
    pub fn spread(&self, energy_ev: f64) -> f64 {
        math::sqrt(GYRORADIUS_AT_1_EV * GYRORADIUS_AT_1_EV * energy_ev + self.diffusion_variance)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::atmosphere::atmosphere;

    #[test]
    fn diffusion_by_hand() {
        // 9.69e18 x 995.84^0.774 / 1.774e15 at 250 km.
        let diffusion = diffusion_coefficient(&atmosphere().at(250.0));
        assert!((diffusion / 1.143e6 - 1.0).abs() < 0.01, "{diffusion}");
    }

    #[test]
    fn spread_is_meters_for_prompt_light_and_kilometers_for_red() {
        let root = |emitter, altitude_km| LifetimeAndDiffusion::new(emitter, &atmosphere().at(altitude_km)).spread(1e4);
        assert!((root(SpectralEmitter::NitrogenIon, 110.0) - 6.74).abs() < 0.01);
        assert!((10.0..100.0).contains(&root(SpectralEmitter::OxygenGreen, 110.0)));
        assert!((5e3..2e4).contains(&root(SpectralEmitter::OxygenRed, 250.0)));
        assert!(root(SpectralEmitter::OxygenRed, 110.0) < 100.0);
    }
}
