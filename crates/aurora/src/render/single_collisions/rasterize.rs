//! Rasterizes one electron track to rows of a meridian and adds it to columns.
//!
//! A track has about a hundred collisions in hundreds of rows, so the touched rows are recorded: only those are added
//! and cleared.

use bansho_base::math::simd::{FourLanes, HalfLanes, LANES, Lanes, Real, ramp, round_to_u32};
use fearless_simd::{Simd, prelude::*, u8x32, u16x16, u64x4, u64x8};

use crate::physics::emission::PerEmitter;

/// Rows that are added to a column at once, two pairs.
pub(crate) const QUAD_ROWS: usize = 4;
/// Points per unrolled, branch-free block.
const UNROLLED: usize = 4;
/// Floats per pair of rows, and per quad.
const PAIR_LIGHT: usize = 2 * 4;
const QUAD_LIGHT: usize = QUAD_ROWS * 4;
/// Byte shuffle that broadcasts the first weight to the four emitters of the upper row and the second to the lower row.
const SPREAD: [u8; 32] =
    [0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3, 4, 5, 6, 7, 4, 5, 6, 7, 4, 5, 6, 7, 4, 5, 6, 7];
/// Lane indices.
const FIRST_QUADS: [u16; SPLAT_LANES] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15];

/// Light of [`QUAD_ROWS`] rows, one cache line.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(crate) struct RowQuad(pub(crate) [f32; QUAD_LIGHT]);

impl RowQuad {
    pub(crate) const DARK: Self = Self([0.0; QUAD_LIGHT]);
}

/// Photons of one track by chart row, with extra rows below for points outside.
///
/// A point adds to a pair of rows with one vector. Pairs with an even and an odd upper row have separate storage: two
/// pairs are then identical or disjoint in memory, which avoids store-to-load forwarding stalls from partial overlap.
pub(crate) struct TrackRasterizer {
    /// Even pairs from row 0 on, then odd pairs from row -1 on.
    light: Vec<f32>,
    /// Offset to the first cache-line boundary.
    start: usize,
    /// 1 if a pair was touched.
    touched: Vec<u8>,
    /// Number of quads.
    height: usize,
    /// Quads with light, and their number.
    active: Vec<u16>,
    active_count: usize,
    /// Their light, contiguous.
    merged: Vec<RowQuad>,
}

impl TrackRasterizer {
    pub(super) fn new(rows: usize) -> Self {
        let height = rows.div_ceil(QUAD_ROWS) + 1 + SPLAT_LANES;
        let quads = 2 * height + 1;
        // One quad more than needed, so that the first can begin at a cache line: a vector of floats is aligned to four bytes only, and loads that
        // cross cache lines are two accesses.
        let light = vec![0.0; QUAD_LIGHT * (quads + 1)];
        Self {
            start: light.as_ptr().align_offset(align_of::<RowQuad>()).min(QUAD_LIGHT),
            light,
            touched: vec![0; 2 * (quads + SPLAT_LANES)],
            height,
            active: vec![0; height + SPLAT_LANES],
            active_count: 0,
            merged: vec![RowQuad::DARK; height],
        }
    }

    /// Index of the first odd pair.
    #[inline(always)]
    pub(super) fn odd_pairs(&self) -> u32 {
        2 * self.height as u32
    }

    /// Quads with light, from the top.
    #[inline(always)]
    pub(crate) fn active_quads(&self) -> &[u16] {
        &self.active[..self.active_count]
    }

    /// Discards the previous track.
    #[inline(always)]
    pub(super) fn reset(&mut self) {
        self.active_count = 0;
    }

