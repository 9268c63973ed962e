//! The functions of [`math`](super) in single precision.

/// Sine of `x` radians.
pub fn sin(x: f32) -> f32 {
    libm::sinf(x)
}

/// Cosine of `x` radians.
pub fn cos(x: f32) -> f32 {
    libm::cosf(x)
}

/// Sine and cosine of `x` radians.
pub fn sin_cos(x: f32) -> (f32, f32) {
    libm::sincosf(x)
}

/// Tangent of `x` radians.
pub fn tan(x: f32) -> f32 {
    libm::tanf(x)
}

/// Arc sine, radians.
pub fn asin(x: f32) -> f32 {
    libm::asinf(x)
}

/// Arc cosine, radians.
pub fn acos(x: f32) -> f32 {
    libm::acosf(x)
}

/// Arc tangent, radians.
pub fn atan(x: f32) -> f32 {
    libm::atanf(x)
}

/// Angle of the point (`x`, `y`) from the x axis, radians in [-pi, pi].
pub fn atan2(y: f32, x: f32) -> f32 {
    libm::atan2f(y, x)
}

/// e to the power `x`.
pub fn exp(x: f32) -> f32 {
    libm::expf(x)
}

/// 2 to the power `x`.
pub fn exp2(x: f32) -> f32 {
    libm::exp2f(x)
}

/// `exp(x) - 1`, accurate near zero.
pub fn exp_m1(x: f32) -> f32 {
    libm::expm1f(x)
}

/// Natural logarithm.
pub fn ln(x: f32) -> f32 {
    libm::logf(x)
}

/// `ln(1 + x)`, accurate near zero.
pub fn ln_1p(x: f32) -> f32 {
    libm::log1pf(x)
}

/// Logarithm to base 2.
pub fn log2(x: f32) -> f32 {
    libm::log2f(x)
}

/// Logarithm to base 10.
pub fn log10(x: f32) -> f32 {
    libm::log10f(x)
}

/// `x` to the power `y`.
pub fn pow(x: f32, y: f32) -> f32 {
    libm::powf(x, y)
}

/// Square root, correctly rounded.
#[inline(always)]
pub fn sqrt(x: f32) -> f32 {
    x.sqrt()
}

/// Cube root.
pub fn cbrt(x: f32) -> f32 {
    libm::cbrtf(x)
}

/// Hyperbolic tangent.
pub fn tanh(x: f32) -> f32 {
    libm::tanhf(x)
}

/// `sqrt(x^2 + y^2)` without intermediate overflow.
pub fn hypot(x: f32, y: f32) -> f32 {
    libm::hypotf(x, y)
}

/// Linear interpolation: exactly `a` at `t = 0` and `b` at `t = 1`; extrapolates outside.
#[inline(always)]
pub fn lerp(a: f32, b: f32, t: f32) -> f32 {
    a * (1.0 - t) + b * t
}

/// `x` clamped to [0, 1]; NaN becomes 0.
#[inline(always)]
pub fn saturate(x: f32) -> f32 {
    if x > 0.0 { if x < 1.0 { x } else { 1.0 } } else { 0.0 }
}

/// 0 up to `x = low`, 1 from `x = high`, the cubic `3 t^2 - 2 t^3` between; a step at `low` where the two are equal.
#[inline(always)]
pub fn smoothstep(low: f32, high: f32, x: f32) -> f32 {
    let t = if high > low { saturate((x - low) / (high - low)) } else { (x >= low) as u8 as f32 };
    t * t * (3.0 - 2.0 * t)
}
