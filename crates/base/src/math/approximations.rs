//! Branch-free `f32` approximations for hot loops.
//!
//! Each function takes one number and is always inlined: a plain loop over `[f32; 16]` under `fearless_simd::dispatch!` is vectorized, and a scalar
//! call gives the same bits. Multiply-adds are explicit ([`MulAdd`]): slow where the processor, or the enclosing function outside `dispatch!`, has no
//! such instruction. Outside hot loops use [`super::f32`].
//! Coefficients are minimax fits with the stated error before rounding; the stated bounds include rounding and are tested.

use super::MulAdd;

/// 3 * 2^22: adding it to a number of magnitude below 2^22 rounds that number to an integer, which is then in the low bits of the sum.
pub(crate) const ROUNDING_MAGIC: f32 = 12_582_912.0;
const SIGN_BIT: u32 = 0x8000_0000;

/// `x` rounded to the nearest integer, ties to even; for magnitudes below 2^22.
#[inline(always)]
pub fn rounded(x: f32) -> f32 {
    (x + ROUNDING_MAGIC) - ROUNDING_MAGIC
}

/// Like [`rounded`], as an integer. (A saturating cast would be checked lane by lane.)
#[inline(always)]
pub fn round_to_i32(x: f32) -> i32 {
    (x + ROUNDING_MAGIC).to_bits().wrapping_sub(ROUNDING_MAGIC.to_bits()).cast_signed()
}

/// 2 to the power `x`; relative error below 1.4e-7. From 128 on the result is infinite, below -126 it is 0 (no subnormals); NaN stays NaN.
#[inline(always)]
pub fn exp2(x: f32) -> f32 {
    let clamped = if x > -127.0 { x } else { -127.0 };
    let clamped = if clamped < 128.0 { clamped } else { 128.0 };
    let result = exp2_in_range(clamped);
    let result = if x < -126.0 { 0.0 } else { result };
    let result = if x >= 128.0 { f32::INFINITY } else { result };
    if x.is_nan() { x } else { result }
}

/// [`exp2`] of a number from -126 to below 128: the same bits, without what other numbers and NaN need, which is half of the time.
#[inline(always)]
pub fn exp2_in_range(x: f32) -> f32 {
    let rounded = x + ROUNDING_MAGIC;
    let f = x - (rounded - ROUNDING_MAGIC);
    // 2^f = 1 + f q(f) on [-1/2, 1/2], fit 2.0e-9.
    let q = 1.535_336e-4_f32.fma(f, 1.339_887_5e-3).fma(f, 9.618_437e-3);
    let q = q.fma(f, 5.550_332_5e-2).fma(f, 2.402_264_8e-1).fma(f, 6.931_472e-1);
    scale(q.fma(f, 1.0), rounded)
}

/// e to the power `x`; relative error below 1.6e-7. Above 88.7 the result is infinite, below -87.3 it is 0 (no subnormals); NaN stays NaN.
#[inline(always)]
pub fn exp(x: f32) -> f32 {
    let clamped = if x > -88.0 { x } else { -88.0 };
    let clamped = if clamped < 89.0 { clamped } else { 89.0 };
    let rounded = clamped.fma(std::f32::consts::LOG2_E, ROUNDING_MAGIC);
    let whole = rounded - ROUNDING_MAGIC;
    // ln 2 is split in two, so that the remainder of a large x keeps its precision (Cody & Waite).
    let f = whole.fma(-0.693_359_4, clamped);
    let f = whole.fma(2.121_944_4e-4, f);
    // e^f = 1 + f + f^2 q(f) on [-ln 2 / 2, ln 2 / 2], fit 3.1e-9.
    let q = 1.381_461_5e-3_f32.fma(f, 8.368_71e-3).fma(f, 4.166_839e-2);
    let q = q.fma(f, 1.666_652_1e-1).fma(f, 4.999_999_3e-1);
    let result = scale((f * f).fma(q, f) + 1.0, rounded);
    let result = if x < -87.336_54 { 0.0 } else { result };
    let result = if x > 88.722_83 { f32::INFINITY } else { result };
    if x.is_nan() { x } else { result }
}

/// `x` times 2 to the power in the low bits of `rounded`: adds to the exponent bits, so that the power itself may overflow.
#[inline(always)]
fn scale(x: f32, rounded: f32) -> f32 {
    f32::from_bits(x.to_bits().wrapping_add(rounded.to_bits() << 23))
}

