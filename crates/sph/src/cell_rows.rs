//! Rows of cells along x: their sort keys, and the ranges of particles in the rows around a chunk of one.

use std::ops::Range;

use super::sorting::Cell;

/// Cells along x per support radius. Short cells keep the candidate ranges of a row short.
pub(super) const CELLS_PER_RADIUS_X: i32 = 4;
/// Cells compared per iteration of a search, without branches: the length of a search is hard to predict.
pub(super) const SEARCH_WIDTH: usize = 4;

/// Packs cell coordinates into 64-bit keys, x in the lowest bits.
#[derive(Clone, Copy, Debug)]
pub(super) struct Keys<const D: usize> {
    lower: [i32; D],
    shift: [u32; D],
    pub(super) bits: u32,
}

impl<const D: usize> Keys<D> {
    /// For cells from `lower` to `upper`, with a margin of one support radius on each side.
    pub(super) fn new(mut lower: [i32; D], upper: [i32; D]) -> Self {
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

    /// The key of the cell of the particle at an index; `coordinates` are the cells of all particles, one array per axis.
    pub(super) fn key(&self, coordinates: &[Vec<i32>; D], index: usize) -> u64 {
        let mut key = 0;
        for c in 0..D {
            key |= ((coordinates[c][index] - self.lower[c]) as u64) << self.shift[c];
        }
        key
    }

    /// The row of a cell: its key without the bits of x.
    pub(super) fn row(&self, key: u64) -> u64 {
        key >> self.shift[1]
    }

    /// Key offsets to the cell of the same x in each neighboring row; wrapping.
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

/// Consecutive particles of a row of cells, with the keys of the first and the last cell.
#[derive(Clone, Debug)]
pub(super) struct RowChunk {
    pub(super) particles: Range<u32>,
    pub(super) first: u64,
    pub(super) last: u64,
}

/// The occupied cells in the order of their keys. The last [`SEARCH_WIDTH`] are sentinels with the largest key.
#[derive(Clone, Copy)]
pub(super) struct CellRows<'a, const D: usize> {
    pub(super) keys: &'a Keys<D>,
    pub(super) occupied: &'a [Cell],
}

impl<'a, const D: usize> CellRows<'a, D> {
    /// The ranges of neighbor candidates of row chunks, from `first` on.
    pub(super) fn neighbor_runs(&self, first: &RowChunk) -> NeighborRuns<'a> {
        let mut rows = Vec::new();
        for key_offset in self.keys.rows() {
            let min_key = first.min_key(key_offset);
            let start = self.occupied.partition_point(|cell| cell.key < min_key);
            rows.push(NeighborRow { key_offset, start, end: 0 });
        }
        NeighborRuns { occupied: self.occupied, runs: vec![0..0; rows.len()], rows }
    }
}

impl RowChunk {
    /// Smallest key of cells within the support radius in the row at a key offset.
    fn min_key(&self, key_offset: u64) -> u64 {
        self.first.wrapping_add(key_offset) - CELLS_PER_RADIUS_X as u64
    }

    /// Largest such key.
    fn max_key(&self, key_offset: u64) -> u64 {
        self.last.wrapping_add(key_offset) + CELLS_PER_RADIUS_X as u64
    }
}

/// Ranges of particles that may be within the support radius of row chunks, which are visited in ascending order.
pub(super) struct NeighborRuns<'a> {
    occupied: &'a [Cell],
    rows: Vec<NeighborRow>,
    runs: Vec<Range<usize>>,
}

/// A row that adjoins the row of the chunks, or the row itself.
struct NeighborRow {
    /// Difference of its keys from those of cells at the same x in the row of the chunks.
    key_offset: u64,
    /// Indices of the first cell near the previous chunk and of the first one beyond it. Both only move forward, so all searches
    /// together take one pass.
    start: usize,
    end: usize,
}

impl NeighborRuns<'_> {
    /// The candidate ranges of a chunk. Chunks are passed in ascending order.
    pub(super) fn near(&mut self, chunk: &RowChunk) -> &[Range<usize>] {
        for (run, row) in self.runs.iter_mut().zip(&mut self.rows) {
            let (min_key, max_key) = (chunk.min_key(row.key_offset), chunk.max_key(row.key_offset));
            row.start = first_cell_from(self.occupied, row.start, min_key);
            row.end = first_cell_from(self.occupied, row.end.max(row.start), max_key + 1);
            *run = self.occupied[row.start].start as usize..self.occupied[row.end].start as usize;
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
