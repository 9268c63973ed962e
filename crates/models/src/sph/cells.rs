//! Particles sorted into cells of the support radius, of which only those that hold some exist.
//!
//! There is no grid: cells are a sorted list, so memory grows with the particles alone, however far they spread. Cells follow each
//! other along x, so three neighbours in a row are one run of particles, and the neighbours of a cell are 3 runs in the plane and
//! 9 in space.

use std::ops::Range;

/// Cells further than this from the origin, in cells, are taken together; so a key of three axes fits 64 bits.
const FARTHEST: i32 = 1 << 19;
/// Cells are this much wider than the support radius, so that rounding never puts two neighbours two cells apart.
const MARGIN: f32 = 1.001;
/// Bits sorted by in one pass.
const DIGIT_BITS: u32 = 11;

/// Particles in cells of one support radius; the order they were given in does not matter.
#[derive(Clone, Debug)]
pub struct Cells<const D: usize> {
    support_radius: f32,
    keys: Keys<D>,
    /// For each sorted slot the index it was given at.
    order: Vec<u32>,
    ids: Vec<u64>,
    positions: [Vec<f32>; D],
    occupied: Vec<Cell>,
}

/// A cell that holds particles: its key and its first particle. The last of the list is a sentinel behind all.
#[derive(Clone, Copy, Debug)]
struct Cell {
    key: u64,
    start: u32,
}

/// How coordinates of cells become keys that sort by the last axis first and by x last.
#[derive(Clone, Copy, Debug)]
struct Keys<const D: usize> {
    lower: [i32; D],
    shift: [u32; D],
    bits: u32,
}

impl<const D: usize> Keys<D> {
    /// For cells from `lower` to `upper` and one more on each side.
    fn new(lower: [i32; D], upper: [i32; D]) -> Self {
        let mut shift = [0; D];
        let mut bits = 0;
        for c in 0..D {
            shift[c] = bits;
            bits += u32::BITS - ((upper[c] - lower[c]) as u32 + 2).leading_zeros();
        }
        Self { lower: lower.map(|cell| cell - 1), shift, bits }
    }

    fn key(&self, cell: [i32; D]) -> u64 {
        (0..D).fold(0, |key, c| key | ((cell[c] - self.lower[c]) as u64) << self.shift[c])
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
        Self { support_radius, keys, order: Vec::new(), ids: Vec::new(), positions: none(), occupied: Vec::new() }
    }

