//! Arrays of sixteen values, one for each drop of a batch. Loops over them are vectorized by the compiler.

use bansho_base::math::simd::LANES;

/// One `f32` for each of sixteen drops.
pub(crate) type Lanes = [f32; LANES];

/// One vector for each of sixteen drops, as a structure of arrays: all x, all y, all z.
pub(crate) type Vec3Lanes = [Lanes; 3];

/// Zero in each lane.
pub(crate) const ZERO_LANES: Lanes = [0.0; LANES];

/// The larger of two numbers by one compare and select, `bound` where `value` is NaN. `f32::max` handles NaN in both
/// operands and needs more instructions.
#[inline(always)]
pub(crate) fn fast_max(bound: f32, value: f32) -> f32 {
    if value > bound { value } else { bound }
}

/// The smaller of two numbers, likewise; `bound` where `value` is NaN.
#[inline(always)]
pub(crate) fn fast_min(bound: f32, value: f32) -> f32 {
    if value < bound { value } else { bound }
}

/// The cubic `3 t^2 - 2 t^3`, with `t` clamped to 0..=1.
#[inline(always)]
pub(crate) fn smoothstep(t: f32) -> f32 {
    let t = fast_min(1.0, fast_max(0.0, t));
    t * t * (3.0 - 2.0 * t)
}
