//! SIMD batches of sixteen particles that came from one burner.
//!
//! Particles of all burners are mixed in memory. Within each task their row indices are sorted by burner, and batches gather and
//! scatter rows.

use std::ops::Range;

use bansho_base::{
    host::parallel::prelude::*,
    math::simd::{LANES, Lanes},
};
use fearless_simd::{Simd, dispatch, prelude::*};

use crate::particles::simulate::forces::external_forces::BurnerForces;

/// Particles per task of the thread pool.
pub(crate) const PARTICLES_PER_TASK: usize = 512;

/// Particle columns that a task only reads.
pub(crate) trait SharedColumns: Copy + Sync {
    /// The rows of one task.
    fn slice(self, range: Range<usize>) -> Self;
}

/// An update of `N` columns, for a batch of sixteen particles of one burner at a time.
pub(crate) trait BatchUpdate<S: SharedColumns, const N: usize>: Sync {
    /// Updates a batch of rows of a task: reads `inputs`, reads and writes `columns`.
    fn update<V: Simd>(&self, simd: V, burner: &BurnerForces, rows: RowBatch, inputs: S, columns: &mut [&mut [f32]; N]);
}

/// Runs an update over all particles, burner by burner within each task.
pub(crate) fn for_each_burner_batch<S: SharedColumns, const N: usize>(
    update: &impl BatchUpdate<S, N>,
    burner_forces: &[BurnerForces],
    burners: &[u32],
    inputs: S,
    columns: [&mut Vec<f32>; N],
) {
    let level = bansho_base::math::simd::level();
    split_into_tasks(columns).into_par_iter().enumerate().for_each(|(task, mut columns)| {
        let first = task * PARTICLES_PER_TASK;
        let range = first..first + columns[0].len();
        let sorted = RowsByBurner::new(&burners[range.clone()], burner_forces.len());
        let inputs = inputs.slice(range);
        dispatch!(level, simd => update_task(simd, update, burner_forces, &sorted, inputs, &mut columns));
    });
}

#[inline(always)]
fn update_task<V: Simd, S: SharedColumns, const N: usize>(
    simd: V,
    update: &impl BatchUpdate<S, N>,
    burner_forces: &[BurnerForces],
    sorted: &RowsByBurner,
    inputs: S,
    columns: &mut [&mut [f32]; N],
) {
    for (index, burner) in burner_forces.iter().enumerate() {
        for rows in sorted.rows_of(index).chunks(LANES) {
            update.update(simd, burner, RowBatch(rows), inputs, columns);
        }
    }
}

/// The slice of each column that belongs to each task.
fn split_into_tasks<const N: usize>(arrays: [&mut Vec<f32>; N]) -> Vec<[&mut [f32]; N]> {
    let tasks = arrays.first().map_or(0, |values| values.len().div_ceil(PARTICLES_PER_TASK));
    let mut chunks = arrays.map(|values| values.chunks_mut(PARTICLES_PER_TASK));
    (0..tasks).map(|_| chunks.each_mut().map(|chunks| chunks.next().unwrap_or_default())).collect()
}

/// Row indices of a task, sorted by burner.
#[derive(Debug)]
struct RowsByBurner {
    rows: Vec<u32>,
    /// End of the rows of each burner.
    ends: Vec<usize>,
}

impl RowsByBurner {
    /// Counting sort of a task's rows by `burners`, of which there are `count`.
    fn new(burners: &[u32], count: usize) -> Self {
        let mut sorted = Self { rows: vec![0; burners.len()], ends: vec![0; count] };
        for burner in burners {
            sorted.ends[*burner as usize] += 1;
        }
        let mut start = 0;
        for end in &mut sorted.ends {
            start += std::mem::replace(end, start);
        }
        for (row, burner) in burners.iter().enumerate() {
            let end = &mut sorted.ends[*burner as usize];
            sorted.rows[*end] = row as u32;
            *end += 1;
        }
        sorted
    }

    /// The rows of a burner, ascending.
    fn rows_of(&self, burner: usize) -> &[u32] {
        let start = if burner == 0 { 0 } else { self.ends[burner - 1] };
        &self.rows[start..self.ends[burner]]
    }
}

/// Up to sixteen row indices, ascending.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RowBatch<'a>(pub(crate) &'a [u32]);

impl RowBatch<'_> {
    /// The first row, if these are sixteen contiguous rows.
    #[inline(always)]
    fn contiguous_start(self) -> Option<usize> {
        let (first, last) = (self.0[0] as usize, self.0[self.0.len() - 1] as usize);
        (self.0.len() == LANES && last - first == LANES - 1).then_some(first)
    }

    /// Gathers values; lanes beyond the last row repeat it.
    #[inline(always)]
    pub(crate) fn load<S: Simd>(self, simd: S, values: &[f32]) -> Lanes<S> {
        if let Some(first) = self.contiguous_start() {
            return Lanes::from_slice(simd, &values[first..first + LANES]);
        }
        let last = values[self.0[self.0.len() - 1] as usize];
        let mut lanes = [last; LANES];
        for (lane, row) in lanes.iter_mut().zip(self.0) {
            *lane = values[*row as usize];
        }
        Lanes::from_slice(simd, &lanes)
    }

    /// Gathers values of several columns.
    #[inline(always)]
    pub(crate) fn load_all<S: Simd, const N: usize>(self, simd: S, arrays: [&[f32]; N]) -> [Lanes<S>; N] {
        let mut batches = [Lanes::splat(simd, 0.0); N];
        for k in 0..N {
            batches[k] = self.load(simd, arrays[k]);
        }
        batches
    }

    /// Scatters values to their rows.
    #[inline(always)]
    pub(crate) fn store<S: Simd>(self, batch: Lanes<S>, values: &mut [f32]) {
        if let Some(first) = self.contiguous_start() {
            batch.store_slice(&mut values[first..first + LANES]);
            return;
        }
        let mut lanes = [0.0; LANES];
        batch.store_slice(&mut lanes);
        for (lane, row) in lanes.iter().zip(self.0) {
            values[*row as usize] = *lane;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_of_each_burner_come_together_and_values_go_back_where_they_were() {
        let burners: Vec<u32> = (0..100).map(|row| if row < 40 { 2 } else { row % 3 }).collect();
        let sorted = RowsByBurner::new(&burners, 5);
        let values: Vec<f32> = (0..100).map(|row| row as f32).collect();
        let mut seen = vec![0.0; 100];
        for burner in 0..5 {
            let rows = sorted.rows_of(burner);
            assert!(rows.iter().all(|row| burners[*row as usize] as usize == burner) && rows.is_sorted());
            for rows in rows.chunks(LANES).map(RowBatch) {
                bansho_base::dispatch_baseline!(simd => {
                    let batch = rows.load(simd, &values);
                    assert_eq!(batch.as_slice()[LANES - 1], rows.0[rows.0.len() - 1] as f32);
                    rows.store(batch + batch, &mut seen);
                });
            }
        }
        assert!((0..100).all(|row| seen[row] == 2.0 * values[row]), "{seen:?}");
    }
}
