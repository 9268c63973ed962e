//! Sums over the neighbors of every particle: the one loop in which density, forces and all other pair terms run.
//!
//! Eight consecutive particles visit their common candidates together, one candidate at a time. Each particle has a SIMD lane of
//! its own, so there are no horizontal sums. A sum depends on the neighbors alone, not on threads.

use bansho_base::{
    host::parallel::prelude::*,
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
use crate::{
    cell_rows::BATCH,
    neighbor_groups::{length_squared, load, splat_all, subtract, truncate_all, values_at},
};
use fearless_simd::{Simd, dispatch, prelude::*};

/// Particles closer than this fraction of the support radius count as coincident.
const COINCIDENCE_RADIUS: f32 = 1e-6;

/// Relative position of a pair.
#[derive(Clone, Copy, Debug)]
pub struct Pair<R, const D: usize> {
    /// `x_i - x_j`, from the neighbor to the particle.
    pub offset: [R; D],
    /// Its squared length.
    pub distance_squared: R,
}

/// Pair term of a sum over neighbors in `D` dimensions: `OUT` results from `IN` values of each particle.
pub trait PairTerm<const D: usize, const IN: usize, const OUT: usize>: Sync {
    /// Whether the term is proportional to the offset, possibly with a pole at distance 0.
    ///
    /// If so, squared distances are clamped above 0, a particle contributes nothing to itself (its offset is 0), and two coincident
    /// particles repel each other in a direction that follows from their ids. If not, the sum includes the particle itself at
    /// distance 0.
    const DIRECTED: bool;

    /// Whether a particle with these values is inert: the term between two inert particles is exactly 0, so that such pairs are skipped.
    fn is_inert(_values: &[f32; IN]) -> bool {
        false
    }

    /// Adds the contribution of a neighbor with the values `other` to the sums of a particle with the values `own`.
    ///
    /// Implementations are `#[inline(always)]` and loop over arrays instead of calling `map`, whose closures do not vectorize. The
    /// term is also evaluated for candidates beyond the support radius, with the squared distance clamped to its square: there it
    /// must be 0 to rounding, as kernels are.
    fn add<R: Real>(&self, pair: &Pair<R, D>, own: &[R; IN], other: &[R; IN], sums: &mut [R; OUT]);
}

impl<const D: usize> Cells<D> {
    /// Sums `term` over the neighbors of every particle, those nearer than the support radius.
    ///
    /// `fields` and `results` are in sorted order. Results are the same on every machine with fused multiply-add, for any number of
    /// threads and any order in which particles were given.
    ///
    /// # Panics
    /// If a field does not hold one value per particle.
    pub fn sum<T, const IN: usize, const OUT: usize>(
        &self,
        term: &T,
        fields: [&[f32]; IN],
        results: [&mut Vec<f32>; OUT],
    ) where
        T: PairTerm<D, IN, OUT>,
    {
        assert!(fields.iter().all(|field| field.len() == self.len()), "one value per particle");
        let level = bansho_base::math::simd::level();
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

/// The slice of each array that belongs to each batch of groups.
fn split<'a, const OUT: usize>(batches: &[GroupBatch], mut arrays: [&'a mut [f32]; OUT]) -> Vec<[&'a mut [f32]; OUT]> {
    let mut slices = Vec::with_capacity(batches.len());
    for batch in batches {
        slices.push(arrays.each_mut().map(|rest| {
            let (head, tail) = std::mem::take(rest).split_at_mut(batch.particles().len());
            *rest = tail;
            head
        }));
    }
    slices
}

/// Inputs of a sum: positions and fields in sorted order.
struct SumInputs<'a, const D: usize, const IN: usize> {
    cells: &'a Cells<D>,
    positions: [&'a [f32]; D],
    fields: [&'a [f32]; IN],
}

/// Sums for all particles of a batch of groups.
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
        let (sums, coincident) = if is_group_inert::<T, D, IN, OUT>(inputs, group) {
            sum_group::<S, T, D, IN, OUT, true>(simd, term, inputs, group.particles.start, candidates)
        } else {
            sum_group::<S, T, D, IN, OUT, false>(simd, term, inputs, group.particles.start, candidates)
        };
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

/// Whether all particles of a group are inert.
#[inline(always)]
fn is_group_inert<T, const D: usize, const IN: usize, const OUT: usize>(
    inputs: &SumInputs<'_, D, IN>,
    group: &Group,
) -> bool
where
    T: PairTerm<D, IN, OUT>,
{
    for particle in group.particles.clone() {
        if !T::is_inert(&values_at(&inputs.fields, particle)) {
            return false;
        }
    }
    true
}

/// Sums for the eight particles from `first` on over all candidates, without the inert ones if `SKIP_INERT`; for directed terms also the number of
/// candidates that coincide with each, itself included.
#[inline(always)]
fn sum_group<S: Simd, T, const D: usize, const IN: usize, const OUT: usize, const SKIP_INERT: bool>(
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
    // Each particle coincides with itself, but is skipped if it is inert.
    let (mut sums, mut coincident) = ([none; OUT], if SKIP_INERT { one } else { none });
    for candidate in candidates {
        let candidate = *candidate as usize;
        let values = values_at(&fields, candidate);
        if SKIP_INERT && T::is_inert(&values) {
            continue;
        }
        let offset = subtract(&position, &splat_all(simd, values_at(&positions, candidate)));
        let length_squared = length_squared(&offset);
        let mut distance_squared = length_squared.simd_min(max_squared);
        if T::DIRECTED {
            coincident += length_squared.select_lt(min_squared, one, none);
            distance_squared = distance_squared.simd_max(min_squared);
        }
        let other = splat_all(simd, values);
        term.add(&Pair { offset, distance_squared }, &own, &other, &mut sums);
    }
    (sums, coincident)
}

/// Loads the batch that begins at an index from each array, padded with 0.
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

/// Adds the contributions of coincident particles to the members of a group that have any.
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

/// Contributions of particles at the same position, each displaced by the coincidence radius in a direction that both sides agree
/// on.
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

/// Unit vector from particle `other` to particle `own` as a hash of both ids; antisymmetric.
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
