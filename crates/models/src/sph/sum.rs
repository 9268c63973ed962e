//! Sums over the neighbours of every particle: the one loop that density, forces and whatever a model adds run in.
//!
//! For each cell the particles of it and its neighbours are gathered once, side by side; then each particle of the cell goes
//! through them sixteen at a time. There is no list of neighbours: rejecting the six candidates out of seven that are too far costs less
//! than storing and fetching the seventh. A sum depends on who is in the neighbouring cells alone, not on threads.

use std::ops::Range;

use bansho_base::math;
use bansho_base::random::{murmur3, uniform};
use fearless_simd::{Level, Simd, dispatch, prelude::*};
use rayon::prelude::*;

use super::cells::Cells;
use crate::lanes::{LANES, Lanes, Real};

/// Particles closer than this share of the support radius count as coincident.
const COINCIDENT: f32 = 1e-6;
/// Particles a task of the thread pool holds at least.
const TASK: usize = 256;

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
    /// Mark it `#[inline(always)]`. It is also called for candidates too far to count, whose result is dropped.
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
        let level = Level::new();
        let visit = |gathered: &mut Gathered<D, IN>, mut task: Task<'_, OUT>| {
            self.visit(task.cells.clone(), |particles, runs| {
                gathered.fill(self, &fields, runs);
                let own = Own { cells: self, fields: &fields, runs, gathered: &*gathered };
                let results = task.results.each_mut().map(|values| {
                    let (head, tail) = std::mem::take(values).split_at_mut(particles.len());
                    *values = tail;
                    head
                });
                dispatch!(level, simd => sum_cell(simd, term, &own, particles, results));
            });
        };
        tasks(self, results).into_par_iter().for_each_init(Gathered::new, visit);
    }
}

/// A stretch of cells and where the results of their particles go.
struct Task<'a, const OUT: usize> {
    cells: Range<usize>,
    results: [&'a mut [f32]; OUT],
}

/// Parts the cells into stretches of about as many particles.
fn tasks<'a, const D: usize, const OUT: usize>(
    cells: &Cells<D>,
    mut results: [&'a mut [f32]; OUT],
) -> Vec<Task<'a, OUT>> {
    let mut tasks = Vec::with_capacity(cells.len() / TASK + 1);
    let mut first = 0;
    for next in 1..=cells.count() {
        let count = cells.particles(first..next).len();
        if count < TASK && next < cells.count() {
            continue;
        }
        let results = results.each_mut().map(|values| {
            let (head, tail) = std::mem::take(values).split_at_mut(count);
            *values = tail;
            head
        });
        tasks.push(Task { cells: first..next, results });
        first = next;
    }
    tasks
}

/// Particles of a cell and its neighbours side by side, filled up to whole batches with particles infinitely far away.
struct Gathered<const D: usize, const IN: usize> {
    positions: [Vec<f32>; D],
    fields: [Vec<f32>; IN],
}

impl<const D: usize, const IN: usize> Gathered<D, IN> {
    fn new() -> Self {
        Self { positions: std::array::from_fn(|_| Vec::new()), fields: std::array::from_fn(|_| Vec::new()) }
    }

    fn fill(&mut self, cells: &Cells<D>, fields: &[&[f32]; IN], runs: &[Range<usize>]) {
        let gather = |to: &mut Vec<f32>, from: &[f32], filler: f32| {
            to.clear();
            runs.iter().for_each(|run| to.extend_from_slice(&from[run.clone()]));
            to.resize(to.len().next_multiple_of(LANES), filler);
        };
        let places = self.positions.iter_mut().zip(cells.positions());
        places.for_each(|(to, from)| gather(to, from, f32::INFINITY));
        self.fields.iter_mut().zip(fields).for_each(|(to, from)| gather(to, from, 0.0));
    }
}

/// What the sums of a cell read.
struct Own<'a, const D: usize, const IN: usize> {
    cells: &'a Cells<D>,
    fields: &'a [&'a [f32]; IN],
    runs: &'a [Range<usize>],
    gathered: &'a Gathered<D, IN>,
}

