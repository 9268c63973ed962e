//! Ionization profiles of Fang et al. (2010), "Parameterization of monoenergetic electron impact ionization", GRL 37,
//! L22106.
//!
//! For monoenergetic electrons, isotropic over the downward hemisphere, along a vertical field. At auroral dip angles
//! (75 degrees and more) the inclination lowers a profile by less than half a kilometer.

use bansho_base::math;

use super::{EV_PER_S_PER_MW, ION_PAIR_EV};
use crate::physics::atmosphere::AirLevel;

/// P_ij of table 1: C_i is the exponential of a cubic in the logarithm of the energy in keV.
const COEFFICIENTS: [[f64; 4]; 8] = [
    [1.24616, 1.45903, -0.242269, 0.0595459],
    [2.23976, -4.22918e-7, 0.0136458, 0.00253332],
    [1.41754, 0.144597, 0.0170433, 0.000639717],
    [0.248775, -0.15089, 6.30894e-9, 0.00123707],
    [-0.465119, -0.105081, -0.0895701, 0.012245],
    [0.386019, 0.0017543, -0.00074296, 0.000460881],
    [-0.645454, 0.000849555, -0.0428581, -0.00299302],
    [0.94893, 0.197385, -0.0025066, -0.00206938],
];
/// Column that scales y in equation (1): 6e-6 g cm^-2, in kg m^-2.
const COLUMN_SCALE: f64 = 6e-5;

/// The terms of the parameterization that depend on the air only.
#[derive(Clone, Copy, Debug)]
pub struct AirLayer {
    /// ln (rho H / 6e-6 g cm^-2)^0.7, of equation (1): y = 2/E times that power, E in keV.
    ln_column: f64,
    /// Ion pairs, m^-3 s^-1 per mW m^-2, for f(y) = 1.
    pairs_at_unit_dissipation: f64,
}

impl AirLayer {
    /// For this air.
    #[must_use]
    pub fn new(air: &AirLevel) -> Self {
        Self {
            ln_column: 0.7 * math::ln(air.density * air.scale_height / COLUMN_SCALE),
            pairs_at_unit_dissipation: EV_PER_S_PER_MW / ION_PAIR_EV / air.scale_height,
        }
    }
}

/// Ionization by monoenergetic electrons.
#[derive(Clone, Debug)]
pub struct MonoenergeticBeam {
    ln_energy: f64,
    /// C_1 to C_8, equation (5).
    coefficients: [f64; 8],
}

impl MonoenergeticBeam {
    /// For electrons of `energy_ev`, valid from 100 eV to 1 MeV.
    #[must_use]
    pub fn new(energy_ev: f64) -> Self {
        let ln_energy = math::ln(energy_ev / 1000.0);
        // Equation (5): a cubic of the logarithm of the energy in keV.
        let coefficients =
            COEFFICIENTS.map(|[a, b, c, d]| math::exp(((d * ln_energy + c) * ln_energy + b) * ln_energy + a));
        Self { ln_energy, coefficients }
    }

    /// Normalized energy dissipation f(y) of equations (3) and (4), from ln y.
    fn dissipation_fraction(&self, ln_y: f64) -> f64 {
        let [c1, c2, c3, c4, c5, c6, c7, c8] = self.coefficients;
        dissipation_term([c1, c2, c3, c4], ln_y) + dissipation_term([c5, c6, c7, c8], ln_y)
    }

    /// Ionization rate, m^-3 s^-1 per mW m^-2 of incident energy flux (2).
    #[must_use]
    pub fn ionization(&self, layer: &AirLayer) -> f64 {
        let ln_y = std::f64::consts::LN_2 - self.ln_energy + layer.ln_column;
        self.dissipation_fraction(ln_y) * layer.pairs_at_unit_dissipation
    }
}

/// One of the two terms of f(y), equation (4), from ln y: `a y^b exp(-c y^d)`.
fn dissipation_term([a, b, c, d]: [f64; 4], ln_y: f64) -> f64 {
    a * math::exp(b * ln_y - c * math::exp(d * ln_y))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::atmosphere::{LEVEL_SPACING, LEVELS, atmosphere, level_altitude_km};

    /// Rows of a reference table as numbers, its header left out.
    fn rows(text: &str) -> Vec<Vec<f64>> {
        text.lines().skip(1).map(|line| line.split(',').map(|field| field.parse().unwrap()).collect()).collect()
    }

    #[test]
    fn profiles_are_those_of_the_reference() {
        let mut compared = 0;
        for (column, energy_ev) in [(1, 1e3), (2, 3e3), (3, 1e4), (4, 3e4)] {
            let beam = MonoenergeticBeam::new(energy_ev);
            for row in rows(include_str!("data/fang2010_profiles.csv")) {
                // Below this the wing is 1e-6 of the peak and less.
                if row[column] > 1e4 {
                    let q = beam.ionization(&AirLayer::new(&atmosphere().at(row[0])));
                    assert!((q / row[column] - 1.0).abs() < 1e-3, "{energy_ev} eV, {} km: {q}", row[0]);
                    compared += 1;
                }
            }
        }
        assert!(compared > 600, "{compared}");
    }

    #[test]
    fn peaks_and_columns_are_those_of_the_reference() {
        for row in rows(include_str!("data/fang2010_peaks.csv")) {
            let beam = MonoenergeticBeam::new(row[0] * 1e3);
            let profile: Vec<f64> =
                atmosphere().levels().iter().map(|air| beam.ionization(&AirLayer::new(air))).collect();
            let peak = (0..LEVELS).max_by(|a, b| profile[*a].total_cmp(&profile[*b])).unwrap();
            assert!((level_altitude_km(peak) - row[1]).abs() < 0.6, "{} keV: {peak}", row[0]);
            assert!((profile[peak] / row[2] - 1.0).abs() < 0.01);
            let column = profile.iter().sum::<f64>() * LEVEL_SPACING;
            assert!((column / row[8] - 1.0).abs() < 0.01, "{} keV: {column} for {}", row[0], row[8]);
        }
    }
}