    /// Adds the light of the first `count` points, by their rows of the photon table.
    #[inline(always)]
    pub(super) fn add<S: Simd>(
        &mut self,
        simd: S,
        points: &SplatBatch,
        photon_rows: &[u16; SPLAT_LANES],
        count: usize,
        photons: &[PerEmitter<f32>],
    ) {
        let light = self.light[self.start..].as_chunks_mut().0;
        let pairs = light.len().min(self.touched.len());
        // Local references: else the compiler must assume that the stores alias the fields.
        let mut sums = RowPairSums { light: &mut light[..pairs], touched: &mut self.touched[..pairs], photons };
        // Only the last batch of a track is not full.
        if count < SPLAT_LANES {
            for lane in 0..count {
                sums.add(simd, points, lane, photon_rows[lane]);
            }
            return;
        }
        for first in (0..SPLAT_LANES).step_by(UNROLLED) {
            for lane in first..first + UNROLLED {
                sums.add(simd, points, lane, photon_rows[lane]);
            }
        }
    }

    /// Finds the touched quads within the row range, merges them, and clears the storage for the next track.
    #[inline(always)]
    pub(super) fn finish<S: Simd>(&mut self, simd: S, rows: &RowRange<S>) {
        self.find_active_quads(simd, rows);
        self.merge_pairs(simd);
    }

    /// Collects the quads with any of their five pairs touched.
    #[inline(always)]
    fn find_active_quads<S: Simd>(&mut self, simd: S, rows: &RowRange<S>) {
        let [first, end] = rows.range();
        let (first, end) = (first / QUAD_ROWS, end.div_ceil(QUAD_ROWS));
        let (even, odd) = self.touched.split_at_mut(2 * self.height);
        let (quads, none) = (u16x16::from_slice(simd, &FIRST_QUADS), u8x32::splat(simd, 0));
        self.active_count = 0;
        for from in (first..end).step_by(SPLAT_LANES) {
            let even = &mut even[2 * from..][..2 * SPLAT_LANES];
            let odd = &mut odd[2 * from..][..2 * SPLAT_LANES + 1];
            // The second and third odd pair of a quad are at the next byte.
            let [touched_even, touched_odd, touched_next_odd] =
                [&*even, &odd[..2 * SPLAT_LANES], &odd[1..]].map(|bytes| u8x32::from_slice(simd, bytes));
            // A quad has two even and two odd pairs, each with a byte: read as 16 bits, a lane is a quad.
            let touched: u16x16<S> = (touched_even | touched_odd | touched_next_odd).bitcast();
            none.store_slice(even);
            none.store_slice(&mut odd[..2 * SPLAT_LANES]);
            let quads = quads + from as u16;
            let lit = touched.simd_gt(0) & quads.simd_lt(end as u16);
            // All lanes are stored and the list grows by the number of lit ones, without a branch. It has room for a batch more.
            quads.compress(lit).store_slice(&mut self.active[self.active_count..][..SPLAT_LANES]);
            self.active_count += lit.to_bitmask().count_ones() as usize;
        }
    }

    /// Merges even and odd pairs of touched quads and clears them.
    #[inline(always)]
    fn merge_pairs<S: Simd>(&mut self, simd: S) {
        let (even, odd) = self.light[self.start..].split_at_mut(QUAD_LIGHT * self.height);
        let (even, none) = (even.as_chunks_mut::<QUAD_LIGHT>().0, Lanes::splat(simd, 0.0));
        for (quad, merged) in self.active[..self.active_count].iter().zip(&mut self.merged) {
            let quad = *quad as usize;
            // Odd pairs start one row higher.
            let odd = odd.get_mut(QUAD_LIGHT * quad..QUAD_LIGHT * (quad + 1) + PAIR_LIGHT / 2);
            let (Some(even), Some(odd)) = (even.get_mut(quad), odd) else { continue };
            let sum = Lanes::from_slice(simd, even) + Lanes::from_slice(simd, &odd[PAIR_LIGHT / 2..]);
            sum.store_slice(&mut merged.0);
            none.store_slice(even);
            // The remaining row belongs to the next quad too, which is then also active.
            none.store_slice(&mut odd[..QUAD_LIGHT]);
        }
    }

    /// Adds the track with weights to a column.
    #[inline(always)]
    pub(crate) fn add_to<S: Simd>(&self, column: &mut [RowQuad], weights: FourLanes<S>) {
        let two = weights.combine(weights);
        let four = two.combine(two);
        for (quad, merged) in self.active_quads().iter().zip(&self.merged) {
            let Some(light) = column.get_mut(*quad as usize) else { continue };
            let [track, sum] = [&merged.0, &light.0].map(|light| Lanes::from_slice(four.simd, light));
            track.fma(four, sum).store_slice(&mut light.0);
        }
    }
}

