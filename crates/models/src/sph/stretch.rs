//! Stretches of cells, the tasks of the thread pool, and who is near whom in them.

use std::ops::Range;

use fearless_simd::{Level, Simd, dispatch, prelude::*};
use rayon::prelude::*;

use super::{
    batch::{BATCH, cut, difference, load, pick, spread, squared},
    cells::Cells,
};
use crate::lanes::HalfLanes;

/// Particles a stretch holds at least, if there are so many.
const PARTICLES: usize = 256;

/// Some cells that follow each other.
#[derive(Clone, Debug, Default)]
pub(super) struct Stretch {
    /// One a cell.
    pub(super) groups: Vec<Group>,
    /// Slots at which batches of candidates begin, group after group.
    pub(super) starts: Vec<u32>,
    /// For each particle which batches of its candidates hold neighbours, see [`Group::bit_shift`].
    pub(super) hits: Vec<u64>,
}

/// The particles of one cell, which share their candidates.
#[derive(Clone, Debug)]
pub(super) struct Group {
    /// Their number among all particles in sorted order.
    pub(super) particles: Range<usize>,
    /// Slot of the first.
    pub(super) slot: usize,
    /// Where the stretch lists their candidates.
    pub(super) starts: Range<usize>,
    /// Each bit of a hit stands for 2 to this power batches: 1, unless there are more than 64.
    pub(super) bit_shift: u32,
}

impl Stretch {
    /// Number of particles.
    pub(super) fn len(&self) -> usize {
        self.hits.len()
    }

    fn fill<const D: usize>(&mut self, cells: &Cells<D>, range: Range<usize>) {
        let Self { groups, starts, hits } = self;
        groups.clear();
        starts.clear();
        hits.clear();
        hits.resize(cells.particles(range.clone()).len(), 0);
        cells.visit(range, |own, runs| {
            let first = starts.len();
            for run in runs {
                starts.extend((0..run.particles.len()).step_by(BATCH).map(|along| (run.slot + along) as u32));
            }
            let bits = (starts.len() - first).div_ceil(u64::BITS as usize).max(1);
            let bit_shift = bits.next_power_of_two().trailing_zeros();
            groups.push(Group { particles: own.particles, slot: own.slot, starts: first..starts.len(), bit_shift });
        });
        let farthest = cells.support_radius() * cells.support_radius();
        dispatch!(Level::new(), simd => find_hits(simd, farthest, cells.positions(), groups, starts, hits));
    }
}

impl<const D: usize> Cells<D> {
    /// Parts the cells into stretches and finds who is near whom. A stretch's results depend on its cells and their neighbours
    /// alone, so it does not matter where one ends.
    pub(super) fn find_stretches(&self, stretches: &mut Vec<Stretch>) {
        let mut ranges = Vec::with_capacity(self.len() / PARTICLES + 1);
        let mut first = 0;
        for next in 1..=self.count() {
            if self.particles(first..next).len() >= PARTICLES || next == self.count() {
                ranges.push(first..next);
                first = next;
            }
        }
        stretches.resize_with(ranges.len(), Stretch::default);
        stretches.par_iter_mut().zip(ranges).for_each(|(stretch, range)| stretch.fill(self, range));
    }
}

/// One bit for each batch in which a particle has a neighbour, so that sums skip the others: about half.
#[inline(always)]
fn find_hits<S: Simd, const D: usize>(
    simd: S,
    farthest: f32,
    positions: [&[f32]; D],
    groups: &[Group],
    starts: &[u32],
    mut hits: &mut [u64],
) {
    let positions = cut(positions, positions[0].len());
    let farthest = HalfLanes::splat(simd, farthest);
    for group in groups {
        let (own, rest) = std::mem::take(&mut hits).split_at_mut(group.particles.len());
        hits = rest;
        let starts = &starts[group.starts.clone()];
        for (slot, hits) in (group.slot..).zip(own) {
            let position = spread(simd, pick(&positions, slot));
            let mut bits = 0;
            for (number, start) in starts.iter().enumerate() {
                let offset = difference(&position, &load(simd, &positions, *start as usize));
                let near = squared(&offset).simd_lt(farthest).any_true();
                bits |= u64::from(near) << (number >> group.bit_shift);
            }
            *hits = bits;
        }
    }
}
