//! AgX, the view transform of Blender 4 and three.js (Sobotka 2022): a sigmoid in the logarithm of light on each channel, between two matrices that mix
//! the channels.
//!
//! The published polynomial of the sigmoid ends at 0.9986; here it is divided by that, so that light of 2^4.026 is display white. Codes differ from those of
//! other programs by at most one, and every display color has light that is shown as it: the inverse may have negative components, which are
//! kept.

use super::{gamut::sanitized, row::DisplayTransform, transfer::clamp_components};
use crate::{
    color::space::{Matrix3, REC2020_FROM_ACESCG, SRGB_FROM_ACESCG, apply_single},
    math::{MulAdd, approximations},
};

/// Mixes the channels of linear Rec. 2020, so that bright saturated colors approach white.
const INSET: Matrix3 = Matrix3([
    [0.856_627_153_315_983, 0.095_121_240_538_158_8, 0.048_251_606_145_858_3],
    [0.137_318_972_929_847, 0.761_241_990_602_591, 0.101_439_036_467_562],
    [0.111_898_212_999_95, 0.076_799_418_603_190_3, 0.811_302_368_396_859],
]);
/// Restores most of the saturation after the sigmoid. It is not the inverse of [`INSET`]: what is left makes colors paler.
const OUTSET: Matrix3 = Matrix3([
    [1.127_100_581_814_436_8, -0.110_606_643_096_603_23, -0.016_493_938_717_834_573],
    [-0.141_329_763_498_438_3, 1.157_823_702_216_272, -0.016_493_938_717_834_257],
    [-0.141_329_763_498_438_26, -0.110_606_643_096_602_94, 1.251_936_406_595_040_5],
]);

/// Exponents of two of the light at both ends of the sigmoid.
const MIN_EXPONENT: f32 = -12.473_93;
const MAX_EXPONENT: f32 = 4.026_069;
/// The sigmoid as a polynomial, from the constant term up.
const SIGMOID: [f32; 7] = [-0.002_32, 0.119_1, 0.429_8, -6.868, 31.96, -40.14, 15.5];
/// Its value at 1.
const SIGMOID_END: f32 = 0.998_58;
/// The sigmoid's result is encoded with this exponent.
const GAMMA: f32 = 2.2;

/// The transform.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Agx;

/// The normalized sigmoid at `t`, 0 to 1.
#[inline(always)]
fn sigmoid(t: f32) -> f32 {
    let [start, a, b, c, d, e, f] = SIGMOID;
    let power = f.fma(t, e).fma(t, d).fma(t, c).fma(t, b).fma(t, a).fma(t, start);
    power * (1.0 / SIGMOID_END)
}

/// The `t` from 0 to 1 at which the sigmoid has a value: by halving, since its slope is small at both ends, where Newton's method leaves the interval.
#[inline(always)]
fn inverse_sigmoid(value: f32) -> f32 {
    let (mut t, mut step) = (0.5, 0.25);
    for _ in 0..24 {
        t += if sigmoid(t) < value { step } else { -step };
        step *= 0.5;
    }
    t
}

/// Display light of one channel, encoded, of the light of the inset.
#[inline(always)]
fn encoded(light: f32) -> f32 {
    let positive = if light > 1e-10 { light } else { 1e-10 };
    let t = (approximations::log2(positive) - MIN_EXPONENT) * (1.0 / (MAX_EXPONENT - MIN_EXPONENT));
    let t = if t > 0.0 { t } else { 0.0 };
    sigmoid(if t < 1.0 { t } else { 1.0 })
}

/// Light of the inset that has this encoded display light. Black has none at all, rather than the little that the sigmoid shows as black.
#[inline(always)]
fn decoded(value: f32) -> f32 {
    let exponent = inverse_sigmoid(value).fma(MAX_EXPONENT - MIN_EXPONENT, MIN_EXPONENT);
    if value > 0.0 { approximations::exp2(exponent) } else { 0.0 }
}

#[inline(always)]
fn power(x: f32, exponent: f32) -> f32 {
    approximations::pow(if x > 0.0 { x } else { 0.0 }, exponent)
}

