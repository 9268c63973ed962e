//! Parallel sort of particles by cell key: a sample sort that gives each thread a range of keys, and a radix sort within each
//! range.
//!
//! What is sorted are words of 64 bits, each the key and the index of one particle: half the memory of two fields, and a
//! comparison of words compares keys.

use std::ops::Range;

use bansho_base::host::parallel::{self, prelude::*};

/// Minimum number of particles per task of the thread pool.
pub(super) const MIN_PARTICLES_PER_TASK: usize = 4096;
/// Maximum number of particles, as a power of two: the lowest bits of a word are the index of a particle.
pub(super) const INDEX_BITS: u32 = 27;
/// Bits of the key in a word, above the index. Longer keys are sorted by their lower bits first, then by the others.
const WORD_KEY_BITS: u32 = u64::BITS - INDEX_BITS;
/// Key bits per radix pass, of which as many passes follow one another as needed.
const DIGIT_BITS: u32 = 11;
/// Up to so many keys per particle are sorted in a single pass. Its larger table is read at more places, but a particle is moved once.
const ONE_PASS_KEYS_PER_PARTICLE: u64 = 2;
/// Particles of a cell up to which they are sorted by insertion.
const MAX_INSERTION_SORT: usize = 16;
/// Sampled keys per range. Their quantiles split the keys into ranges of about equal size.
const SAMPLES: usize = 64;

/// Keys of particles.
pub(super) trait ParticleKeys: Sync {
    /// Number of bits of the longest key.
    fn bits(&self) -> u32;
    /// The key of the particle at an index.
    fn key(&self, index: usize) -> u64;
    /// Writes the keys of consecutive particles, from index `first` on.
    fn write_keys(&self, first: usize, keys: &mut [u64]);
}

/// Particles in the order of their keys, then of their ids.
#[derive(Clone, Debug, Default)]
pub(super) struct SortedParticles {
    /// For each particle, the index at which it was given.
    pub(super) order: Vec<u32>,
    pub(super) ids: Vec<u64>,
    pub(super) keys: Vec<u64>,
}

impl SortedParticles {
    /// Sets the number of particles. Those that were there before keep their values: the sort overwrites all.
    fn resize(&mut self, count: usize) {
        self.order.resize(count, 0);
        self.ids.resize(count, 0);
        self.keys.resize(count, 0);
    }
}

/// Consecutive particles of [`SortedParticles`].
struct SortedSlice<'a> {
    order: &'a mut [u32],
    ids: &'a mut [u64],
    keys: &'a mut [u64],
}

impl SortedSlice<'_> {
    /// Removes the first `count` particles and returns them.
    fn split_off_first(&mut self, count: usize) -> Self {
        let (order, ids, keys) =
            (std::mem::take(&mut self.order), std::mem::take(&mut self.ids), std::mem::take(&mut self.keys));
        let (first_order, order) = order.split_at_mut(count);
        let (first_ids, ids) = ids.split_at_mut(count);
        let (first_keys, keys) = keys.split_at_mut(count);
        (self.order, self.ids, self.keys) = (order, ids, keys);
        Self { order: first_order, ids: first_ids, keys: first_keys }
    }
}

/// Buffers of the sort, reused from step to step.
#[derive(Clone, Debug, Default)]
pub(super) struct SampleSort {
    words: Vec<u64>,
    /// Sampled words.
    sample: Vec<u64>,
    ranges: Vec<KeyRange>,
}

/// The particles of one range of keys.
#[derive(Clone, Debug, Default)]
struct KeyRange {
    words: Vec<u64>,
    scratch: Vec<u64>,
    /// Table of a radix pass.
    offsets: Vec<u32>,
    /// One particle of each cell whose particles are not in the order of their ids.
    unordered: Vec<usize>,
}

impl SampleSort {
    /// Sorts particles by key, then by id.
    pub(super) fn sort(&mut self, keys: &impl ParticleKeys, ids: &[u64], sorted: &mut SortedParticles) {
        self.words.resize(ids.len(), 0);
        self.words.par_chunks_mut(MIN_PARTICLES_PER_TASK).enumerate().for_each(|(number, words)| {
            write_words(keys, number * MIN_PARTICLES_PER_TASK, words);
        });
        self.split_into_ranges(keys.bits());
        sorted.resize(ids.len());
        let mut rest = SortedSlice { order: &mut sorted.order, ids: &mut sorted.ids, keys: &mut sorted.keys };
        let mut slices = Vec::with_capacity(self.ranges.len());
        for range in &self.ranges {
            slices.push(rest.split_off_first(range.words.len()));
        }
        self.ranges.par_iter_mut().zip(slices).for_each(|(range, slice)| {
            range.sort(keys);
            range.write(keys, ids, slice);
        });
    }

