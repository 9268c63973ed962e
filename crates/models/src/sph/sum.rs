//! Sums over the neighbours of every particle: the one loop that density, forces and whatever a model adds run in.
//!
//! Each particle of a cell goes through the candidates of the cell eight at a time. The first sum notes the batches in which it has
//! neighbours; later ones leave out the others, about half. There is no list of neighbours: rejecting candidates within a batch costs
//! less than storing and fetching the others one by one. A sum depends on who is in the neighbouring cells alone, not on threads.

use bansho_base::{
    math,
    random::{murmur3, uniform},
};
use fearless_simd::{Level, Simd, dispatch, prelude::*};
use rayon::prelude::*;

use super::{
    batch::{BATCH, cut, difference, load, pair, pick, spread, squared},
    cells::Cells,
    stretch::{Group, Stretch},
};
use crate::lanes::{HalfLanes, LANES, Lanes, Real};

/// Particles closer than this share of the support radius count as coincident.
const COINCIDENT: f32 = 1e-6;

/// Where a neighbour is.
#[derive(Clone, Copy, Debug)]
pub struct Pair<R, const D: usize> {
    /// `x_i - x_j`, from the neighbour to the particle.
    pub offset: [R; D],
    /// Its squared length.
    pub distance_squared: R,
}

/// One term of a sum over neighbours, in `D` dimensions, of `OUT` results, from `IN` values of each particle.
pub trait PairTerm<const D: usize, const IN: usize, const OUT: usize>: Sync {
    /// Whether the term has the direction of the offset, and perhaps a pole at distance 0.
    ///
    /// If so, squared distances are held above 0, a particle itself must add nothing by its offset of 0, and two that coincide push each
    /// other in a direction by their birth ids. If not, the sum includes the particle itself, at distance 0.
    const DIRECTED: bool;

    /// Adds to the sums of a particle with the values `own` what a neighbour with the values `other` gives.
    ///
    /// Mark it `#[inline(always)]`, and loop over arrays in place of `map`, whose closure would not become vector code. It is also called for
    /// candidates too far to count, with the squared distance held to that of the support radius: kernels are 0 there, and so must the
    /// term be, to rounding.
    fn add<R: Real>(&self, pair: &Pair<R, D>, own: &[R; IN], other: &[R; IN], sums: &mut [R; OUT]);
}

impl<const D: usize> Cells<D> {
    /// Sums `term` over the neighbours of every particle, those nearer than the support radius.
    ///
    /// `fields` are the values of the particles in sorted order, and so are the results. The same on every machine with fused
    /// multiply-add, for any number of threads and any order in which the particles were given.
    ///
    /// # Panics
    /// If a field does not hold one value a particle.
    pub fn sum<T, const IN: usize, const OUT: usize>(
        &self,
        term: &T,
        fields: [&[f32]; IN],
        results: [&mut Vec<f32>; OUT],
    ) where
        T: PairTerm<D, IN, OUT>,
    {
        let slots = self.slots(fields);
        let (level, fields) = (Level::new(), slots.each_ref().map(Vec::as_slice));
        let results = split(self.stretches(), self.sized(results));
        self.stretches().par_iter().zip(results).for_each(|(stretch, mut results)| {
            let Stretch { groups, starts, hits, crowded, .. } = stretch;
            let around = Around { cells: self, groups, starts, positions: self.positions(), fields };
            dispatch!(level, simd => sum_stretch(simd, term, &around, hits, &mut results));
            if T::DIRECTED {
                around.add_coincident(term, crowded.as_deref(), &mut results);
            }
        });
    }

