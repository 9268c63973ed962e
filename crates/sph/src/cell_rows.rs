//! Rows of cells along x: their division into chunks, and the ranges of particles in the rows around a chunk of one.

use std::ops::Range;

use bansho_base::host::parallel::{self, prelude::*};

use super::{
    cell_keys::{CELLS_PER_RADIUS_X, KeyLayout},
    sorting::MIN_PARTICLES_PER_TASK,
};

/// Particles per batch of neighbor sums, and at most in a chunk.
pub(super) const BATCH: usize = 8;
/// Keys compared per iteration of a search, without branches: the length of a search is hard to predict.
const SEARCH_WIDTH: usize = 8;
/// Maximum length of a chunk, in cells along x: all particles within that length become candidates of its group.
const MAX_CHUNK_LENGTH: u64 = 8 * CELLS_PER_RADIUS_X as u64;
/// There is a table of all keys, 4 bytes each, if there are at most so many per particle.
const TABLE_KEYS_PER_PARTICLE: usize = 8;
/// Entries of that table that one task writes.
const TABLE_ENTRIES_PER_TASK: usize = 1 << 14;

/// Up to [`BATCH`] consecutive particles of a row of cells, with the keys of the first and the last cell.
#[derive(Clone, Debug)]
pub(super) struct RowChunk {
    pub(super) particles: Range<u32>,
    pub(super) first: u64,
    pub(super) last: u64,
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

/// Splits every row of cells into chunks; `keys` are the sorted keys of the particles.
pub(super) fn chunk_rows<const D: usize>(layout: &KeyLayout<D>, keys: &[u64], chunks: &mut Vec<RowChunk>) {
    let tasks = parallel::current_num_threads().min(keys.len() / MIN_PARTICLES_PER_TASK);
    if tasks < 2 {
        chunks.clear();
        chunk_rows_of(layout, keys, 0..keys.len(), chunks);
        return;
    }
    let chunks_of_tasks: Vec<Vec<RowChunk>> = (0..tasks)
        .into_par_iter()
        .map(|task| {
            // Tasks begin where a row begins, so that chunks do not depend on their number.
            let [start, end] = [task, task + 1].map(|task| start_of_row(layout, keys, keys.len() * task / tasks));
            let mut chunks = Vec::new();
            chunk_rows_of(layout, keys, start..end, &mut chunks);
            chunks
        })
        .collect();
    chunks.clear();
    for mut task in chunks_of_tasks {
        chunks.append(&mut task);
    }
}

/// Index of the first particle in the row of a particle; that of the end is the end.
fn start_of_row<const D: usize>(layout: &KeyLayout<D>, keys: &[u64], particle: usize) -> usize {
    keys.get(particle).map_or(keys.len(), |key| {
        let first = layout.first_of_row(*key);
        keys.partition_point(|key| *key < first)
    })
}

/// Appends the chunks of some particles, which are whole rows.
fn chunk_rows_of<const D: usize>(
    layout: &KeyLayout<D>,
    keys: &[u64],
    particles: Range<usize>,
    chunks: &mut Vec<RowChunk>,
) {
    let mut start = particles.start;
    while start < particles.end {
        let first = keys[start];
        let max_key = layout.last_of_row(first).min(first + MAX_CHUNK_LENGTH);
        let mut end = particles.end.min(start + BATCH);
        while keys[end - 1] > max_key {
            end -= 1;
        }
        chunks.push(RowChunk { particles: start as u32..end as u32, first, last: keys[end - 1] });
        start = end;
    }
}

/// Sorted keys of the particles, and where each key begins.
#[derive(Clone, Copy)]
pub(super) struct CellRows<'a, const D: usize> {
    pub(super) layout: &'a KeyLayout<D>,
    pub(super) keys: &'a [u64],
    /// Number of particles with smaller keys, for each key; empty if there are too many keys.
    pub(super) starts: &'a [u32],
}