/// Logarithm to base 2; relative error below 2.4e-7. Zero gives minus infinity, a negative number NaN.
#[inline(always)]
pub fn log2(x: f32) -> f32 {
    let subnormal = x < f32::MIN_POSITIVE;
    let normal = if subnormal { x * 8_388_608.0 } else { x };
    let result = log2_of_scaled(normal, if subnormal { 23.0 } else { 0.0 });
    let result = if x == 0.0 { f32::NEG_INFINITY } else { result };
    let result = if x == f32::INFINITY { x } else { result };
    if x >= 0.0 { result } else { f32::NAN }
}

/// [`log2`] of a normal number above 0: the same bits, without what other numbers and NaN need.
#[inline(always)]
pub fn log2_of_normal(x: f32) -> f32 {
    log2_of_scaled(x, 0.0)
}

/// Logarithm to base 2 of a normal number above 0 that is 2 to the power `exponent` times another one, of that one.
#[inline(always)]
fn log2_of_scaled(normal: f32, exponent: f32) -> f32 {
    // Exponent and mantissa, the mantissa in [sqrt(1/2), sqrt(2)).
    let shifted = normal.to_bits().wrapping_sub(0x3f35_04f3);
    let exponent = (shifted as i32 >> 23) as f32 - exponent;
    let mantissa = f32::from_bits((shifted & 0x007f_ffff).wrapping_add(0x3f35_04f3));
    // log2 m = s q(s^2), s = (m - 1) / (m + 1), |s| < 0.172, fit 6.7e-9.
    let s = (mantissa - 1.0) / (mantissa + 1.0);
    let s2 = s * s;
    let q = 4.547_422e-1_f32.fma(s2, 5.757_17e-1).fma(s2, 9.618_095e-1).fma(s2, 2.885_39);
    s.fma(q, exponent)
}

/// Natural logarithm; relative error below 3.5e-7. Zero gives minus infinity, a negative number NaN.
#[inline(always)]
pub fn ln(x: f32) -> f32 {
    log2(x) * std::f32::consts::LN_2
}

/// `x` to the power `y` for `x >= 0`; relative error below `1.6e-7 + 3e-7 |y log2 x|`. A negative `x` gives NaN; `y` must not be 0 if
/// `x` is 0 or infinite.
#[inline(always)]
pub fn pow(x: f32, y: f32) -> f32 {
    exp2(y * log2(x))
}

/// Sine of `x` turns; absolute error below 1.8e-7 in addition to the rounding error of `x`. NaN where `x` is not finite.
#[inline(always)]
pub fn sin_turns(x: f32) -> f32 {
    let r = x - x.round_ties_even();
    // Fold the outer quarters: sin(pi - a) = sin a.
    let magnitude = f32::from_bits(r.to_bits() & !SIGN_BIT);
    let folded = if magnitude > 0.25 { 0.5 - magnitude } else { magnitude };
    sin_quarter(f32::from_bits(folded.to_bits() | (r.to_bits() & SIGN_BIT)))
}

/// Cosine of `x` turns; absolute error below 1.8e-7 in addition to the rounding error of `x`. NaN where `x` is not finite.
#[inline(always)]
pub fn cos_turns(x: f32) -> f32 {
    let r = x - x.round_ties_even();
    sin_quarter(0.25 - f32::from_bits(r.to_bits() & !SIGN_BIT))
}

/// Sine of `r` turns on [-1/4, 1/4]: odd polynomial of degree 9, fit 5.3e-9; clamped to [-1, 1].
#[inline(always)]
fn sin_quarter(r: f32) -> f32 {
    let r2 = r * r;
    let q = 39.711_13_f32.fma(r2, -76.575_02).fma(r2, 81.602_234).fma(r2, -41.341_68).fma(r2, 6.283_185_5);
    let sine = r * q;
    let sine = if sine > 1.0 { 1.0 } else { sine };
    if sine < -1.0 { -1.0 } else { sine }
}

