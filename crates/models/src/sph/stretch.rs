//! Stretches of cells, the tasks of the thread pool.

use std::ops::Range;

use rayon::prelude::*;

use super::{batch::BATCH, cells::Cells};

/// Particles a stretch holds at least, if there are so many.
const PARTICLES: usize = 256;

/// Some cells that follow each other.
#[derive(Clone, Debug, Default)]
pub(super) struct Stretch {
    /// One a cell.
    pub(super) groups: Vec<Group>,
    /// Slots at which batches of candidates begin, group after group.
    pub(super) starts: Vec<u32>,
    /// For each particle which batches of its candidates may hold neighbours, see [`Group::bit_shift`]: all, until a sum notes them.
    pub(super) hits: Vec<u64>,
    /// Indices of the particles that coincide with others; `None` until a sum notes them.
    pub(super) crowded: Option<Vec<u64>>,
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
        let Self { groups, starts, hits, crowded } = self;
        *crowded = None;
        groups.clear();
        starts.clear();
        hits.clear();
        cells.visit(range, |own, runs| {
            let first = starts.len();
            for run in runs {
                starts.extend((0..run.particles.len()).step_by(BATCH).map(|along| (run.slot + along) as u32));
            }
            let batches = starts.len() - first;
            let bit_shift = batches.div_ceil(u64::BITS as usize).max(1).next_power_of_two().trailing_zeros();
            let all = u64::MAX >> (u64::BITS as usize - batches.div_ceil(1 << bit_shift));
            hits.resize(hits.len() + own.particles.len(), all);
            groups.push(Group { particles: own.particles, slot: own.slot, starts: first..starts.len(), bit_shift });
        });
    }
}

impl<const D: usize> Cells<D> {
    /// Parts the cells into stretches. A stretch's results depend on its cells and their neighbours
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
