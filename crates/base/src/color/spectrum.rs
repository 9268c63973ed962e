//! Spectra to CIE XYZ: color-matching functions, Planck's law, spectral lines.

use std::sync::LazyLock;

/// CIE 1931 2-degree color-matching functions: a header line with the origin, then `nm,xbar,ybar,zbar`.
const TABLE_TEXT: &str = include_str!("../data/cie1931_2deg_1nm.csv");

/// First wavelength of the color-matching functions, nm.
pub const FIRST_NM: usize = 360;
/// Last wavelength of the color-matching functions, nm.
pub const LAST_NM: usize = 830;
const COUNT: usize = LAST_NM - FIRST_NM + 1;

/// Luminous efficacy K_m: luminance in cd/m^2 is K_m times Y of a spectral radiance in W m^-2 sr^-1.
pub const LUMINOUS_EFFICACY_LM_PER_W: f64 = 683.0;

/// Planck constant h, J s (SI 2019, exact).
const PLANCK_J_S: f64 = 6.626_070_15e-34;
/// Speed of light c, m/s (exact).
const LIGHT_SPEED_M_PER_S: f64 = 299_792_458.0;
/// Boltzmann constant k, J/K (exact).
const BOLTZMANN_J_PER_K: f64 = 1.380_649e-23;

static MATCHING: LazyLock<[[f64; 3]; COUNT]> = LazyLock::new(|| {
    let mut table = [[0.0; 3]; COUNT];
    let rows = TABLE_TEXT.lines().filter(|line| !line.starts_with('#'));
    for (entry, line) in table.iter_mut().zip(rows) {
        for (value, field) in entry.iter_mut().zip(line.split(',').skip(1)) {
            // The table is compiled in and a test parses every field, so the fallback is never used.
            *value = field.trim().parse().unwrap_or(0.0);
        }
    }
    table
});

/// XYZ of a spectral radiance given per nm, `radiance_per_nm(wavelength_nm)` in W m^-2 sr^-1 nm^-1: the sum over 360-830 nm in steps
/// of 1 nm (CIE 015:2018, section 7). The unit is W m^-2 sr^-1; luminance is [`LUMINOUS_EFFICACY_LM_PER_W`] times Y.
#[must_use]
pub fn xyz_of_spectrum(radiance_per_nm: impl Fn(f64) -> f64) -> [f64; 3] {
    let mut xyz = [0.0; 3];
    for (step, matching) in MATCHING.iter().enumerate() {
        let radiance = radiance_per_nm((FIRST_NM + step) as f64);
        for (sum, value) in xyz.iter_mut().zip(matching) {
            *sum = radiance.mul_add(*value, *sum);
        }
    }
    xyz
}

/// XYZ of a spectral line per unit radiance: the color-matching functions at `wavelength_nm`, linear between whole nm, zero outside 360-830 nm.
#[must_use]
pub fn line_xyz(wavelength_nm: f64) -> [f64; 3] {
    let position = wavelength_nm - FIRST_NM as f64;
    if !(0.0..=(COUNT - 1) as f64).contains(&position) {
        return [0.0; 3];
    }
    let below = (position as usize).min(COUNT - 2);
    let fraction = position - below as f64;
    std::array::from_fn(|i| MATCHING[below][i] + (MATCHING[below + 1][i] - MATCHING[below][i]) * fraction)
}

/// Spectral radiance of a black body, W m^-2 sr^-1 nm^-1 (Planck): `2 h c^2 / lambda^5 / (exp(h c / lambda k T) - 1)`.
/// Zero where it would underflow, and for temperatures that are not above 0 K.
#[must_use]
pub fn planck_radiance_per_nm(wavelength_nm: f64, temperature_k: f64) -> f64 {
    let wavelength_m = wavelength_nm * 1e-9;
    let exponent = PLANCK_J_S * LIGHT_SPEED_M_PER_S / (wavelength_m * BOLTZMANN_J_PER_K * temperature_k);
    // exp(700) is near the largest double; below this radiance (1e-290) nothing is visible.
    if !(exponent > 0.0 && exponent < 700.0) {
        return 0.0;
    }
    let squared = wavelength_m * wavelength_m;
    let numerator = 2.0 * PLANCK_J_S * LIGHT_SPEED_M_PER_S * LIGHT_SPEED_M_PER_S;
    numerator / (squared * squared * wavelength_m) / libm::expm1(exponent) * 1e-9
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn table_is_whole() {
        let rows: Vec<&str> = TABLE_TEXT.lines().filter(|line| !line.starts_with('#')).collect();
        assert_eq!(rows.len(), COUNT);
        for (step, row) in rows.iter().enumerate() {
            let fields: Vec<f64> = row.split(',').map(|field| field.parse().unwrap()).collect();
            assert_eq!((fields.len(), fields[0]), (4, (FIRST_NM + step) as f64));
            assert_eq!(MATCHING[step], fields[1..]);
        }
        // CIE 018: ybar is 1 at 555 nm; the three functions enclose equal areas.
        assert_eq!(MATCHING[555 - FIRST_NM][1], 1.0);
        let [x, y, z] = xyz_of_spectrum(|_| 1.0);
        assert!((x - 106.865469).abs() < 1e-3 && (y - 106.856917).abs() < 1e-3 && (z - 106.892251).abs() < 1e-3);
    }

    #[test]
    fn lines_agree_with_the_reference() {
        let mut checked = 0;
        for row in include_str!("../../tests/data/line_colors.csv").lines().skip(1) {
            let fields: Vec<&str> = row.split(',').collect();
            if fields[2] != "CIE1931_2deg" || fields[0].contains("composite") {
                continue;
            }
            let xyz = line_xyz(fields[1].parse().unwrap());
            for (value, field) in xyz.iter().zip(&fields[3..6]) {
                let expected: f64 = field.parse().unwrap();
                assert!((value - expected).abs() <= 2e-5 + 2e-3 * expected, "{row}: {xyz:?}");
            }
            checked += 1;
        }
        assert!(checked >= 6);
        assert_eq!((line_xyz(359.9), line_xyz(830.1), line_xyz(f64::NAN)), ([0.0; 3], [0.0; 3], [0.0; 3]));
        assert_eq!(line_xyz(830.0), MATCHING[COUNT - 1]);
    }

    #[test]
    fn planck_has_its_known_values() {
        // Wien: at 2898 K the peak lies at 1000 nm; 4.0956e-6 T^5 W m^-2 sr^-1 m^-1 there.
        let peak = planck_radiance_per_nm(1000.0, 2897.771955);
        assert!((peak / (4.095_7e-6 * libm::pow(2897.771955, 5.0) * 1e-9) - 1.0).abs() < 1e-3, "{peak}");
        assert!(planck_radiance_per_nm(990.0, 2897.77) < peak && planck_radiance_per_nm(1010.0, 2897.77) < peak);
        for cold in [1.0, 1e-300, 0.0, -5.0, f64::NAN, 20.0] {
            assert_eq!(planck_radiance_per_nm(555.0, cold), 0.0);
        }
        assert!(planck_radiance_per_nm(555.0, 1e12).is_finite());
    }
}
