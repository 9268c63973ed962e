//! Color and luminance of black bodies, tabulated for hot loops.

use std::sync::LazyLock;

use super::{
    space::acescg_from_xyz,
    spectrum::{LUMINOUS_EFFICACY_LM_PER_W, planck_radiance_per_nm, xyz_of_spectrum},
};

/// Lowest temperature of the table, K; below it a black body is dark.
pub const LOWEST_K: f32 = 1.0;
/// Highest temperature of the table, K; hotter bodies have this color and luminance.
pub const HIGHEST_K: f32 = 10_000.0;

/// Natural logarithm of the luminance (1e-30 cd/m^2) assigned to bodies too cold for single precision.
pub const DARK_LN_LUMINANCE: f32 = -69.077_55;

const ENTRIES: usize = HIGHEST_K as usize + 1;

/// Black bodies of 1 to 10000 K as absolute ACEScg, one entry per kelvin.
///
/// Planck's law is integrated over 360-830 nm on a geometric grid of temperatures. Between the grid points ln Y, X/Y and Z/Y, which are nearly
/// linear in ln T, are interpolated by cubics (relative error below 1e-6) and tabulated per kelvin.
#[derive(Clone, Debug)]
pub struct BlackBody {
    /// Red, green, blue in cd/m^2 and ln of luminance.
    entries: Vec<[f32; 4]>,
}

/// The table, built on first use (a few ms).
#[must_use]
pub fn black_body() -> &'static BlackBody {
    static TABLE: LazyLock<BlackBody> = LazyLock::new(BlackBody::new);
    &TABLE
}

impl BlackBody {
    fn new() -> Self {
        let coarse = CoarseTable::new();
        Self { entries: (0..ENTRIES).map(|kelvin| coarse.entry(kelvin as f64)).collect() }
    }

    /// The table interval of a temperature and the fraction within it. NaN and negative temperatures count as 0 K.
    #[inline(always)]
    fn locate(temperature_k: f32) -> (usize, f32) {
        let clamped = if temperature_k > 0.0 { temperature_k.min(HIGHEST_K) } else { 0.0 };
        let below = (clamped as usize).min(ENTRIES - 2);
        (below, clamped - below as f32)
    }

    #[inline(always)]
    fn interpolate(&self, temperature_k: f32) -> [f32; 4] {
        let (below, fraction) = Self::locate(temperature_k);
        let (a, b) = (self.entries[below], self.entries[below + 1]);
        let mut between = [0.0; 4];
        for i in 0..4 {
            between[i] = (b[i] - a[i]).mul_add(fraction, a[i]);
        }
        between
    }

    /// Radiance of a black body as ACEScg with luminance in cd/m^2. Linear between whole kelvins; 0 below about 150 K.
    ///
    /// ```
    /// let candle = bansho_base::color::blackbody::black_body().radiance(1900.0);
    /// assert!(candle[0] > candle[1] && candle[1] > candle[2]);
    /// ```
    #[inline(always)]
    #[must_use]
    pub fn radiance(&self, temperature_k: f32) -> [f32; 3] {
        let [r, g, b, _] = self.interpolate(temperature_k);
        [r, g, b]
    }

    /// Natural logarithm of the luminance in cd/m^2, at least [`DARK_LN_LUMINANCE`].
    #[inline(always)]
    #[must_use]
    pub fn ln_luminance(&self, temperature_k: f32) -> f32 {
        self.interpolate(temperature_k)[3]
    }
}

/// Coldest node, K: at 100 K the luminance is about 1e-66 cd/m^2.
const COARSE_LOWEST_K: f64 = 100.0;
const COARSE_HIGHEST_K: f64 = 10_000.0;
const COARSE_INTERVALS: usize = 384;

/// ln Y, X/Y and Z/Y at temperatures spaced evenly in ln T.
struct CoarseTable(Vec<[f64; 3]>);

impl CoarseTable {
    fn ln_ratio() -> f64 {
        libm::log(COARSE_HIGHEST_K / COARSE_LOWEST_K) / COARSE_INTERVALS as f64
    }

