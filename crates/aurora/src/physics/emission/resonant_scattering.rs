//! Sunlight that N2+ scatters in its first negative bands: the violet tops of rays that reach out of the Earth's shadow.
//!
//! # References
//! - A. L. Broadfoot, Planet. Space Sci. 15 (1967) 1801: sunlight scattered per ion.
//! - Lindinger et al. (1974), McFarland et al. (1973), Sheehan & St.-Maurice (2004): rates at which N2+ vanishes.

use bansho_base::math::{self, smoothstep};

use super::excitation::{ionization_fractions, n2_ion_charge_transfer_per_s};
use crate::physics::atmosphere::{AirLevel, level_altitude_km};

/// Photons of 391.4 nm per ion and second in full sunlight (Broadfoot 1967), and of 427.8 nm, in which the emitter is counted, per photon of it.
const PHOTONS_391_PER_ION_S: f64 = 0.050;
const PHOTONS_427_PER_391: f64 = 1.0 / 3.28;
/// Rate coefficient of the dissociative recombination of N2+ at 300 K (Sheehan & St.-Maurice 2004), m^3/s, its exponent of temperature, and a typical density of electrons in an aurora, m^-3.
const RECOMBINATION: f64 = 2.2e-13;
const RECOMBINATION_EXPONENT: f64 = -0.39;
const ELECTRONS: f64 = 1e11;
/// Half the width of the edge of the shadow, km: low air dims violet sunlight that grazes the Earth.
const PENUMBRA_KM: f64 = 20.0;

/// Mean life of an N2+ ion, s: it gives its charge to O or O2, or recombines.
fn mean_life(air: &AirLevel) -> f64 {
    let recombination = RECOMBINATION * math::pow(air.temperature / 300.0, RECOMBINATION_EXPONENT) * ELECTRONS;
    1.0 / (n2_ion_charge_transfer_per_s(air).iter().sum::<f64>() + recombination)
}

/// Scattered photons of 427.8 nm per ion pair produced at a level of the atmosphere, where the sun shines above an altitude.
pub(super) fn scattered_photons_per_ion_pair(level: usize, air: &AirLevel, sunlit_above_km: f64) -> f64 {
    let altitude_km = level_altitude_km(level);
    let sunlight = smoothstep(sunlit_above_km - PENUMBRA_KM, sunlit_above_km + PENUMBRA_KM, altitude_km);
    sunlight * PHOTONS_391_PER_ION_S * PHOTONS_427_PER_391 * ionization_fractions(air).n2 * mean_life(air)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::{
        atmosphere::{LOWEST_KM, atmosphere},
        emission::{Emission, SpectralEmitter},
        precipitation::energy_grid::ARC,
    };

    #[test]
    fn an_ion_lives_4_s_at_200_km_20_s_at_300_km_and_67_s_at_500_km() {
        let [low, middle, high] = [200.0, 300.0, 500.0].map(|altitude_km| mean_life(&atmosphere().at(altitude_km)));
        // By hand, at 300 km: 1 / (1.4e-16 (300 / T)^0.44 [O] + 5e-17 (300 / T)^0.8 [O2] + 0.022 (300 / T)^0.39).
        assert!((low - 3.88).abs() < 0.05 && (middle - 20.06).abs() < 0.2, "{low} {middle}");
        assert!((high - 66.7).abs() < 0.7, "{high}");
        // Never longer than recombination alone allows: 1e11 x 2.2e-13 x (T / 300)^-0.39 per second.
        assert!(mean_life(&atmosphere().at(800.0)) < 110.0);
    }

    #[test]
    fn rays_are_violet_above_the_shadow_and_as_they_were_below() {
        let dark = Emission::new(atmosphere(), ARC);
        let lit = Emission::new(atmosphere(), ARC).sunlit_above(atmosphere(), 250.0);
        let ion = SpectralEmitter::NitrogenIon.index();
        let ratio = |altitude_km: f64| lit.at(1000.0, altitude_km)[ion] / dark.at(1000.0, altitude_km)[ion];
        assert_eq!(ratio(LOWEST_KM + 60.0), 1.0);
        assert_eq!(ratio(229.0), 1.0);
        assert!(ratio(300.0) > 2.0 && ratio(450.0) > ratio(300.0), "{} {}", ratio(300.0), ratio(450.0));
        // Everything else is as it was, and the column gains what the profile gains.
        let [before, after] = [&dark, &lit].map(|emission| emission.column(1000.0).kilorayleigh);
        assert_eq!([before[0], before[1], before[3]], [after[0], after[1], after[3]]);
        assert!(after[ion] > before[ion]);
    }
}
