//! Cell list: particles sorted by cell, storing occupied cells only.
//!
//! There is no dense grid. Occupied cells are a sorted list, so memory is proportional to the number of particles, however far they
//! spread. A cell is one support radius wide, and a quarter of that along x. Cells are ordered along x, so the near cells of one
//! row hold one contiguous range of particles: 3 ranges in 2-D, 9 in 3-D.

use bansho_base::host::parallel::{self, prelude::*};
use fearless_simd::dispatch;

use super::{
    cell_rows::{CELLS_PER_RADIUS_X, CellRows, Keys, RowChunk, SEARCH_WIDTH},
    error::SphError,
    neighbor_groups::{BATCH, GroupBatch},
    sorting::{Cell, MIN_PARTICLES_PER_TASK, SampleSort},
};

/// Cell coordinates are clamped to this distance from the origin, in support radii, so that a key of three axes fits 64 bits.
const MAX_CELL_COORDINATE: i32 = 1 << 18;
/// Cells are larger than the support radius by this factor, so that rounding never separates two neighbors by more than one cell.
const CELL_SIZE_MARGIN: f32 = 1.001;
/// Maximum length of a group, in cells along x: all particles within that length become candidates of the group.
const MAX_GROUP_LENGTH: u64 = 8 * CELLS_PER_RADIUS_X as u64;
/// Particles farther away than this, or at NaN, are moved to this coordinate. The square of such a distance is still finite.
pub(super) const OUT_OF_RANGE: f32 = 1e12;

/// Particles sorted into cells of one support radius. The result does not depend on the order in which particles are given.
#[derive(Clone, Debug)]
pub struct Cells<const D: usize> {
    support_radius: f32,
    keys: Keys<D>,
    /// For each particle in sorted order, the index at which it was given.
    order: Vec<u32>,
    ids: Vec<u64>,
    /// Positions in sorted order, padded with one batch that is out of range.
    positions: [Vec<f32>; D],
    /// Occupied cells; the last [`SEARCH_WIDTH`] are sentinels with the largest key.
    occupied: Vec<Cell>,
    row_chunks: Vec<RowChunk>,
    batches: Vec<GroupBatch>,
    /// Cell coordinate of each particle, one array per axis.
    coordinates: [Vec<i32>; D],
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
        let keys = Keys::new([0; D], [0; D]);
        let (order, ids, occupied, row_chunks, batches) = Default::default();
        Self {
            support_radius,
            keys,
            order,
            ids,
            positions: [const { Vec::new() }; D],
            occupied,
            row_chunks,
            batches,
            coordinates: [const { Vec::new() }; D],
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
        self.order.len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.order.is_empty()
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
        let mut sorted = std::mem::replace(&mut self.positions, [const { Vec::new() }; D]);
        sorted.par_iter_mut().zip(positions).for_each(|(to, from)| {
            to.clear();
            to.extend(self.order.iter().map(|index| limit_to_range(from[*index as usize])));
            to.resize((ids.len() + BATCH).next_multiple_of(BATCH), -OUT_OF_RANGE);
        });
        self.positions = sorted;
        self.ids.clear();
        self.ids.par_extend(self.order.par_iter().with_min_len(MIN_PARTICLES_PER_TASK).map(|i| ids[*i as usize]));
        self.chunk_rows();
        let rows = CellRows { keys: &self.keys, occupied: &self.occupied };
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
        self.ids.clear();
        self.batches.clear();
    }

    /// Determines the order and the occupied cells.
    fn sort_by_cell(&mut self, positions: [&[f32]; D], ids: &[u64]) {
        assert!(ids.len() <= 1 << 27, "particles are counted in 32 bits");
        assert!(positions.iter().all(|component| component.len() == ids.len()), "one position per id");
        let scale = 1.0 / (self.support_radius * CELL_SIZE_MARGIN);
        let mut bounds = [[0; 2]; D];
        let axes = self.coordinates.par_iter_mut().zip(positions).zip(&mut bounds);
        axes.enumerate().for_each(|(c, ((cells, component), bounds))| {
            let along = if c == 0 { CELLS_PER_RADIUS_X } else { 1 };
            let (scale, max_coordinate) = (scale * along as f32, (MAX_CELL_COORDINATE * along) as f32);
            dispatch!(bansho_base::math::simd::level(), _simd => *bounds = cell_coordinates(component, scale, max_coordinate, cells));
        });
        self.order.clear();
        self.occupied.clear();
        if !ids.is_empty() {
            self.sort_by_key(ids, &bounds);
        }
    }

