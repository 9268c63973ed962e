//! Draws sheets into strips, sixteen pixels at a time.
//!
//! Flame coordinates, threshold and brightness vary slowly from row to row of a large picture. They are computed exactly on every
//! second, fourth or sixteenth row and interpolated linearly between; texture and color are looked up for every pixel. Where the
//! mapping minifies the texture, at the flame's base and in its fringe, pixels are supersampled.

use std::ops::Range;

use bansho_base::{
    image::Rect,
    math::simd::{LANES, Lanes, Real},
    phenomenon::strip::Strip,
};
use fearless_simd::{Simd, prelude::*};

use super::shade::{
    ShadedBatch, SheetContent, TimeSample,
    flame::{coordinates, shade_coordinates},
    shade_sample,
};
use crate::sheet::{
    eddies::MAX_EDDY_BAND,
    tables::{
        color_ramp::ColorRamp,
        shape_tables::{FlameCoordinates, ShapeTables},
    },
};

/// One sheet with the inputs of drawing.
#[derive(Clone, Copy)]
pub(crate) struct DrawContext<'a> {
    pub(crate) shape: &'a ShapeTables,
    pub(crate) ramp: &'a ColorRamp,
    pub(crate) samples: &'a [TimeSample],
    pub(crate) content: SheetContent,
    /// Whether it absorbs light from behind.
    pub(crate) absorbs: bool,
    /// Distance between exact rows, a power of two.
    pub(crate) row_band: usize,
    /// Texels between neighboring pixels above which pixels are supersampled: [`MAX_MINIFICATION`], except in tests.
    pub(crate) max_minification: f32,
}

/// Texels between neighboring pixels up to which one lookup per pixel causes no visible aliasing.
pub(crate) const MAX_MINIFICATION: f32 = 4.0;

/// Supersampling offsets from the pixel center, pixels across and up: rotated grid, no two in one column or row.
const SUPERSAMPLES_4: [[f32; 2]; 4] = [[-0.375, 0.125], [-0.125, -0.375], [0.125, 0.375], [0.375, -0.125]];
/// Offsets for up to twice the maximum minification.
const SUPERSAMPLES_2: [[f32; 2]; 2] = [[-0.25, 0.25], [0.25, -0.25]];

/// Distance between exact rows for a sheet of that height: 1 up to 255 pixels, 16 from 1024 on, 4 with eddies.
pub(crate) fn row_band_height(height_pixels: f64, has_eddies: bool) -> usize {
    /// Distances between exact rows, and the minimum sheet heights for which they are used.
    const BANDS: [(usize, f64); 3] = [(16, 1024.0), (4, 512.0), (2, 256.0)];
    let rows = BANDS.into_iter().find(|(_, min_height)| height_pixels >= *min_height).map_or(1, |(rows, _)| rows);
    if has_eddies { rows.min(MAX_EDDY_BAND) } else { rows }
}

/// Pixels of a row that are tested together for being outside the flame.
const GROUP_COLUMNS: usize = 4 * LANES;

/// Draws all time samples of one sheet into `rect` of `strip`, behind its current contents.
///
/// Batches start at multiples of sixteen columns of the whole picture and bands at multiples of their height, so that pixels do not depend on strips and
/// crops.
#[inline(always)]
pub(crate) fn draw_rows<S: Simd>(simd: S, context: &DrawContext, rect: Rect, strip: &mut Strip) {
    let start = rect.x / LANES * LANES;
    let mut row_band = RowBand::new(context);
    for group in (start..rect.right()).step_by(GROUP_COLUMNS) {
        let end = (group + GROUP_COLUMNS).min(rect.right());
        match context.content {
            SheetContent::Flame => draw_bands(simd, context, group..end, rect, &mut row_band, strip),
            _ => draw_each_row(simd, context, group..end, rect, strip),
        }
    }
}

#[inline(always)]
fn draw_each_row<S: Simd>(simd: S, context: &DrawContext, columns: Range<usize>, rect: Rect, strip: &mut Strip) {
    for y in rect.y..rect.bottom() {
        for column in columns.clone().step_by(LANES) {
            let mut sums = PixelSums::new(simd);
            for sample in context.samples {
                let batch = sample.pixel_to_sheet.batch(simd, column, y);
                if let Some(shade) = shade_sample(context.shape, context.ramp, sample, context.content, &batch) {
                    sums.add(&shade, batch.depth, sample.luminance, context.samples.len());
                }
            }
            sums.composite(column, y, rect, context.absorbs, strip);
        }
    }
}

/// Flame coordinates of sixteen pixels of one time sample, and their depth.
#[derive(Clone, Copy)]
struct SheetSamples<S: Simd> {
    coordinates: FlameCoordinates<S>,
    depth: Lanes<S>,
    /// Maximum number of texels per pixel, relative to the threshold of supersampling.
    minification: f32,
}

/// The exact rows around a band, for all batches and time samples.
struct RowBand<S: Simd> {
    /// The first row of the band.
    first: Vec<SheetSamples<S>>,
    /// The first row of the next band minus that of this one.
    delta: Vec<SheetSamples<S>>,
    /// The first row of the next band.
    next: Vec<SheetSamples<S>>,
}

