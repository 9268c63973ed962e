//! The candidates of a cell side by side, and which of them are near whom.

use std::ops::Range;

use fearless_simd::{Level, Simd, dispatch, prelude::*};
use rayon::prelude::*;

use super::cells::{BEYOND, Cells};
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
    offset[1..].iter().fold(offset[0] * offset[0], |sum, component| component.fused(*component, sum))
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

/// Values of the candidates of a cell, filled up to whole batches.
pub(super) struct Gathered<const N: usize> {
    values: [Vec<f32>; N],
    batches: usize,
}

impl<const N: usize> Gathered<N> {
    pub(super) fn new() -> Self {
        Self { values: std::array::from_fn(|_| Vec::new()), batches: 0 }
    }

    /// Copies the runs of each array one after the other.
    #[inline(always)]
    pub(super) fn fill(&mut self, from: &[&[f32]; N], runs: &[Range<usize>], filler: f32) {
        let count: usize = runs.iter().map(ExactSizeIterator::len).sum();
        self.batches = count.div_ceil(BATCH);
        let mut to = self.values.each_mut().map(|values| {
            values.resize(values.len().max((self.batches + 1) * BATCH), filler);
            values.as_mut_slice()
        });
        let mut at = 0;
        for run in runs {
            copy_run(&mut to, at, from, run);
            at += run.len();
        }
        to.iter_mut().for_each(|values| values[count..self.batches * BATCH].fill(filler));
    }

    pub(super) fn batches(&self) -> usize {
        self.batches
    }

    /// The values of one batch.
    #[inline(always)]
    pub(super) fn batch<S: Simd>(&self, simd: S, number: usize) -> [HalfLanes<S>; N] {
        self.values.each_ref().map(|values| HalfLanes::from_slice(simd, &values[number * BATCH..][..BATCH]))
    }
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
        Task::all(self, [hits.as_mut_slice()]).into_par_iter().for_each_init(
            Gathered::<D>::new,
            |gathered, mut task| {
                self.visit(task.cells.clone(), |particles, runs| {
                    let [results] = task.take(particles.len());
                    dispatch!(level, simd => {
                        gathered.fill(&positions, runs, -BEYOND);
                        hits_of_cell(simd, self, gathered, particles, results);
                    });
                });
            },
        );
    }
}

#[inline(always)]
fn hits_of_cell<S: Simd, const D: usize>(
    simd: S,
    cells: &Cells<D>,
    gathered: &Gathered<D>,
    particles: Range<usize>,
    results: &mut [u64],
) {
    let farthest = HalfLanes::splat(simd, farthest_squared(cells));
    let per_bit = batches_per_bit(gathered.batches());
    for (result, i) in results.iter_mut().zip(particles) {
        let position = cells.positions().map(|component| farthest.like(component[i]));
        let mut bits = 0;
        for batch in 0..gathered.batches() {
            let theirs = gathered.batch(simd, batch);
            let offset = std::array::from_fn(|c| position[c] - theirs[c]);
            let near = squared::<_, D>(&offset).simd_lt(farthest).any_true();
            bits |= u64::from(near) << (batch / per_bit);
        }
        *result = bits;
    }
}