    /// Sorts by key, then by id, and lists the occupied cells; `bounds` are the first and last cell along each axis.
    fn sort_by_key(&mut self, ids: &[u64], bounds: &[[i32; 2]; D]) {
        let Self { coordinates, sorting, order, occupied, .. } = self;
        let keys = Keys::new(bounds.map(|[first, _]| first), bounds.map(|[_, last]| last));
        sorting.sort(|index| keys.key(coordinates, index), keys.bits, ids, order, occupied);
        occupied.resize(occupied.len() + SEARCH_WIDTH, Cell { key: u64::MAX, start: ids.len() as u32 });
        self.keys = keys;
    }

    /// Splits every row of cells into chunks of up to [`BATCH`] particles.
    fn chunk_rows(&mut self) {
        self.row_chunks.clear();
        let mut row = u64::MAX;
        for pair in self.occupied.windows(2) {
            let (key, mut start) = (pair[0].key, pair[0].start);
            let same_row = std::mem::replace(&mut row, self.keys.row(key)) == self.keys.row(key);
            if let Some(chunk) =
                self.row_chunks.last_mut().filter(|chunk| same_row && key - chunk.first <= MAX_GROUP_LENGTH)
            {
                let end = pair[1].start.min(chunk.particles.start + BATCH as u32);
                if end > start {
                    (chunk.particles.end, chunk.last, start) = (end, key, end);
                }
            }
            while start < pair[1].start {
                let end = pair[1].start.min(start + BATCH as u32);
                self.row_chunks.push(RowChunk { particles: start..end, first: key, last: key });
                start = end;
            }
        }
    }

    /// Permutes values from the order of the arguments of [`Cells::assign`] into the sorted order.
    ///
    /// # Panics
    /// If there is not one value per particle.
    pub fn reorder<T: Copy + Send + Sync>(&self, values: &mut Vec<T>) {
        assert_eq!(values.len(), self.order.len(), "one value per particle");
        *values = self.order.par_iter().with_min_len(MIN_PARTICLES_PER_TASK).map(|i| values[*i as usize]).collect();
    }

    /// As [`Cells::reorder`] for many arrays of `f32`, with scratch memory that is reused.
    ///
    /// # Panics
    /// If there is not one value per particle.
    pub fn reorder_all<'a>(&mut self, arrays: impl IntoIterator<Item = &'a mut Vec<f32>>) {
        let mut arrays: Vec<&mut Vec<f32>> = arrays.into_iter().collect();
        let threads = parallel::current_num_threads().clamp(1, arrays.len().max(1));
        let Self { order, scratch, .. } = self;
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

    /// Particle ids in sorted order.
    pub(super) fn ids(&self) -> &[u64] {
        &self.ids
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

/// Cell coordinates of one component, `scale` cells per unit; returns the minimum and the maximum. `floor` is avoided: without
/// SSE4.1 it is a function call.
#[inline(always)]
fn cell_coordinates(component: &[f32], scale: f32, max_coordinate: f32, cells: &mut Vec<i32>) -> [i32; 2] {
    cells.resize(component.len(), 0);
    let (mut first, mut last) = (i32::MAX, i32::MIN);
    for (cell, value) in cells.iter_mut().zip(component) {
        let scaled = (value * scale).clamp(-max_coordinate, max_coordinate);
        let truncated = scaled as i32;
        *cell = truncated - i32::from(truncated as f32 > scaled);
        (first, last) = (first.min(*cell), last.max(*cell));
    }
    [first, last]
}