impl<S: Simd> RowBand<S> {
    /// Empty rows with capacity for a group of columns.
    #[inline(always)]
    fn new(context: &DrawContext) -> Self {
        let length = GROUP_COLUMNS / LANES * context.samples.len();
        // A band of one row has no next row to interpolate to.
        let interpolated = if context.row_band > 1 { length } else { 0 };
        Self {
            first: Vec::with_capacity(length),
            delta: Vec::with_capacity(interpolated),
            next: Vec::with_capacity(interpolated),
        }
    }

    /// Discards both rows, for a band that does not follow the previous one.
    #[inline(always)]
    fn clear(&mut self) {
        self.first.clear();
        self.next.clear();
    }

    /// Advances to the band that starts at `row`.
    #[inline(always)]
    fn advance(&mut self, simd: S, context: &DrawContext, columns: &Range<usize>, row: usize) {
        if context.row_band > 1 {
            std::mem::swap(&mut self.first, &mut self.next);
        } else {
            self.first.clear();
        }
        if self.first.is_empty() {
            add_sheet_samples(simd, context, columns, row, &mut self.first);
        }
        self.next.clear();
        self.delta.clear();
        if context.row_band > 1 {
            add_sheet_samples(simd, context, columns, row + context.row_band, &mut self.next);
            for (first, next) in self.first.iter().zip(&self.next) {
                let minification = first.minification.max(next.minification);
                self.delta.push(SheetSamples {
                    coordinates: next.coordinates.difference(&first.coordinates),
                    depth: next.depth - first.depth,
                    minification,
                });
            }
        }
    }
}

/// Draws the flame in a range of columns, band by band.
#[inline(always)]
fn draw_bands<S: Simd>(
    simd: S,
    context: &DrawContext,
    columns: Range<usize>,
    rect: Rect,
    row_band: &mut RowBand<S>,
    strip: &mut Strip,
) {
    row_band.clear();
    let batch_count = columns.len().div_ceil(LANES);
    for first in (rect.y / context.row_band * context.row_band..rect.bottom()).step_by(context.row_band) {
        if context
            .samples
            .iter()
            .all(|sample| misses_flame(context.shape, sample, &columns, [first, first + context.row_band]))
        {
            row_band.clear();
            continue;
        }
        row_band.advance(simd, context, &columns, first);
        for row in first.max(rect.y)..(first + context.row_band).min(rect.bottom()) {
            let fraction = (row - first) as f32 / context.row_band as f32;
            for batch in 0..batch_count {
                let range = batch * context.samples.len()..(batch + 1) * context.samples.len();
                let delta = row_band.delta.get(range.clone()).unwrap_or(&[]);
                let column = columns.start + batch * LANES;
                let sums = average_samples(simd, context, &row_band.first[range], delta, fraction, [column, row]);
                sums.composite(column, row, rect, context.absorbs, strip);
            }
        }
    }
}

/// Exact flame coordinates of all time samples on a row, batch by batch.
#[inline(always)]
fn add_sheet_samples<S: Simd>(
    simd: S,
    context: &DrawContext,
    columns: &Range<usize>,
    row: usize,
    samples_of_row: &mut Vec<SheetSamples<S>>,
) {
    for column in columns.clone().step_by(LANES) {
        for sample in context.samples {
            let batch = sample.pixel_to_sheet.batch(simd, column, row);
            let coordinates = coordinates(context.shape, &sample.state, &batch);
            let minification = coordinates.max_texel_step(sample.state.texels()) / context.max_minification;
            samples_of_row.push(SheetSamples { coordinates, depth: batch.depth, minification });
        }
    }
}

/// Averages the time samples of the sixteen pixels from `pixel` on, interpolated by `fraction` between two exact rows.
#[inline(always)]
fn average_samples<S: Simd>(
    simd: S,
    context: &DrawContext,
    samples_of_row: &[SheetSamples<S>],
    deltas: &[SheetSamples<S>],
    fraction: f32,
    pixel: [usize; 2],
) -> PixelSums<S> {
    let mut sums = PixelSums::new(simd);
    for (index, (sample, sample_coordinates)) in context.samples.iter().zip(samples_of_row).enumerate() {
        let (coordinates, depth) = match deltas.get(index) {
            Some(delta) => (
                sample_coordinates.coordinates.add_scaled(fraction, &delta.coordinates),
                delta.depth.fma(sample_coordinates.depth.broadcast(fraction), sample_coordinates.depth),
            ),
            None => (sample_coordinates.coordinates, sample_coordinates.depth),
        };
        let Some(shade) = shade_coordinates(context.shape, context.ramp, &sample.state, &coordinates) else { continue };
        let minification = deltas.get(index).map_or(sample_coordinates.minification, |delta| delta.minification);
        if minification > 1.0 {
            let offsets: &[_] = if minification > 2.0 { &SUPERSAMPLES_4 } else { &SUPERSAMPLES_2 };
            add_supersampled(simd, context, sample, pixel, offsets, &mut sums);
        } else {
            sums.add(&shade, depth, sample.luminance, context.samples.len());
        }
    }
    sums
}

