//! Particles sorted into cells, of which only those that hold some exist.
//!
//! There is no grid: cells are a sorted list, so memory grows with the particles alone, however far they spread. A cell is as wide as the
//! support radius, and a quarter as long along x. Cells follow each other along x, so that all in a row that are near are one run of
//! particles, and the neighbours of a cell are 3 runs in the plane and 9 in space.

use std::ops::Range;

use fearless_simd::{Level, dispatch};
use rayon::prelude::*;

use super::{
    neighbor_groups::GroupBatch,
    sorting::{Cell, MIN_PARTICLES_PER_TASK, SampleSort},
};
use crate::neighbor_groups::BATCH;

/// Cells further than this from the origin, in support radii, are taken together; so a key of three axes fits 64 bits.
const MAX_CELL_COORDINATE: i32 = 1 << 18;
/// Cells are this much larger than the support radius asks, so that rounding never puts two neighbours further apart.
const CELL_SIZE_MARGIN: f32 = 1.001;
/// Cells along x in a support radius: short ones keep the groups of a row short.
const CELLS_PER_RADIUS_X: i32 = 4;
/// A group ends where it would be longer than this, in cells along x: what lies between would all be its candidates.
const MAX_GROUP_LENGTH: u64 = 8 * CELLS_PER_RADIUS_X as u64;
/// Where particles are put that are farther away or nowhere; squares of such distances are still finite.
pub(super) const OUT_OF_RANGE: f32 = 1e12;
/// Cells looked at together when a search moves on: how far it goes is hard to foresee, for the processor too.
const SEARCH_WIDTH: usize = 4;

/// Particles in cells by one support radius; the order they were given in does not matter.
#[derive(Clone, Debug)]
pub struct Cells<const D: usize> {
    support_radius: f32,
    keys: Keys<D>,
    /// For each particle in sorted order the index it was given at.
    order: Vec<u32>,
    ids: Vec<u64>,
    /// Positions in sorted order, and a batch that is nowhere.
    positions: [Vec<f32>; D],
    /// The cells that hold particles; the last [`SEARCH_WIDTH`] are sentinels behind all.
    occupied: Vec<Cell>,
    row_chunks: Vec<RowChunk>,
    batches: Vec<GroupBatch>,
    /// Cells along each axis.
    coordinates: [Vec<i32>; D],
    sorting: SampleSort,
    /// Arrays that take the place of those brought into order, one a thread.
    scratch: Vec<Vec<f32>>,
}

/// Up to [`BATCH`] particles that follow each other in a row, and the keys of the first and the last one's cell.
#[derive(Clone, Debug)]
pub(super) struct RowChunk {
    pub(super) particles: Range<u32>,
    first: u64,
    last: u64,
}

/// How coordinates of cells become keys that sort by the last axis first and by x last.
#[derive(Clone, Copy, Debug)]
struct Keys<const D: usize> {
    lower: [i32; D],
    shift: [u32; D],
    bits: u32,
}

impl<const D: usize> Keys<D> {
    /// For cells from `lower` to `upper` and a support radius more on each side.
    fn new(mut lower: [i32; D], upper: [i32; D]) -> Self {
        let mut shift = [0; D];
        let mut bits = 0;
        for c in 0..D {
            let margin = if c == 0 { CELLS_PER_RADIUS_X } else { 1 };
            shift[c] = bits;
            bits += u32::BITS - ((upper[c] - lower[c] + 2 * margin) as u32).leading_zeros();
            lower[c] -= margin;
        }
        Self { lower, shift, bits }
    }

    fn key(&self, cell: [i32; D]) -> u64 {
        let mut key = 0;
        for c in 0..D {
            key |= ((cell[c] - self.lower[c]) as u64) << self.shift[c];
        }
        key
    }

    /// The row of a cell: what its key says but for x.
    fn row(&self, key: u64) -> u64 {
        key >> self.shift[1]
    }

    /// What the key of the same x in each neighbouring row adds, wrapping.
    fn rows(&self) -> impl Iterator<Item = u64> {
        let shift = self.shift;
        (0..3_usize.pow(D as u32 - 1)).map(move |row| {
            (1..D).fold(0, |sum: u64, c| {
                let step = row / 3_usize.pow(c as u32 - 1) % 3;
                sum.wrapping_add((step as u64).wrapping_sub(1) << shift[c])
            })
        })
    }
}

