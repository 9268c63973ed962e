//! Values at faces from the values of cells: third order where the field is smooth, bounded where it is not.

use bansho_base::math::simd::{Lanes, Real};
use fearless_simd::{Simd, prelude::*};

/// Sixteen values of a field from `index` on.
///
/// Code with vectors calls no closures by `array::map`: the compiler does not inline it into functions with other instruction sets, and a call for each vector
/// takes three times as long.
#[inline(always)]
pub(crate) fn load<S: Simd>(simd: S, field: &[f32], index: usize) -> Lanes<S> {
    Lanes::from_slice(simd, &field[index..index + 16])
}

/// Value at the face between cell `index - stride` and cell `index` of what is carried through it at the speed `carrier`.
#[inline(always)]
pub(crate) fn carried<S: Simd>(
    simd: S,
    field: &[f32],
    index: usize,
    stride: usize,
    is_positive: fearless_simd::mask32x16<S>,
) -> Lanes<S> {
    let before_low = load(simd, field, index - 2 * stride);
    let low = load(simd, field, index - stride);
    let high = load(simd, field, index);
    let after_high = load(simd, field, index + stride);
    let upwind = is_positive.select(low, high);
    let far_upwind = is_positive.select(before_low, after_high);
    let downwind = is_positive.select(high, low);
    upwind + limited_slope(upwind - far_upwind, downwind - upwind) * Lanes::splat(simd, 0.5)
}

/// The limiter of Koren (1993) as a slope: the third-order slope `(a + 2 b) / 3` of the differences `a` upwind and `b` downwind, at most twice either of them,
/// and 0 at an extremum.
#[inline(always)]
pub(crate) fn limited_slope<S: Simd>(upwind: Lanes<S>, downwind: Lanes<S>) -> Lanes<S> {
    let simd = upwind.simd;
    let zero = Lanes::splat(simd, 0.0);
    let third_order = (upwind + downwind + downwind) * Lanes::splat(simd, 1.0 / 3.0);
    let twice_upwind = upwind + upwind;
    let twice_downwind = downwind + downwind;
    // For positive differences the smallest of the three, at least 0; for negative ones the largest, at most 0. Only one of the two is not 0.
    let rising = twice_upwind.simd_min(twice_downwind).simd_min(third_order).simd_max(zero);
    let falling = twice_upwind.simd_max(twice_downwind).simd_max(third_order).simd_min(zero);
    rising + falling
}
