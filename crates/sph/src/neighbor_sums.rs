//! Sums over the neighbours of every particle: the one loop that density, forces and whatever a model adds run in.
//!
//! Eight particles that lie beside each other go through their common candidates together, one candidate at a time: each has a lane of a
//! vector to itself, so nothing waits and nothing is added up across lanes. A sum depends on who is near alone, not on threads.

use bansho_base::{
    math,
    math::{
        random::{murmur3, uniform},
        simd::{HalfLanes, Real},
    },
};

use super::{
    cells::Cells,
    neighbor_groups::{Group, GroupBatch},
};
use crate::neighbor_groups::{BATCH, length_squared, load, splat_all, subtract, truncate_all, values_at};
use fearless_simd::{Level, Simd, dispatch, prelude::*};
use rayon::prelude::*;

/// Particles closer than this share of the support radius count as coincident.
const COINCIDENCE_RADIUS: f32 = 1e-6;

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
        assert!(fields.iter().all(|field| field.len() == self.len()), "one value a particle");
        let level = Level::new();
        let results = results.map(|values| {
            values.resize(self.len(), 0.0);
            values.as_mut_slice()
        });
        let inputs = SumInputs { cells: self, positions: self.positions(), fields };
        let batches = self.batches().par_iter().with_max_len(1);
        batches.zip(split(self.batches(), results)).for_each(|(batch, mut results)| {
            dispatch!(level, simd => sum_batch(simd, term, &inputs, batch, &mut results));
        });
    }
}

/// The part of each array that belongs to each stretch.
fn split<'a, const OUT: usize>(batches: &[GroupBatch], mut arrays: [&'a mut [f32]; OUT]) -> Vec<[&'a mut [f32]; OUT]> {
    let mut slice_of = |batch: &GroupBatch| {
        arrays.each_mut().map(|values| {
            let (head, tail) = std::mem::take(values).split_at_mut(batch.particles().len());
            *values = tail;
            head
        })
    };
    batches.iter().map(&mut slice_of).collect()
}

