//! Particles sorted into cells of the support radius, of which only those that hold some exist.
//!
//! There is no grid: cells are a sorted list, so memory grows with the particles alone, however far they spread. Cells follow each
//! other along x, so three neighbours in a row are one run of particles, and the neighbours of a cell are 3 runs in the plane and
//! 9 in space.

use std::ops::Range;

use fearless_simd::{Level, dispatch};
use rayon::prelude::*;

use super::{batch::BATCH, stretch::Stretch};

/// Cells further than this from the origin, in cells, are taken together; so a key of three axes fits 64 bits.
const FARTHEST: i32 = 1 << 19;
/// Cells are this much wider than the support radius, so that rounding never puts two neighbours two cells apart.
const MARGIN: f32 = 1.001;
/// Where particles are put that are farther away or nowhere; squares of such distances are still finite.
pub(super) const BEYOND: f32 = 1e12;
/// Particles that one task takes at least.
pub(super) const AT_ONCE: usize = 4096;
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
    /// Positions by slot.
    positions: [Vec<f32>; D],
    occupied: Vec<Cell>,
    stretches: Vec<Stretch>,
}

/// Particles that follow each other in slots: those of up to three cells of a row.
#[derive(Clone, Debug, Default)]
pub(super) struct Run {
    pub(super) particles: Range<usize>,
    /// Slot of the first.
    pub(super) slot: usize,
}

/// A cell that holds particles: its key, its first particle and the slot of that. The last of the list is a sentinel behind all.
#[derive(Clone, Copy, Debug)]
struct Cell {
    key: u64,
    start: u32,
    slot: usize,
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
        let (order, ids, occupied, stretches) = Default::default();
        Self { support_radius, keys, order, ids, positions: none(), occupied, stretches }
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

    /// Sorts particles by cell, then by birth id, and remembers where they are. [`Cells::reorder`] then brings arrays into that order.
    ///
    /// # Panics
    /// If there are more than 2^28 of them, or positions and ids are not equally many.
    pub fn assign(&mut self, positions: [&[f32]; D], ids: &[u64]) {
        assert!(ids.len() <= 1 << 28, "slots are counted in 32 bits");
        assert!(positions.iter().all(|component| component.len() == ids.len()), "one position an id");
        let scale = 1.0 / (self.support_radius * MARGIN);
        let mut coordinates: [Vec<i32>; D] = std::array::from_fn(|_| Vec::new());
        coordinates.par_iter_mut().zip(positions).for_each(|(cells, component)| {
            dispatch!(Level::new(), _simd => cells_along(component, scale, cells));
        });
        if ids.is_empty() {
            self.order.clear();
            self.occupied.clear();
        } else {
            let bound =
                |c: usize, pick: fn(i32, i32) -> i32| coordinates[c].iter().copied().fold(coordinates[c][0], pick);
            self.keys =
                Keys::new(std::array::from_fn(|c| bound(c, i32::min)), std::array::from_fn(|c| bound(c, i32::max)));
            self.sort(&coordinates, ids);
        }
        let within = |x: f32| if x.abs() < BEYOND { x } else { BEYOND };
        let mut slots = std::mem::replace(&mut self.positions, std::array::from_fn(|_| Vec::new()));
        slots.par_iter_mut().zip(positions).for_each(|(to, from)| {
            self.fill_slots(to, -BEYOND, |particle| within(from[self.order[particle] as usize]));
        });
        self.positions = slots;
        self.ids.clear();
        self.ids.par_extend(self.order.par_iter().with_min_len(AT_ONCE).map(|i| ids[*i as usize]));
        let mut stretches = self.take_stretches();
        self.find_stretches(&mut stretches);
        self.put_stretches(stretches);
    }

    /// Sorts by key, then by id, and lists the cells.
    fn sort(&mut self, coordinates: &[Vec<i32>; D], ids: &[u64]) {
        let keys = self.keys;
        let entry = |i: usize| {
            let mut cell = [0; D];
            for c in 0..D {
                cell[c] = coordinates[c][i];
            }
            (keys.key(cell), i as u32)
        };
        let mut sorted: Vec<(u64, u32)> = (0..ids.len()).into_par_iter().with_min_len(AT_ONCE).map(entry).collect();
        let mut spare = sorted.clone();
        for shift in (0..keys.bits).step_by(DIGIT_BITS as usize) {
            counting_pass(&sorted, &mut spare, shift);
            std::mem::swap(&mut sorted, &mut spare);
        }
        let by_id = |cell: &mut [(u64, u32)]| cell.sort_unstable_by_key(|entry| ids[entry.1 as usize]);
        sorted.par_chunk_by_mut(|a, b| a.0 == b.0).for_each(by_id);
        self.list(&sorted);
        self.order.clear();
        self.order.par_extend(sorted.par_iter().with_min_len(AT_ONCE).map(|entry| entry.1));
    }

