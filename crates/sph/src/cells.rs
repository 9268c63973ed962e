//! Cell list: particles sorted by cell.
//!
//! A table holds where each cell begins, occupied or not, as long as there are not many more cells than particles. Where they are spread so far
//! that there are, cells are found by search in the sorted keys: memory is proportional to the number of particles in any case. A cell is one support
//! radius wide, and a quarter of that along x. Cells are ordered along x, so the near cells of one row hold one contiguous range of
//! particles: 3 ranges in 2-D, 9 in 3-D.

use bansho_base::host::parallel::{self, prelude::*};

use super::{
    cell_keys::{CellKeys, KeyLayout},
    cell_rows::{self, BATCH, CellRows, RowChunk},
    error::SphError,
    neighbor_groups::GroupBatch,
    sorting::{INDEX_BITS, MIN_PARTICLES_PER_TASK, SampleSort, SortedParticles},
};

/// Particles farther away than this, or at NaN, are moved to this coordinate. The square of such a distance is still finite.
pub(super) const OUT_OF_RANGE: f32 = 1e12;

/// Particles sorted into cells of one support radius. The result does not depend on the order in which particles are given.
#[derive(Clone, Debug)]
pub struct Cells<const D: usize> {
    support_radius: f32,
    layout: KeyLayout<D>,
    sorted: SortedParticles,
    /// Positions in sorted order, padded with one batch that is out of range.
    positions: [Vec<f32>; D],
    /// Table of [`CellRows`].
    starts: Vec<u32>,
    row_chunks: Vec<RowChunk>,
    batches: Vec<GroupBatch>,
    sorting: SampleSort,
    /// Scratch arrays that are swapped with those being reordered, one per thread.
    scratch: Vec<Vec<f32>>,
}

impl<const D: usize> Cells<D> {
    /// Cells for a support radius in the unit of positions.
    ///
    /// # Errors
    /// A radius that is not finite or not above 0.
    pub fn try_new(support_radius: f32) -> Result<Self, SphError> {
        let is_valid = support_radius.is_finite() && support_radius > 0.0;
        if is_valid { Ok(Self::new(support_radius)) } else { Err(SphError::SupportRadius { value: support_radius }) }
    }

    /// As [`try_new`](Self::try_new) for a radius that is known to be finite and above 0. With any other, sums are meaningless.
    #[must_use]
    pub fn new(support_radius: f32) -> Self {
        const { assert!(D == 2 || D == 3, "particles have two or three dimensions") };
        Self {
            support_radius,
            layout: KeyLayout::new(&[[0; 2]; D]),
            sorted: SortedParticles::default(),
            positions: [const { Vec::new() }; D],
            starts: Vec::new(),
            row_chunks: Vec::new(),
            batches: Vec::new(),
            sorting: SampleSort::default(),
            scratch: Vec::new(),
        }
    }

    /// The support radius: particles at this distance or farther do not interact.
    #[must_use]
    pub fn support_radius(&self) -> f32 {
        self.support_radius
    }

    /// Sets the support radius for the next [`Cells::assign`], finite and above 0: otherwise sums are meaningless. Buffers are kept.
    pub fn set_support_radius(&mut self, support_radius: f32) {
        self.support_radius = support_radius;
    }

    /// Number of particles.
    #[must_use]
    pub fn len(&self) -> usize {
        self.sorted.order.len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.sorted.order.is_empty()
    }

    /// Sorts particles by cell, then by id, and finds the candidate neighbors of each group. [`Cells::reorder`] and
    /// [`Cells::reorder_all`] then permute other arrays into that order.
    ///
    /// Particles at NaN, or farther than 1e12 from the origin, are kept but have no neighbors; ids should be unique, since they decide the order within a cell.
    ///
    /// # Panics
    /// If there are more than 2^27 particles, or `positions` and `ids` differ in length.
    pub fn assign(&mut self, positions: [&[f32]; D], ids: &[u64]) {
        self.sort_by_cell(positions, ids);
        let order = &self.sorted.order;
        self.positions.par_iter_mut().zip(positions).for_each(|(to, from)| {
            to.resize((ids.len() + BATCH).next_multiple_of(BATCH), 0.0);
            let (to, padding) = to.split_at_mut(ids.len());
            padding.fill(-OUT_OF_RANGE);
            let parts = to.par_chunks_mut(MIN_PARTICLES_PER_TASK).zip(order.par_chunks(MIN_PARTICLES_PER_TASK));
            parts.for_each(|(to, order)| {
                for (to, index) in to.iter_mut().zip(order) {
                    *to = limit_to_range(from[*index as usize]);
                }
            });
        });
        cell_rows::chunk_rows(&self.layout, &self.sorted.keys, &mut self.row_chunks);
        cell_rows::find_starts(&self.layout, &self.sorted.keys, &mut self.starts);
        let rows = CellRows { layout: &self.layout, keys: &self.sorted.keys, starts: &self.starts };
        GroupBatch::find_all(
            &mut self.batches,
            self.positions.each_ref().map(Vec::as_slice),
            self.support_radius,
            rows,
            &self.row_chunks,
        );
    }

