//! How long excited states last: collisional quenching, the effective lifetime, diffusion within it, and the decay of the red line by altitude.
//!
//! The effective lifetime of the red line is 1 s at 150 km and two minutes at 400 km. The afterglow stores red light for three altitudes, each with its
//! own lifetime. Light between two of them is split by linear weights, so the decay is continuous in altitude.

use bansho_base::math;

use super::{PerEmitter, SpectralEmitter};
use crate::physics::atmosphere::{AirLevel, level_altitude_km};

/// Rate coefficient `A exp(B / T)`, m^3 s^-1.
#[derive(Clone, Copy, Debug)]
struct RateCoefficient {
    a: f64,
    b: f64,
}

impl RateCoefficient {
    const NONE: Self = Self { a: 0.0, b: 0.0 };

    const fn constant(a: f64) -> Self {
        Self { a, b: 0.0 }
    }

    fn at(self, temperature: f64) -> f64 {
        if self.b == 0.0 { self.a } else { self.a * math::exp(self.b / temperature) }
    }
}

/// Radiative lifetime and quenching rate coefficients by N2, O2 and O.
#[derive(Clone, Copy, Debug)]
struct ExcitedState {
    lifetime: f64,
    n2: RateCoefficient,
    o2: RateCoefficient,
    o: RateCoefficient,
}

/// By emitter.
const STATES: PerEmitter<ExcitedState> = [
    // Wiese et al. 1996; Slanger et al. 1972, Slanger & Black 1981 as in the GLOW model.
    ExcitedState {
        lifetime: 0.748_704,
        n2: RateCoefficient::NONE,
        o2: RateCoefficient { a: 4e-18, b: -865.0 },
        o: RateCoefficient::constant(2e-20),
    },
    // Wiese et al. 1996; JPL 2011; O as in GLOW (Abreu et al. 1986), in dispute between 0 and 2.2e-17.
    ExcitedState {
        lifetime: 133.782,
        n2: RateCoefficient { a: 2.15e-17, b: 110.0 },
        o2: RateCoefficient { a: 3.3e-17, b: 55.0 },
        o: RateCoefficient::constant(3e-18),
    },
    // Vallance Jones 1974; Pancheshnyi et al. 1998. It matters below 65 km only.
    ExcitedState {
        lifetime: 65.9975e-9,
        n2: RateCoefficient::constant(2.1e-16),
        o2: RateCoefficient::constant(5.1e-16),
        o: RateCoefficient::NONE,
    },
    // Vallance Jones 1974; Pintassilgo & Guerra, Kossyi et al. 1992. It matters below 90 km only.
    ExcitedState {
        lifetime: 5.818_92e-6,
        n2: RateCoefficient::constant(3e-17),
        o2: RateCoefficient::constant(3e-16),
        o: RateCoefficient::NONE,
    },
];

/// Radiative lifetime, s.
#[must_use]
pub(crate) fn natural_lifetime(emitter: SpectralEmitter) -> f64 {
    STATES[emitter.index()].lifetime
}

/// Fraction of the excited states that radiate, `1 / (1 + tau sum k_q n_q)` (Stern-Volmer).
#[must_use]
pub fn radiated_fraction(emitter: SpectralEmitter, air: &AirLevel) -> f64 {
    let ExcitedState { lifetime, n2, o2, o } = STATES[emitter.index()];
    let t = air.temperature;
    1.0 / (1.0 + lifetime * (n2.at(t) * air.n2 + o2.at(t) * air.o2 + o.at(t) * air.o))
}

/// Effective lifetime with quenching, s: the radiative lifetime times the radiated fraction.
#[must_use]
pub fn lifetime(emitter: SpectralEmitter, air: &AirLevel) -> f64 {
    natural_lifetime(emitter) * radiated_fraction(emitter, air)
}

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

/// Number of altitudes for which the afterglow stores red light.
pub(crate) const RED_ALTITUDES: usize = 3;
/// The altitudes, km: the best three round values for electrons of 1 to 10 keV.
const RED_ALTITUDES_KM: [f64; RED_ALTITUDES] = [150.0, 220.0, 300.0];

/// Linear weights of the light at an altitude; their sum is 1.
#[must_use]
pub(crate) fn red_altitude_weights(altitude_km: f64) -> [f64; RED_ALTITUDES] {
    let mut weights = [0.0; RED_ALTITUDES];
    let above = RED_ALTITUDES_KM.partition_point(|altitude| *altitude <= altitude_km).clamp(1, RED_ALTITUDES - 1);
    let [low, high] = [RED_ALTITUDES_KM[above - 1], RED_ALTITUDES_KM[above]];
    let fraction = ((altitude_km - low) / (high - low)).clamp(0.0, 1.0);
    (weights[above - 1], weights[above]) = (1.0 - fraction, fraction);
    weights
}