    /// Lists the cells of sorted keys.
    fn list(&mut self, sorted: &[(u64, u32)]) {
        self.occupied.clear();
        let (mut start, mut slot, mut row) = (0, 0, self.keys.row(sorted[0].0));
        for cell in sorted.chunk_by(|a, b| a.0 == b.0) {
            let key = cell[0].0;
            if self.keys.row(key) != row {
                (slot, row) = (slot + BATCH, self.keys.row(key));
            }
            self.occupied.push(Cell { key, start, slot });
            (start, slot) = (start + cell.len() as u32, slot + cell.len());
        }
        self.occupied.push(Cell { key: u64::MAX, start, slot: slot + BATCH });
    }

    /// Brings values, given in the order of [`Cells::assign`], into the sorted order.
    ///
    /// # Panics
    /// If they are not one a particle.
    pub fn reorder<T: Copy + Send + Sync>(&self, values: &mut Vec<T>) {
        assert_eq!(values.len(), self.order.len(), "one value a particle");
        *values = self.order.par_iter().with_min_len(AT_ONCE).map(|i| values[*i as usize]).collect();
    }

    /// Birth ids in sorted order.
    pub(super) fn ids(&self) -> &[u64] {
        &self.ids
    }

    /// Positions by slot, one array a component.
    pub(super) fn positions(&self) -> [&[f32]; D] {
        self.positions.each_ref().map(Vec::as_slice)
    }

    /// Puts the value of each particle into its slot and `empty` into the others.
    pub(super) fn fill_slots(&self, slots: &mut Vec<f32>, empty: f32, value: impl Fn(usize) -> f32) {
        slots.clear();
        for pair in self.occupied.windows(2) {
            slots.extend((pair[0].start as usize..pair[1].start as usize).map(&value));
            slots.resize(pair[1].slot, empty);
        }
    }

    /// All cells, in stretches.
    pub(super) fn stretches(&self) -> &[Stretch] {
        &self.stretches
    }

    /// The stretches, to be put back.
    pub(super) fn take_stretches(&mut self) -> Vec<Stretch> {
        std::mem::take(&mut self.stretches)
    }

    pub(super) fn put_stretches(&mut self, stretches: Vec<Stretch>) {
        self.stretches = stretches;
    }

    /// The particle in a slot that is not empty.
    pub(super) fn particle_in(&self, slot: usize) -> usize {
        let cell = self.occupied[self.occupied.partition_point(|cell| cell.slot <= slot) - 1];
        cell.start as usize + slot - cell.slot
    }

    /// Number of cells that hold particles.
    pub(super) fn count(&self) -> usize {
        self.occupied.len().saturating_sub(1)
    }

    /// Particles of a range of cells.
    pub(super) fn particles(&self, cells: Range<usize>) -> Range<usize> {
        self.occupied[cells.start].start as usize..self.occupied[cells.end].start as usize
    }

    /// For each of a range of cells in turn: its particles, and the runs of its candidates.
    pub(super) fn visit(&self, cells: Range<usize>, mut visitor: impl FnMut(Run, &[Run])) {
        let Some(first) = self.occupied.get(cells.start) else { return };
        // Where each neighbouring row has got to; rows move on with the cells, so all searching is one pass.
        let from = |row: u64| (row, self.occupied.partition_point(|cell| cell.key < first.key.wrapping_add(row) - 1));
        let mut rows: Vec<(u64, usize)> = self.keys.rows().map(from).collect();
        let mut runs = vec![Run::default(); rows.len()];
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
                *run = Run { particles: self.particles(*cursor..end), slot: self.occupied[*cursor].slot };
            }
            let own = Run { particles: self.particles(index..index + 1), slot: self.occupied[index].slot };
            visitor(own, &runs);
        }
    }
}

/// The cells of coordinates, `scale` cells a unit. No `floor`: where the processor lacks it that is a call.
#[inline(always)]
fn cells_along(component: &[f32], scale: f32, cells: &mut Vec<i32>) {
    let farthest = FARTHEST as f32;
    cells.resize(component.len(), 0);
    for (cell, value) in cells.iter_mut().zip(component) {
        let place = (value * scale).clamp(-farthest, farthest);
        let whole = place as i32;
        *cell = whole - i32::from(whole as f32 > place);
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
