//! Sums over the neighbours of every particle: the one loop that density, forces and whatever a model adds run in.
//!
//! Each particle of a cell goes through the candidates of the cell eight at a time, leaving out batches in which it has no neighbour. There is no list of neighbours: rejecting
//! candidates within a batch costs less than storing and fetching the others one by one. A sum depends on who is in the
//! neighbouring cells alone, not on threads.

use bansho_base::{
    math,
    random::{murmur3, uniform},
};
use fearless_simd::{Level, Simd, dispatch, prelude::*};
use rayon::prelude::*;

use super::{
    batch::{BATCH, cut, difference, load, pick, spread, squared},
    cells::Cells,
    stretch::{Group, Stretch},
};
use crate::lanes::{HalfLanes, Real};

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
    /// Whether the term has a direction or a pole at distance 0.
    ///
    /// If so, a particle is not its own neighbour, and two that coincide are given a direction by their birth ids. If not, the sum includes
    /// the particle itself, at distance 0.
    const DIRECTED: bool;

    /// What a neighbour with the values `other` adds to the sums of a particle with the values `own`.
    ///
    /// Mark it `#[inline(always)]`, and loop over arrays in place of `map`, whose closure would not become vector code. It is also called for candidates too far to count, with the squared distance held to that of the
    /// support radius; such a result is multiplied by 0, so it must be finite.
    fn term<R: Real>(&self, pair: &Pair<R, D>, own: &[R; IN], other: &[R; IN]) -> [R; OUT];
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
        assert!(fields.iter().all(|field| field.len() == self.len()), "one value a particle");
        let results = results.map(|values| {
            values.resize(self.len(), 0.0);
            values.as_mut_slice()
        });
        let mut slots: [Vec<f32>; IN] = std::array::from_fn(|_| Vec::new());
        slots
            .par_iter_mut()
            .zip(fields)
            .for_each(|(slots, field)| self.fill_slots(slots, 0.0, |particle| field[particle]));
        let (level, fields) = (Level::new(), slots.each_ref().map(Vec::as_slice));
        let tasks = self.stretches().iter().zip(split(self.stretches(), results)).collect::<Vec<_>>();
        tasks.into_par_iter().for_each(|(stretch, results)| {
            let around = Around { cells: self, stretch, positions: self.positions(), fields };
            dispatch!(level, simd => sum_stretch(simd, term, &around, results));
        });
    }
}

/// The part of each array that belongs to each stretch.
fn split<'a, const OUT: usize>(
    stretches: &[Stretch],
    mut arrays: [&'a mut [f32]; OUT],
) -> impl Iterator<Item = [&'a mut [f32]; OUT]> {
    stretches.iter().map(move |stretch| {
        arrays.each_mut().map(|values| {
            let (head, tail) = std::mem::take(values).split_at_mut(stretch.len());
            *values = tail;
            head
        })
    })
}

/// What the sums of a stretch read: where its candidates are, and positions and fields by slot.
struct Around<'a, const D: usize, const IN: usize> {
    cells: &'a Cells<D>,
    stretch: &'a Stretch,
    positions: [&'a [f32]; D],
    fields: [&'a [f32]; IN],
}

/// Sums for all particles of a stretch.
#[inline(always)]
fn sum_stretch<S: Simd, T, const D: usize, const IN: usize, const OUT: usize>(
    simd: S,
    term: &T,
    around: &Around<'_, D, IN>,
    results: [&mut [f32]; OUT],
) where
    T: PairTerm<D, IN, OUT>,
{
    let mut index = 0;
    for group in &around.stretch.groups {
        for slot in group.slot..group.slot + group.particles.len() {
            let (mut sums, coincident) = sum_one(simd, term, around, group, slot, around.stretch.hits[index]);
            if T::DIRECTED && coincident > 1.5 {
                let more = sum_coincident(term, around, group, slot);
                for k in 0..OUT {
                    sums[k] += more[k];
                }
            }
            for k in 0..OUT {
                results[k][index] = sums[k];
            }
            index += 1;
        }
    }
}

/// Sums for the particle in a slot, and how many candidates coincide with it, itself included (counted for directed terms only).
#[inline(always)]
fn sum_one<S: Simd, T, const D: usize, const IN: usize, const OUT: usize>(
    simd: S,
    term: &T,
    around: &Around<'_, D, IN>,
    group: &Group,
    slot: usize,
    mut hits: u64,
) -> ([f32; OUT], f32)
where
    T: PairTerm<D, IN, OUT>,
{
    let (zero, one) = (HalfLanes::splat(simd, 0.0), HalfLanes::splat(simd, 1.0));
    let support = around.cells.support_radius();
    let (farthest, nearest) = (zero.like(support * support), zero.like(nearest_squared(support)));
    let slots = around.positions[0].len();
    let (positions, fields) = (cut(around.positions, slots), cut(around.fields, slots));
    let (position, own) = (spread(simd, pick(&positions, slot)), spread(simd, pick(&fields, slot)));
    let (mut sums, mut coincident) = ([zero; OUT], zero);
    let starts = &around.stretch.starts[group.starts.clone()];
    while hits != 0 {
        let first = (hits.trailing_zeros() as usize) << group.bit_shift;
        hits &= hits - 1;
        for start in &starts[first..(first + (1 << group.bit_shift)).min(starts.len())] {
            let start = *start as usize;
            let offset = difference(&position, &load(simd, &positions, start));
            let squared = squared(&offset);
            let mut counts = squared.choose(farthest, one, zero);
            let mut distance_squared = squared.least(farthest);
            if T::DIRECTED {
                let same = squared.choose(nearest, one, zero);
                coincident += same;
                counts -= same;
                distance_squared = distance_squared.greatest(nearest);
            }
            let terms = term.term(&Pair { offset, distance_squared }, &own, &load(simd, &fields, start));
            for k in 0..OUT {
                sums[k] = terms[k].fused(counts, sums[k]);
            }
        }
    }
    let mut totals = [0.0; OUT];
    for k in 0..OUT {
        totals[k] = total(sums[k]);
    }
    (totals, total(coincident))
}

/// Squared distance below which particles coincide.
fn nearest_squared(support_radius: f32) -> f32 {
    (support_radius * COINCIDENT) * (support_radius * COINCIDENT)
}

/// Sum of a batch, halves first, whatever the vector width.
#[inline(always)]
fn total<S: Simd>(batch: HalfLanes<S>) -> f32 {
    let mut parts = [0.0; BATCH];
    batch.store_slice(&mut parts);
    for half in [4, 2, 1] {
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
    let starts = &around.stretch.starts[group.starts.clone()];
    let mut sums = [0.0; OUT];
    for other in starts.iter().flat_map(|start| (*start as usize..).take(BATCH)).filter(|other| *other != slot) {
        let between = difference(&position, &pick(&around.positions, other));
        if squared(&between) < nearest_squared(support) {
            let offset = direction(id(slot), id(other)).map(|component: f32| component * support * COINCIDENT);
            let pair = Pair { offset, distance_squared: squared(&offset) };
            let terms = term.term(&pair, &values, &pick(&around.fields, other));
            sums = std::array::from_fn(|k| sums[k] + terms[k]);
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