    fn new() -> Self {
        // There is no node beyond the highest temperature: the cubic of the last interval uses the four last nodes instead.
        let nodes = (0..=COARSE_INTERVALS).map(|i| {
            let temperature_k = COARSE_LOWEST_K * libm::exp(Self::ln_ratio() * i as f64);
            let [x, y, z] = xyz_of_spectrum(|nm| planck_radiance_per_nm(nm, temperature_k));
            [libm::log(y * LUMINOUS_EFFICACY_LM_PER_W), x / y, z / y]
        });
        Self(nodes.collect())
    }

    /// Cubic Lagrange interpolation in ln T through the four nodes around `temperature_k`.
    fn at(&self, temperature_k: f64) -> [f64; 3] {
        let position = libm::log(temperature_k / COARSE_LOWEST_K) / Self::ln_ratio();
        let first = (position as usize).saturating_sub(1).min(COARSE_INTERVALS - 3);
        let u = position - first as f64;
        let weights = [
            -(u - 1.0) * (u - 2.0) * (u - 3.0) / 6.0,
            u * (u - 2.0) * (u - 3.0) / 2.0,
            -u * (u - 1.0) * (u - 3.0) / 2.0,
            u * (u - 1.0) * (u - 2.0) / 6.0,
        ];
        let mut sum = [0.0; 3];
        for (weight, node) in weights.iter().zip(&self.0[first..]) {
            for (total, value) in sum.iter_mut().zip(node) {
                *total += weight * value;
            }
        }
        sum
    }

    fn entry(&self, temperature_k: f64) -> [f32; 4] {
        const DARK: [f32; 4] = [0.0, 0.0, 0.0, DARK_LN_LUMINANCE];
        if temperature_k < COARSE_LOWEST_K {
            return DARK;
        }
        let [ln_luminance, x_over_y, z_over_y] = self.at(temperature_k);
        if ln_luminance <= f64::from(DARK_LN_LUMINANCE) {
            return DARK;
        }
        let luminance = libm::exp(ln_luminance);
        let [r, g, b] = acescg_from_xyz([x_over_y * luminance, luminance, z_over_y * luminance]);
        [r, g, b, ln_luminance as f32]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::{luminance, xyz_from_acescg};

    #[test]
    fn agrees_with_the_reference() {
        let rows: Vec<&str> = include_str!("../../tests/data/blackbody.csv").lines().skip(1).collect();
        assert_eq!(rows.len(), 93);
        for row in rows {
            let fields: Vec<f64> = row.split(',').map(|field| field.parse().unwrap()).collect();
            let light = black_body().radiance(fields[0] as f32);
            let relative = f64::from(luminance(light)) / fields[4] - 1.0;
            assert!(relative.abs() < 1e-4, "{} K: luminance off by {relative}", fields[0]);
            let xyz = xyz_from_acescg(light);
            let sum: f64 = xyz.iter().sum();
            assert!((xyz[0] / sum - fields[7]).abs() < 1e-4 && (xyz[1] / sum - fields[8]).abs() < 1e-4, "{row}");
        }
    }

    #[test]
    fn between_kelvins_it_follows_the_integral() {
        for temperature_k in [612.5, 850.5, 1203.25, 1850.75, 2999.5, 7777.7, 9999.5] {
            let y = xyz_of_spectrum(|nm| planck_radiance_per_nm(nm, temperature_k))[1] * LUMINOUS_EFFICACY_LM_PER_W;
            let light = black_body().radiance(temperature_k as f32);
            let relative = f64::from(luminance(light)) / y - 1.0;
            assert!(relative.abs() < 1e-3, "{temperature_k} K: {relative}");
            let logarithm = f64::from(black_body().ln_luminance(temperature_k as f32));
            assert!((logarithm - libm::log(y)).abs() < 1e-3);
        }
    }

    #[test]
    fn every_temperature_is_finite_and_rises() {
        let table = black_body();
        let mut before = 0.0;
        for step in 0..40_000 {
            let light = table.radiance(step as f32 * 0.25);
            assert!(light.iter().all(|v| v.is_finite()));
            let y = luminance(light);
            assert!(y >= before, "{} K", step as f32 * 0.25);
            before = y;
        }
        for cold in [1.0, 0.0, -3.0, f32::NAN, f32::NEG_INFINITY] {
            assert_eq!(table.radiance(cold), [0.0; 3]);
            assert_eq!(table.ln_luminance(cold), DARK_LN_LUMINANCE);
        }
        assert_eq!(table.radiance(f32::INFINITY), table.radiance(HIGHEST_K));
    }
}
