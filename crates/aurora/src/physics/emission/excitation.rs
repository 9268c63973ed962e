//! Photons per ion pair by altitude: which species is ionized, which states are excited, which of them radiate.
//!
//! A full model solves electron transport and ion chemistry. Here each source is proportional to the ion pairs of a
//! species, with measured rate coefficients for its altitude dependence. Where published yields disagree, one number is
//! fitted to observed line ratios and marked as fitted.

use bansho_base::math;

use super::{
    emitter::{PerEmitter, SpectralEmitter},
    quenching::radiated_fraction,
};
use crate::physics::atmosphere::AirLevel;

/// Fraction of N2 ionizations that leave N2+(B) (Borst & Zipf 1970), and branching ratio of 427.8 nm.
const ION_B: f64 = 0.11;
const ION_B_TO_427: f64 = 0.20;
/// N2(B) per N2 ionization, cascades included. Fitted: a first positive system 9 times as strong as 557.7 nm at 5 keV,
/// close to the 8.8 of Vallance Jones (1974).
const NITROGEN_B: f64 = 0.78;
/// Direct electron-impact excitation of O(1S) and O(1D) per O ionization. Fitted: I(557.7)/I(427.8) of 5 and
/// I(630.0)/I(427.8) of 4 at 1 keV.
const DIRECT_GREEN: f64 = 0.25;
const DIRECT_RED: f64 = 1.5;
/// O(1S) from N2(A) + O energy transfer, per N2 ionization whose N2(A) reacts with O. Fitted: I(557.7)/I(427.8) of 4 at
/// 5 keV and above 2.5 at 30 keV, where most of the light comes from altitudes with little O. It makes the lower border
/// of hard auroras pink, as observed. Laboratory yields (Piper 1982) would give three times as much; this discrepancy
/// of the green line is known and unresolved.
const TRANSFER_GREEN: f64 = 0.088;
/// O(1S) and O(1D) per dissociative recombination of O2+: from the same fit (a storage ring gave 0.05 for vibrational
/// ground-state ions: Kella et al. 1997); 1.2 as in GLOW.
const RECOMBINATION_GREEN: f64 = 0.028;
const RECOMBINATION_RED: f64 = 1.2;
/// Branching ratios of 557.7 nm from O(1S) and of 630.0 nm from O(1D) (Wiese et al. 1996).
const GREEN_TO_557: f64 = 0.943_367;
const RED_TO_630: f64 = 0.756_001;
/// N2(A): radiative rate, 1/s, and quenching rate coefficients by O and O2, m^3/s (Piper et al. 1981).
const NITROGEN_A_RADIATION: f64 = 1.0 / 1.299;
const NITROGEN_A_BY_O: f64 = 3.1e-17;
const NITROGEN_A_BY_O2: f64 = 4.1e-18;

/// Fractions of the ion pairs by species.
#[derive(Clone, Copy, Debug, PartialEq)]
struct IonizationFractions {
    n2: f64,
    o2: f64,
    o: f64,
}

/// Weights 0.92, 1 and 0.56 of Rees (1989).
fn ionization_fractions(air: &AirLevel) -> IonizationFractions {
    let (n2, o2, o) = (0.92 * air.n2, air.o2, 0.56 * air.o);
    let sum = n2 + o2 + o;
    IonizationFractions { n2: n2 / sum, o2: o2 / sum, o: o / sum }
}

/// Fraction of the ion pairs that become O2+: N2+ and O+ transfer their charge to O2 or form NO+ (rates of Lindinger et
/// al. 1974 and McFarland et al. 1973). It increases downward with the density of O2.
fn o2_ion_fraction(air: &AirLevel, ionization_fractions: &IonizationFractions) -> f64 {
    let cold = 300.0 / air.temperature;
    let n2_by_o2 = 5e-17 * math::pow(cold, 0.8) * air.o2;
    let n2_by_o = 1.4e-16 * math::pow(cold, 0.44) * air.o;
    let o_by_o2 = 2e-17 * math::sqrt(cold) * air.o2;
    let o_by_n2 = 1.2e-18 * air.n2;
    ionization_fractions.o2
        + ionization_fractions.n2 * n2_by_o2 / (n2_by_o2 + n2_by_o)
        + ionization_fractions.o * o_by_o2 / (o_by_o2 + o_by_n2)
}

