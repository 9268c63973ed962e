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
    batch::{
        BATCH, Task, batch_starts, batches_per_bit, cut, difference, farthest_squared, load, pick, spread, squared,
    },
    cells::{Cells, Run},
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
        let (level, slots) = (Level::new(), slots.each_ref().map(Vec::as_slice));
        Task::all(self, results).into_par_iter().for_each_init(Vec::new, |starts, mut task| {
            self.visit(task.cells.clone(), |own, runs| {
                let results = task.take(own.particles.len());
                batch_starts(runs, starts);
                let around = Around { cells: self, positions: self.positions(), fields: slots, runs, starts };
                dispatch!(level, simd => sum_cell(simd, term, &around, &own, results));
            });
        });
    }
}

/// What the sums of a cell read: positions and fields by slot, and where in them its candidates are.
struct Around<'a, const D: usize, const IN: usize> {
    cells: &'a Cells<D>,
    positions: [&'a [f32]; D],
    fields: [&'a [f32]; IN],
    runs: &'a [Run],
    starts: &'a [usize],
}

/// Sums for all particles of a cell.
#[inline(always)]
fn sum_cell<S: Simd, T, const D: usize, const IN: usize, const OUT: usize>(
    simd: S,
    term: &T,
    around: &Around<'_, D, IN>,
    own: &Run,
    results: [&mut [f32]; OUT],
) where
    T: PairTerm<D, IN, OUT>,
{
    let hits = &around.cells.hits()[own.particles.clone()];
    for (number, hits) in hits.iter().enumerate() {
        let (mut sums, coincident) = sum_one(simd, term, around, own.slot + number, *hits);
        if T::DIRECTED && coincident > 1.5 {
            let more = sum_coincident(term, around, own, number);
            for k in 0..OUT {
                sums[k] += more[k];
            }
        }
        for k in 0..OUT {
            results[k][number] = sums[k];
        }
    }
}

/// Sums for the particle in a slot, and how many candidates coincide with it, itself included (counted for directed terms only).
#[inline(always)]
fn sum_one<S: Simd, T, const D: usize, const IN: usize, const OUT: usize>(
    simd: S,
    term: &T,
    around: &Around<'_, D, IN>,
    slot: usize,
    mut hits: u64,
) -> ([f32; OUT], f32)
where
    T: PairTerm<D, IN, OUT>,
{
    let (zero, one) = (HalfLanes::splat(simd, 0.0), HalfLanes::splat(simd, 1.0));
    let farthest = zero.like(farthest_squared(around.cells));
    let nearest = zero.like(nearest_squared(around.cells.support_radius()));
    let slots = around.positions[0].len();
    let (positions, fields) = (cut(around.positions, slots), cut(around.fields, slots));
    let (position, own) = (spread(simd, pick(&positions, slot)), spread(simd, pick(&fields, slot)));
    let (mut sums, mut coincident) = ([zero; OUT], zero);
    let per_bit = batches_per_bit(around.starts.len());
    while hits != 0 {
        let first = hits.trailing_zeros() as usize * per_bit;
        hits &= hits - 1;
        for start in &around.starts[first..(first + per_bit).min(around.starts.len())] {
            let offset = difference(&position, &load(simd, &positions, *start));
            let squared = squared(&offset);
            let mut counts = squared.choose(farthest, one, zero);
            let mut distance_squared = squared.least(farthest);
            if T::DIRECTED {
                let same = squared.choose(nearest, one, zero);
                coincident += same;
                counts = counts - same;
                distance_squared = distance_squared.greatest(nearest);
            }
            let terms = term.term(&Pair { offset, distance_squared }, &own, &load(simd, &fields, *start));
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

/// What others at the place of the particle that is `number` in its cell add, each pushed aside by a hair in a direction that both
/// agree on.
#[inline(never)]
fn sum_coincident<T, const D: usize, const IN: usize, const OUT: usize>(
    term: &T,
    around: &Around<'_, D, IN>,
    own: &Run,
    number: usize,
) -> [f32; OUT]
where
    T: PairTerm<D, IN, OUT>,
{
    let (support, ids) = (around.cells.support_radius(), around.cells.ids());
    let (id, slot) = (ids[own.particles.start + number], own.slot + number);
    let (position, values) = (pick(&around.positions, slot), pick(&around.fields, slot));
    let mut sums = [0.0; OUT];
    let candidates = around.runs.iter().flat_map(|run| run.particles.clone().zip(run.slot..));
    for (other, other_slot) in candidates.filter(|candidate| candidate.1 != slot) {
        let between = difference(&position, &pick(&around.positions, other_slot));
        if squared(&between) < nearest_squared(support) {
            let offset = direction(id, ids[other]).map(|component: f32| component * support * COINCIDENT);
            let pair = Pair { offset, distance_squared: squared(&offset) };
            let terms = term.term(&pair, &values, &pick(&around.fields, other_slot));
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
