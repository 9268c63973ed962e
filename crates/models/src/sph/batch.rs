//! The candidates of a cell in batches, and which batches hold neighbours of whom.

use std::ops::Range;

use fearless_simd::{Level, Simd, dispatch, prelude::*};
use rayon::prelude::*;

use super::cells::{Cells, Run};
use crate::lanes::{HalfLanes, Real};

/// Candidates looked at together.
pub(super) const BATCH: usize = 8;
/// Particles a task of the thread pool holds at least.
const TASK: usize = 256;

/// Squared distance below which a particle is a neighbour.
pub(super) fn farthest_squared<const D: usize>(cells: &Cells<D>) -> f32 {
    cells.support_radius() * cells.support_radius()
}

/// Squared length of an offset.
#[inline(always)]
pub(super) fn squared<R: Real, const D: usize>(offset: &[R; D]) -> R {
    let mut sum = offset[0] * offset[0];
    for c in 1..D {
        sum = offset[c].fused(offset[c], sum);
    }
    sum
}

/// A stretch of cells and where the results of their particles go.
pub(super) struct Task<'a, T, const OUT: usize> {
    pub(super) cells: Range<usize>,
    results: [&'a mut [T]; OUT],
}

impl<'a, T, const OUT: usize> Task<'a, T, OUT> {
    /// Parts the cells into stretches of about as many particles.
    pub(super) fn all<const D: usize>(cells: &Cells<D>, results: [&'a mut [T]; OUT]) -> Vec<Self> {
        let mut rest = Self { cells: 0..cells.count(), results };
        let mut tasks = Vec::with_capacity(cells.len() / TASK + 1);
        let mut first = 0;
        for next in 1..=cells.count() {
            let count = cells.particles(first..next).len();
            if count >= TASK || next == cells.count() {
                tasks.push(Self { cells: first..next, results: rest.take(count) });
                first = next;
            }
        }
        tasks
    }

    /// Takes the room for the next `count` results.
    pub(super) fn take(&mut self, count: usize) -> [&'a mut [T]; OUT] {
        self.results.each_mut().map(|values| {
            let (head, tail) = std::mem::take(values).split_at_mut(count);
            *values = tail;
            head
        })
    }
}

/// Slots at which the batches of candidates begin, run after run.
#[inline(always)]
pub(super) fn batch_starts(runs: &[Run], starts: &mut Vec<usize>) {
    starts.clear();
    runs.iter().for_each(|run| starts.extend((0..run.particles.len()).step_by(BATCH).map(|first| run.slot + first)));
}

/// Arrays cut to one length, so that one check of an index serves all.
#[inline(always)]
pub(super) fn cut<'a, const N: usize>(arrays: [&'a [f32]; N], length: usize) -> [&'a [f32]; N] {
    let mut cut = arrays;
    for k in 0..N {
        cut[k] = &arrays[k][..length];
    }
    cut
}

/// The batch of each array that begins at a slot.
#[inline(always)]
pub(super) fn load<S: Simd, const N: usize>(simd: S, arrays: &[&[f32]; N], slot: usize) -> [HalfLanes<S>; N] {
    let mut batches = [HalfLanes::splat(simd, 0.0); N];
    for k in 0..N {
        batches[k] = HalfLanes::from_slice(simd, &arrays[k][slot..slot + BATCH]);
    }
    batches
}

/// One value of each array.
#[inline(always)]
pub(super) fn pick<const N: usize>(arrays: &[&[f32]; N], index: usize) -> [f32; N] {
    let mut values = [0.0; N];
    for k in 0..N {
        values[k] = arrays[k][index];
    }
    values
}

/// Each of some numbers in all places of a batch.
#[inline(always)]
pub(super) fn spread<S: Simd, const N: usize>(simd: S, values: [f32; N]) -> [HalfLanes<S>; N] {
    let mut batches = [HalfLanes::splat(simd, 0.0); N];
    for k in 0..N {
        batches[k] = HalfLanes::splat(simd, values[k]);
    }
    batches
}

/// `one - other`, component by component.
#[inline(always)]
pub(super) fn difference<R: Real, const D: usize>(one: &[R; D], other: &[R; D]) -> [R; D] {
    let mut result = *one;
    for c in 0..D {
        result[c] = one[c] - other[c];
    }
    result
}

/// Copies one run of each array to `at`. What whole batches copy too much, the next run or the filler overwrites.
#[inline(always)]
fn copy_run<const N: usize>(to: &mut [&mut [f32]; N], at: usize, from: &[&[f32]; N], run: &Range<usize>) {
    let whole = run.len().next_multiple_of(BATCH);
    if N == 0 || run.start + whole > from[0].len() {
        (0..N).for_each(|k| to[k][at..at + run.len()].copy_from_slice(&from[k][run.clone()]));
        return;
    }
    for batch in (0..whole).step_by(BATCH) {
        for k in 0..N {
            to[k][at + batch..][..BATCH].copy_from_slice(&from[k][run.start + batch..][..BATCH]);
        }
    }
}

/// How many batches one bit of a particle's hits stands for: one, unless there are more than 64.
pub(super) fn batches_per_bit(batches: usize) -> usize {
    batches.div_ceil(u64::BITS as usize).max(1)
}

impl<const D: usize> Cells<D> {
    /// Finds for each particle which batches of its candidates hold neighbours, one bit each, so that sums skip the others: about half.
    pub(super) fn find_hits(&self, hits: &mut Vec<u64>) {
        hits.resize(self.len(), 0);
        let level = Level::new();
        let positions = self.positions();
        Task::all(self, [hits.as_mut_slice()]).into_par_iter().for_each_init(Vec::new, |starts, mut task| {
            self.visit(task.cells.clone(), |own, runs| {
                let [results] = task.take(own.particles.len());
                batch_starts(runs, starts);
                dispatch!(level, simd => hits_of_cell(simd, farthest_squared(self), positions, starts, own.slot, results));
            });
        });
    }
}

/// Hits of all particles of a cell, which begin at the slot `first`.
#[inline(always)]
fn hits_of_cell<S: Simd, const D: usize>(
    simd: S,
    farthest: f32,
    positions: [&[f32]; D],
    starts: &[usize],
    first: usize,
    results: &mut [u64],
) {
    let positions = cut(positions, positions[0].len());
    let farthest = HalfLanes::splat(simd, farthest);
    let per_bit = batches_per_bit(starts.len());
    for (slot, result) in (first..).zip(results) {
        let position = spread(simd, pick(&positions, slot));
        let (mut bits, mut bit, mut left) = (0, 1_u64, per_bit);
        for start in starts {
            let offset = difference(&position, &load(simd, &positions, *start));
            let near = squared(&offset).simd_lt(farthest).any_true();
            bits |= bit & u64::from(near).wrapping_neg();
            left -= 1;
            if left == 0 {
                (bit, left) = (bit << 1, per_bit);
            }
        }
        *result = bits;
    }
}
