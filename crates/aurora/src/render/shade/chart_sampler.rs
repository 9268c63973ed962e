//! Bilinear sampling of a chart.

use bansho_base::math::simd::{FourLanes, HalfLanes, Real};
#[cfg(test)]
use fearless_simd::dispatch;
use fearless_simd::{Simd, prelude::*};

use crate::{
    physics::emission::PerEmitter,
    render::{integrate::columns::ColumnBuffer, project::chart::ChartProjection},
};

impl ColumnBuffer {
    /// A sampler of this buffer.
    pub(crate) fn sampler(&self) -> ChartSampler<'_> {
        ChartSampler { buffer: self, projection: self.chart.projection() }
    }
}

/// A chart and its mapping from directions to cells.
pub(crate) struct ChartSampler<'a> {
    buffer: &'a ColumnBuffer,
    projection: ChartProjection,
}

impl ChartSampler<'_> {
    /// Adds the light at directions, bilinear between cells.
    #[inline(always)]
    pub(crate) fn add<S: Simd, const COUNT: usize>(
        &self,
        simd: S,
        longitude: &[f32; COUNT],
        colatitude: &[f32; COUNT],
        light: &mut [PerEmitter<f32>; COUNT],
    ) {
        let last = (self.buffer.chart.rows - 1) as f32;
        let (mut columns, mut rows) = ([0.0; COUNT], [0.0; COUNT]);
        for i in 0..COUNT {
            columns[i] = self.projection.column(longitude[i]) - 0.5;
            rows[i] = (self.projection.row(colatitude[i]) - 0.5).clamp(0.0, last);
        }
        for i in 0..COUNT {
            self.add_bilinear(simd, columns[i], rows[i], &mut light[i]);
        }
    }

    /// The light at one direction.
    #[cfg(test)]
    pub(crate) fn light(&self, longitude: f32, colatitude: f32) -> PerEmitter<f32> {
        let mut light = [[0.0; 4]];
        dispatch!(bansho_base::math::simd::level(), simd => self.add(simd, &[longitude], &[colatitude], &mut light));
        light[0]
    }

    #[inline(always)]
    fn add_bilinear<S: Simd>(&self, simd: S, column: f32, row: f32, light: &mut PerEmitter<f32>) {
        let ColumnBuffer { chart, light: all, .. } = self.buffer;
        let left = column.floor();
        let across = column - left;
        let upper = (row as usize).min(chart.rows - 2);
        let fraction = row - upper as f32;
        let (left, right) = (chart.wrap_column(left as i32), chart.wrap_column(left as i32 + 1));
        let [first, end] = self.buffer.valid_rows_of_either([left, right]);
        if upper as u32 + 1 < first || upper as u32 >= end {
            return;
        }
        // A row and the next one are adjacent in memory.
        let (left, right) = (left * chart.rows + upper, right * chart.rows + upper);
        let left = HalfLanes::from_slice(simd, all[left..left + 2].as_flattened());
        let right = HalfLanes::from_slice(simd, all[right..right + 2].as_flattened());
        let (above, below) = (left.broadcast(across)).fma(right - left, left).split();
        *light = above.broadcast(fraction).fma(below - above, above + FourLanes::simd_from(simd, *light)).into();
    }

    /// Conservative test whether a region between two longitudes, in radians, and two colatitudes is dark.
    pub(crate) fn is_dark(&self, longitudes: [f32; 2], colatitudes: [f32; 2]) -> bool {
        let ColumnBuffer { chart, valid_rows, .. } = self.buffer;
        let [left, right] = longitudes.map(|longitude| self.projection.column(longitude) as i32);
        // Regions across the seam of a full-circle chart are not tested.
        if right < left || (right - left) as usize > chart.columns / 2 {
            return false;
        }
        let [top, bottom] = colatitudes.map(|colatitude| (self.projection.row(colatitude).max(0.0)) as u32);
        (left - 2..=right + 2).all(|column| {
            let [first, end] = valid_rows[chart.wrap_column(column)];
            bottom + 2 < first || top >= end + 2
        })
    }
}
