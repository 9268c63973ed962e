//! Operations on scalars or SIMD vectors with constants, and on vectors of three or four components, each a scalar or a SIMD vector.

use bansho_base::math::simd::Real;

/// `factor * x`.
#[inline(always)]
pub(crate) fn scaled<R: Real>(x: R, factor: f32) -> R {
    x * x.broadcast(factor)
}

/// `slope * x + offset`, rounded once.
#[inline(always)]
pub(crate) fn linear<R: Real>(x: R, slope: f32, offset: f32) -> R {
    x.fma(x.broadcast(slope), x.broadcast(offset))
}

/// Dot product.
#[inline(always)]
pub(crate) fn dot<R: Real>(one: &[R; 3], other: &[R; 3]) -> R {
    one[0].fma(other[0], one[1].fma(other[1], one[2] * other[2]))
}

/// Euclidean length.
#[inline(always)]
pub(crate) fn length<R: Real>(vector: &[R; 3]) -> R {
    dot(vector, vector).simd_sqrt()
}

/// `one - other`.
#[inline(always)]
pub(crate) fn subtract<R: Real>(one: &[R; 3], other: &[R; 3]) -> [R; 3] {
    let mut difference = *one;
    for c in 0..3 {
        difference[c] = one[c] - other[c];
    }
    difference
}

/// `one + other * factor`.
#[inline(always)]
pub(crate) fn add_scaled<R: Real>(one: &[R; 3], other: &[R; 3], factor: R) -> [R; 3] {
    let mut sum = *one;
    for c in 0..3 {
        sum[c] = other[c].fma(factor, one[c]);
    }
    sum
}

/// Scales a vector down to `max_length` where it is longer.
#[inline(always)]
pub(crate) fn clamp_length<R: Real>(vector: &[R; 3], max_length: f32) -> [R; 3] {
    // The reciprocal root is for normal numbers above 0.
    let squared = dot(vector, vector).simd_max(vector[0].broadcast(f32::MIN_POSITIVE));
    let scale = scaled(squared.simd_rsqrt(), max_length).simd_min(vector[0].broadcast(1.0));
    let mut clamped = *vector;
    for c in 0..3 {
        clamped[c] = vector[c] * scale;
    }
    clamped
}

/// Linear interpolation of four components.
#[inline(always)]
pub(crate) fn lerp4<R: Real>(one: &[R; 4], other: &[R; 4], weight: R) -> [R; 4] {
    let mut result = *one;
    for c in 0..4 {
        result[c] = weight.fma(other[c] - one[c], one[c]);
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_vectors_are_shortened_and_others_stay() {
        assert_eq!(clamp_length(&[1.0, -2.0, 2.0], 3.1), [1.0, -2.0, 2.0]);
        assert_eq!(clamp_length(&[0.0; 3], 1.0), [0.0; 3]);
        let clamped = clamp_length(&[10.0, -20.0, 20.0], 3.0);
        assert!((length(&clamped) - 3.0).abs() < 1e-5 && (clamped[1] + 2.0).abs() < 1e-5, "{clamped:?}");
    }
}