    /// The same, which also notes who is near whom, so that every later sum is faster.
    pub(super) fn sum_and_note<T, const IN: usize, const OUT: usize>(
        &mut self,
        term: &T,
        fields: [&[f32]; IN],
        results: [&mut Vec<f32>; OUT],
    ) where
        T: PairTerm<D, IN, OUT>,
    {
        let mut stretches = self.take_stretches();
        let slots = self.slots(fields);
        let (level, fields) = (Level::new(), slots.each_ref().map(Vec::as_slice));
        let results = split(&stretches, self.sized(results));
        stretches.par_iter_mut().zip(results).for_each(|(stretch, mut results)| {
            let Stretch { groups, starts, hits, crowded } = stretch;
            let around = Around { cells: self, groups, starts, positions: self.positions(), fields };
            dispatch!(level, simd => note_stretch(simd, term, &around, [hits, crowded.insert(Vec::new())], &mut results));
        });
        self.put_stretches(stretches);
    }

    /// Fields by slot.
    fn slots<const IN: usize>(&self, fields: [&[f32]; IN]) -> [Vec<f32>; IN] {
        assert!(fields.iter().all(|field| field.len() == self.len()), "one value a particle");
        let mut slots: [Vec<f32>; IN] = std::array::from_fn(|_| Vec::new());
        slots
            .par_iter_mut()
            .zip(fields)
            .for_each(|(slots, field)| self.fill_slots(slots, 0.0, |particle| field[particle]));
        slots
    }

    /// Results with room for every particle.
    fn sized<'a, const OUT: usize>(&self, results: [&'a mut Vec<f32>; OUT]) -> [&'a mut [f32]; OUT] {
        results.map(|values| {
            values.resize(self.len(), 0.0);
            values.as_mut_slice()
        })
    }
}

/// The part of each array that belongs to each stretch.
fn split<'a, const OUT: usize>(stretches: &[Stretch], mut arrays: [&'a mut [f32]; OUT]) -> Vec<[&'a mut [f32]; OUT]> {
    let mut part = |stretch: &Stretch| {
        arrays.each_mut().map(|values| {
            let (head, tail) = std::mem::take(values).split_at_mut(stretch.len());
            *values = tail;
            head
        })
    };
    stretches.iter().map(&mut part).collect()
}

/// What the sums of a stretch read: where its candidates are, and positions and fields by slot.
struct Around<'a, const D: usize, const IN: usize> {
    cells: &'a Cells<D>,
    groups: &'a [Group],
    starts: &'a [u32],
    positions: [&'a [f32]; D],
    fields: [&'a [f32]; IN],
}

impl<const D: usize, const IN: usize> Around<'_, D, IN> {
    /// Where a batch without particles begins: the last one.
    fn empty(&self) -> usize {
        self.positions[0].len().saturating_sub(BATCH)
    }

    /// Adds what particles give that coincide with those at the indices `crowded` of the stretch; `None` where nobody has looked.
    fn add_coincident<T: PairTerm<D, IN, OUT>, const OUT: usize>(
        &self,
        term: &T,
        crowded: Option<&[u64]>,
        results: &mut [&mut [f32]; OUT],
    ) {
        let mut index = 0;
        for group in self.groups {
            for slot in group.slot..group.slot + group.particles.len() {
                if crowded.is_none_or(|crowded| crowded.binary_search(&index).is_ok()) {
                    let more = sum_coincident(term, self, group, slot);
                    for k in 0..OUT {
                        results[k][index as usize] += more[k];
                    }
                }
                index += 1;
            }
        }
    }
}

/// Sums for all particles of a stretch, over the batches that their hits name.
#[inline(always)]
fn sum_stretch<S: Simd, T, const D: usize, const IN: usize, const OUT: usize>(
    simd: S,
    term: &T,
    around: &Around<'_, D, IN>,
    hits: &[u64],
    results: &mut [&mut [f32]; OUT],
) where
    T: PairTerm<D, IN, OUT>,
{
    let none = around.empty();
    let mut index = 0;
    for group in around.groups {
        let starts = &around.starts[group.starts.clone()];
        for slot in group.slot..group.slot + group.particles.len() {
            let mut one = One::new(simd, around, slot);
            let mut hit = Hits::new(hits[index], group.bit_shift, starts);
            while let Some(start) = hit.next() {
                one.add(simd, term, [start, hit.next().unwrap_or(none)]);
            }
            for k in 0..OUT {
                results[k][index] = total(one.sums[k]);
            }
            index += 1;
        }
    }
}

