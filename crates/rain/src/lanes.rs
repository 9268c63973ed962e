//! Arithmetic on sixteen drops at a time, in loops that the compiler vectorizes.

use bansho_base::math::simd::LANES;

/// A number for each of sixteen drops.
pub(crate) type Lanes = [f32; LANES];

/// A vector for each of them: all x, all y and all z.
pub(crate) type Vec3Lanes = [Lanes; 3];

/// Nothing, for each drop.
pub(crate) const ZERO_LANES: Lanes = [0.0; LANES];

/// Comparisons that become one instruction each, unlike those that ask what is not a number.
#[inline(always)]
pub(crate) fn fast_max(least: f32, value: f32) -> f32 {
    if value > least { value } else { least }
}

#[inline(always)]
pub(crate) fn fast_min(most: f32, value: f32) -> f32 {
    if value < most { value } else { most }
}

/// The cubic `3 t^2 - 2 t^3` of `t` held to 0 to 1.
#[inline(always)]
pub(crate) fn smoothstep(t: f32) -> f32 {
    let t = fast_min(1.0, fast_max(0.0, t));
    t * t * (3.0 - 2.0 * t)
}
