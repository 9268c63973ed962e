//! The accumulation buffer of a chart, column by column, and the memory of charts, which the frames of a shot reuse: for a dome it is hundreds of megabytes,
//! and for the system to map it anew takes longer than to integrate the light.

use std::{
    ops::Range,
    sync::{Mutex, PoisonError},
};

use bansho_base::{
    host::parallel::prelude::*,
    math::simd::{FourLanes, Real},
};
use fearless_simd::{Simd, prelude::*};

use crate::{physics::emission::PerEmitter, render::project::chart::Chart};

/// Accumulation buffer: brightness by emitter in kR without extinction, column by column.
#[derive(Clone)]
pub(crate) struct ColumnBuffer {
    pub(crate) chart: Chart,
    pub(crate) light: Vec<PerEmitter<f32>>,
    /// First row of each column that may be non-zero, and one past the last.
    pub(crate) valid_rows: Vec<[u32; 2]>,
}

impl ColumnBuffer {
    /// A buffer without light.
    pub(crate) fn zeros(chart: Chart) -> Self {
        Self {
            light: vec![[0.0; 4]; chart.columns * chart.rows],
            valid_rows: vec![[u32::MAX, 0]; chart.columns],
            chart,
        }
    }

    /// Sums the red light of all altitudes into the red emitter.
    pub(crate) fn sum_red_altitudes(&mut self) {
        for (column, [first, end]) in self.light.chunks_mut(self.chart.rows).zip(&self.valid_rows) {
            for light in &mut column[(*first).min(*end) as usize..*end as usize] {
                let [low, middle, high, _] = *light;
                *light = [0.0, low + middle + high, 0.0, 0.0];
            }
        }
    }

    /// Adds the light of a buffer with the same chart.
    pub(crate) fn add(&mut self, other: &Self) {
        let rows = self.chart.rows;
        let columns = self.light.par_chunks_mut(rows).zip(&mut self.valid_rows);
        columns.zip(other.light.par_chunks(rows).zip(&other.valid_rows)).for_each(
            |((light, valid), (added, range))| {
                let [first, end] = range.map(|row| row as usize);
                for (sum, value) in light[first.min(end)..end].iter_mut().zip(&added[first.min(end)..end]) {
                    *sum = std::array::from_fn(|emitter| sum[emitter] + value[emitter]);
                }
                *valid = [valid[0].min(range[0]), valid[1].max(range[1])];
            },
        );
    }

    /// The chart, and the buffer in blocks of that many columns, each for one thread.
    pub(crate) fn blocks(&mut self, columns: usize) -> (&Chart, impl IndexedParallelIterator<Item = ColumnBlock<'_>>) {
        let light = self.light.par_chunks_mut(columns * self.chart.rows);
        let blocks = light.zip(self.valid_rows.par_chunks_mut(columns)).enumerate();
        (&self.chart, blocks.map(|(number, (light, valid_rows))| ColumnBlock { number, light, valid_rows }))
    }

    /// Union of the valid rows of two columns.
    #[inline(always)]
    pub(crate) fn valid_rows_of_either(&self, [left, right]: [usize; 2]) -> [u32; 2] {
        let (left, right) = (self.valid_rows[left], self.valid_rows[right]);
        [left[0].min(right[0]), left[1].max(right[1])]
    }
}

/// A block of adjacent columns of a buffer.
pub(crate) struct ColumnBlock<'a> {
    pub(crate) number: usize,
    pub(crate) light: &'a mut [PerEmitter<f32>],
    pub(crate) valid_rows: &'a mut [[u32; 2]],
}

impl ColumnBlock<'_> {
    /// A column of `row_count` rows, with its valid range extended to include `rows`.
    ///
    /// New rows are cleared explicitly although the allocation is zeroed: a first read maps the shared zero page and
    /// the later write faults again with a TLB shootdown on all threads.
    #[inline(always)]
    pub(super) fn extend_valid_rows(
        &mut self,
        column: usize,
        rows: &Range<usize>,
        row_count: usize,
    ) -> &mut [PerEmitter<f32>] {
        let [first, end] = self.valid_rows[column].map(|row| row as usize);
        let light = &mut self.light[column * row_count..][..row_count];
        if first > end {
            light[rows.clone()].fill([0.0; 4]);
            self.valid_rows[column] = [rows.start as u32, rows.end as u32];
            return light;
        }
        if rows.start < first {
            light[rows.start..first].fill([0.0; 4]);
            self.valid_rows[column][0] = rows.start as u32;
        }
        if rows.end > end {
            light[end..rows.end].fill([0.0; 4]);
            self.valid_rows[column][1] = rows.end as u32;
        }
        light
    }
}

