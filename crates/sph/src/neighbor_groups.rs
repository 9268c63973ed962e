//! Groups of up to eight consecutive particles, with lists of their candidate neighbors, and operations on batches of eight.
//!
//! The batch operations loop over arrays instead of calling `map`: its closures do not vectorize.

use super::cell_rows::{BATCH, CellRows, RowChunk};
use bansho_base::{
    host::parallel::prelude::*,
    math::simd::{HalfLanes, Real},
};
use fearless_simd::{Simd, dispatch, prelude::*};
use std::ops::Range;

/// Groups per task of the thread pool.
const GROUPS_PER_TASK: usize = 32;

/// Consecutive groups: one task of the thread pool. The candidates of a group do not depend on where a batch ends.
#[derive(Clone, Debug, Default)]
pub(super) struct GroupBatch {
    pub(super) groups: Vec<Group>,
    /// Candidate neighbors of all groups, one after the other, and unused entries after them.
    pub(super) candidates: Vec<u32>,
}

/// Up to eight consecutive particles of a row of cells.
#[derive(Clone, Debug)]
pub(super) struct Group {
    /// Their indices in sorted order.
    pub(super) particles: Range<usize>,
    /// Range in [`GroupBatch::candidates`] of the particles nearer than the support radius to the bounding box of the group, itself
    /// included.
    pub(super) candidates: Range<usize>,
}

impl GroupBatch {
    /// The particles of all groups.
    pub(super) fn particles(&self) -> Range<usize> {
        match self.groups.as_slice() {
            [] => 0..0,
            [group] => group.particles.clone(),
            [first, .., last] => first.particles.start..last.particles.end,
        }
    }
}

/// Axis-aligned bounding box of some particles.
struct BoundingBox<const D: usize> {
    lower: [f32; D],
    upper: [f32; D],
}

impl<const D: usize> BoundingBox<D> {
    /// Of up to eight particles, at least one; their positions are not NaN.
    #[inline(always)]
    fn of(positions: &[&[f32]; D], particles: Range<usize>) -> Self {
        let mut bounds = Self { lower: [0.0; D], upper: [0.0; D] };
        for c in 0..D {
            let batch = &positions[c][particles.start..particles.start + BATCH];
            let mut lower = [batch[0]; BATCH];
            if particles.len() == BATCH {
                lower.copy_from_slice(batch);
            } else {
                lower[..particles.len()].copy_from_slice(&batch[..particles.len()]);
            }
            let mut upper = lower;
            // In steps of four, two and one lanes: a chain of eight took a tenth of the whole search.
            for lanes in [4, 2, 1] {
                for lane in 0..lanes {
                    lower[lane] = lower[lane].simd_min(lower[lane + lanes]);
                    upper[lane] = upper[lane].simd_max(upper[lane + lanes]);
                }
            }
            (bounds.lower[c], bounds.upper[c]) = (lower[0], upper[0]);
        }
        bounds
    }

    /// Squared distance of points from the box, 0 inside.
    #[inline(always)]
    fn distance_squared<R: Real>(&self, point: &[R; D]) -> R {
        let mut outside = *point;
        for c in 0..D {
            let nearest =
                point[c].simd_max(point[c].broadcast(self.lower[c])).simd_min(point[c].broadcast(self.upper[c]));
            outside[c] = point[c] - nearest;
        }
        length_squared(&outside)
    }
}

/// Writes the particles of a run within the support radius of a box to the front of `candidates` and returns their number.
/// Entries after them are overwritten.
#[inline(always)]
fn list_near<S: Simd, const D: usize>(
    simd: S,
    positions: &[&[f32]; D],
    bounds: &BoundingBox<D>,
    support_squared: f32,
    run: Range<usize>,
    candidates: &mut [u32],
) -> usize {
    let support = HalfLanes::splat(simd, support_squared);
    let mut count = 0;
    let positions = truncate_all(*positions, positions[0].len());
    for start in run.clone().step_by(BATCH) {
        let near = bounds.distance_squared(&load(simd, &positions, start)).simd_lt(support).to_bitmask() as usize;
        // The last batch extends beyond the run.
        let near = near & (0xff >> (BATCH - (run.end - start).min(BATCH)));
        for (to, bit_index) in candidates[count..count + BATCH].iter_mut().zip(&SET_BIT_INDICES[near]) {
            *to = start as u32 + u32::from(*bit_index);
        }
        count += near.count_ones() as usize;
    }
    count
}