    /// As [`Cells::assign`] without candidate neighbors, which take most of its time and memory: for [`Cells::reorder`] and [`Cells::reorder_all`] where
    /// neighbors are found in another way. Until the next [`Cells::assign`], there are no particles in sums.
    ///
    /// # Panics
    /// If there are more than 2^27 particles, or `positions` and `ids` differ in length.
    pub fn sort(&mut self, positions: [&[f32]; D], ids: &[u64]) {
        self.sort_by_cell(positions, ids);
        self.positions.iter_mut().for_each(Vec::clear);
        self.batches.clear();
    }

    /// Determines the order.
    fn sort_by_cell(&mut self, positions: [&[f32]; D], ids: &[u64]) {
        assert!(ids.len() <= 1 << INDEX_BITS, "particles are counted in 32 bits");
        assert!(positions.iter().all(|component| component.len() == ids.len()), "one position per id");
        let keys = CellKeys::new(positions, self.support_radius);
        self.sorting.sort(&keys, ids, &mut self.sorted);
        self.layout = keys.layout;
    }

    /// Permutes values from the order of the arguments of [`Cells::assign`] into the sorted order.
    ///
    /// # Panics
    /// If there is not one value per particle.
    pub fn reorder<T: Copy + Send + Sync>(&self, values: &mut Vec<T>) {
        assert_eq!(values.len(), self.sorted.order.len(), "one value per particle");
        *values =
            self.sorted.order.par_iter().with_min_len(MIN_PARTICLES_PER_TASK).map(|i| values[*i as usize]).collect();
    }

    /// As [`Cells::reorder`] for many arrays of `f32`, with scratch memory that is reused.
    ///
    /// # Panics
    /// If there is not one value per particle.
    pub fn reorder_all<'a>(&mut self, arrays: impl IntoIterator<Item = &'a mut Vec<f32>>) {
        let mut arrays: Vec<&mut Vec<f32>> = arrays.into_iter().collect();
        let threads = parallel::current_num_threads().clamp(1, arrays.len().max(1));
        let Self { sorted: SortedParticles { order, .. }, scratch, .. } = self;
        scratch.resize_with(threads, Vec::new);
        let arrays_per_thread = arrays.len().div_ceil(threads).max(1);
        arrays.par_chunks_mut(arrays_per_thread).zip(scratch).for_each(|(arrays, scratch)| {
            for values in arrays {
                assert_eq!(values.len(), order.len(), "one value per particle");
                scratch.clear();
                scratch.extend(order.iter().map(|i| values[*i as usize]));
                std::mem::swap(*values, scratch);
            }
        });
    }

    /// Permutes the positions and ids that were given to [`Cells::assign`] into the sorted order: it has done so already, and copying takes less time than
    /// [`Cells::reorder`].
    ///
    /// # Panics
    /// If there is not one position and one id per particle, or the particles were sorted by [`Cells::sort`].
    pub fn reorder_assigned(&self, positions: [&mut Vec<f32>; D], ids: &mut [u64]) {
        positions.into_par_iter().zip(&self.positions).for_each(|(values, sorted)| {
            let sorted = &sorted[..self.len()];
            // Numbers that may stand for others.
            if contains(sorted, OUT_OF_RANGE) {
                self.reorder(values);
            } else {
                values.copy_from_slice(sorted);
            }
        });
        ids.copy_from_slice(&self.sorted.ids);
    }

    /// Particle ids in sorted order.
    pub(super) fn ids(&self) -> &[u64] {
        &self.sorted.ids
    }

    /// Positions in sorted order, one array per component, padded with one batch that is out of range.
    pub(super) fn positions(&self) -> [&[f32]; D] {
        self.positions.each_ref().map(Vec::as_slice)
    }

    /// All groups of particles, in batches of one task each.
    pub(super) fn batches(&self) -> &[GroupBatch] {
        &self.batches
    }
}

/// A coordinate, or [`OUT_OF_RANGE`] in place of NaN and of one that is farther away.
fn limit_to_range(x: f32) -> f32 {
    if x.abs() < OUT_OF_RANGE { x } else { OUT_OF_RANGE }
}

/// Whether a number occurs in an array. The loop does not end where it is found, so that it vectorizes.
fn contains(values: &[f32], number: f32) -> bool {
    values.iter().fold(false, |found, value| found | (*value == number))
}