/// What sums read: positions and fields in sorted order.
struct SumInputs<'a, const D: usize, const IN: usize> {
    cells: &'a Cells<D>,
    positions: [&'a [f32]; D],
    fields: [&'a [f32]; IN],
}

/// Sums for all particles of a stretch.
#[inline(always)]
fn sum_batch<S: Simd, T, const D: usize, const IN: usize, const OUT: usize>(
    simd: S,
    term: &T,
    inputs: &SumInputs<'_, D, IN>,
    batch: &GroupBatch,
    results: &mut [&mut [f32]; OUT],
) where
    T: PairTerm<D, IN, OUT>,
{
    let first = batch.particles().start;
    for group in &batch.groups {
        let candidates = &batch.candidates[group.candidates.clone()];
        let (sums, coincident) = sum_group(simd, term, inputs, group.particles.start, candidates);
        let mut lanes = [[0.0; BATCH]; OUT];
        for k in 0..OUT {
            sums[k].store_slice(&mut lanes[k]);
        }
        if T::DIRECTED {
            add_coincident(term, inputs, group, candidates, coincident, &mut lanes);
        }
        let rows = group.particles.start - first..group.particles.end - first;
        for k in 0..OUT {
            results[k][rows.clone()].copy_from_slice(&lanes[k][..group.particles.len()]);
        }
    }
}

/// Sums for the eight particles from `first` on over all candidates; and how many of these coincide with each, itself included, if
/// the term is directed.
#[inline(always)]
fn sum_group<S: Simd, T, const D: usize, const IN: usize, const OUT: usize>(
    simd: S,
    term: &T,
    inputs: &SumInputs<'_, D, IN>,
    first: usize,
    candidates: &[u32],
) -> ([HalfLanes<S>; OUT], HalfLanes<S>)
where
    T: PairTerm<D, IN, OUT>,
{
    let support = inputs.cells.support_radius();
    let count = inputs.cells.len();
    let (positions, fields) = (truncate_all(inputs.positions, count), truncate_all(inputs.fields, count));
    let position = load(simd, &inputs.positions, first);
    let own = load_padded(simd, &fields, first);
    let none = HalfLanes::splat(simd, 0.0);
    let (max_squared, min_squared, one) =
        (none.broadcast(support * support), none.broadcast(coincidence_distance_squared(support)), none.broadcast(1.0));
    let (mut sums, mut coincident) = ([none; OUT], none);
    for candidate in candidates {
        let candidate = *candidate as usize;
        let offset = subtract(&position, &splat_all(simd, values_at(&positions, candidate)));
        let length_squared = length_squared(&offset);
        let mut distance_squared = length_squared.simd_min(max_squared);
        if T::DIRECTED {
            coincident += length_squared.select_lt(min_squared, one, none);
            distance_squared = distance_squared.simd_max(min_squared);
        }
        let other = splat_all(simd, values_at(&fields, candidate));
        term.add(&Pair { offset, distance_squared }, &own, &other, &mut sums);
    }
    (sums, coincident)
}

/// The batch of each array that begins at an index; 0 behind their end.
#[inline(always)]
fn load_padded<S: Simd, const N: usize>(simd: S, arrays: &[&[f32]; N], first: usize) -> [HalfLanes<S>; N] {
    let length = arrays.first().map_or(0, |array| array.len());
    if first + BATCH <= length {
        return load(simd, arrays, first);
    }
    let mut batches = [HalfLanes::splat(simd, 0.0); N];
    for k in 0..N {
        let mut values = [0.0; BATCH];
        values[..length - first].copy_from_slice(&arrays[k][first..]);
        batches[k] = HalfLanes::from_slice(simd, &values);
    }
    batches
}

/// Squared distance below which particles coincide.
fn coincidence_distance_squared(support_radius: f32) -> f32 {
    (support_radius * COINCIDENCE_RADIUS) * (support_radius * COINCIDENCE_RADIUS)
}

/// Adds what those particles of a group gain that coincide with more than themselves.
#[inline(always)]
fn add_coincident<S: Simd, T, const D: usize, const IN: usize, const OUT: usize>(
    term: &T,
    inputs: &SumInputs<'_, D, IN>,
    group: &Group,
    candidates: &[u32],
    coincident: HalfLanes<S>,
    sums: &mut [[f32; BATCH]; OUT],
) where
    T: PairTerm<D, IN, OUT>,
{
    if !coincident.simd_gt(coincident.broadcast(1.5)).any_true() {
        return;
    }
    for particle in group.particles.clone() {
        let extra = sum_coincident(term, inputs, candidates, particle);
        for k in 0..OUT {
            sums[k][particle - group.particles.start] += extra[k];
        }
    }
}

/// What others at the place of a particle add, each pushed aside by a hair in a direction that both agree on.
#[inline(never)]
fn sum_coincident<T, const D: usize, const IN: usize, const OUT: usize>(
    term: &T,
    inputs: &SumInputs<'_, D, IN>,
    candidates: &[u32],
    particle: usize,
) -> [f32; OUT]
where
    T: PairTerm<D, IN, OUT>,
{
    let support = inputs.cells.support_radius();
    let ids = inputs.cells.ids();
    let (position, values) = (values_at(&inputs.positions, particle), values_at(&inputs.fields, particle));
    let mut sums = [0.0; OUT];
    for other in candidates.iter().map(|other| *other as usize).filter(|other| *other != particle) {
        let separation = subtract(&position, &values_at(&inputs.positions, other));
        if length_squared(&separation) < coincidence_distance_squared(support) {
            let offset =
                direction(ids[particle], ids[other]).map(|component: f32| component * support * COINCIDENCE_RADIUS);
            let pair = Pair { offset, distance_squared: length_squared(&offset) };
            term.add(&pair, &values, &values_at(&inputs.fields, other), &mut sums);
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
