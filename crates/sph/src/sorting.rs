//! Parallel sort of particles by cell key: a sample sort that gives each thread a range of keys, and a radix sort within each
//! range.

use std::ops::Range;

use bansho_base::host::parallel::{self, prelude::*};

/// Minimum number of particles per task of the thread pool.
pub(super) const MIN_PARTICLES_PER_TASK: usize = 4096;
/// Maximum number of key bits per radix pass.
const DIGIT_BITS: u32 = 11;
/// Sampled keys per range. Their quantiles split the keys into ranges of about equal size.
const SAMPLES: usize = 64;

/// A particle to be sorted.
#[derive(Clone, Copy, Debug, Default)]
struct Entry {
    key: u64,
    /// Index of the particle.
    particle: u32,
}

/// An occupied cell: its key and the index of its first particle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cell {
    pub(super) key: u64,
    pub(super) start: u32,
}

/// Buffers of the sort, reused from step to step.
#[derive(Clone, Debug, Default)]
pub(super) struct SampleSort {
    entries: Vec<Entry>,
    /// Sampled keys.
    sample: Vec<u64>,
    ranges: Vec<KeyRange>,
}

/// The particles of one range of keys.
#[derive(Clone, Debug, Default)]
struct KeyRange {
    entries: Vec<Entry>,
    scratch: Vec<Entry>,
    cells: Vec<Cell>,
}

impl SampleSort {
    /// Sorts particles by key (of `bits` bits), then by id. Writes their indices in that order, and the occupied cells.
    pub(super) fn sort(
        &mut self,
        key: impl Fn(usize) -> u64 + Sync,
        bits: u32,
        ids: &[u64],
        order: &mut Vec<u32>,
        cells: &mut Vec<Cell>,
    ) {
        let all = (0..ids.len()).into_par_iter().with_min_len(MIN_PARTICLES_PER_TASK);
        all.map(|index| Entry { key: key(index), particle: index as u32 }).collect_into_vec(&mut self.entries);
        let count = parallel::current_num_threads().min(ids.len() / MIN_PARTICLES_PER_TASK).max(1);
        self.ranges.resize_with(count, KeyRange::default);
        let starts = self.starts_of_ranges();
        let Self { entries, ranges, .. } = self;
        ranges.par_iter_mut().enumerate().for_each(|(number, range)| {
            range.take(entries, starts[number], starts.get(number + 1).copied());
            range.sort(bits, ids);
        });
        order.resize(ids.len(), 0);
        let (mut rest, mut start, mut slices) = (order.as_mut_slice(), 0, Vec::with_capacity(count));
        for range in ranges {
            let (head, tail) = rest.split_at_mut(range.entries.len());
            slices.push((head, start));
            (rest, start) = (tail, start + range.entries.len() as u32);
        }
        self.ranges.par_iter_mut().zip(slices).for_each(|(range, (order, start))| range.write(order, start));
        cells.clear();
        self.ranges.iter().for_each(|range| cells.extend_from_slice(&range.cells));
    }

    /// Smallest key of each range.
    fn starts_of_ranges(&mut self) -> Vec<u64> {
        let count = self.ranges.len();
        self.sample.clear();
        let step = (self.entries.len() / (count * SAMPLES)).max(1);
        self.sample.extend(self.entries.iter().step_by(step).map(|entry| entry.key));
        self.sample.sort_unstable();
        let mut starts = vec![0; count];
        for (number, start) in starts.iter_mut().enumerate().skip(1) {
            *start = self.sample[number * self.sample.len() / count];
        }
        starts
    }
}

impl KeyRange {
    /// Takes the particles with keys from `start` up to, not including, `end`.
    fn take(&mut self, all: &[Entry], start: u64, end: Option<u64>) {
        self.entries.clear();
        let last = end.map_or(u64::MAX, |end| end.wrapping_sub(1));
        if end != Some(start) {
            self.entries.extend(all.iter().filter(|entry| start <= entry.key && entry.key <= last));
        }
    }

    /// Sorts them by key, then by id.
    fn sort(&mut self, bits: u32, ids: &[u64]) {
        let Self { entries, scratch, .. } = self;
        scratch.resize(entries.len(), Entry::default());
        let passes = bits.div_ceil(DIGIT_BITS);
        for pass in 0..passes {
            let [from, to] = [pass, pass + 1].map(|pass| bits * pass / passes);
            radix_pass(entries, scratch, from..to);
            std::mem::swap(entries, scratch);
        }
        for cell in entries.chunk_by_mut(|a, b| a.key == b.key).filter(|cell| cell.len() > 1) {
            cell.sort_unstable_by_key(|entry| ids[entry.particle as usize]);
        }
    }

    /// Writes the sorted indices and lists the occupied cells; `start` is the index of the first particle.
    fn write(&mut self, order: &mut [u32], mut start: u32) {
        order.iter_mut().zip(&self.entries).for_each(|(index, entry)| *index = entry.particle);
        self.cells.clear();
        for cell in self.entries.chunk_by(|a, b| a.key == b.key) {
            self.cells.push(Cell { key: cell[0].key, start });
            start += cell.len() as u32;
        }
    }
}

/// One stable counting pass of the radix sort, over some bits of the keys.
fn radix_pass(from: &[Entry], to: &mut [Entry], bits: Range<u32>) {
    let mut offsets = [0_u32; 1 << DIGIT_BITS];
    let mask = (1 << bits.len()) - 1;
    for entry in from {
        offsets[(entry.key >> bits.start) as usize & mask] += 1;
    }
    let mut sum = 0;
    for offset in &mut offsets[..=mask] {
        sum += std::mem::replace(offset, sum);
    }
    for entry in from {
        let offset = &mut offsets[(entry.key >> bits.start) as usize & mask];
        to[*offset as usize] = *entry;
        *offset += 1;
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::math::random::{Key, Purpose};

    use super::*;

    /// The order is the same as that of a standard sort, for any number of threads.
    #[test]
    fn ranges_put_together_are_all_in_order() {
        let random = Key::new(4, "sorting");
        // More keys than particles, few keys, and a single key: ranges may be empty.
        for key_count in [1 << 20, 50, 1] {
            let words: Vec<_> = (0..50_000).map(|index| random.words(index, 0, Purpose::named("key"))).collect();
            let key = |index: usize| u64::from(words[index][0]) % key_count;
            // All ids are different.
            let ids: Vec<u64> = (0..).zip(&words).map(|(index, words)| u64::from(words[1]) << 32 | index).collect();
            let mut expected: Vec<u32> = (0..50_000).collect();
            expected.sort_by_key(|index| (key(*index as usize), ids[*index as usize]));
            for threads in [1, 2, 7] {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("few threads");
                let (mut order, mut cells) = (Vec::new(), Vec::new());
                pool.install(|| SampleSort::default().sort(key, 21, &ids, &mut order, &mut cells));
                assert!(order == expected, "{key_count} keys, {threads} threads");
                let firsts = (0..50_000).filter(|offset| {
                    let key = |offset: u32| key(expected[offset as usize] as usize);
                    *offset == 0 || key(*offset) != key(offset - 1)
                });
                assert!(cells.iter().map(|cell| cell.start).eq(firsts), "{key_count} keys, {threads} threads");
                assert!(cells.iter().all(|cell| cell.key == key(expected[cell.start as usize] as usize)));
            }
        }
    }
}