/// The same over all batches; notes those that hold neighbours as hits, and particles that coincide with others as crowded.
#[inline(always)]
fn note_stretch<S: Simd, T, const D: usize, const IN: usize, const OUT: usize>(
    simd: S,
    term: &T,
    around: &Around<'_, D, IN>,
    [hits, crowded]: [&mut Vec<u64>; 2],
    results: &mut [&mut [f32]; OUT],
) where
    T: PairTerm<D, IN, OUT>,
{
    let none = around.empty();
    let one = Lanes::splat(simd, 1.0);
    let nearest = one.like(nearest_squared(around.cells.support_radius()));
    let mut index = 0;
    for group in around.groups {
        let starts = &around.starts[group.starts.clone()];
        for slot in group.slot..group.slot + group.particles.len() {
            let mut sum = One::new(simd, around, slot);
            let (mut noted, mut coincident) = (0, one.like(0.0));
            for (number, starts) in starts.chunks(2).enumerate() {
                let start = starts[0] as usize;
                let squared = sum.add(simd, term, [start, starts.get(1).map_or(none, |start| *start as usize)]);
                coincident += squared.choose(nearest, one, one.like(0.0));
                let (farthest, halves) = (HalfLanes::splat(simd, sum.farthest), squared.split());
                noted |= u64::from(halves.0.simd_lt(farthest).any_true()) << ((2 * number) >> group.bit_shift);
                noted |= u64::from(halves.1.simd_lt(farthest).any_true()) << ((2 * number + 1) >> group.bit_shift);
            }
            hits[index] = noted;
            if total(coincident) > 1.5 {
                crowded.push(index as u64);
            }
            for k in 0..OUT {
                results[k][index] = total(sum.sums[k]);
            }
            index += 1;
        }
    }
}

/// The batches that may hold neighbours of a particle.
struct Hits<'a> {
    bits: u64,
    bit_shift: u32,
    starts: &'a [u32],
    /// Batches of the present bit that are left.
    rest: &'a [u32],
}

impl<'a> Hits<'a> {
    #[inline(always)]
    fn new(bits: u64, bit_shift: u32, starts: &'a [u32]) -> Self {
        Self { bits, bit_shift, starts, rest: &[] }
    }

    /// Where the next one begins.
    #[inline(always)]
    fn next(&mut self) -> Option<usize> {
        if self.rest.is_empty() {
            if self.bits == 0 {
                return None;
            }
            let first = (self.bits.trailing_zeros() as usize) << self.bit_shift;
            self.bits &= self.bits - 1;
            self.rest = &self.starts[first..(first + (1 << self.bit_shift)).min(self.starts.len())];
        }
        let (start, rest) = self.rest.split_first()?;
        self.rest = rest;
        Some(*start as usize)
    }
}