/// For each 8-bit mask, the indices of the set bits.
const SET_BIT_INDICES: [[u8; BATCH]; 256] = {
    let mut indices = [[0; BATCH]; 256];
    let mut bits = 0;
    while bits < 256 {
        let (mut bit, mut count) = (0, 0);
        while bit < BATCH {
            if bits >> bit & 1 == 1 {
                indices[bits][count] = bit as u8;
                count += 1;
            }
            bit += 1;
        }
        bits += 1;
    }
    indices
};

impl GroupBatch {
    /// Splits row chunks into batches and finds the candidates of every group. `positions` are sorted and padded with one batch.
    pub(super) fn find_all<const D: usize>(
        batches: &mut Vec<Self>,
        positions: [&[f32]; D],
        support_radius: f32,
        rows: CellRows<D>,
        chunks: &[RowChunk],
    ) {
        let level = bansho_base::math::simd::level();
        batches.resize_with(chunks.len().div_ceil(GROUPS_PER_TASK), Self::default);
        batches.par_iter_mut().with_max_len(1).zip(chunks.par_chunks(GROUPS_PER_TASK)).for_each(|(batch, chunks)| {
            dispatch!(level, simd => batch.find(simd, &positions, support_radius * support_radius, rows, chunks));
        });
    }

    /// Finds the candidates of some row chunks.
    #[inline(always)]
    fn find<S: Simd, const D: usize>(
        &mut self,
        simd: S,
        positions: &[&[f32]; D],
        support_squared: f32,
        rows: CellRows<D>,
        chunks: &[RowChunk],
    ) {
        let Self { groups, candidates } = self;
        groups.clear();
        let Some(first) = chunks.first() else { return };
        let mut neighbor_runs = rows.neighbor_runs(first);
        let mut count_so_far = 0;
        for chunk in chunks {
            let particles = chunk.particles.start as usize..chunk.particles.end as usize;
            let bounds = BoundingBox::of(positions, particles.clone());
            let (runs, particles_of_runs) = neighbor_runs.near(chunk);
            // Each run may write a batch beyond its end.
            let max_candidates = particles_of_runs + runs.len() * BATCH;
            // Entries of earlier steps are overwritten: filling them with 0 first would take as long as writing the list.
            if candidates.len() < count_so_far + max_candidates {
                candidates.resize(count_so_far + max_candidates, 0);
            }
            let first = count_so_far;
            for run in runs {
                let free = &mut candidates[count_so_far..];
                count_so_far += list_near(simd, positions, &bounds, support_squared, run.clone(), free);
            }
            groups.push(Group { particles, candidates: first..count_so_far });
        }
    }
}

/// Squared length of an offset.
#[inline(always)]
pub(super) fn length_squared<R: Real, const D: usize>(offset: &[R; D]) -> R {
    let mut sum = offset[0] * offset[0];
    for c in 1..D {
        sum = offset[c].fma(offset[c], sum);
    }
    sum
}

/// Truncates arrays to one length, so that one bounds check serves all.
#[inline(always)]
pub(super) fn truncate_all<const N: usize>(arrays: [&[f32]; N], length: usize) -> [&[f32]; N] {
    let mut truncated = arrays;
    for k in 0..N {
        truncated[k] = &arrays[k][..length];
    }
    truncated
}

/// Loads the batch that begins at an index from each array.
#[inline(always)]
pub(super) fn load<S: Simd, const N: usize>(simd: S, arrays: &[&[f32]; N], first: usize) -> [HalfLanes<S>; N] {
    let mut batches = [HalfLanes::splat(simd, 0.0); N];
    for k in 0..N {
        batches[k] = HalfLanes::from_slice(simd, &arrays[k][first..first + BATCH]);
    }
    batches
}

/// The value at an index of each array.
#[inline(always)]
pub(super) fn values_at<const N: usize>(arrays: &[&[f32]; N], index: usize) -> [f32; N] {
    let mut values = [0.0; N];
    for k in 0..N {
        values[k] = arrays[k][index];
    }
    values
}

/// Broadcasts each value to all lanes of a batch.
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
