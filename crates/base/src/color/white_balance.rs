//! The white balance of a camera: the light that is shown as white.

use super::{
    space::{ACESCG_FROM_XYZ, D65, Matrix3, XYZ_FROM_ACESCG, adaptation},
    spectrum::{planck_radiance_per_nm, xyz_of_spectrum},
};

/// Maps the light of a black body to white, and back, by Bradford adaptation (Lam 1985) of exposed ACEScg.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WhiteBalance {
    forward: [[f32; 3]; 3],
    inverse: [[f32; 3]; 3],
}

impl WhiteBalance {
    /// The white balance for a black body of that temperature, K.
    #[must_use]
    pub fn from_black_body(temperature_k: f64) -> Self {
        let balanced = Self::matrix(temperature_k);
        Self { forward: balanced.single(), inverse: balanced.inverse().single() }
    }

    /// The matrix of [`apply`](Self::apply) in double precision, for products with other matrices.
    #[must_use]
    pub fn matrix(temperature_k: f64) -> Matrix3 {
        ACESCG_FROM_XYZ.times(&adaptation(chromaticity(temperature_k), D65).times(&XYZ_FROM_ACESCG))
    }

    /// The adapted light.
    #[inline(always)]
    #[must_use]
    pub fn apply(&self, acescg: [f32; 3]) -> [f32; 3] {
        multiply(&self.forward, acescg)
    }

    /// The light that [`apply`](Self::apply) maps to `acescg`.
    #[inline(always)]
    #[must_use]
    pub fn invert(&self, acescg: [f32; 3]) -> [f32; 3] {
        multiply(&self.inverse, acescg)
    }
}

/// CIE 1931 xy of the light of a black body of that temperature, K.
#[must_use]
pub fn chromaticity(temperature_k: f64) -> [f64; 2] {
    let [x, y, z] = xyz_of_spectrum(|wavelength_nm| planck_radiance_per_nm(wavelength_nm, temperature_k));
    [x / (x + y + z), y / (x + y + z)]
}

/// Matrix times vector in a fixed order and without fused multiply-adds, so that all machines give the same bits.
#[inline(always)]
fn multiply(matrix: &[[f32; 3]; 3], [r, g, b]: [f32; 3]) -> [f32; 3] {
    let [x, y, z] = matrix;
    [x[0] * r + x[1] * g + x[2] * b, y[0] * r + y[1] * g + y[2] * b, z[0] * r + z[1] * g + z[2] * b]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::{acescg_from_xyz, luminance, srgb_from_acescg};

    /// A black body's light is neutral under its own balance, bluish under that of a cooler one, and keeps its luminance as white does.
    #[test]
    fn a_black_body_is_white_under_its_own_balance() {
        for temperature in [1500.0, 2856.0, 4000.0, 6504.0, 20_000.0] {
            let [x, y] = chromaticity(temperature);
            let light = acescg_from_xyz([x / y, 1.0, (1.0 - x - y) / y]);
            let balance = WhiteBalance::from_black_body(temperature);
            let shown = srgb_from_acescg(balance.apply(light));
            assert!(shown.iter().all(|value| (value - 1.0).abs() < 1e-4), "{temperature} K: {shown:?}");
            let back = balance.invert(balance.apply(light));
            assert!(light.iter().zip(back).all(|(a, b)| (a - b).abs() < 1e-5), "{temperature} K: {back:?}");
            assert!((luminance(balance.apply(light)) - 1.0).abs() < 1e-4);
        }
        let [r, g, b] = srgb_from_acescg(WhiteBalance::from_black_body(4000.0).apply([1.0; 3]));
        assert!(r < 0.8 && b > 1.3 && (0.8..1.1).contains(&g), "{r} {g} {b}");
    }

    /// Illuminant A, a black body of 2856 K (CIE 15: 0.44758, 0.40745).
    #[test]
    fn chromaticity_is_that_of_illuminant_a() {
        let [x, y] = chromaticity(2855.5);
        assert!((x - 0.447_58).abs() < 2e-4 && (y - 0.407_45).abs() < 2e-4, "{x} {y}");
    }
}