/// The sums of one particle as they grow.
struct One<'a, S: Simd, const D: usize, const IN: usize, const OUT: usize> {
    positions: [&'a [f32]; D],
    fields: [&'a [f32]; IN],
    position: [HalfLanes<S>; D],
    own: [HalfLanes<S>; IN],
    /// Squares of the support radius, and of the distance below which particles coincide.
    farthest: f32,
    nearest: f32,
    sums: [Lanes<S>; OUT],
}

impl<'a, S: Simd, const D: usize, const IN: usize, const OUT: usize> One<'a, S, D, IN, OUT> {
    #[inline(always)]
    fn new(simd: S, around: &Around<'a, D, IN>, slot: usize) -> Self {
        let support = around.cells.support_radius();
        let slots = around.positions[0].len();
        let (positions, fields) = (cut(around.positions, slots), cut(around.fields, slots));
        Self {
            position: spread(simd, pick(&positions, slot)),
            own: spread(simd, pick(&fields, slot)),
            positions,
            fields,
            farthest: support * support,
            nearest: nearest_squared(support),
            sums: [Lanes::splat(simd, 0.0); OUT],
        }
    }

    /// Adds the batches of candidates that begin at two slots, and gives their squared distances.
    ///
    /// Two at a time, since each step of one waits for the last: a processor's queue is too short to find the next batch by itself.
    #[inline(always)]
    fn add<T: PairTerm<D, IN, OUT>>(&mut self, simd: S, term: &T, [one, two]: [usize; 2]) -> Lanes<S> {
        let positions = pair(&load(simd, &self.positions, one), &load(simd, &self.positions, two));
        let others = pair(&load(simd, &self.fields, one), &load(simd, &self.fields, two));
        let offset = difference(&pair(&self.position, &self.position), &positions);
        let squared = squared(&offset);
        let mut distance_squared = squared.least(squared.like(self.farthest));
        if T::DIRECTED {
            distance_squared = distance_squared.greatest(squared.like(self.nearest));
        }
        term.add(&Pair { offset, distance_squared }, &pair(&self.own, &self.own), &others, &mut self.sums);
        squared
    }
}

/// Squared distance below which particles coincide.
fn nearest_squared(support_radius: f32) -> f32 {
    (support_radius * COINCIDENT) * (support_radius * COINCIDENT)
}

/// Sum of all lanes, halves first, whatever the vector width.
#[inline(always)]
fn total<S: Simd>(lanes: Lanes<S>) -> f32 {
    let mut parts = [0.0; LANES];
    lanes.store_slice(&mut parts);
    for half in [8, 4, 2, 1] {
        for lane in 0..half {
            parts[lane] += parts[lane + half];
        }
    }
    parts[0]
}

/// What others at the place of the particle in a slot add, each pushed aside by a hair in a direction that both agree on.
#[inline(never)]
fn sum_coincident<T, const D: usize, const IN: usize, const OUT: usize>(
    term: &T,
    around: &Around<'_, D, IN>,
    group: &Group,
    slot: usize,
) -> [f32; OUT]
where
    T: PairTerm<D, IN, OUT>,
{
    let support = around.cells.support_radius();
    let id = |slot: usize| around.cells.ids()[around.cells.particle_in(slot)];
    let (position, values) = (pick(&around.positions, slot), pick(&around.fields, slot));
    let starts = &around.starts[group.starts.clone()];
    let mut sums = [0.0; OUT];
    for other in starts.iter().flat_map(|start| (*start as usize..).take(BATCH)).filter(|other| *other != slot) {
        let between = difference(&position, &pick(&around.positions, other));
        if squared(&between) < nearest_squared(support) {
            let offset = direction(id(slot), id(other)).map(|component: f32| component * support * COINCIDENT);
            let pair = Pair { offset, distance_squared: squared(&offset) };
            term.add(&pair, &values, &pick(&around.fields, other), &mut sums);
        }
    }
    sums
}

/// A unit vector from particle `other` to particle `own`, opposite when they change places.
fn direction<const D: usize>(own: u64, other: u64) -> [f32; D] {
    let (low, high) = (own.min(other), own.max(other));
    let mut bytes = [0; 16];
    bytes[..8].copy_from_slice(&low.to_le_bytes());
    bytes[8..].copy_from_slice(&high.to_le_bytes());
    let sign = if own < other { 1.0 } else { -1.0 };
    let height = if D == 3 { 2.0 * uniform(murmur3(&bytes, 1)) - 1.0 } else { 0.0 };
    let (sine, cosine) = math::sin_cos(std::f64::consts::TAU * f64::from(uniform(murmur3(&bytes, 0))));
    let across = (1.0 - height * height).sqrt();
    let unit = [across * cosine as f32, across * sine as f32, height];
    std::array::from_fn(|c| sign * unit[c])
}
