//! The thesis's way from spectral lines to RGB: table 2.1, (2.29) and (2.30).
//!
//! Its table is that of a later observer (the CIE 2006 functions), its matrix that of sRGB, which belongs to the observer of 1931. The five colors
//! differ from those of one observer, most for 391.4 nm, of which table 2.1 sees a fifth.

use bansho_base::color::{ACESCG_FROM_SRGB, LUMINOUS_EFFICACY_LM_PER_W, Matrix3};

/// Table 2.1: wavelength, nm, and the color matching functions there.
pub(crate) const XYZ: [(f64, [f64; 3]); 5] = [
    (557.734, [0.5739, 0.9993, 0.0018]),
    (630.03, [0.6924, 0.2981, 0.0000]),
    (391.44, [0.0049, 0.0005, 0.0239]),
    (427.81, [0.2736, 0.0299, 1.4463]),
    (670.48, [0.0893, 0.0345, 0.0000]),
];

/// (2.30): linear sRGB of XYZ.
const RGB_FROM_XYZ: Matrix3 =
    Matrix3([[3.24097, -1.53738, -0.498612], [-0.969241, 1.87596, 0.0415554], [0.0556299, -0.203976, 1.05697]]);

/// Linear sRGB of a line of a radiance in W m^-2 sr^-1, (2.29) with K = 683 lm/W and (2.30). The line is the nearest of the five. Components are negative
/// where the line lies outside sRGB.
#[must_use]
pub(crate) fn srgb(wavelength_nm: f64, radiance: f64) -> [f64; 3] {
    let nearest = XYZ.iter().min_by(|(a, _), (b, _)| (a - wavelength_nm).abs().total_cmp(&(b - wavelength_nm).abs()));
    let xyz = nearest.map_or([0.0; 3], |(_, xyz)| xyz.map(|value| LUMINOUS_EFFICACY_LM_PER_W * radiance * value));
    RGB_FROM_XYZ.apply(xyz)
}

/// [`srgb`] in the working space.
#[must_use]
pub(crate) fn acescg(wavelength_nm: f64, radiance: f64) -> [f64; 3] {
    ACESCG_FROM_SRGB.apply(srgb(wavelength_nm, radiance))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_five_colors_of_table_2_1_by_hand() {
        // 3.24097 x 0.5739 - 1.53738 x 0.9993 - 0.498612 x 0.0018 = 0.322793; -0.556247 + 1.874647 + 0.000075 = 1.318475;
        // 0.031926 - 0.203833 + 0.001903 = -0.170005. Times 683.
        let [r, g, b] = srgb(557.7, 1.0);
        assert!((r / 683.0 - 0.322793).abs() < 1e-5 && (g / 683.0 - 1.318475).abs() < 1e-5, "{r} {g}");
        assert!((b / 683.0 + 0.170005).abs() < 1e-5, "{b}");
        // 427.8 nm: 0.886729 - 0.045968 - 0.721143 = 0.119619; -0.265184 + 0.056091 + 0.060102 = -0.148991; 0.015220 - 0.006099 + 1.528696 = 1.537817.
        let [r, g, b] = srgb(427.8, 2.0).map(|value| value / (2.0 * 683.0));
        assert!(
            (r - 0.119619).abs() < 1e-5 && (g + 0.148991).abs() < 1e-5 && (b - 1.537817).abs() < 1e-5,
            "{r} {g} {b}"
        );
    }
}