/// Linear interpolation of all emitters.
#[inline(always)]
pub(crate) fn lerp_emitters<S: Simd>(
    simd: S,
    low: &PerEmitter<f32>,
    high: &PerEmitter<f32>,
    fraction: f32,
) -> FourLanes<S> {
    let (low, high) = (FourLanes::simd_from(simd, *low), FourLanes::simd_from(simd, *high));
    low.broadcast(fraction).fma(high - low, low)
}

/// The memory of charts that are no longer used, all of it without light.
#[derive(Debug, Default)]
pub(crate) struct ChartMemory(Mutex<Vec<Vec<PerEmitter<f32>>>>);

impl ChartMemory {
    /// Number of charts whose memory is kept: a picture's and its mirror's.
    const CAPACITY: usize = 2;

    /// A buffer without light.
    pub(crate) fn zeros(&self, chart: Chart) -> ColumnBuffer {
        let cells = chart.columns * chart.rows;
        let recycled = {
            let mut free = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            let fits = free.iter().enumerate().filter(|(_, memory)| memory.capacity() >= cells);
            let smallest = fits.min_by_key(|(_, memory)| memory.capacity()).map(|(index, _)| index);
            smallest.map(|index| free.swap_remove(index))
        };
        match recycled {
            None => ColumnBuffer::zeros(chart),
            Some(mut light) => {
                light.resize(cells, [0.0; 4]);
                ColumnBuffer { light, valid_rows: vec![[u32::MAX, 0]; chart.columns], chart }
            }
        }
    }

    /// Takes the memory of a chart whose light is no longer used, which stays empty. Its light is outside of its valid rows nowhere.
    pub(crate) fn recycle(&self, buffer: &mut ColumnBuffer) {
        let rows = buffer.chart.rows;
        let mut light = std::mem::take(&mut buffer.light);
        light.par_chunks_mut(rows).zip(&buffer.valid_rows).for_each(|(column, [first, end])| {
            column[(*first).min(*end) as usize..*end as usize].fill([0.0; 4]);
        });
        let mut free = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        free.insert(0, light);
        free.truncate(Self::CAPACITY);
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::{
        camera::CameraParameters,
        phenomenon::strip::{Shutter, View},
    };

    use super::*;
    use crate::render::project::{chart::Coverage, field_lines::FieldLines};

    #[test]
    fn memory_is_reused_by_charts_that_fit_and_comes_without_light() {
        let mut camera = CameraParameters::default();
        camera.look_up();
        let view = View::new(camera, Shutter { open: 0.0, close: 0.0 }, 0.0, [64, 48], 0);
        let coverage = Coverage::of_view(&view, &FieldLines::new(77.0, 0.0, view.camera.position));
        let chart = |scale: f64| Chart::new(&coverage, scale * coverage.pixel, scale * coverage.pixel);
        let memory = ChartMemory::default();
        let mut buffer = memory.zeros(chart(1.0));
        let rows = buffer.chart.rows;
        buffer.light[rows + 3..rows + 7].fill([1.0; 4]);
        buffer.valid_rows[1] = [3, 7];
        let address = buffer.light.as_ptr();
        memory.recycle(&mut buffer);
        let smaller = memory.zeros(chart(2.0));
        assert_eq!(smaller.light.as_ptr(), address);
        assert_eq!(smaller.light.len(), smaller.chart.columns * smaller.chart.rows);
        assert!(smaller.light.iter().flatten().all(|value| *value == 0.0));
        assert!(smaller.valid_rows.iter().all(|rows| *rows == [u32::MAX, 0]));
        // In use, so that the next chart gets memory of its own.
        assert_ne!(memory.zeros(chart(2.0)).light.as_ptr(), address);
    }
}