/// Sums for all particles of a cell.
#[inline(always)]
fn sum_cell<S: Simd, T, const D: usize, const IN: usize, const OUT: usize>(
    simd: S,
    term: &T,
    own: &Own<'_, D, IN>,
    particles: Range<usize>,
    results: [&mut [f32]; OUT],
) where
    T: PairTerm<D, IN, OUT>,
{
    for (slot, i) in particles.enumerate() {
        let position = own.cells.positions().map(|component| component[i]);
        let values = own.fields.map(|field| field[i]);
        let (mut sums, coincident) = sum_one(simd, term, own, position, values);
        if T::DIRECTED && coincident > 1.5 {
            let more = sum_coincident(term, own, i);
            sums = std::array::from_fn(|k| sums[k] + more[k]);
        }
        for k in 0..OUT {
            results[k][slot] = sums[k];
        }
    }
}

/// Sums for one particle, and how many candidates coincide with it, itself included (counted for directed terms only).
#[inline(always)]
fn sum_one<S: Simd, T, const D: usize, const IN: usize, const OUT: usize>(
    simd: S,
    term: &T,
    own: &Own<'_, D, IN>,
    position: [f32; D],
    values: [f32; IN],
) -> ([f32; OUT], f32)
where
    T: PairTerm<D, IN, OUT>,
{
    let support = own.cells.support_radius();
    let zero = Lanes::splat(simd, 0.0);
    let farthest = zero.like(support * support);
    let nearest = zero.like(nearest_squared(support));
    let position = position.map(|component| zero.like(component));
    let values = values.map(|value| zero.like(value));
    let mut sums = [zero; OUT];
    let mut coincident = zero;
    for block in (0..own.gathered.positions[0].len()).step_by(LANES) {
        let at = |from: &Vec<f32>| Lanes::from_slice(simd, &from[block..block + LANES]);
        let theirs = own.gathered.positions.each_ref().map(at);
        let offset = std::array::from_fn(|c| position[c] - theirs[c]);
        let distance_squared = squared(&offset);
        let other = own.gathered.fields.each_ref().map(at);
        let terms = term.term(&Pair { offset, distance_squared }, &values, &other);
        for k in 0..OUT {
            let counted = distance_squared.choose(farthest, terms[k], zero);
            sums[k] += if T::DIRECTED { distance_squared.choose(nearest, zero, counted) } else { counted };
        }
        if T::DIRECTED {
            coincident += distance_squared.choose(nearest, zero.like(1.0), zero);
        }
    }
    (sums.map(total), total(coincident))
}

/// Squared distance below which particles coincide.
fn nearest_squared(support_radius: f32) -> f32 {
    (support_radius * COINCIDENT) * (support_radius * COINCIDENT)
}

#[inline(always)]
fn squared<R: Real, const D: usize>(offset: &[R; D]) -> R {
    offset[1..].iter().fold(offset[0] * offset[0], |sum, component| component.fused(*component, sum))
}

/// Sum of a batch, halves first, whatever the vector width.
#[inline(always)]
fn total<S: Simd>(batch: Lanes<S>) -> f32 {
    let mut parts = [0.0; LANES];
    batch.store_slice(&mut parts);
    for half in [8, 4, 2, 1] {
        for lane in 0..half {
            parts[lane] += parts[lane + half];
        }
    }
    parts[0]
}

/// What others at the place of particle `i` add, each pushed aside by a hair in a direction that both agree on.
#[inline(never)]
fn sum_coincident<T, const D: usize, const IN: usize, const OUT: usize>(
    term: &T,
    own: &Own<'_, D, IN>,
    i: usize,
) -> [f32; OUT]
where
    T: PairTerm<D, IN, OUT>,
{
    let (positions, ids) = (own.cells.positions(), own.cells.ids());
    let support = own.cells.support_radius();
    let values = own.fields.map(|field| field[i]);
    let mut sums = [0.0; OUT];
    for j in own.runs.iter().cloned().flatten().filter(|j| *j != i) {
        let between: [f32; D] = positions.map(|component| component[i] - component[j]);
        if squared(&between) < nearest_squared(support) {
            let offset = direction(ids[i], ids[j]).map(|component: f32| component * support * COINCIDENT);
            let pair = Pair { offset, distance_squared: squared(&offset) };
            let terms = term.term(&pair, &values, &own.fields.map(|field| field[j]));
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