/// Red light of each level, split by altitude in place of the emitters; the last component is 0.
#[must_use]
pub(crate) fn red_by_altitude(profile: &[PerEmitter<f64>]) -> Vec<PerEmitter<f64>> {
    let divided = profile.iter().enumerate().map(|(level, light)| {
        let [low, middle, high] = red_altitude_weights(level_altitude_km(level))
            .map(|weight| weight * light[SpectralEmitter::OxygenRed.index()]);
        [low, middle, high, 0.0]
    });
    divided.collect()
}

/// Lifetimes in s, averaged over the levels with the weights and the emission. `levels` yields emission and lifetime.
pub(super) fn mean_lifetimes(levels: impl Iterator<Item = (f64, f64)>) -> [f64; RED_ALTITUDES] {
    let (mut light, mut lifetimes) = ([0.0; RED_ALTITUDES], [0.0; RED_ALTITUDES]);
    for (level, (emission, lifetime)) in levels.enumerate() {
        for (altitude, weight) in red_altitude_weights(level_altitude_km(level)).into_iter().enumerate() {
            light[altitude] += weight * emission;
            lifetimes[altitude] += weight * emission * lifetime;
        }
    }
    std::array::from_fn(|altitude| lifetimes[altitude] / light[altitude].max(f64::MIN_POSITIVE))
}

#[cfg(test)]
mod tests {
    use bansho_base::math;

    use super::*;
    use crate::physics::{
        atmosphere::{LEVELS, atmosphere},
        emission::{EMITTERS, Emission},
        precipitation::energy_grid::ARC,
    };

    #[test]
    fn shares_and_lifetimes_are_those_of_the_reference() {
        let mut compared = 0;
        for row in include_str!("data/quenching_survival.csv").lines().skip(1) {
            let fields: Vec<f64> = row.split(',').map(|field| field.parse().unwrap_or(f64::NAN)).collect();
            let air = atmosphere().at(fields[0]);
            // Columns: O(1S), O(1D), N2+(B), N2(B); then the lifetimes of O(1D) and O(1S).
            for (emitter, column) in EMITTERS.into_iter().zip([2, 1, 5, 4]) {
                if fields[0] >= 80.0 {
                    let fraction = radiated_fraction(emitter, &air);
                    assert!((fraction / fields[column] - 1.0).abs() < 0.01, "{emitter:?} {} km: {fraction}", fields[0]);
                    compared += 1;
                }
            }
            if fields[0] >= 80.0 {
                assert!((lifetime(SpectralEmitter::OxygenRed, &air) / fields[6] - 1.0).abs() < 0.01);
                assert!((lifetime(SpectralEmitter::OxygenGreen, &air) / fields[7] - 1.0).abs() < 0.01);
            }
        }
        assert!(compared > 150, "{compared}");
    }

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

    #[test]
    fn every_altitude_counts_once() {
        for altitude_km in [80.0, 150.0, 185.0, 220.0, 299.0, 300.0, 800.0] {
            assert!((red_altitude_weights(altitude_km).iter().sum::<f64>() - 1.0).abs() < 1e-12);
        }
        assert_eq!((red_altitude_weights(90.0), red_altitude_weights(500.0)), ([1.0, 0.0, 0.0], [0.0, 0.0, 1.0]));
        assert_eq!(red_altitude_weights(185.0), [0.5, 0.5, 0.0]);
    }

    /// The fraction of the red light that is left at most too long, or too short, after electrons of an energy have gone: by the altitudes, and
    /// by one lifetime for the whole column.
    fn errors(energy_ev: f64) -> [f64; 2] {
        let emission = Emission::new(atmosphere(), ARC);
        let (profile, air) = (emission.profile(energy_ev), atmosphere().levels());
        let light: Vec<f64> = profile.iter().map(|light| light[SpectralEmitter::OxygenRed.index()]).collect();
        let whole: f64 = light.iter().sum();
        let by_height = red_by_altitude(&profile);
        let sums: [f64; RED_ALTITUDES] =
            std::array::from_fn(|altitude| by_height.iter().map(|light| light[altitude]).sum());
        let lifetimes = emission.red_lifetimes(energy_ev);
        let column = emission.column(energy_ev).lifetime[SpectralEmitter::OxygenRed.index()];
        let mut errors = [0.0_f64; 2];
        for second in 0..300 {
            let left = |lifetime: f64| math::exp(-f64::from(second) / lifetime);
            let exact: f64 =
                (0..LEVELS).map(|level| light[level] * left(lifetime(SpectralEmitter::OxygenRed, &air[level]))).sum();
            let found: f64 = (0..RED_ALTITUDES).map(|altitude| sums[altitude] * left(lifetimes[altitude])).sum();
            errors[0] = errors[0].max((found - exact).abs() / whole);
            errors[1] = errors[1].max((whole * left(column) - exact).abs() / whole);
        }
        errors
    }

    #[test]
    fn red_light_fades_as_by_the_lifetime_at_each_height() {
        for (energy_ev, bound) in [(1e3, 0.05), (3e3, 0.05), (1e4, 0.08)] {
            let [by_height, by_column] = errors(energy_ev);
            assert!(by_height < bound && by_column > 2.5 * by_height, "{energy_ev}: {by_height} {by_column}");
        }
    }
}
