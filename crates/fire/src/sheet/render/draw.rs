//! Sheets drawn into strips, sixteen pixels at a time.
//!
//! Where a pixel lies on the flame, its threshold and its glow change slowly from row to row of a large picture. They are found exactly on
//! every second, fourth or sixteenth row and taken as straight between; texture and colour are looked up for every pixel. Where the mapping
//! squeezes the texture, at the flame's foot and in its fringe, a pixel spans many texels: there it is the mean of several exact places.

use std::ops::Range;

use bansho_base::{
    image::Rect,
    math::simd::{LANES, Lanes, Real},
    phenomenon::strip::Strip,
};

use super::shade::{ShadedBatch, SheetContent, TimeSample, coordinates, shade_coordinates, shade_sample};
use crate::sheet::render::{
    color_ramp::ColorRamp,
    curve_tables::{FlameCoordinates, ShapeTables},
};
use fearless_simd::{Simd, prelude::*};

/// What is drawn of one sheet.
#[derive(Clone, Copy)]
pub(crate) struct DrawContext<'a> {
    pub(crate) shape: &'a ShapeTables,
    pub(crate) ramp: &'a ColorRamp,
    pub(crate) samples: &'a [TimeSample],
    pub(crate) content: SheetContent,
    /// Whether it hides anything.
    pub(crate) absorbs: bool,
    /// Rows from one exact row to the next, a power of two.
    pub(crate) row_band: usize,
    /// Texels from one pixel to the next beyond which a pixel is drawn from several places, [`MAX_MINIFICATION`].
    pub(crate) minification: f32,
}

/// Texels from one pixel to the next that look-ups at their middles still show without dots and steps.
pub(crate) const MAX_MINIFICATION: f32 = 4.0;

/// Places within a squeezed pixel from its middle, pixels across and up: no two in one column or row.
const SUPERSAMPLES_4: [[f32; 2]; 4] = [[-0.375, 0.125], [-0.125, -0.375], [0.125, 0.375], [0.375, -0.125]];
/// The same of a pixel that spans less than twice as many texels as show well.
const SUPERSAMPLES_2: [[f32; 2]; 2] = [[-0.25, 0.25], [0.25, -0.25]];

/// Rows from one exact row to the next for a sheet of this height: 1 up to 255 pixels, 16 from 1024 on.
pub(crate) fn row_band_height(height_pixels: f64) -> usize {
    /// Rows of a row_band, and from which height on they are taken.
    const BANDS: [(usize, f64); 3] = [(16, 1024.0), (4, 512.0), (2, 256.0)];
    BANDS.into_iter().find(|(_, least)| height_pixels >= *least).map_or(1, |(rows, _)| rows)
}

/// Pixels of a row that are tried together for whether any flame can be there.
const GROUP_COLUMNS: usize = 4 * LANES;

/// Draws all samples of one sheet into the part `rect` of `strip`, behind what it holds.
///
/// Batches begin at multiples of sixteen columns of the whole picture and bands at multiples of their height, so that strips and
/// crops change no pixel.
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

/// Sixteen points of one sample, and how far they are from the camera.
#[derive(Clone, Copy)]
struct SheetSamples<S: Simd> {
    coordinates: FlameCoordinates<S>,
    depth: Lanes<S>,
    /// The most texels that a pixel spans, in those that show well with one look-up.
    minification: f32,
}

/// What is known of the rows of a row_band, batch after batch and in each all samples.
struct RowBand<S: Simd> {
    /// Exact places on the first row.
    first: Vec<SheetSamples<S>>,
    /// How they differ on the first row of the next row_band.
    delta: Vec<SheetSamples<S>>,
    /// Exact places on that row.
    next: Vec<SheetSamples<S>>,
}

impl<S: Simd> RowBand<S> {
    /// Room for a group of columns.
    #[inline(always)]
    fn new(context: &DrawContext) -> Self {
        let room = || Vec::with_capacity(GROUP_COLUMNS / LANES * context.samples.len());
        Self { first: room(), delta: room(), next: room() }
    }

    /// Forgets both rows: what comes next does not follow on them.
    #[inline(always)]
    fn clear(&mut self) {
        self.first.clear();
        self.next.clear();
    }

    /// Moves on to the row_band that begins at `row`.
    #[inline(always)]
    fn advance(&mut self, simd: S, context: &DrawContext, columns: &Range<usize>, row: usize) {
        std::mem::swap(&mut self.first, &mut self.next);
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

/// Draws the flame in some columns, row_band after row_band; the last row of a row_band is the first of the next.
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
                let spots = batch * context.samples.len()..(batch + 1) * context.samples.len();
                let delta = row_band.delta.get(spots.clone()).unwrap_or(&[]);
                let column = columns.start + batch * LANES;
                let sums = average_samples(simd, context, &row_band.first[spots], delta, fraction, [column, row]);
                sums.composite(column, row, rect, context.absorbs, strip);
            }
        }
    }
}

/// Exact places of all samples on a row, batch after batch.
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
            let minification = coordinates.span(sample.state.texels()) / context.minification;
            samples_of_row.push(SheetSamples { coordinates, depth: batch.depth, minification });
        }
    }
}

/// Averages all samples of the sixteen pixels from `pixel` on, `fraction` of the way between two exact rows.
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

/// Adds a sample of sixteen pixels as the mean over several places in each.
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
            let spots = 1.0 / offsets.len() as f32;
            for &[across, up] in offsets {
                let near = batch.offset_by(0.5 * across * sample.state.pixel[0], up * sample.state.pixel[1]);
                let coordinates = coordinates(context.shape, &sample.state, &near);
                if let Some(mut shade) = shade_coordinates(context.shape, context.ramp, &sample.state, &coordinates) {
                    for plane in &mut shade.light {
                        *plane *= spots;
                    }
                    sums.add(&shade, batch.depth, sample.luminance, context.samples.len());
                }
            }
        },
    );
}

/// Whether no flame can be in some columns between two rows.
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

/// Mean light and opacity of sixteen pixels over the exposure, and the nearest depth at which they see anything.
struct PixelSums<S: Simd> {
    light: [Lanes<S>; 4],
    depth: Lanes<S>,
    covered: bool,
}

impl<S: Simd> PixelSums<S> {
    #[inline(always)]
    fn new(simd: S) -> Self {
        Self { light: [Lanes::splat(simd, 0.0); 4], depth: Lanes::splat(simd, f32::INFINITY), covered: false }
    }

    #[inline(always)]
    fn add(&mut self, shade: &ShadedBatch<S>, depth: Lanes<S>, luminance: f32, samples: usize) {
        for (k, weight) in [luminance, luminance, luminance, 1.0 / samples as f32].into_iter().enumerate() {
            self.light[k] = shade.light[k].fma(depth.broadcast(weight), self.light[k]);
        }
        let nonzero = shade.light[0] + shade.light[2] + shade.light[3];
        self.depth = depth.broadcast(0.0).select_lt(nonzero, self.depth.simd_min(depth), self.depth);
        self.covered = true;
    }

    /// Moves the pixels behind what the strip holds, where the plate does not hide them.
    #[inline(always)]
    fn composite(&self, column: usize, y: usize, rect: Rect, absorbs: bool, strip: &mut Strip) {
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

/// [`PixelSums`] as plain numbers.
struct PixelArrays {
    light: [[f32; LANES]; 4],
    depth: [f32; LANES],
}

/// Moves those of sixteen pixels that lie in `rect` behind what the strip holds, where the plate does not hide them.
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