/// Writes the number of particles with smaller keys, for each key; nothing if there are more than [`TABLE_KEYS_PER_PARTICLE`].
pub(super) fn find_starts<const D: usize>(layout: &KeyLayout<D>, keys: &[u64], starts: &mut Vec<u32>) {
    if (1_u64 << layout.bits) > (TABLE_KEYS_PER_PARTICLE * keys.len()) as u64 {
        starts.clear();
        return;
    }
    // One more: the end of the last key.
    starts.resize((1 << layout.bits) + 1, 0);
    starts.par_chunks_mut(TABLE_ENTRIES_PER_TASK).enumerate().for_each(|(number, starts)| {
        let first_key = (number * TABLE_ENTRIES_PER_TASK) as u64;
        let first = keys.partition_point(|key| *key < first_key);
        starts.fill(0);
        starts[0] = first as u32;
        // The end of each key that particles have: of several with one key, the last one writes last.
        for (index, key) in keys.iter().enumerate().skip(first) {
            let Some(end) = starts.get_mut((key - first_key) as usize + 1) else { break };
            *end = index as u32 + 1;
        }
        // A key without particles begins where the one before it ends.
        let mut largest = 0;
        for start in starts {
            // Not `max`, which becomes a branch that is hard to predict.
            largest = std::hint::select_unpredictable(*start > largest, *start, largest);
            *start = largest;
        }
    });
}

impl<'a, const D: usize> CellRows<'a, D> {
    /// The ranges of neighbor candidates of row chunks, from `first` on.
    pub(super) fn neighbor_runs(&self, first: &RowChunk) -> NeighborRuns<'a> {
        let mut runs = NeighborRuns {
            keys: self.keys,
            starts: self.starts,
            rows: Default::default(),
            runs: Default::default(),
            count: 0,
        };
        for key_offset in self.layout.rows() {
            let min_key = first.min_key(key_offset);
            let start = if self.starts.is_empty() { self.keys.partition_point(|key| *key < min_key) } else { 0 };
            runs.rows[runs.count] = NeighborRow { key_offset, start, end: 0 };
            runs.count += 1;
        }
        runs
    }
}

/// Maximum number of rows around one, itself included: those of three dimensions.
pub(super) const MAX_ROWS: usize = 9;

/// Ranges of particles that may be within the support radius of row chunks, which are visited in ascending order.
pub(super) struct NeighborRuns<'a> {
    keys: &'a [u64],
    starts: &'a [u32],
    rows: [NeighborRow; MAX_ROWS],
    runs: [Range<usize>; MAX_ROWS],
    /// Number of rows.
    count: usize,
}

/// A row that adjoins the row of the chunks, or the row itself.
#[derive(Default)]
struct NeighborRow {
    /// Difference of its keys from those of cells at the same x in the row of the chunks.
    key_offset: u64,
    /// Indices of the first particle near the previous chunk and of the first one beyond it. Both only move forward, so all searches
    /// together take one pass.
    start: usize,
    end: usize,
}

impl NeighborRuns<'_> {
    /// The candidate ranges of a chunk, and how many particles they hold together. Chunks are passed in ascending order.
    #[inline(always)]
    pub(super) fn near(&mut self, chunk: &RowChunk) -> (&[Range<usize>], usize) {
        let particles = if self.starts.is_empty() { self.search(chunk) } else { self.look_up(chunk) };
        (&self.runs[..self.count], particles)
    }

    /// Finds the ranges in the table; returns the number of their particles.
    #[inline(always)]
    fn look_up(&mut self, chunk: &RowChunk) -> usize {
        let mut particles = 0;
        for (run, row) in self.runs[..self.count].iter_mut().zip(&self.rows) {
            let (min_key, max_key) = (chunk.min_key(row.key_offset), chunk.max_key(row.key_offset));
            *run = self.starts[min_key as usize] as usize..self.starts[max_key as usize + 1] as usize;
            particles += run.end - run.start;
        }
        particles
    }

    /// Finds the ranges in the sorted keys; returns the number of their particles.
    #[inline(never)]
    fn search(&mut self, chunk: &RowChunk) -> usize {
        let mut particles = 0;
        for (run, row) in self.runs[..self.count].iter_mut().zip(&mut self.rows) {
            let (min_key, max_key) = (chunk.min_key(row.key_offset), chunk.max_key(row.key_offset));
            row.start = first_from(self.keys, row.start, min_key);
            row.end = first_from(self.keys, row.end.max(row.start), max_key + 1);
            *run = row.start..row.end;
            particles += run.end - run.start;
        }
        particles
    }
}

