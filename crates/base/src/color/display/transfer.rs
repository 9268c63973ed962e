//! The sRGB transfer function (IEC 61966-2-1) and its inverse.

use std::sync::LazyLock;

use crate::math::MulAdd;

/// Linear value below which the sRGB encoding is linear.
const LINEAR_LIMIT: f32 = 0.003_130_8;
const LINEAR_SLOPE: f32 = 12.92;

/// `1.055 x^(1/2.4) - 0.055` as a polynomial in `s = x^(1/4)`, from the constant term up: minimax over `LINEAR_LIMIT..=1`, error below
/// 1e-7. As a function of `s`, `1.055 s^(5/3) - 0.055`, it is smooth enough for that; `s` takes two square roots.
const POLYNOMIAL: [f32; 9] = [
    -0.057_718_296,
    0.111_458_71,
    1.546_335_5,
    -1.482_257_1,
    1.965_432_9,
    -1.981_202_7,
    1.332_185_1,
    -0.526_033_9,
    0.091_799_81,
];

/// Encodes linear light as sRGB, within 1e-6 of the definition. Values outside 0..=1 and NaN are clamped.
#[inline(always)]
#[must_use]
pub fn encode_srgb(linear: f32) -> f32 {
    let x = clamp_unit(linear);
    let s = x.sqrt().sqrt();
    let [start, rest @ ..] = POLYNOMIAL;
    let [a, b, c, d, e, f, g, h] = rest;
    let mut power = h;
    for coefficient in [g, f, e, d, c, b, a, start] {
        power = power.fma(s, coefficient);
    }
    if x <= LINEAR_LIMIT { x * LINEAR_SLOPE } else { power }
}

/// `x` clamped to 0..=1; NaN becomes 0. Comparisons instead of `clamp`, so that all vector widths give the same bits.
#[inline(always)]
pub(super) fn clamp_unit(x: f32) -> f32 {
    let non_negative = if x > 0.0 { x } else { 0.0 };
    if non_negative < 1.0 { non_negative } else { 1.0 }
}

/// Components clamped to 0..=1.
#[inline(always)]
pub(super) fn clamp_components([r, g, b]: [f32; 3]) -> [f32; 3] {
    [clamp_unit(r), clamp_unit(g), clamp_unit(b)]
}

/// Linear light of an sRGB value, exact to rounding. Values outside 0..=1 and NaN are clamped.
#[must_use]
pub fn decode_srgb(encoded: f32) -> f32 {
    let x = f64::from(clamp_unit(encoded));
    let linear = if x <= 0.040_45 { x / 12.92 } else { libm::pow((x + 0.055) / 1.055, 2.4) };
    linear as f32
}

/// The values, 0 to 1, of 8-bit codes.
pub const VALUES_OF_CODES: [f32; 256] = {
    let mut values = [0.0; 256];
    let mut code = 0;
    while code < 256 {
        values[code] = code as f32 / 255.0;
        code += 1;
    }
    values
};

/// Linear light of an 8-bit sRGB code, from a table.
#[inline]
#[must_use]
pub fn decode_srgb8(code: u8) -> f32 {
    static TABLE: LazyLock<[f32; 256]> = LazyLock::new(|| std::array::from_fn(|code| decode_srgb(code as f32 / 255.0)));
    TABLE[usize::from(code)]
}

/// [`decode_srgb`], by a table for the values of 8-bit codes.
#[inline]
pub(super) fn decode_srgb_code_or_value(value: f32) -> f32 {
    let code = (value * 255.0 + 0.5) as u8;
    // A comparison with the table instead of a division, which would take longest.
    if VALUES_OF_CODES[usize::from(code)] == value { decode_srgb8(code) } else { decode_srgb(value) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn encode_exactly(x: f64) -> f64 {
        if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * libm::pow(x, 1.0 / 2.4) - 0.055 }
    }

    #[test]
    fn follows_the_definition() {
        for step in 0..=200_000 {
            let x = step as f32 / 200_000.0;
            let error = f64::from(encode_srgb(x)) - encode_exactly(f64::from(x));
            assert!(error.abs() < 1e-6, "{x}: {error}");
        }
        assert!((encode_srgb(0.214_041_14) - 0.5).abs() < 1e-6);
        assert_eq!([-1.0, f32::NAN, 0.0].map(encode_srgb), [0.0; 3]);
        assert!([1.0, 7.0, f32::INFINITY].iter().all(|&x| (encode_srgb(x) - 1.0).abs() < 1e-6));
    }

    #[test]
    fn codes_survive_the_round_trip() {
        for code in 0..=255_u8 {
            let back = encode_srgb(decode_srgb8(code)) * 255.0;
            assert!((back - f32::from(code)).abs() < 2e-3, "{code} came back as {back}");
        }
        assert_eq!((decode_srgb8(0), decode_srgb8(255)), (0.0, 1.0));
    }
}