/// Fraction of N2(A) that transfers its energy to O.
fn n2a_transfer_fraction(air: &AirLevel) -> f64 {
    let by_o = NITROGEN_A_BY_O * air.o;
    by_o / (NITROGEN_A_RADIATION + by_o + NITROGEN_A_BY_O2 * air.o2)
}

/// Counted photons of each emitter per ion pair produced in this air.
#[must_use]
pub fn photons_per_ion_pair(air: &AirLevel) -> PerEmitter<f64> {
    let pairs = ionization_fractions(air);
    let oxygen_ions = o2_ion_fraction(air, &pairs);
    let green_made = DIRECT_GREEN * pairs.o
        + TRANSFER_GREEN * pairs.n2 * n2a_transfer_fraction(air)
        + RECOMBINATION_GREEN * oxygen_ions;
    let green = GREEN_TO_557 * green_made * radiated_fraction(SpectralEmitter::OxygenGreen, air);
    // Every 557.7 nm photon leaves an O(1D).
    let red_made = DIRECT_RED * pairs.o + RECOMBINATION_RED * oxygen_ions + green;
    [
        green,
        RED_TO_630 * red_made * radiated_fraction(SpectralEmitter::OxygenRed, air),
        ION_B * ION_B_TO_427 * pairs.n2 * radiated_fraction(SpectralEmitter::NitrogenIon, air),
        NITROGEN_B * pairs.n2 * radiated_fraction(SpectralEmitter::Nitrogen, air),
    ]
}

/// Counted photons of each emitter without quenching, per ion pair of the target species: O for the first two, N2 for
/// the others. The thesis calls these production rates.
pub(super) const DIRECT_PHOTONS: PerEmitter<f64> =
    [GREEN_TO_557 * DIRECT_GREEN, RED_TO_630 * DIRECT_RED, ION_B * ION_B_TO_427, NITROGEN_B];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::atmosphere::atmosphere;

    #[test]
    fn an_ion_pair_by_hand_at_110_km() {
        let air = atmosphere().at(110.0);
        // 0.92 x 1.48394e18, 2.74567e17, 0.56 x 1.3908e17 of their sum 1.717677e18.
        let pairs = ionization_fractions(&air);
        assert!(
            (pairs.n2 - 0.79481).abs() < 1e-4 && (pairs.o2 - 0.15985).abs() < 1e-4 && (pairs.o - 0.04534).abs() < 1e-4
        );
        // 4.31148 of 0.76982 + 4.31148 + 1.12572.
        assert!((n2a_transfer_fraction(&air) - 0.69463).abs() < 1e-4);
        assert!((o2_ion_fraction(&air, &pairs) - 0.538).abs() < 1e-3);
        let [green, red, ion, nitrogen] = photons_per_ion_pair(&air);
        assert!((ion - 0.022 * 0.79481).abs() < 1e-5 && (nitrogen - 0.78 * 0.79481).abs() < 1e-3);
        // 0.943367 x 0.9746 x (0.25 x 0.04534 + 0.088 x 0.79481 x 0.69463 + 0.028 x 0.538).
        assert!((green - 0.06894).abs() < 2e-4, "{green}");
        // 0.756 x 1.21e-4 x (1.5 x 0.04534 + 1.2 x 0.538 + 0.06894).
        assert!((red / 7.16e-5 - 1.0).abs() < 0.01, "{red}");
    }

    #[test]
    fn every_level_gives_some_of_everything() {
        for air in atmosphere().levels() {
            let photons = photons_per_ion_pair(air);
            assert!(photons.iter().all(|photons| *photons > 0.0 && *photons < 2.0), "{photons:?}");
        }
    }
}