impl<const D: usize> Cells<D> {
    /// Cells for a support radius, in the unit of positions, finite and above 0.
    #[must_use]
    pub fn new(support_radius: f32) -> Self {
        const { assert!(D == 2 || D == 3, "particles live in two or three dimensions") };
        let none = || std::array::from_fn(|_| Vec::new());
        let keys = Keys::new([0; D], [0; D]);
        let (order, ids, occupied, row_chunks, batches) = Default::default();
        let coordinates = std::array::from_fn(|_| Vec::new());
        Self {
            support_radius,
            keys,
            order,
            ids,
            positions: none(),
            occupied,
            row_chunks,
            batches,
            coordinates,
            sorting: SampleSort::default(),
            scratch: Vec::new(),
        }
    }

    /// The distance from which on particles do not see each other.
    #[must_use]
    pub fn support_radius(&self) -> f32 {
        self.support_radius
    }

    /// Changes that distance for the next [`Cells::assign`], finite and above 0; buffers are kept.
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

    /// Sorts particles by cell, then by birth id, and remembers where they are. [`Cells::reorder`] and [`Cells::reorder_all`] then bring arrays into that order.
    ///
    /// # Panics
    /// If there are more than 2^27 of them, or positions and ids are not equally many.
    pub fn assign(&mut self, positions: [&[f32]; D], ids: &[u64]) {
        assert!(ids.len() <= 1 << 27, "particles are counted in 32 bits");
        assert!(positions.iter().all(|component| component.len() == ids.len()), "one position an id");
        let scale = 1.0 / (self.support_radius * CELL_SIZE_MARGIN);
        let mut bounds = [[0; 2]; D];
        let axes = self.coordinates.par_iter_mut().zip(positions).zip(&mut bounds);
        axes.enumerate().for_each(|(c, ((cells, component), bounds))| {
            let along = if c == 0 { CELLS_PER_RADIUS_X } else { 1 };
            let (scale, max_coordinate) = (scale * along as f32, (MAX_CELL_COORDINATE * along) as f32);
            dispatch!(Level::new(), _simd => *bounds = cell_coordinates(component, scale, max_coordinate, cells));
        });
        self.order.clear();
        self.occupied.clear();
        if !ids.is_empty() {
            self.sort(ids, &bounds);
        }
        let clamp_to_range = |x: f32| if x.abs() < OUT_OF_RANGE { x } else { OUT_OF_RANGE };
        let mut sorted = std::mem::replace(&mut self.positions, std::array::from_fn(|_| Vec::new()));
        sorted.par_iter_mut().zip(positions).for_each(|(to, from)| {
            to.clear();
            to.extend(self.order.iter().map(|i| clamp_to_range(from[*i as usize])));
            to.resize((ids.len() + BATCH).next_multiple_of(BATCH), -OUT_OF_RANGE);
        });
        self.positions = sorted;
        self.ids.clear();
        self.ids.par_extend(self.order.par_iter().with_min_len(MIN_PARTICLES_PER_TASK).map(|i| ids[*i as usize]));
        self.chunk_rows();
        let mut batches = std::mem::take(&mut self.batches);
        GroupBatch::find_all(&mut batches, self, &self.row_chunks);
        self.batches = batches;
    }

    /// Sorts by key, then by id, and lists the cells, of which the first and the last along each axis are given.
    fn sort(&mut self, ids: &[u64], bounds: &[[i32; 2]; D]) {
        let Self { coordinates, sorting, order, occupied, .. } = self;
        let keys = Keys::new(bounds.map(|[first, _]| first), bounds.map(|[_, last]| last));
        let key = |index: usize| {
            let mut cell = [0; D];
            for c in 0..D {
                cell[c] = coordinates[c][index];
            }
            keys.key(cell)
        };
        sorting.sort(key, keys.bits, ids, (order, occupied));
        occupied.resize(occupied.len() + SEARCH_WIDTH, Cell { key: u64::MAX, start: ids.len() as u32 });
        self.keys = keys;
    }

    /// Parts every row of cells into particles for groups.
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

