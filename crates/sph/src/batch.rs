//! Eight particles at a time.
//!
//! Arrays are walked by loops, not by `map`: its closures would not become vector code.

use fearless_simd::{Simd, prelude::*};

use bansho_base::math::simd::{HalfLanes, Real};

/// Particles looked at together.
pub(super) const BATCH: usize = 8;

/// Squared length of an offset.
#[inline(always)]
pub(super) fn length_squared<R: Real, const D: usize>(offset: &[R; D]) -> R {
    let mut sum = offset[0] * offset[0];
    for c in 1..D {
        sum = offset[c].fma(offset[c], sum);
    }
    sum
}

/// Arrays cut to one length, so that one check of an index serves all.
#[inline(always)]
pub(super) fn truncate_all<const N: usize>(arrays: [&[f32]; N], length: usize) -> [&[f32]; N] {
    let mut truncate_all = arrays;
    for k in 0..N {
        truncate_all[k] = &arrays[k][..length];
    }
    truncate_all
}

/// The batch of each array that begins at an index.
#[inline(always)]
pub(super) fn load<S: Simd, const N: usize>(simd: S, arrays: &[&[f32]; N], first: usize) -> [HalfLanes<S>; N] {
    let mut batches = [HalfLanes::splat(simd, 0.0); N];
    for k in 0..N {
        batches[k] = HalfLanes::from_slice(simd, &arrays[k][first..first + BATCH]);
    }
    batches
}

/// One value of each array.
#[inline(always)]
pub(super) fn values_at<const N: usize>(arrays: &[&[f32]; N], index: usize) -> [f32; N] {
    let mut values = [0.0; N];
    for k in 0..N {
        values[k] = arrays[k][index];
    }
    values
}

/// Each of some numbers in all places of a batch.
#[inline(always)]
pub(super) fn splat_all<S: Simd, const N: usize>(simd: S, values: [f32; N]) -> [HalfLanes<S>; N] {
    let mut batches = [HalfLanes::splat(simd, 0.0); N];
    for k in 0..N {
        batches[k] = HalfLanes::splat(simd, values[k]);
    }
    batches
}

/// `one - other`, component by component.
#[inline(always)]
pub(super) fn subtract<R: Real, const D: usize>(one: &[R; D], other: &[R; D]) -> [R; D] {
    let mut result = *one;
    for c in 0..D {
        result[c] = one[c] - other[c];
    }
    result
}
