//! From charts to pixels: the sharp and the soft chart are composited, so that a pixel samples one chart; extinction is applied, and kilorayleighs become
//! color.

use std::f64::consts::FRAC_PI_2;

use bansho_base::{
    host::{parallel::prelude::*, scratch_pool::ScratchPool},
    math::{
        self, DVec3,
        simd::{FourLanes, HalfLanes, Real},
    },
};
use fearless_simd::{Simd, dispatch, prelude::*};

use super::{
    RenderingParameters,
    integrate::column_buffer::{ColumnBlock, ColumnBuffer, lerp_emitters},
    project::{
        chart::{BLOCK_COLUMNS, Chart, ChartProjection},
        field_lines::FieldLines,
    },
};
use crate::physics::{
    emission::{ColorMatching, EMITTERS, LineSet, PerEmitter, SpectralEmitter, camera::DigitalCamera},
    extinction::Extinction,
};

/// Steps from the horizon to the zenith, uniform in the square root of the sine of the elevation: extinction varies
/// rapidly near the horizon.
const STEPS: usize = 1024;
/// Effective wavelength of the visible first positive bands, nm.
const BANDS_NM: f64 = 655.0;

/// ACEScg of a kilorayleigh of each emitter by elevation; luminance in cd/m^2.
#[derive(Clone, Debug)]
pub(crate) struct EmitterColors {
    /// Red, green, blue, and 1 for emitters that contribute to the brightness, else 0.
    colors: Vec<PerEmitter<[f32; 4]>>,
}

impl EmitterColors {
    /// Precomputes the table for the extinction and the color matching functions of a rendering, and the lines of its emission.
    pub(crate) fn new(rendering: &RenderingParameters, lines: LineSet) -> Self {
        let air = &rendering.extinction;
        let emitters = EMITTERS.map(|emitter| EmitterLines::new(emitter, lines, rendering));
        let colors = (0..=STEPS).map(|step| {
            let root = step as f64 / STEPS as f64;
            let elevation = math::asin(root * root).min(FRAC_PI_2);
            emitters.each_ref().map(|emitter| {
                let [red, green, blue] = emitter.attenuated_color(air, elevation).map(|value| value as f32);
                [red, green, blue, if emitter.emitter == SpectralEmitter::Nitrogen { 0.0 } else { 1.0 }]
            })
        });
        Self { colors: colors.collect() }
    }

    /// Table coordinate of a sine of elevation, clamped at the horizon.
    #[inline(always)]
    pub(crate) fn table_coordinate(sine: f32) -> f32 {
        let clamped = if sine > 0.0 { sine } else { 0.0 };
        // The nearest step, rounded by the cast: 1024 steps differ too little to interpolate.
        clamped.sqrt().fma(STEPS as f32, 0.5)
    }

    /// Color of light by emitter in kR at a [`table_coordinate`](Self::table_coordinate); the fourth component is its
    /// brightness in kR without the dim first positive bands.
    #[inline(always)]
    pub(crate) fn attenuated<S: Simd>(&self, simd: S, light: &PerEmitter<f32>, coordinate: f32) -> FourLanes<S> {
        let mut sum = FourLanes::splat(simd, 0.0);
        for (light, color) in light.iter().zip(&self.colors[(coordinate as usize).min(STEPS)]) {
            sum = sum.broadcast(*light).fma(FourLanes::simd_from(simd, *color), sum);
        }
        sum
    }
}

/// The lines of an emitter.
struct EmitterLines {
    emitter: SpectralEmitter,
    /// Wavelength, nm, photons per counted photon, and color per kilorayleigh of each line.
    lines: Vec<(f64, f64, DVec3)>,
}

impl EmitterLines {
    fn new(emitter: SpectralEmitter, lines: LineSet, rendering: &RenderingParameters) -> Self {
        if emitter == SpectralEmitter::Nitrogen
            && lines == LineSet::Observed
            && rendering.color_matching == ColorMatching::Cie1931
        {
            return Self { emitter, lines: vec![(BANDS_NM, 1.0, DVec3::from(emitter.color_per_kilorayleigh()))] };
        }
        let camera = DigitalCamera::new(rendering.camera_white_k);
        let mut colored = Vec::new();
        for (wavelength_nm, photons) in lines.lines(emitter) {
            let color = DVec3::from(rendering.color_matching.line_color(&camera, wavelength_nm));
            colored.push((wavelength_nm, photons, color));
        }
        Self { emitter, lines: colored }
    }

    /// Attenuated color of a kilorayleigh, all lines included.
    fn attenuated_color(&self, air: &Extinction, elevation: f64) -> [f64; 3] {
        let sum = self.lines.iter().fold(DVec3::ZERO, |sum, (wavelength_nm, photons, color)| {
            sum + *color * (photons * air.transmittance(*wavelength_nm, elevation))
        });
        sum.to_array()
    }
}

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
        // Two cells of margin: bilinear sampling reads half a cell further, and the casts truncate.
        (left - 2..=right + 2).all(|column| {
            let [first, end] = valid_rows[chart.wrap_column(column)];
            bottom + 2 < first || top >= end + 2
        })
    }
}

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
                // Interpolation carries a soft row to the centers of its neighbors.
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
        // Bilinear in two steps: across once for the column, down for each row.
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
    use fearless_simd::dispatch;

    use super::*;
    use crate::{
        physics::emission::LineSet,
        render::{
            RenderingParameters,
            project::chart::{Coverage, PixelBatch},
        },
    };

    #[test]
    fn without_air_every_emitter_has_its_own_color() {
        let none = Extinction { rayleigh: 0.0, aerosol: 0.0, ozone: 0.0, ..Extinction::default() };
        let rendering = RenderingParameters { extinction: none, ..RenderingParameters::default() };
        let emitter_colors = EmitterColors::new(&rendering, LineSet::Observed);
        for emitter in EMITTERS {
            let mut light = [0.0; 4];
            light[emitter.index()] = 2.0;
            let color: [f32; 4] = dispatch!(bansho_base::math::simd::level(), simd => emitter_colors.attenuated(simd, &light, EmitterColors::table_coordinate(0.3)).into());
            let expected = emitter.color_per_kilorayleigh();
            assert!(
                (0..3).all(|c| (f64::from(color[c]) - 2.0 * expected[c]).abs() < 1e-4 * expected[1].abs().max(1e-6))
            );
        }
    }

    #[test]
    fn blue_fades_before_red_toward_the_horizon() {
        let emitter_colors = EmitterColors::new(&RenderingParameters::default(), LineSet::Observed);
        let transmittance = |emitter: SpectralEmitter| {
            let mut light = [0.0; 4];
            light[emitter.index()] = 1.0;
            let blue = |sine: f32| dispatch!(bansho_base::math::simd::level(), simd => emitter_colors.attenuated(simd, &light, EmitterColors::table_coordinate(sine))[2]);
            blue(0.02) / blue(1.0)
        };
        assert!(transmittance(SpectralEmitter::NitrogenIon) < 0.5 * transmittance(SpectralEmitter::OxygenGreen).abs());
    }

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
