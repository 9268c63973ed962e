//! Composites the sharp and the soft chart, applies extinction and converts to color, so that a pixel samples one
//! chart.

use bansho_base::{
    host::{parallel::prelude::*, scratch_pool::ScratchPool},
    math,
    math::simd::{FourLanes, HalfLanes, Real},
};
use fearless_simd::{Simd, dispatch, prelude::*};

use super::attenuation::EmitterColors;
use crate::{
    physics::emission::PerEmitter,
    render::{
        integrate::columns::{ColumnBlock, ColumnBuffer, lerp_emitters},
        project::{
            chart::{BLOCK_COLUMNS, Chart, ChartProjection},
            field_lines::FieldLines,
        },
    },
};

/// Rows per batch.
const ROWS: usize = 16;

/// Inputs that all columns share.
struct ColorPass<'a> {
    chart: &'a Chart,
    soft: &'a ColumnBuffer,
    soft_projection: ChartProjection,
    emitter_colors: &'a EmitterColors,
    field: &'a FieldLines,
    /// By row, padded by [`ROWS`]: cosine and sine of the colatitude, and the row of the soft chart.
    cosines: Vec<f32>,
    sines: Vec<f32>,
    soft_rows: Vec<f32>,
}

impl ColumnBuffer {
    /// Replaces brightness by emitter with the attenuated color of this and the soft chart, ACEScg in cd/m^2; the
    /// fourth component is the brightness in kR.
    pub(crate) fn composite(mut self, soft: &Self, field: &FieldLines, emitter_colors: &EmitterColors) -> Self {
        let level = bansho_base::math::simd::level();
        let (chart, blocks) = self.blocks(BLOCK_COLUMNS);
        let soft_projection = soft.chart.projection();
        let (mut cosines, mut sines, mut soft_rows) = (Vec::new(), Vec::new(), Vec::new());
        for row in 0..chart.rows + ROWS {
            let colatitude = chart.colatitude(row);
            let (sine, cosine) = math::sin_cos(colatitude);
            cosines.push(cosine as f32);
            sines.push(sine as f32);
            soft_rows.push(soft_projection.row(colatitude as f32) - 0.5);
        }
        let pass = ColorPass { chart, soft, soft_projection, emitter_colors, field, cosines, sines, soft_rows };
        let scratch_pool = ScratchPool::new(Vec::new);
        blocks.with_max_len(1).for_each(|block| {
            scratch_pool.with(|column| dispatch!(level, simd => pass.color_block(simd, block, column)));
        });
        self
    }
}