    /// Gives each range its words, in their order.
    fn split_into_ranges(&mut self, bits: u32) {
        let most = if bits > WORD_KEY_BITS { 1 } else { parallel::current_num_threads() };
        let count = most.min(self.words.len() / MIN_PARTICLES_PER_TASK).max(1);
        self.ranges.resize_with(count, KeyRange::default);
        if let [range] = self.ranges.as_mut_slice() {
            std::mem::swap(&mut range.words, &mut self.words);
            return;
        }
        let starts = self.starts_of_ranges();
        let Self { words, ranges, .. } = self;
        ranges.par_iter_mut().enumerate().for_each(|(number, range)| {
            range.take(words, starts[number], starts.get(number + 1).copied());
        });
    }

    /// Smallest word of each range.
    fn starts_of_ranges(&mut self) -> Vec<u64> {
        let count = self.ranges.len();
        self.sample.clear();
        let step = (self.words.len() / (count * SAMPLES)).max(1);
        // Without the index: particles of one key are in one range.
        self.sample.extend(self.words.iter().step_by(step).map(|word| key_in(*word) << INDEX_BITS));
        self.sample.sort_unstable();
        let mut starts = vec![0; count];
        for (number, start) in starts.iter_mut().enumerate().skip(1) {
            *start = self.sample[number * self.sample.len() / count];
        }
        starts
    }
}

impl KeyRange {
    /// Takes the words from `start` up to, not including, `end`.
    fn take(&mut self, all: &[u64], start: u64, end: Option<u64>) {
        self.words.clear();
        let last = end.map_or(u64::MAX, |end| end.wrapping_sub(1));
        if end != Some(start) {
            self.words.extend(all.iter().filter(|word| (start..=last).contains(word)));
        }
    }

    /// Sorts them by key. Particles of one key stay in the order in which they are.
    fn sort(&mut self, keys: &impl ParticleKeys) {
        let Self { words, scratch, offsets, .. } = self;
        scratch.resize(words.len(), 0);
        let bits = keys.bits();
        for first_bit in (0..bits).step_by(WORD_KEY_BITS as usize) {
            if first_bit > 0 {
                for word in &mut *words {
                    *word = keys.key(index_in(*word)) >> first_bit << INDEX_BITS | index_in(*word) as u64;
                }
            }
            let bits = WORD_KEY_BITS.min(bits - first_bit);
            let is_one_pass = 1 << bits <= ONE_PASS_KEYS_PER_PARTICLE * words.len() as u64;
            let passes = if is_one_pass { 1 } else { bits.div_ceil(DIGIT_BITS) };
            for pass in 0..passes {
                let [from, to] = [pass, pass + 1].map(|pass| INDEX_BITS + bits * pass / passes);
                radix_pass(words, scratch, from..to, offsets);
                std::mem::swap(words, scratch);
            }
        }
    }

    /// Writes the particles in the order of the words, those of one key in the order of their ids.
    fn write(&mut self, keys: &impl ParticleKeys, ids: &[u64], sorted: SortedSlice) {
        let Self { words, unordered, .. } = self;
        let is_key_in_word = keys.bits() <= WORD_KEY_BITS;
        let count = words.len();
        let (order, sorted_ids, sorted_keys) =
            (&mut sorted.order[..count], &mut sorted.ids[..count], &mut sorted.keys[..count]);
        unordered.clear();
        let mut largest = 0;
        for (offset, word) in words.iter().enumerate() {
            let index = index_in(*word);
            order[offset] = index as u32;
            sorted_ids[offset] = ids[index];
            sorted_keys[offset] = if is_key_in_word { key_in(*word) } else { keys.key(index) };
            // Rare: most particles were sorted in the step before. One comparison of both numbers, since it is hard to predict whether the key
            // is that of the particle before, or the id smaller.
            let key_and_id = u128::from(sorted_keys[offset]) << 64 | u128::from(sorted_ids[offset]);
            if key_and_id < largest && unordered.last().is_none_or(|last| sorted_keys[*last] != sorted_keys[offset]) {
                unordered.push(offset);
            }
            largest = largest.max(key_and_id);
        }
        for offset in unordered {
            let key = sorted_keys[*offset];
            let start = *offset - sorted_keys[..*offset].iter().rev().take_while(|before| **before == key).count();
            let end = *offset + sorted_keys[*offset..].iter().take_while(|after| **after == key).count();
            sort_by_id(&mut sorted_ids[start..end], &mut order[start..end]);
        }
    }
}

