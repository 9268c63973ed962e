//! Arrays of sixteen values, one for each drop of a batch. Loops over them are vectorized by the compiler.

pub(crate) use bansho_base::math::simd::LaneArray;
use bansho_base::math::simd::{LANES, Real};

/// One vector for each of sixteen drops, as a structure of arrays: all x, all y, all z.
pub(crate) type Vec3Lanes = [LaneArray; 3];

/// Zero in each lane.
pub(crate) const ZERO_LANES: LaneArray = [0.0; LANES];

/// The cubic `3 t^2 - 2 t^3`, with `t` clamped to 0..=1.
#[inline(always)]
pub(crate) fn smoothstep(t: f32) -> f32 {
    let t = t.simd_clamp01();
    t * t * (3.0 - 2.0 * t)
}