    /// The distance from which on particles do not see each other.
    #[must_use]
    pub fn support_radius(&self) -> f32 {
        self.support_radius
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

    /// Sorts particles by cell, then by birth id, and remembers where they are. [`Cells::reorder`] then brings arrays into that order.
    ///
    /// # Panics
    /// If there are more than 2^32 - 1 of them, or positions and ids are not equally many.
    pub fn assign(&mut self, positions: [&[f32]; D], ids: &[u64]) {
        assert!(u32::try_from(ids.len()).is_ok(), "particles are counted in 32 bits");
        assert!(positions.iter().all(|component| component.len() == ids.len()), "one position an id");
        let scale = 1.0 / (self.support_radius * MARGIN);
        let cell = |value: f32| ((value * scale).floor() as i32).clamp(-FARTHEST, FARTHEST);
        let bounds = positions.map(|component| {
            component
                .iter()
                .fold((i32::MAX, i32::MIN), |(low, high), value| (low.min(cell(*value)), high.max(cell(*value))))
        });
        if ids.is_empty() {
            self.order.clear();
            self.occupied.clear();
        } else {
            self.keys = Keys::new(bounds.map(|bound| bound.0), bounds.map(|bound| bound.1));
            let keys = self.keys;
            let key = |i: usize| keys.key(positions.map(|component| cell(component[i])));
            self.sort((0..ids.len()).map(key).collect(), ids);
        }
        self.positions = positions.map(|component| self.order.iter().map(|i| component[*i as usize]).collect());
        self.ids = self.order.iter().map(|i| ids[*i as usize]).collect();
    }

    /// Sorts by key, then by id, and lists the cells.
    fn sort(&mut self, keys: Vec<u64>, ids: &[u64]) {
        let mut sorted: Vec<(u64, u32)> = keys.into_iter().zip(0..).collect();
        let mut spare = sorted.clone();
        for shift in (0..self.keys.bits).step_by(DIGIT_BITS as usize) {
            counting_pass(&sorted, &mut spare, shift);
            std::mem::swap(&mut sorted, &mut spare);
        }
        self.occupied.clear();
        let mut start = 0;
        for cell in sorted.chunk_by_mut(|a, b| a.0 == b.0) {
            cell.sort_unstable_by_key(|entry| ids[entry.1 as usize]);
            self.occupied.push(Cell { key: cell[0].0, start });
            start += cell.len() as u32;
        }
        self.occupied.push(Cell { key: u64::MAX, start });
        self.order = sorted.into_iter().map(|entry| entry.1).collect();
    }

    /// Brings values, given in the order of [`Cells::assign`], into the sorted order.
    ///
    /// # Panics
    /// If they are not one a particle.
    pub fn reorder<T: Copy>(&self, values: &mut Vec<T>) {
        assert_eq!(values.len(), self.order.len(), "one value a particle");
        *values = self.order.iter().map(|i| values[*i as usize]).collect();
    }

    /// Birth ids in sorted order.
    pub(super) fn ids(&self) -> &[u64] {
        &self.ids
    }

    /// Positions in sorted order, one array a component.
    pub(super) fn positions(&self) -> [&[f32]; D] {
        self.positions.each_ref().map(Vec::as_slice)
    }

    /// Number of cells that hold particles.
    pub(super) fn count(&self) -> usize {
        self.occupied.len().saturating_sub(1)
    }

    /// Particles of a range of cells.
    pub(super) fn particles(&self, cells: Range<usize>) -> Range<usize> {
        self.occupied[cells.start].start as usize..self.occupied[cells.end].start as usize
    }

    /// For each of a range of cells in turn: its particles, and the runs of particles in it and its neighbours.
    pub(super) fn visit(&self, cells: Range<usize>, mut visitor: impl FnMut(Range<usize>, &[Range<usize>])) {
        let Some(first) = self.occupied.get(cells.start) else { return };
        // Where each neighbouring row has got to; rows move on with the cells, so all searching is one pass.
        let from = |row: u64| (row, self.occupied.partition_point(|cell| cell.key < first.key.wrapping_add(row) - 1));
        let mut rows: Vec<(u64, usize)> = self.keys.rows().map(from).collect();
        let mut runs = vec![0..0; rows.len()];
        for index in cells {
            let key = self.occupied[index].key;
            for (run, (row, cursor)) in runs.iter_mut().zip(&mut rows) {
                let centre = key.wrapping_add(*row);
                while self.occupied[*cursor].key < centre - 1 {
                    *cursor += 1;
                }
                let mut end = *cursor;
                while self.occupied[end].key <= centre + 1 {
                    end += 1;
                }
                *run = self.occupied[*cursor].start as usize..self.occupied[end].start as usize;
            }
            visitor(self.particles(index..index + 1), &runs);
        }
    }
}

/// One stable pass of a radix sort, over the digit that begins at bit `shift`.
fn counting_pass(from: &[(u64, u32)], to: &mut [(u64, u32)], shift: u32) {
    const DIGITS: usize = 1 << DIGIT_BITS;
    let digit = |key: u64| (key >> shift) as usize % DIGITS;
    let mut places = [0_u32; DIGITS];
    from.iter().for_each(|entry| places[digit(entry.0)] += 1);
    let mut sum = 0;
    for place in &mut places {
        sum += std::mem::replace(place, sum);
    }
    for entry in from {
        let place = &mut places[digit(entry.0)];
        to[*place as usize] = *entry;
        *place += 1;
    }
}