/// The first particle from `start` on whose key is not below `key`.
#[inline(always)]
fn first_from(keys: &[u64], mut start: usize, key: u64) -> usize {
    while let Some(ahead) = keys.get(start..start + SEARCH_WIDTH) {
        let below = ahead.iter().map(|ahead| usize::from(*ahead < key)).sum::<usize>();
        start += below;
        if below < SEARCH_WIDTH {
            return start;
        }
    }
    start + keys[start..].iter().take_while(|ahead| **ahead < key).count()
}

#[cfg(test)]
mod tests {
    use bansho_base::math::random::{Key, Purpose};

    use super::*;
    use crate::cell_keys::CellKeys;
    use crate::sorting::ParticleKeys;

    /// Sorted keys of random particles in a box of that width, in support radii; one in eight is in a small clump.
    fn sorted_keys(count: u64, width: f32) -> (KeyLayout<3>, Vec<u64>) {
        let random = Key::new(5, "rows");
        let mut positions = [const { Vec::new() }; 3];
        for id in 0..count {
            let width = if id % 8 == 0 { 0.5 } else { width };
            let uniforms = random.uniforms(id, 0, Purpose(1));
            positions.iter_mut().zip(uniforms).for_each(|(values, uniform)| values.push(width * uniform));
        }
        let keys = CellKeys::new(positions.each_ref().map(Vec::as_slice), 1.0);
        let mut sorted: Vec<u64> = (0..count as usize).map(|index| keys.key(index)).collect();
        sorted.sort_unstable();
        (keys.layout, sorted)
    }

    #[test]
    fn ranges_of_neighbors_are_those_of_the_definition_by_table_and_by_search() {
        // Rows that are dense, sparse, and so sparse that the search is the only way.
        for (width, is_table_expected) in [(3.0, true), (9.0, true), (30.0, false)] {
            let (layout, keys) = sorted_keys(3000, width);
            let (mut chunks, mut starts) = (Vec::new(), Vec::new());
            chunk_rows(&layout, &keys, &mut chunks);
            find_starts(&layout, &keys, &mut starts);
            assert_eq!(!starts.is_empty(), is_table_expected, "{width}");
            let by_search = CellRows { layout: &layout, keys: &keys, starts: &[] };
            let by_table = CellRows { starts: &starts, ..by_search };
            let (mut table_runs, mut search_runs) =
                (by_table.neighbor_runs(&chunks[0]), by_search.neighbor_runs(&chunks[0]));
            for chunk in &chunks {
                let expected: Vec<Range<usize>> = layout
                    .rows()
                    .map(|offset| {
                        let first = keys.partition_point(|key| *key < chunk.min_key(offset));
                        first..keys.partition_point(|key| *key <= chunk.max_key(offset))
                    })
                    .collect();
                let particles: usize = expected.iter().map(Range::len).sum();
                assert_eq!(search_runs.near(chunk), (&expected[..], particles));
                assert_eq!(table_runs.near(chunk), (&expected[..], particles));
            }
        }
    }

    #[test]
    fn chunks_are_whole_rows_cut_every_eight_particles_or_eight_radii_for_any_number_of_threads() {
        let (layout, keys) = sorted_keys(20_000, 40.0);
        let mut expected: Vec<Range<u32>> = Vec::new();
        for (index, key) in (0_u32..).zip(&keys) {
            match expected.last_mut() {
                Some(chunk)
                    if chunk.len() < 8
                        && key - keys[chunk.start as usize] <= 32
                        && layout.first_of_row(*key) == layout.first_of_row(keys[chunk.start as usize]) =>
                {
                    chunk.end = index + 1;
                }
                _ => expected.push(index..index + 1),
            }
        }
        for threads in [1, 2, 5] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("few threads");
            let mut chunks = Vec::new();
            pool.install(|| chunk_rows(&layout, &keys, &mut chunks));
            assert!(chunks.iter().map(|chunk| &chunk.particles).eq(&expected), "{threads} threads");
            for chunk in &chunks {
                let [first, last] = [chunk.particles.start, chunk.particles.end - 1].map(|index| keys[index as usize]);
                assert_eq!((chunk.first, chunk.last), (first, last));
            }
        }
    }
}