/// Accumulation buffers and photon table.
struct RowPairSums<'a> {
    light: &'a mut [[f32; PAIR_LIGHT]],
    touched: &'a mut [u8],
    photons: &'a [PerEmitter<f32>],
}

impl RowPairSums<'_> {
    #[inline(always)]
    fn add<S: Simd>(&mut self, simd: S, points: &SplatBatch, lane: usize, photon_row: u16) {
        let pair = points.pairs[lane] as usize;
        let photons = self.photons.get(photon_row as usize);
        let (Some(photons), Some(both), Some(touched)) =
            (photons, self.light.get_mut(pair), self.touched.get_mut(pair))
        else {
            return;
        };
        // Stored always: a test whether it is set already would be mispredicted.
        *touched = 1;
        // Both weights are one word, so one broadcast loads them; the shuffle stays within blocks of 128 bits, where it takes one instruction on all
        // machines.
        let weights: HalfLanes<S> = u64x4::splat(simd, points.weights[lane]).bitcast();
        let weights = weights.swizzle_dyn_within_blocks(u8x32::from_slice(simd, &SPREAD));
        let photons = FourLanes::simd_from(simd, *photons);
        photons.combine(photons).fma(weights, HalfLanes::from_slice(simd, both)).store_slice(both);
    }
}

/// Collisions per batch.
pub(super) const SPLAT_LANES: usize = LANES;

/// Row pairs of collisions and the weights of both rows. Collisions outside have weight 0, each with another pair
/// below the chart, to avoid dependent sums.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(super) struct SplatBatch {
    /// Index of a pair: half its upper row if even; else half its lower row, offset by the first odd pair.
    pub(super) pairs: [u32; SPLAT_LANES],
    /// Two floats each, loaded as one word.
    pub(super) weights: [u64; SPLAT_LANES],
}

/// Minimum and maximum row per lane.
pub(super) struct RowRange<S: Simd> {
    min: Lanes<S>,
    max: Lanes<S>,
}

impl<S: Simd> RowRange<S> {
    #[inline(always)]
    pub(super) fn new(simd: S) -> Self {
        Self { min: Lanes::splat(simd, f32::INFINITY), max: Lanes::splat(simd, -1.0) }
    }

    /// First row that may have light, and one past the last.
    #[inline(always)]
    pub(super) fn range(&self) -> [usize; 2] {
        let (min, max) = (self.min.reduce_min(), self.max.reduce_max());
        if max < min { [0; 2] } else { [min as usize, max as usize + 2] }
    }
}

impl SplatBatch {
    pub(super) const NONE: Self = Self { pairs: [0; SPLAT_LANES], weights: [0; SPLAT_LANES] };

    /// Computes pairs and weights of points at rows, with brightness factors; rows outside 0 to `last` are masked.
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
        let (no_min, no_max) = (rows.broadcast(f32::INFINITY), rows.broadcast(-1.0));
        row_range.min = row_range.min.simd_min(inside(rows, end, [whole, no_min]));
        row_range.max = row_range.max.simd_max(inside(rows, end, [whole, no_max]));
        // Points outside go to rows below the chart, two apart, so that no two lanes of a batch add to the same pair.
        let row = round_to_u32(inside(rows, end, [whole, outside]));
        (((row + 1) >> 1) + (row & 1) * odd_pairs).store_slice(&mut self.pairs);
        let weights = inside(rows, end, [brightness, zero]);
        let lower = weights * (rows - whole);
        let (first, second) = (weights - lower).interleave(lower);
        let [first, second]: [u64x8<S>; 2] = [first.bitcast(), second.bitcast()];
        first.store_slice(&mut self.weights[..SPLAT_LANES / 2]);
        second.store_slice(&mut self.weights[SPLAT_LANES / 2..]);
    }
}