/// Adds a time sample of sixteen pixels, averaged over several points of each pixel.
fn add_supersampled<S: Simd>(
    simd: S,
    context: &DrawContext,
    sample: &TimeSample,
    pixel: [usize; 2],
    offsets: &[[f32; 2]],
    sums: &mut PixelSums<S>,
) {
    simd.vectorize(
        #[inline(always)]
        || {
            let batch = sample.pixel_to_sheet.batch(simd, pixel[0], pixel[1]);
            let weight = 1.0 / offsets.len() as f32;
            for &[across, up] in offsets {
                let offset_batch = batch.offset_by(0.5 * across * sample.state.pixel[0], up * sample.state.pixel[1]);
                let coordinates = coordinates(context.shape, &sample.state, &offset_batch);
                if let Some(mut shade) = shade_coordinates(context.shape, context.ramp, &sample.state, &coordinates) {
                    for plane in &mut shade.light {
                        *plane *= weight;
                    }
                    sums.add(&shade, batch.depth, sample.luminance, context.samples.len());
                }
            }
        },
    );
}

/// Whether there is certainly no flame in a range of columns between two rows.
#[inline(always)]
fn misses_flame(shape: &ShapeTables, sample: &TimeSample, columns: &Range<usize>, rows: [usize; 2]) -> bool {
    let (mut x, mut y) = ([0.0; 6], [0.0; 6]);
    let middle = (columns.start + columns.end) / 2;
    for (k, column) in [columns.start, middle, columns.end].into_iter().enumerate() {
        for (j, row) in rows.into_iter().enumerate() {
            let Some(point) = sample.pixel_to_sheet.pixel_center(column, row) else { return false };
            let point = sample.state.warp.unwarp_at(point);
            (x[3 * j + k], y[3 * j + k]) = (point[0], point[1]);
        }
    }
    shape.misses_flame(&x, &y)
}

/// Mean light and opacity of sixteen pixels over the exposure, and the depth of their nearest sample.
pub(crate) struct PixelSums<S: Simd> {
    light: [Lanes<S>; 4],
    depth: Lanes<S>,
    covered: bool,
}

impl<S: Simd> PixelSums<S> {
    #[inline(always)]
    pub(crate) fn new(simd: S) -> Self {
        Self { light: [Lanes::splat(simd, 0.0); 4], depth: Lanes::splat(simd, f32::INFINITY), covered: false }
    }

    #[inline(always)]
    pub(crate) fn add(&mut self, shade: &ShadedBatch<S>, depth: Lanes<S>, luminance: f32, samples: usize) {
        for (k, weight) in [luminance, luminance, luminance, 1.0 / samples as f32].into_iter().enumerate() {
            self.light[k] = shade.light[k].fma(depth.broadcast(weight), self.light[k]);
        }
        let nonzero = shade.light[0] + shade.light[2] + shade.light[3];
        self.depth = depth.broadcast(0.0).select_lt(nonzero, self.depth.simd_min(depth), self.depth);
        self.covered = true;
    }

    /// Composites the pixels behind the contents of the strip, where the plate does not hide them.
    #[inline(always)]
    pub(crate) fn composite(&self, column: usize, y: usize, rect: Rect, absorbs: bool, strip: &mut Strip) {
        if !self.covered {
            return;
        }
        let [red, green, blue, opacity] = self.light;
        if column >= rect.x && column + LANES <= rect.right() && !strip.has_plate() {
            let index = (y - strip.rect.y) * strip.rect.width + column - strip.rect.x;
            return strip.add_sixteen_behind(index, [red, green, blue], absorbs.then_some(opacity), self.depth);
        }
        let mut pixels = PixelArrays { light: [[0.0; LANES]; 4], depth: [0.0; LANES] };
        for k in 0..4 {
            self.light[k].store_slice(&mut pixels.light[k]);
        }
        self.depth.store_slice(&mut pixels.depth);
        composite(&pixels, column, y, rect, absorbs, strip);
    }
}

/// [`PixelSums`] as arrays.
struct PixelArrays {
    light: [[f32; LANES]; 4],
    depth: [f32; LANES],
}

/// Composites those of sixteen pixels that are inside `rect` behind the contents of the strip, where the plate does not hide them.
fn composite(pixels: &PixelArrays, column: usize, y: usize, rect: Rect, absorbs: bool, strip: &mut Strip) {
    let row = (y - strip.rect.y) * strip.rect.width;
    for lane in 0..LANES {
        let (x, depth) = (column + lane, pixels.depth[lane]);
        if !(rect.x..rect.right()).contains(&x) {
            continue;
        }
        let index = row + x - strip.rect.x;
        if depth.is_finite() && !strip.visible(index, depth) {
            continue;
        }
        let light = [0, 1, 2].map(|k| &pixels.light[k][lane..=lane]);
        strip.add_row_behind(index, light, absorbs.then_some(&pixels.light[3][lane..=lane]), &[depth]);
    }
}
