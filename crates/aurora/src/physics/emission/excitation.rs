//! Photons per ion pair by altitude: which species is ionized, which states are excited, which of them radiate; and the same by the rules of the thesis, in
//! which a collision excites one state and one contact quenches it.
//!
//! A full model solves electron transport and ion chemistry. Here each source is proportional to the ion pairs of a
//! species, with measured rate coefficients for its altitude dependence. Where published yields disagree, one number is
//! fitted to observed line ratios and marked as fitted.

use bansho_base::math;

use super::{
    emitter::{EMITTERS, PerEmitter, SpectralEmitter},
    quenching::{natural_lifetime, radiated_fraction},
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
pub(super) struct IonizationFractions {
    pub(super) n2: f64,
    o2: f64,
    o: f64,
}

/// Weights 0.92, 1 and 0.56 of Rees (1989).
pub(super) fn ionization_fractions(air: &AirLevel) -> IonizationFractions {
    let (n2, o2, o) = (0.92 * air.n2, air.o2, 0.56 * air.o);
    let sum = n2 + o2 + o;
    IonizationFractions { n2: n2 / sum, o2: o2 / sum, o: o / sum }
}

/// Rates at which an N2+ ion gives its charge to O2, and reacts with O, 1/s (Lindinger et al. 1974; McFarland et al. 1973).
pub(super) fn n2_ion_charge_transfer_per_s(air: &AirLevel) -> [f64; 2] {
    let cold = 300.0 / air.temperature;
    [5e-17 * math::pow(cold, 0.8) * air.o2, 1.4e-16 * math::pow(cold, 0.44) * air.o]
}

/// Fraction of the ion pairs that become O2+: N2+ and O+ transfer their charge to O2 or form NO+ (rates of Lindinger et
/// al. 1974 and McFarland et al. 1973). It increases downward with the density of O2.
fn o2_ion_fraction(air: &AirLevel, ionization_fractions: &IonizationFractions) -> f64 {
    let cold = 300.0 / air.temperature;
    let [n2_by_o2, n2_by_o] = n2_ion_charge_transfer_per_s(air);
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
const DIRECT_PHOTONS: PerEmitter<f64> =
    [GREEN_TO_557 * DIRECT_GREEN, RED_TO_630 * DIRECT_RED, ION_B * ION_B_TO_427, NITROGEN_B];

/// k_b, J/K, and the atomic mass unit, kg.
const BOLTZMANN: f64 = 1.380_649e-23;
const ATOMIC_MASS: f64 = 1.660_539e-27;

/// Mean thermal speed of molecules with a mass in atomic units, m/s (2.26).
#[must_use]
pub fn thermal_speed(temperature: f64, mass_u: f64) -> f64 {
    math::sqrt(8.0 * BOLTZMANN * temperature / (std::f64::consts::PI * mass_u * ATOMIC_MASS))
}

/// Probability that a contact with a sphere of `radius` in m de-excites a state within its mean lifetime (2.25).
///
/// With the radius of the electrons' collisions, 3.2e-11 m, 2.5 % of the green light are left at 110 km and 87 % at 150 km. With that of a
/// molecule, 1.85e-10 m, 12 % are left at 170 km and 33 % at 190 km, which is not observed: few contacts with a molecule quench O(1S).
#[must_use]
pub fn hard_sphere_quenching(emitter: SpectralEmitter, air: &AirLevel, radius: f64) -> f64 {
    let mass_u = match emitter {
        SpectralEmitter::OxygenGreen | SpectralEmitter::OxygenRed => 15.999,
        SpectralEmitter::NitrogenIon | SpectralEmitter::Nitrogen => 28.014,
    };
    let cross_section = std::f64::consts::PI * radius * radius;
    let rate = std::f64::consts::SQRT_2 * air.number_density() * cross_section * thermal_speed(air.temperature, mass_u);
    -math::exp_m1(-rate * natural_lifetime(emitter))
}

/// Photons of each emitter per ion pair by the rules of the thesis (2.4.2): the target is chosen by number density and
/// emits one line by production rate, unless it is quenched (2.25) by spheres of `radius` in m. O2 emits nothing. This is the expected value over
/// all random choices.
#[must_use]
pub fn mean_hard_sphere_photons(air: &AirLevel, radius: f64) -> PerEmitter<f64> {
    EMITTERS.map(|emitter| {
        let struck = match emitter {
            SpectralEmitter::OxygenGreen | SpectralEmitter::OxygenRed => air.o,
            SpectralEmitter::NitrogenIon | SpectralEmitter::Nitrogen => air.n2,
        };
        let radiated = 1.0 - hard_sphere_quenching(emitter, air, radius);
        struck / air.number_density() * DIRECT_PHOTONS[emitter.index()] * radiated
    })
}

/// What a collision in some air emits by the rules of the thesis (2.4.2), drawn instead of averaged: its mean is [`mean_hard_sphere_photons`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct DrawnEmission {
    /// Fractions of the number density up to O, and up to N2 above it; O2 is the rest.
    species: [f32; 2],
    /// Probability of quenching, by emitter.
    quenching: PerEmitter<f32>,
}

/// The two emitters of O, and those of N2.
const EMITTERS_OF_SPECIES: [[SpectralEmitter; 2]; 2] = [
    [SpectralEmitter::OxygenGreen, SpectralEmitter::OxygenRed],
    [SpectralEmitter::NitrogenIon, SpectralEmitter::Nitrogen],
];

impl DrawnEmission {
    /// Of collisions in this air, with spheres of `radius` in m that quench.
    #[must_use]
    pub(crate) fn new(air: &AirLevel, radius: f64) -> Self {
        let density = air.number_density();
        Self {
            species: [(air.o / density) as f32, ((air.o + air.n2) / density) as f32],
            quenching: EMITTERS.map(|emitter| hard_sphere_quenching(emitter, air, radius) as f32),
        }
    }

    /// What shines after a collision, for three uniform numbers: the species by number density, one of its lines by production rate, and whether it is
    /// quenched.
    #[must_use]
    pub(crate) fn draw(&self, [species, line, quenching]: [f32; 3]) -> Option<SpectralEmitter> {
        let index = self.species.iter().position(|fraction| species < *fraction)?;
        let [first, second] = EMITTERS_OF_SPECIES[index];
        let share = (DIRECT_PHOTONS[first.index()] / Self::photons(first)) as f32;
        let emitter = if line < share { first } else { second };
        (quenching >= self.quenching[emitter.index()]).then_some(emitter)
    }

    /// Photons that a drawn emission stands for: all that a collision with its species makes, per ion pair.
    #[must_use]
    pub(crate) fn photons(emitter: SpectralEmitter) -> f64 {
        let siblings = EMITTERS_OF_SPECIES.iter().find(|emitters| emitters.contains(&emitter));
        siblings.into_iter().flatten().map(|emitter| DIRECT_PHOTONS[emitter.index()]).sum()
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::math::random::{Key, Purpose};

    use super::*;
    use crate::physics::{
        atmosphere::{LEVELS, atmosphere},
        emission::{
            Emission, PHOTONS_PER_KILORAYLEIGH,
            emitter::{LineSet, table_2_1_srgb, watts_per_kilorayleigh},
        },
        precipitation::{electron_track::TrackSampler, energy_grid::ARC},
    };

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

    /// Light by level and emitter, kR per mW m^-2, of so many tracks of a spectrum.
    fn light(table: &Emission, tracks: &TrackSampler, energy_ev: f64, particles: u64) -> Vec<PerEmitter<f64>> {
        let key = Key::new(11, "aurora");
        let mut sum = vec![[0.0; 4]; LEVELS];
        for particle in 0..particles {
            let uniforms = key.uniforms(particle, 0, Purpose::named("energy")).map(f64::from);
            let node = table.deposition().sample_node(energy_ev, [uniforms[0], uniforms[1]]);
            let pairs = table.ion_pairs_per_collision(node) / particles as f64;
            for collision in tracks.sample_track(node, key, particle) {
                let level = collision.level as usize;
                let photons = table.photons_per_ion_pair()[level];
                sum[level] = std::array::from_fn(|i| sum[level][i] + photons[i] * pairs);
            }
        }
        sum
    }

    /// Sum of absolute differences from the profile over its sum, levels taken together by tens for the red line, which few collisions
    /// high up make.
    fn difference(table: &Emission, energy_ev: f64, found: &[PerEmitter<f64>]) -> PerEmitter<f64> {
        let profile = table.profile(energy_ev);
        std::array::from_fn(|i| {
            let together = if i == SpectralEmitter::OxygenRed.index() { 20 } else { 1 };
            let sums = |levels: &[PerEmitter<f64>]| -> Vec<f64> {
                levels.chunks(together).map(|chunk| chunk.iter().map(|photons| photons[i]).sum()).collect()
            };
            let expected: Vec<f64> = sums(&profile).iter().map(|sum| sum * 1e3 / PHOTONS_PER_KILORAYLEIGH).collect();
            let apart: f64 = sums(found).iter().zip(&expected).map(|(found, expected)| (found - expected).abs()).sum();
            apart / expected.iter().sum::<f64>()
        })
    }

    #[test]
    fn the_mean_of_collisions_is_the_profile() {
        let table = Emission::new(atmosphere(), ARC);
        let tracks = TrackSampler::new(table.deposition(), 0.02);
        // 64 sets of 500 particles; a picture of 120,000 has a fifteenth of this noise.
        let all = difference(&table, 4000.0, &light(&table, &tracks, 4000.0, 32_000));
        assert!(all.iter().all(|difference| *difference < 0.03), "{all:?}");
    }

    #[test]
    fn thermal_speed_by_hand() {
        // sqrt(8 x 1.380649e-23 x 300 / (pi x 28.014 x 1.660539e-27)) = 476.2 m/s.
        bansho_base::assert_measured!(
            "equation (2.26): speed of nitrogen at 300 K, m/s",
            thermal_speed(300.0, 28.014),
            476.2,
            0.1
        );
    }

    #[test]
    fn green_survives_the_radius_of_the_collisions_and_not_that_of_a_molecule() {
        let left = |altitude_km, radius| {
            1.0 - hard_sphere_quenching(SpectralEmitter::OxygenGreen, &atmosphere().at(altitude_km), radius)
        };
        for (altitude_km, of_collisions, of_molecules) in [
            (110.0, 0.025, 0.0),
            (115.0, 0.16, 0.0),
            (120.0, 0.35, 0.0),
            (130.0, 0.64, 0.0),
            (150.0, 0.87, 0.01),
            (170.0, 0.94, 0.12),
            (190.0, 0.967, 0.33),
        ] {
            let found = [32.0, 185.0].map(|radius_pm| left(altitude_km, 1e-12 * radius_pm));
            assert!((found[0] - of_collisions).abs() < 0.006, "{altitude_km}: {found:?}");
            assert!((found[1] - of_molecules).abs() < 0.006, "{altitude_km}: {found:?}");
        }
        bansho_base::assert_measured!("equation (2.25): left at 115 km with 32 pm", left(115.0, 32e-12), 0.16, 0.006);
        bansho_base::assert_measured!("equation (2.25): left at 120 km with 32 pm", left(120.0, 32e-12), 0.35, 0.006);
        bansho_base::assert_measured!("equation (2.25): left at 130 km with 32 pm", left(130.0, 32e-12), 0.64, 0.006);
        bansho_base::assert_measured!("equation (2.25): left at 150 km with 32 pm", left(150.0, 32e-12), 0.87, 0.006);
        bansho_base::assert_measured!("equation (2.25): left at 130 km with 185 pm", left(130.0, 185e-12), 0.0, 0.006);
        bansho_base::assert_measured!("equation (2.25): left at 150 km with 185 pm", left(150.0, 185e-12), 0.01, 0.006);
        bansho_base::assert_measured!("equation (2.25): left at 170 km with 185 pm", left(170.0, 185e-12), 0.12, 0.006);
        bansho_base::assert_measured!("equation (2.25): left at 190 km with 185 pm", left(190.0, 185e-12), 0.33, 0.006);
        assert!(hard_sphere_quenching(SpectralEmitter::NitrogenIon, &atmosphere().at(110.0), 1.85e-10) < 1e-3);
    }

    /// Color of the mean light at an altitude by the rules of the thesis, with quenching by spheres of a radius (pm): linear sRGB by table 2.1 and (2.30).
    fn color_by_the_rules(altitude_km: f64, radius_pm: f64) -> [f64; 3] {
        let photons = mean_hard_sphere_photons(&atmosphere().at(altitude_km), 1e-12 * radius_pm);
        let mut color = [0.0; 3];
        for emitter in EMITTERS {
            for (wavelength_nm, per_photon) in LineSet::Thesis.lines(emitter) {
                let srgb = table_2_1_srgb(wavelength_nm, watts_per_kilorayleigh(wavelength_nm));
                (0..3).for_each(|c| color[c] += photons[emitter.index()] * per_photon * srgb[c]);
            }
        }
        color
    }

    #[test]
    fn the_rules_of_the_thesis_give_a_violet_border_and_red_tops_at_the_heights_of_the_page() {
        // Radius, altitude (km), and two components of which the first exceeds the second from there on; the last component is 0.
        for (radius_pm, altitude_km, component, other) in [
            (100.0, 136.0, 1, 3),
            (100.0, 144.0, 1, 0),
            (100.0, 157.0, 1, 2),
            (100.0, 330.0, 0, 1),
            (30.0, 130.0, 1, 2),
            (30.0, 220.0, 0, 1),
        ] {
            let difference = |altitude_km: f64| {
                let [r, g, b] = color_by_the_rules(altitude_km, radius_pm);
                let components = [r, g, b, 0.0];
                components[component] - components[other]
            };
            let [below, above] = [0.98, 1.02].map(|factor| difference(factor * altitude_km));
            assert!(below < 0.0 && above > 0.0, "{radius_pm} pm at {altitude_km} km: {below} and {above}");
        }
    }

    #[test]
    fn the_mean_of_the_rules_is_what_they_draw() {
        let air = atmosphere().at(220.0);
        let rules = DrawnEmission::new(&air, 1.85e-10);
        let (mut sum, draws) = ([0.0; 4], 100_000_u64);
        for draw in 0..draws {
            let [a, b, c, _] = Key::new(1, "rules").uniforms(draw, 0, Purpose::named("draw"));
            if let Some(emitter) = rules.draw([a, b, c]) {
                sum[emitter.index()] += DrawnEmission::photons(emitter) / draws as f64;
            }
        }
        let mean = mean_hard_sphere_photons(&air, 1.85e-10);
        // Hardly any red is left, and 1,700 photons of the violet: 2.4 %.
        for i in [0, 2, 3] {
            assert!((sum[i] / mean[i] - 1.0).abs() < 0.08, "{i}: {sum:?} {mean:?}");
        }
        assert!(mean[1] < 1e-3 && sum[1] < 1e-3, "{sum:?} {mean:?}");
    }
}