/// Sorts the particles of one cell by id.
fn sort_by_id(ids: &mut [u64], order: &mut [u32]) {
    if ids.len() > MAX_INSERTION_SORT {
        let mut particles: Vec<(u64, u32)> = ids.iter().copied().zip(order.iter().copied()).collect();
        particles.sort_unstable();
        for ((id, index), particle) in ids.iter_mut().zip(order).zip(particles) {
            (*id, *index) = particle;
        }
        return;
    }
    for end in 1..ids.len() {
        for at in (1..=end).rev() {
            if ids[at - 1] <= ids[at] {
                break;
            }
            ids.swap(at - 1, at);
            order.swap(at - 1, at);
        }
    }
}

/// Writes the words of consecutive particles, from index `first` on, with the lower bits of their keys.
fn write_words(keys: &impl ParticleKeys, first: usize, words: &mut [u64]) {
    keys.write_keys(first, words);
    for (index, word) in (first as u64..).zip(words) {
        // Shifts out the bits that do not fit.
        *word = *word << INDEX_BITS | index;
    }
}

/// The key in a word.
fn key_in(word: u64) -> u64 {
    word >> INDEX_BITS
}

/// The index of the particle in a word.
fn index_in(word: u64) -> usize {
    (word & ((1 << INDEX_BITS) - 1)) as usize
}

/// One stable counting pass of the radix sort, over some bits of the words.
fn radix_pass(from: &[u64], to: &mut [u64], bits: Range<u32>, offsets: &mut Vec<u32>) {
    offsets.clear();
    offsets.resize(1 << bits.len(), 0);
    let mask = offsets.len() - 1;
    for word in from {
        offsets[(word >> bits.start) as usize & mask] += 1;
    }
    let mut sum = 0;
    for offset in &mut *offsets {
        sum += std::mem::replace(offset, sum);
    }
    for word in from {
        let offset = &mut offsets[(word >> bits.start) as usize & mask];
        to[*offset as usize] = *word;
        *offset += 1;
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::math::random::{Key, Purpose};

    use super::*;

    /// Keys that are given, of up to `bits` bits.
    struct GivenKeys {
        keys: Vec<u64>,
        bits: u32,
    }

    impl ParticleKeys for GivenKeys {
        fn bits(&self) -> u32 {
            self.bits
        }

        fn key(&self, index: usize) -> u64 {
            self.keys[index]
        }

        fn write_keys(&self, first: usize, keys: &mut [u64]) {
            keys.copy_from_slice(&self.keys[first..first + keys.len()]);
        }
    }

    /// The order is the same as that of a standard sort, for any number of threads.
    #[test]
    fn ranges_put_together_are_all_in_order() {
        let random = Key::new(4, "sorting");
        let words: Vec<_> = (0..50_000).map(|index| random.words(index, 0, Purpose::named("key"))).collect();
        // All ids are different.
        let ids: Vec<u64> = (0..).zip(&words).map(|(index, words)| u64::from(words[1]) << 32 | index).collect();
        // Keys longer than a word holds, many more keys than particles, few keys, and a single key: ranges may be empty.
        for bits in [62, 38, 37, 30, 16, 5, 0] {
            let long_key = |words: &[u32; 4]| u64::from(words[0]) << 32 | u64::from(words[2]);
            // Some keys occur more than once even if there are many.
            let keys = words.iter().map(|words| (long_key(words) | 0xfff << 30) & ((1 << bits) - 1)).collect();
            let given = GivenKeys { keys, bits };
            let mut expected: Vec<u32> = (0..50_000).collect();
            expected.sort_by_key(|index| (given.keys[*index as usize], ids[*index as usize]));
            for threads in [1, 2, 7] {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("few threads");
                let mut sorted = SortedParticles::default();
                pool.install(|| SampleSort::default().sort(&given, &ids, &mut sorted));
                assert!(sorted.order == expected, "keys of {bits} bits, {threads} threads");
                assert!(sorted.ids.iter().eq(expected.iter().map(|index| &ids[*index as usize])));
                assert!(sorted.keys.iter().eq(expected.iter().map(|index| &given.keys[*index as usize])));
            }
        }
    }
}