/// Angle of the direction (`x`, `y`) from the first axis in [-pi, pi], radians; absolute error below 4e-7. 0 where both are 0.
#[inline(always)]
pub fn atan2(y: f32, x: f32) -> f32 {
    let (abs_y, abs_x) = (f32::from_bits(y.to_bits() & !SIGN_BIT), f32::from_bits(x.to_bits() & !SIGN_BIT));
    let steep = abs_y > abs_x;
    let (smaller, larger) = if steep { (abs_x, abs_y) } else { (abs_y, abs_x) };
    // atan r = r q(r^2) on [0, 1], fit 3.8e-8.
    let r = smaller / if larger > 0.0 { larger } else { 1.0 };
    let r2 = r * r;
    let q = (-4.054_555e-3_f32).fma(r2, 2.186_291_5e-2).fma(r2, -5.591_226_6e-2).fma(r2, 9.642_193e-2);
    let q = q.fma(r2, -1.390_862_8e-1).fma(r2, 1.994_656_5e-1).fma(r2, -3.332_986e-1);
    let angle = r * q.fma(r2, 9.999_993e-1);
    let angle = if steep { std::f32::consts::FRAC_PI_2 - angle } else { angle };
    let angle = if x < 0.0 { std::f32::consts::PI - angle } else { angle };
    f32::from_bits(angle.to_bits() | (y.to_bits() & SIGN_BIT))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math;

    /// Largest of `error` over the `f32` from `low` to `high` whose bit patterns lie `stride` apart.
    fn worst(low: f32, high: f32, stride: usize, error: impl Fn(f32) -> f64) -> f64 {
        assert!(0.0 <= low && low < high);
        (low.to_bits()..=high.to_bits()).step_by(stride).map(|bits| error(f32::from_bits(bits))).fold(0.0, f64::max)
    }

    fn relative(got: f32, want: f64) -> f64 {
        if want == 0.0 && got == 0.0 { 0.0 } else { ((got as f64 - want) / want).abs() }
    }

    #[test]
    fn functions_of_a_range_have_the_bits_of_the_whole_functions_there() {
        for step in 0..=1_000_000 {
            let x = step as f32 * 254e-6 - 126.0;
            if x < 128.0 {
                assert_eq!(exp2_in_range(x).to_bits(), exp2(x).to_bits(), "{x}");
            }
            // Every exponent, from the smallest normal number to the largest number.
            let positive = f32::from_bits(f32::MIN_POSITIVE.to_bits() + step * 2122);
            if positive.is_finite() {
                assert_eq!(log2_of_normal(positive).to_bits(), log2(positive).to_bits(), "{positive}");
            }
        }
    }

    #[test]
    fn exp2_keeps_its_bound_over_its_whole_domain() {
        let error = |x: f32| relative(exp2(x), math::exp2(x as f64)).max(relative(exp2(-x), math::exp2(-x as f64)));
        assert!(worst(1e-9, 125.999, 1511, error) < 1.4e-7);
        let above = |x: f32| relative(exp2(x), math::exp2(x as f64));
        assert!(worst(126.0, 127.999_99, 1, above) < 1.4e-7);
        assert_eq!(
            (exp2(0.0), exp2(10.0), exp2(-126.0), exp2(127.0)),
            (1.0, 1024.0, f32::MIN_POSITIVE, 2_f32.powi_exact(127))
        );
        assert_eq!(
            (exp2(128.0), exp2(1e30), exp2(-126.01), exp2(f32::NEG_INFINITY)),
            (f32::INFINITY, f32::INFINITY, 0.0, 0.0)
        );
        assert!(exp2(f32::NAN).is_nan() && exp2(f32::from_bits(0x7fff_ffff)).is_nan());
    }

    trait PowerOfTwo {
        fn powi_exact(self, exponent: i32) -> f32;
    }
    impl PowerOfTwo for f32 {
        fn powi_exact(self, exponent: i32) -> f32 {
            (0..exponent).fold(1.0, |product, _| product * self)
        }
    }

    #[test]
    fn exp_keeps_its_bound_over_its_whole_domain() {
        let error = |x: f32| relative(exp(x), math::exp(x as f64)).max(relative(exp(-x), math::exp(-x as f64)));
        assert!(worst(1e-9, 87.336, 1511, error) < 1.6e-7);
        assert!(worst(87.336, 88.722_8, 1, |x| relative(exp(x), math::exp(x as f64))) < 1.6e-7);
        assert_eq!(
            (exp(0.0), exp(-90.0), exp(-1e30), exp(89.0), exp(f32::INFINITY)),
            (1.0, 0.0, 0.0, f32::INFINITY, f32::INFINITY)
        );
        assert!(exp(f32::NAN).is_nan());
    }

    #[test]
    fn logarithms_keep_their_bound_over_all_positive_numbers() {
        assert!(worst(f32::from_bits(1), f32::MAX, 1511, |x| relative(log2(x), math::log2(x as f64))) < 2.4e-7);
        assert!(worst(0.99, 1.01, 1, |x| relative(log2(x), math::log2(x as f64))) < 2.4e-7);
        assert!(worst(f32::from_bits(1), f32::MAX, 1511, |x| relative(ln(x), math::ln(x as f64))) < 3.5e-7);
        assert_eq!(
            (log2(1.0), log2(0.125), log2(0.0), log2(f32::INFINITY)),
            (0.0, -3.0, f32::NEG_INFINITY, f32::INFINITY)
        );
        assert!(log2(-1.0).is_nan() && log2(f32::NAN).is_nan());
    }

    #[test]
    fn pow_keeps_its_bound() {
        for y in [-3.5_f32, -1.0, 0.45, 1.0, 2.4, 5.0] {
            let excess = |x: f32| {
                let want = math::pow(x as f64, y as f64);
                relative(pow(x, y), want) - 3e-7 * (y as f64 * math::log2(x as f64)).abs()
            };
            assert!(worst(1e-6, 1e6, 4001, excess) < 1.6e-7);
        }
        assert_eq!((pow(0.0, 2.0), pow(4.0, 0.0), pow(2.0, 3.0)), (0.0, 1.0, 8.0));
    }

    #[test]
    fn sine_and_cosine_keep_their_bounds_and_stay_within_one() {
        let error = |x: f32| {
            let angle = std::f64::consts::TAU * (x as f64 - (x as f64).floor());
            let sine =
                (sin_turns(x) as f64 - math::sin(angle)).abs().max((sin_turns(-x) as f64 + math::sin(angle)).abs());
            assert!(sin_turns(x).abs() <= 1.0 && cos_turns(x).abs() <= 1.0);
            sine.max((cos_turns(x) as f64 - math::cos(angle)).abs())
        };
        assert!(worst(1e-9, 1e7, 1511, error) < 1.8e-7);
        assert!(worst(0.2, 0.3, 7, error) < 1.8e-7);
        assert_eq!((sin_turns(0.0), sin_turns(0.5), cos_turns(0.25), cos_turns(0.0)), (0.0, 0.0, 0.0, 1.0));
        assert_eq!((sin_turns(0.25), sin_turns(-0.25), cos_turns(3.5), sin_turns(1e30)), (1.0, -1.0, -1.0, 0.0));
        assert!(sin_turns(f32::INFINITY).is_nan());
    }

    #[test]
    fn angles_keep_their_bound_in_all_quadrants() {
        for step in 0..100_000 {
            let angle = (step as f64 / 50_000.0 - 1.0) * 0.999_999 * std::f64::consts::PI;
            let (sin, cos) = math::sin_cos(angle);
            let (y, x) = ((17.0 * sin) as f32, (17.0 * cos) as f32);
            assert!((atan2(y, x) as f64 - math::atan2(y as f64, x as f64)).abs() < 4e-7, "{angle}");
        }
        assert_eq!((atan2(0.0, 0.0), atan2(0.0, 2.0), atan2(3.0, 0.0)), (0.0, 0.0, std::f32::consts::FRAC_PI_2));
        assert_eq!(atan2(0.0, -1.0), std::f32::consts::PI);
    }

    #[test]
    fn vector_code_gives_the_bits_of_scalar_code() {
        #[inline(always)]
        fn all(x: &[f32; 16]) -> [[f32; 16]; 5] {
            [x.map(exp2), x.map(exp), x.map(log2), x.map(sin_turns), x.map(cos_turns)]
        }
        for (start, level) in (0..4000_u32).zip(crate::math::simd::available_levels().cycle()) {
            let x: [f32; 16] =
                std::array::from_fn(|i| f32::from_bits((start * 16 + i as u32).wrapping_mul(0x9e37_79b9)));
            let vector = fearless_simd::dispatch!(level, _simd => all(&x)).map(|row| row.map(canonical));
            let scalar = all(&x);
            assert_eq!(vector, scalar.map(|row| row.map(canonical)), "{level:?}");
        }
    }

    /// Bits, with one pattern for every NaN.
    fn canonical(x: f32) -> u32 {
        if x.is_nan() { 0x7fc0_0000 } else { x.to_bits() }
    }
}