/// Selects `within` where rows are in [0, end), else `without`.
#[inline(always)]
fn inside<S: Simd>(rows: Lanes<S>, end: Lanes<S>, [within, without]: [Lanes<S>; 2]) -> Lanes<S> {
    rows.select_lt(rows.broadcast(0.0), without, rows.select_lt(end, within, without))
}

#[cfg(test)]
mod tests {
    use fearless_simd::dispatch;

    use super::*;

    const ROWS: usize = 150;

    struct Batch<'a> {
        rows: &'a [f32; SPLAT_LANES],
        brightness: &'a [f32; SPLAT_LANES],
        photon_rows: &'a [u16; SPLAT_LANES],
        count: usize,
        photons: &'a [PerEmitter<f32>],
    }

    /// A column with the light of a batch of points, times two.
    #[inline(always)]
    fn column_of<S: Simd>(simd: S, rasterizer: &mut TrackRasterizer, batch: &Batch) -> Vec<RowQuad> {
        let (mut points, mut row_range) = (SplatBatch::NONE, RowRange::new(simd));
        let (rows, brightness) = (Lanes::from_slice(simd, batch.rows), Lanes::from_slice(simd, batch.brightness));
        points.project([rows, brightness], (ROWS - 1) as f32, rasterizer.odd_pairs(), &mut row_range);
        rasterizer.reset();
        rasterizer.add(simd, &points, batch.photon_rows, batch.count, batch.photons);
        rasterizer.finish(simd, &row_range);
        let mut column = vec![RowQuad::DARK; ROWS.div_ceil(QUAD_ROWS)];
        rasterizer.add_to(&mut column, FourLanes::splat(simd, 2.0));
        column
    }

    /// Points inside and outside of the chart: the sums equal scalar ones, and no light is left for the next track.
    #[test]
    fn points_light_the_two_rows_that_they_lie_between() {
        let photons = [[1.0, 2.0, 3.0, 4.0], [0.5, 0.0, 0.25, 8.0]];
        let mut rasterizer = TrackRasterizer::new(ROWS);
        for track in 0..20_u16 {
            let spread = 1.0 + 9.0 * f32::from(track % 5);
            let row = |lane: usize| 3.0 + 2.37 * f32::from(track) + spread * (lane * 7 % SPLAT_LANES) as f32 - 8.0;
            let rows: [f32; SPLAT_LANES] = std::array::from_fn(row);
            let brightness: [f32; SPLAT_LANES] = std::array::from_fn(|lane| 0.5 + lane as f32);
            let photon_rows: [u16; SPLAT_LANES] = std::array::from_fn(|lane| (lane % 2) as u16);
            let count = SPLAT_LANES - (track % 4) as usize;
            let batch =
                Batch { rows: &rows, brightness: &brightness, photon_rows: &photon_rows, count, photons: &photons };
            let column = dispatch!(bansho_base::math::simd::level(), simd => column_of(simd, &mut rasterizer, &batch));
            let plainest = bansho_base::dispatch_baseline!(simd => column_of(simd, &mut rasterizer, &batch));
            assert!(column.iter().zip(&plainest).all(|(wide, plain)| wide.0 == plain.0), "the same on all machines");
            let mut expected = [[0.0_f32; 4]; ROWS + 1];
            for lane in 0..count {
                let (row, lower) = (rows[lane].floor(), rows[lane] - rows[lane].floor());
                if (0.0..(ROWS - 1) as f32).contains(&rows[lane]) {
                    for (emitter, photons) in photons[lane % 2].iter().enumerate() {
                        let light = 2.0 * photons * brightness[lane];
                        expected[row as usize][emitter] += light * (1.0 - lower);
                        expected[row as usize + 1][emitter] += light * lower;
                    }
                }
            }
            let found = column.iter().flat_map(|quad| quad.0);
            for (number, (found, expected)) in found.zip(expected.as_flattened()).enumerate() {
                let what = || format!("track {track}, row {}, emitter {}", number / 4, number % 4);
                assert!((found - expected).abs() <= 1e-4 * expected.abs(), "{}: {found} for {expected}", what());
            }
        }
    }
}
