//! A batch of collisions on the rows of a chart.

use fearless_simd::{Simd, prelude::*, u64x8};

use bansho_base::math::simd::{LANES, Lanes, Real, nearest_whole, ramp};

/// Collisions that are worked on at once.
pub(super) const SPLAT_LANES: usize = LANES;

/// Pairs of rows that collisions lie between, and the weights of both rows. Those outside have no weight and a pair each below the chart,
/// for sums in one would wait for each other.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(super) struct SplatBatch {
    /// Number of a pair: half its upper row if that is even; else half its lower row, counted from the first odd pair on.
    pub(super) pairs: [u32; SPLAT_LANES],
    /// Two numbers each, for they are read at once.
    pub(super) weights: [u64; SPLAT_LANES],
}

/// The least and the greatest row of each lane.
pub(super) struct RowRange<S: Simd> {
    least: Lanes<S>,
    greatest: Lanes<S>,
}

impl<S: Simd> RowRange<S> {
    #[inline(always)]
    pub(super) fn new(simd: S) -> Self {
        Self { least: Lanes::splat(simd, f32::INFINITY), greatest: Lanes::splat(simd, -1.0) }
    }

    /// The first row that may hold something, and the one after the last.
    #[inline(always)]
    pub(super) fn range(&self) -> [usize; 2] {
        let (least, greatest) = (self.least.reduce_min(), self.greatest.reduce_max());
        if greatest < least { [0; 2] } else { [least as usize, greatest as usize + 2] }
    }
}

impl SplatBatch {
    pub(super) const NONE: Self = Self { pairs: [0; SPLAT_LANES], weights: [0; SPLAT_LANES] };

    /// Places them, so bright, at rows above `last`, or outside.
    #[inline(always)]
    pub(super) fn project<S: Simd>(
        &mut self,
        [rows, brightness]: [Lanes<S>; 2],
        last: f32,
        odd_pairs: u32,
        row_range: &mut RowRange<S>,
    ) {
        let (zero, end, outside) = (rows.broadcast(0.0), rows.broadcast(last), ramp(rows.simd, last + 1.0, 2.0));
        let whole = rows.floor();
        let (least, greatest) = (rows.broadcast(f32::INFINITY), rows.broadcast(-1.0));
        row_range.least = row_range.least.simd_min(inside(rows, end, [whole, least]));
        row_range.greatest = row_range.greatest.simd_max(inside(rows, end, [whole, greatest]));
        let row = nearest_whole(inside(rows, end, [whole, outside]));
        (((row + 1) >> 1) + (row & 1) * odd_pairs).store_slice(&mut self.pairs);
        let weights = inside(rows, end, [brightness, zero]);
        let lower = weights * (rows - whole);
        let (first, second) = (weights - lower).interleave(lower);
        let [first, second]: [u64x8<S>; 2] = [first.bitcast(), second.bitcast()];
        first.store_slice(&mut self.weights[..SPLAT_LANES / 2]);
        second.store_slice(&mut self.weights[SPLAT_LANES / 2..]);
    }
}

/// The first where rows lie from 0 to `end`, the second elsewhere.
#[inline(always)]
fn inside<S: Simd>(rows: Lanes<S>, end: Lanes<S>, [within, without]: [Lanes<S>; 2]) -> Lanes<S> {
    rows.select_lt(rows.broadcast(0.0), without, rows.select_lt(end, within, without))
}
