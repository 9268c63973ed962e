//! Mathematical functions with the same results on every machine.
//!
//! The platform's `sin`, `exp` or `pow` differ in their last bits between systems, so a picture made with them is not
//! reproducible. Here every function is computed by `libm`, which is written in Rust with IEEE operations only. Of glam only functions are used that
//! need no more than these operations and a square root.
//! The free functions take `f64`; [`f32`](mod@f32) contains the same for `f32`, and [`approximations`] branch-free approximations for hot loops.

pub mod approximations;
pub mod curve;
pub mod f32;
pub mod random;
pub mod simd;
mod vector_level;

pub use glam::{
    Affine3A, DAffine3, DMat2, DMat3, DMat4, DQuat, DVec2, DVec3, DVec4, EulerRot, IVec2, IVec3, Mat2, Mat3, Mat4,
    Quat, UVec2, UVec3, Vec2, Vec3, Vec3A, Vec4,
};

/// Multiply-add for hot loops.
pub trait MulAdd: Sized {
    /// `self * factor + term`, rounded once; rounded twice in WebAssembly, where fused multiply-add is emulated and thirty times slower.
    #[must_use]
    fn fma(self, factor: Self, term: Self) -> Self;
}

macro_rules! fused_multiply_add {
    ($($float:ty),*) => {
        $(impl MulAdd for $float {
            #[inline(always)]
            fn fma(self, factor: Self, term: Self) -> Self {
                if cfg!(target_arch = "wasm32") { self * factor + term } else { self.mul_add(factor, term) }
            }
        })*
    };
}

fused_multiply_add!(::core::primitive::f32, ::core::primitive::f64);

/// Sine of `x` radians.
pub fn sin(x: f64) -> f64 {
    libm::sin(x)
}

/// Cosine of `x` radians.
pub fn cos(x: f64) -> f64 {
    libm::cos(x)
}

/// Sine and cosine of `x` radians.
pub fn sin_cos(x: f64) -> (f64, f64) {
    libm::sincos(x)
}

/// Tangent of `x` radians.
pub fn tan(x: f64) -> f64 {
    libm::tan(x)
}

/// Arc sine, radians.
pub fn asin(x: f64) -> f64 {
    libm::asin(x)
}

/// Arc cosine, radians.
pub fn acos(x: f64) -> f64 {
    libm::acos(x)
}

/// Arc tangent, radians.
pub fn atan(x: f64) -> f64 {
    libm::atan(x)
}

/// Angle of the point (`x`, `y`) from the x axis, radians in [-pi, pi].
pub fn atan2(y: f64, x: f64) -> f64 {
    libm::atan2(y, x)
}

/// e to the power `x`.
pub fn exp(x: f64) -> f64 {
    libm::exp(x)
}

/// 2 to the power `x`.
pub fn exp2(x: f64) -> f64 {
    libm::exp2(x)
}

/// `exp(x) - 1`, accurate near zero.
pub fn exp_m1(x: f64) -> f64 {
    libm::expm1(x)
}

/// Natural logarithm.
pub fn ln(x: f64) -> f64 {
    libm::log(x)
}

/// `ln(1 + x)`, accurate near zero.
pub fn ln_1p(x: f64) -> f64 {
    libm::log1p(x)
}

/// Logarithm to base 2.
pub fn log2(x: f64) -> f64 {
    libm::log2(x)
}

/// Logarithm to base 10.
pub fn log10(x: f64) -> f64 {
    libm::log10(x)
}

/// `x` to the power `y`.
pub fn pow(x: f64, y: f64) -> f64 {
    libm::pow(x, y)
}

/// Square root, correctly rounded.
pub fn sqrt(x: f64) -> f64 {
    x.sqrt()
}

/// Cube root.
pub fn cbrt(x: f64) -> f64 {
    libm::cbrt(x)
}

/// Hyperbolic tangent.
pub fn tanh(x: f64) -> f64 {
    libm::tanh(x)
}

/// `sqrt(x^2 + y^2)` without intermediate overflow.
pub fn hypot(x: f64, y: f64) -> f64 {
    libm::hypot(x, y)
}

/// Linear interpolation: exactly `a` at `t = 0` and `b` at `t = 1`; extrapolates outside.
#[inline(always)]
pub fn lerp(a: f64, b: f64, t: f64) -> f64 {
    a * (1.0 - t) + b * t
}