    /// Brings values, given in the order of [`Cells::assign`], into the sorted order.
    ///
    /// # Panics
    /// If they are not one a particle.
    pub fn reorder<T: Copy + Send + Sync>(&self, values: &mut Vec<T>) {
        assert_eq!(values.len(), self.order.len(), "one value a particle");
        *values = self.order.par_iter().with_min_len(MIN_PARTICLES_PER_TASK).map(|i| values[*i as usize]).collect();
    }

    /// Does so with many arrays of numbers, without asking the system for memory again and again.
    ///
    /// # Panics
    /// If they are not one a particle.
    pub fn reorder_all<'a>(&mut self, arrays: impl IntoIterator<Item = &'a mut Vec<f32>>) {
        let mut arrays: Vec<&mut Vec<f32>> = arrays.into_iter().collect();
        let threads = rayon::current_num_threads().clamp(1, arrays.len().max(1));
        let Self { order, scratch, .. } = self;
        scratch.resize_with(threads, Vec::new);
        let arrays_per_thread = arrays.len().div_ceil(threads).max(1);
        arrays.par_chunks_mut(arrays_per_thread).zip(scratch).for_each(|(arrays, scratch)| {
            for values in arrays {
                assert_eq!(values.len(), order.len(), "one value a particle");
                scratch.clear();
                scratch.extend(order.iter().map(|i| values[*i as usize]));
                std::mem::swap(*values, scratch);
            }
        });
    }

    /// Birth ids in sorted order.
    pub(super) fn ids(&self) -> &[u64] {
        &self.ids
    }

    /// Positions in sorted order, one array a component, and a batch that is nowhere.
    pub(super) fn positions(&self) -> [&[f32]; D] {
        self.positions.each_ref().map(Vec::as_slice)
    }

    /// All groups of particles, in stretches.
    pub(super) fn batches(&self) -> &[GroupBatch] {
        &self.batches
    }

    /// The runs of particles around parts of rows, from `first` on.
    pub(super) fn neighbor_runs(&self, first: &RowChunk) -> NeighborRuns<'_> {
        let start = |row: u64| self.occupied.partition_point(|cell| cell.key < first.min_key(row));
        let rows: Vec<(u64, usize, usize)> = self.keys.rows().map(|row| (row, start(row), 0)).collect();
        NeighborRuns { occupied: &self.occupied, runs: vec![0..0; rows.len()], rows }
    }
}

impl RowChunk {
    /// The least key that may be near in the row that is so far away.
    fn min_key(&self, row: u64) -> u64 {
        self.first.wrapping_add(row) - CELLS_PER_RADIUS_X as u64
    }

    /// The greatest.
    fn max_key(&self, row: u64) -> u64 {
        self.last.wrapping_add(row) + CELLS_PER_RADIUS_X as u64
    }
}

/// The runs of particles that may be near parts of rows, one after the other.
pub(super) struct NeighborRuns<'a> {
    occupied: &'a [Cell],
    /// How far away each neighbouring row is, and which of its cells were near last: they move on with the parts, so all searching is one pass.
    rows: Vec<(u64, usize, usize)>,
    runs: Vec<Range<usize>>,
}

impl NeighborRuns<'_> {
    /// The runs of those that may be near a part, which comes after those asked for before.
    pub(super) fn near(&mut self, chunk: &RowChunk) -> &[Range<usize>] {
        for (run, (row, start, end)) in self.runs.iter_mut().zip(&mut self.rows) {
            let (min_key, max_key) = (chunk.min_key(*row), chunk.max_key(*row));
            *start = first_cell_from(self.occupied, *start, min_key);
            *end = first_cell_from(self.occupied, (*end).max(*start), max_key + 1);
            *run = self.occupied[*start].start as usize..self.occupied[*end].start as usize;
        }
        &self.runs
    }
}

/// The first cell from `start` on whose key is not below `key`.
#[inline(always)]
fn first_cell_from(cells: &[Cell], mut start: usize, key: u64) -> usize {
    while let Some(ahead) = cells.get(start..start + SEARCH_WIDTH) {
        let below = ahead.iter().map(|cell| usize::from(cell.key < key)).sum::<usize>();
        start += below;
        if below < SEARCH_WIDTH {
            break;
        }
    }
    start
}

/// The cells of coordinates, `scale` cells a unit; gives the first and the last. No `floor`: where the processor lacks it that is a call.
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