impl ColorPass<'_> {
    #[inline(always)]
    fn color_block<S: Simd>(&self, simd: S, block: ColumnBlock, soft: &mut Vec<PerEmitter<f32>>) {
        for column in 0..BLOCK_COLUMNS {
            let number = block.number * BLOCK_COLUMNS + column;
            let [soft_first, soft_end] = self.soft_column(simd, self.chart.longitude(number) as f32, soft);
            let [mut first, mut end] = block.valid_rows[column].map(|row| row as usize);
            if soft_first < soft_end {
                first = first.min(self.row_of_soft(soft_first.saturating_sub(1)));
                end = end.max((self.row_of_soft(soft_end) + 1).min(self.chart.rows));
            }
            if first >= end {
                continue;
            }
            let light = &mut block.light[column * self.chart.rows..][first..end];
            self.color(simd, number, first, light, soft);
            block.valid_rows[column] = [first as u32, end as u32];
        }
    }

    /// The row of the chart at a row of the soft one.
    fn row_of_soft(&self, soft_row: usize) -> usize {
        self.soft_rows[..self.chart.rows].partition_point(|row| *row < soft_row as f32)
    }

    /// The soft light along a longitude, by row, and its valid rows.
    #[inline(always)]
    fn soft_column<S: Simd>(&self, simd: S, longitude: f32, column: &mut Vec<PerEmitter<f32>>) -> [usize; 2] {
        let rows = self.soft.chart.rows;
        let column_position = self.soft_projection.column(longitude) - 0.5;
        let left = column_position.floor();
        let across = column_position - left;
        let pair = [left as i32, left as i32 + 1].map(|column| self.soft.chart.wrap_column(column));
        let [first, end] = self.soft.valid_rows_of_either(pair).map(|row| (row as usize).min(rows));
        column.clear();
        column.resize(rows, [0.0; 4]);
        if first >= end {
            return [rows, 0];
        }
        let [left, right] = pair.map(|column| &self.soft.light[column * rows..][first..end]);
        for ((light, left), right) in column[first..end].iter_mut().zip(left).zip(right) {
            *light = lerp_emitters(simd, left, right, across).into();
        }
        [first, end]
    }

    /// Converts the rows of a column from `first` on to color.
    #[inline(always)]
    fn color<S: Simd>(
        &self,
        simd: S,
        number: usize,
        first: usize,
        light: &mut [PerEmitter<f32>],
        soft: &[PerEmitter<f32>],
    ) {
        let last = (soft.len() - 1) as f32;
        let [cosine, sine] = self.chart.longitude_cos_sin(number);
        let [first_axis, second_axis] = self.field.across;
        let along = self.field.along.y as f32;
        let outward = (first_axis.y * cosine + second_axis.y * sine) as f32;
        for (batch, light) in light.chunks_mut(ROWS).enumerate() {
            let from = first + batch * ROWS;
            let (cosines, sines) = (&self.cosines[from..][..ROWS], &self.sines[from..][..ROWS]);
            let mut steps = [0.0; ROWS];
            for i in 0..ROWS {
                steps[i] = EmitterColors::table_coordinate(along.fma(cosines[i], outward * sines[i]));
            }
            for (i, light) in light.iter_mut().enumerate() {
                let row = self.soft_rows[from + i].max(0.0).min(last);
                let upper = (row as usize).min(soft.len() - 2);
                let both = HalfLanes::from_slice(simd, soft[upper..][..2].as_flattened());
                let (above, below) = both.split();
                let soft = above.broadcast(row - upper as f32).fma(below - above, above);
                let all = soft + FourLanes::simd_from(simd, *light);
                *light = self.emitter_colors.attenuated(simd, &all.into(), steps[i]).into();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::{
        camera::CameraParameters,
        math::{DVec2, DVec3},
        phenomenon::strip::{Shutter, View},
    };

    use super::*;
    use crate::{
        physics::emission::LineSet,
        render::{
            RenderingParameters,
            project::{chart::Coverage, pixel_batch::PixelBatch},
        },
    };

    /// Light that changes slowly over the sky, on a chart.
    fn painted(chart: Chart, scale: f32) -> ColumnBuffer {
        let mut picture = ColumnBuffer::zeros(chart);
        let rows = picture.chart.rows;
        for (index, light) in picture.light.iter_mut().enumerate() {
            let (longitude, colatitude) =
                (picture.chart.longitude(index / rows), picture.chart.colatitude(index % rows));
            let value = scale * (2.0 + math::sin(5.0 * longitude) * math::cos(4.0 * colatitude)) as f32;
            *light = [value, 0.5 * value, 0.3, 0.2 * value];
        }
        picture.valid_rows.fill([0, rows as u32]);
        picture
    }

    #[test]
    fn a_pixel_of_the_seen_chart_is_what_both_charts_give_through_the_air() {
        let camera = CameraParameters {
            position: [0.0; 3].into(),
            target: [0.0, 26.0, -60.0].into(),
            ..CameraParameters::default()
        };
        let view = View::new(camera, Shutter { open: 0.0, close: 0.0 }, 0.0, [320, 240], 0);
        let field = FieldLines::new(77.0, 3.0, DVec3::ZERO);
        let emitter_colors = EmitterColors::new(&RenderingParameters::default(), LineSet::Observed);
        let coverage = Coverage::of_view(&view, &field);
        let pixel = coverage.pixel;
        let [sharp, soft] = [(1.0, 2.0, 9.0), (8.0, 2.0, 4.0)]
            .map(|(column, row, scale)| painted(Chart::new(&coverage, column * pixel, row * pixel), scale));
        let expected = |longitude: f32, colatitude: f32, sine: f32| -> PerEmitter<f32> {
            let [a, b] = [&sharp, &soft].map(|picture| picture.sampler().light(longitude, colatitude));
            let both = std::array::from_fn(|i| a[i] + b[i]);
            dispatch!(bansho_base::math::simd::level(), simd => emitter_colors.attenuated(simd, &both, EmitterColors::table_coordinate(sine)).into())
        };
        let samples: Vec<_> = [[20, 10], [160, 100], [300, 60], [90, 180]]
            .map(|[x, y]| {
                let PixelBatch { longitude, colatitude, .. } = PixelBatch::new(&view.camera, &field, x, y);
                let direction = view.camera.direction(DVec2::new(x as f64 + 0.5, y as f64 + 0.5)).unwrap();
                let sine = direction.normalize().y as f32;
                (longitude[0], colatitude[0], expected(longitude[0], colatitude[0], sine))
            })
            .into();
        let seen = sharp.composite(&soft, &field, &emitter_colors);
        for (longitude, colatitude, expected) in samples {
            let found = seen.sampler().light(longitude, colatitude);
            for i in 0..4 {
                assert!((found[i] / expected[i] - 1.0).abs() < 0.005, "{found:?} {expected:?}");
            }
        }
    }
}