impl DisplayTransform for Agx {
    #[inline(always)]
    fn display_from_acescg(&self, [r, g, b]: [f32; 3]) -> [f32; 3] {
        let light = apply_single(
            &const { INSET.times(&REC2020_FROM_ACESCG).single() },
            [sanitized(r), sanitized(g), sanitized(b)],
        );
        let [r, g, b] =
            apply_single(&const { OUTSET.single() }, [encoded(light[0]), encoded(light[1]), encoded(light[2])]);
        let rec2020 = [power(r, GAMMA), power(g, GAMMA), power(b, GAMMA)];
        clamp_components(apply_single(
            &const { SRGB_FROM_ACESCG.times(&REC2020_FROM_ACESCG.inverse()).single() },
            rec2020,
        ))
    }

    #[inline(always)]
    fn acescg_from_display(&self, display: [f32; 3]) -> [f32; 3] {
        let [r, g, b] = apply_single(
            &const { REC2020_FROM_ACESCG.times(&SRGB_FROM_ACESCG.inverse()).single() },
            clamp_components(display),
        );
        let values = [power(r, 1.0 / GAMMA), power(g, 1.0 / GAMMA), power(b, 1.0 / GAMMA)];
        let [r, g, b] = apply_single(&const { OUTSET.inverse().single() }, values);
        apply_single(
            &const { INSET.times(&REC2020_FROM_ACESCG).inverse().single() },
            [decoded(r), decoded(g), decoded(b)],
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::{acescg_from_srgb, encode_srgb};

    /// The published formula in double precision, from linear sRGB to linear sRGB.
    fn reference(srgb: [f64; 3]) -> [f64; 3] {
        let inset = INSET.times(&REC2020_FROM_ACESCG.times(&SRGB_FROM_ACESCG.inverse())).apply(srgb);
        let encoded = inset.map(|light| {
            let t = ((libm::log2(light.max(1e-10)) + 12.473_93) / 16.499_999).clamp(0.0, 1.0);
            SIGMOID.iter().rev().fold(0.0, |sum, coefficient| sum * t + f64::from(*coefficient))
        });
        let rec2020 = OUTSET.apply(encoded).map(|value| libm::pow(value.max(0.0), 2.2));
        SRGB_FROM_ACESCG.times(&REC2020_FROM_ACESCG.inverse()).apply(rec2020).map(|light| light.clamp(0.0, 1.0))
    }

    #[test]
    fn codes_are_those_of_the_published_formula_within_one() {
        for index in 0..9 * 9 * 9 {
            let steps = [index % 9, index / 9 % 9, index / 81];
            let srgb = steps.map(|step| if step == 0 { 0.0 } else { libm::exp2(1.9 * f64::from(step) - 11.0) });
            let shown = Agx.display_from_acescg(acescg_from_srgb(srgb.map(|light| light as f32)));
            for (light, expected) in shown.iter().zip(reference(srgb)) {
                let [code, expected] = [*light, expected as f32].map(|light| 255.0 * encode_srgb(light));
                assert!((code - expected).abs() < 0.6, "{srgb:?}: {code} is not {expected}");
            }
        }
    }

    #[test]
    fn middle_gray_is_shown_as_half_and_the_brightest_light_as_white() {
        // t = (log2 0.18 + 12.474) / 16.5 = 0.606, where the polynomial is 0.4967: (0.4967 / 0.99858)^2.2 = 0.2152.
        let gray = Agx.display_from_acescg([0.18; 3])[1];
        assert!((gray - 0.2152).abs() < 2e-4, "{gray}");
        for light in [16.5, 1e3, f32::INFINITY] {
            assert!(Agx.display_from_acescg([light; 3]).iter().all(|light| *light > 0.999_99));
        }
        assert_eq!(Agx.display_from_acescg([0.0; 3]), [0.0; 3]);
        assert_eq!(Agx.acescg_from_display([0.0; 3]), [0.0; 3]);
    }

    #[test]
    fn the_sigmoid_rises_everywhere() {
        for i in 0..1000 {
            let [low, high] = [i, i + 1].map(|i| sigmoid(i as f32 / 1000.0));
            assert!(high > low, "{i}");
            assert!((inverse_sigmoid(0.5 * (low + high)) - (i as f32 + 0.5) / 1000.0).abs() < 1e-3, "{i}");
        }
    }
}
