//! Collisional quenching of excited states.

use bansho_base::math;

use super::emitter::{PerEmitter, SpectralEmitter};
use crate::physics::atmosphere::AirLevel;

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

#[cfg(test)]
mod tests {
    use super::{super::EMITTERS, *};
    use crate::physics::atmosphere::atmosphere;

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
}