/// `x` clamped to [0, 1]; NaN becomes 0.
#[inline(always)]
pub fn saturate(x: f64) -> f64 {
    if x > 0.0 { if x < 1.0 { x } else { 1.0 } } else { 0.0 }
}

/// 0 up to `x = low`, 1 from `x = high`, the cubic `3 t^2 - 2 t^3` between; a step at `low` where the two are equal.
#[inline(always)]
pub fn smoothstep(low: f64, high: f64, x: f64) -> f64 {
    let t = if high > low { saturate((x - low) / (high - low)) } else { (x >= low) as u8 as f64 };
    t * t * (3.0 - 2.0 * t)
}

/// The fractional part of a phase in turns, in [0, 1): reduced in `f64`, so that large times lose no precision. NaN if `turns` is
/// not finite.
#[inline(always)]
pub fn reduce_phase(turns: f64) -> ::core::primitive::f32 {
    let phase = (turns - turns.floor()) as ::core::primitive::f32;
    // Rounding to f32 may give 1, which is the same phase as 0.
    if phase >= 1.0 { 0.0 } else { phase }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elementary_functions_give_known_bits() {
        // Pinned bits: the correctly rounded values, except for exp(1), which libm computes one unit in the last place higher.
        assert_eq!(exp(1.0).to_bits(), std::f64::consts::E.to_bits() + 1);
        assert_eq!(ln(2.0), std::f64::consts::LN_2);
        assert_eq!(4.0 * atan(1.0), std::f64::consts::PI);
        assert_eq!(sin(1.0), 0.841_470_984_807_896_5);
        assert_eq!(cos(1.0), 0.540_302_305_868_139_8);
        assert_eq!(pow(2.0, 0.5), std::f64::consts::SQRT_2);
        assert_eq!(exp2(10.0), 1024.0);
        assert_eq!(log10(1000.0), 3.0);
        assert_eq!(log2(8.0), 3.0);
        assert_eq!(cbrt(27.0), 3.0);
        assert_eq!(hypot(3.0, 4.0), 5.0);
        assert_eq!(exp_m1(1e-20), 1e-20);
        assert_eq!(tanh(40.0), 1.0);
        assert_eq!(atan2(0.0, -1.0), std::f64::consts::PI);
        assert_eq!(sin_cos(1.0), (sin(1.0), cos(1.0)));
    }

    #[test]
    fn single_precision_twins_agree_with_double_precision() {
        for i in 1..2000 {
            let x = i as ::core::primitive::f32 * 0.003;
            let close = |single: ::core::primitive::f32, double: f64| {
                assert!(
                    (single as f64 - double).abs() <= 1.2e-7 * double.abs().max(1e-3),
                    "{x}: {single} for {double}"
                );
            };
            let wide = x as f64;
            close(f32::sin(x), sin(wide));
            close(f32::cos(x), cos(wide));
            close(f32::exp(x), exp(wide));
            close(f32::ln(x), ln(wide));
            close(f32::pow(x, 2.4), pow(wide, 2.4_f32 as f64));
            close(f32::cbrt(x), cbrt(wide));
            close(f32::atan2(x, 2.0), atan2(wide, 2.0));
        }
    }

    #[test]
    fn shaping_functions_hold_their_ends() {
        assert_eq!(lerp(0.1, 0.7, 1.0), 0.7);
        assert_eq!(lerp(2.0, 4.0, 0.25), 2.5);
        assert_eq!((saturate(-1.0), saturate(0.25), saturate(7.0), saturate(f64::NAN)), (0.0, 0.25, 1.0, 0.0));
        assert_eq!((smoothstep(1.0, 3.0, 0.0), smoothstep(1.0, 3.0, 2.0), smoothstep(1.0, 3.0, 9.0)), (0.0, 0.5, 1.0));
        assert_eq!(smoothstep(0.0, 1.0, 0.25), 0.156_25);
        assert_eq!((smoothstep(1.0, 1.0, 0.9), smoothstep(1.0, 1.0, 1.0)), (0.0, 1.0));
    }

    #[test]
    fn phases_stay_below_a_turn_and_lose_nothing_after_hours() {
        assert_eq!(reduce_phase(3.25), 0.25);
        assert_eq!(reduce_phase(-0.25), 0.75);
        assert_eq!(reduce_phase(-1e-30), 0.0);
        assert_eq!(reduce_phase(1.0 - 1e-12), 0.0);
        assert_eq!(reduce_phase(1e9 + 0.125), 0.125);
        assert!(reduce_phase(f64::INFINITY).is_nan());
    }
}
