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

use super::{
    ramp::Ramp,
    shade::{Drawn, Sample, Shade, place, shade_as, shade_place},
    shape_tables::{Place, Shape},
};
use fearless_simd::{Simd, prelude::*};

/// What is drawn of one sheet.
#[derive(Clone, Copy)]
pub(crate) struct Paint<'a> {
    pub(crate) shape: &'a Shape,
    pub(crate) ramp: &'a Ramp,
    pub(crate) samples: &'a [Sample],
    pub(crate) drawn: Drawn,
    /// Whether it hides anything.
    pub(crate) absorbs: bool,
    /// Rows from one exact row to the next, a power of two.
    pub(crate) band: usize,
    /// Texels from one pixel to the next beyond which a pixel is drawn from several places, [`SQUEEZED`].
    pub(crate) squeezed: f32,
}

/// Texels from one pixel to the next that look-ups at their middles still show without dots and steps.
pub(crate) const SQUEEZED: f32 = 4.0;

/// Places within a squeezed pixel from its middle, pixels across and up: no two in one column or row.
const WITHIN: [[f32; 2]; 4] = [[-0.375, 0.125], [-0.125, -0.375], [0.125, 0.375], [0.375, -0.125]];
/// The same of a pixel that spans less than twice as many texels as show well.
const WITHIN_LITTLE: [[f32; 2]; 2] = [[-0.25, 0.25], [0.25, -0.25]];

/// Rows from one exact row to the next for a sheet of this height: 1 up to 255 pixels, 16 from 1024 on.
pub(crate) fn band_of(height_pixels: f64) -> usize {
    /// Rows of a band, and from which height on they are taken.
    const BANDS: [(usize, f64); 3] = [(16, 1024.0), (4, 512.0), (2, 256.0)];
    BANDS.into_iter().find(|(_, least)| height_pixels >= *least).map_or(1, |(rows, _)| rows)
}

/// Pixels of a row that are tried together for whether any flame can be there.
const GROUP: usize = 4 * LANES;

/// Draws all samples of one sheet into the part `rect` of `strip`, behind what it holds.
///
/// Batches begin at multiples of sixteen columns of the whole picture and bands at multiples of their height, so that strips and
/// crops change no pixel.
#[inline(always)]
pub(crate) fn draw_rows<S: Simd>(simd: S, paint: &Paint, rect: Rect, strip: &mut Strip) {
    let start = rect.x / LANES * LANES;
    let mut band = Band::new(paint);
    for group in (start..rect.right()).step_by(GROUP) {
        let end = (group + GROUP).min(rect.right());
        match paint.drawn {
            Drawn::Flame => draw_bands(simd, paint, group..end, rect, &mut band, strip),
            _ => draw_each_row(simd, paint, group..end, rect, strip),
        }
    }
}

#[inline(always)]
fn draw_each_row<S: Simd>(simd: S, paint: &Paint, columns: Range<usize>, rect: Rect, strip: &mut Strip) {
    for y in rect.y..rect.bottom() {
        for column in columns.clone().step_by(LANES) {
            let mut sums = Sums::new(simd);
            for sample in paint.samples {
                let batch = sample.mapping.batch(simd, column, y);
                if let Some(shade) = shade_as(paint.shape, paint.ramp, sample, paint.drawn, &batch) {
                    sums.add(&shade, batch.depth, sample.luminance, paint.samples.len());
                }
            }
            sums.compose(column, y, rect, paint.absorbs, strip);
        }
    }
}

/// Sixteen points of one sample, and how far they are from the camera.
#[derive(Clone, Copy)]
struct Spot<S: Simd> {
    place: Place<S>,
    depth: Lanes<S>,
    /// The most texels that a pixel spans, in those that show well with one look-up.
    squeezed: f32,
}

/// What is known of the rows of a band, batch after batch and in each all samples.
struct Band<S: Simd> {
    /// Exact places on the first row.
    first: Vec<Spot<S>>,
    /// How they differ on the first row of the next band.
    change: Vec<Spot<S>>,
    /// Exact places on that row.
    next: Vec<Spot<S>>,
}

impl<S: Simd> Band<S> {
    /// Room for a group of columns.
    #[inline(always)]
    fn new(paint: &Paint) -> Self {
        let room = || Vec::with_capacity(GROUP / LANES * paint.samples.len());
        Self { first: room(), change: room(), next: room() }
    }

    /// Forgets both rows: what comes next does not follow on them.
    #[inline(always)]
    fn clear(&mut self) {
        self.first.clear();
        self.next.clear();
    }

    /// Moves on to the band that begins at `row`.
    #[inline(always)]
    fn advance(&mut self, simd: S, paint: &Paint, columns: &Range<usize>, row: usize) {
        std::mem::swap(&mut self.first, &mut self.next);
        if self.first.is_empty() {
            add_spots(simd, paint, columns, row, &mut self.first);
        }
        self.next.clear();
        self.change.clear();
        if paint.band > 1 {
            add_spots(simd, paint, columns, row + paint.band, &mut self.next);
            for (first, next) in self.first.iter().zip(&self.next) {
                let squeezed = first.squeezed.max(next.squeezed);
                self.change.push(Spot {
                    place: next.place.less(&first.place),
                    depth: next.depth - first.depth,
                    squeezed,
                });
            }
        }
    }
}

/// Draws the flame in some columns, band after band; the last row of a band is the first of the next.
#[inline(always)]
fn draw_bands<S: Simd>(
    simd: S,
    paint: &Paint,
    columns: Range<usize>,
    rect: Rect,
    band: &mut Band<S>,
    strip: &mut Strip,
) {
    band.clear();
    let batches = columns.len().div_ceil(LANES);
    for first in (rect.y / paint.band * paint.band..rect.bottom()).step_by(paint.band) {
        if paint.samples.iter().all(|sample| dark(paint.shape, sample, &columns, [first, first + paint.band])) {
            band.clear();
            continue;
        }
        band.advance(simd, paint, &columns, first);
        for row in first.max(rect.y)..(first + paint.band).min(rect.bottom()) {
            let part = (row - first) as f32 / paint.band as f32;
            for batch in 0..batches {
                let share = batch * paint.samples.len()..(batch + 1) * paint.samples.len();
                let change = band.change.get(share.clone()).unwrap_or(&[]);
                let column = columns.start + batch * LANES;
                let sums = expose(simd, paint, &band.first[share], change, part, [column, row]);
                sums.compose(column, row, rect, paint.absorbs, strip);
            }
        }
    }
}

/// Exact places of all samples on a row, batch after batch.
#[inline(always)]
fn add_spots<S: Simd>(simd: S, paint: &Paint, columns: &Range<usize>, row: usize, spots: &mut Vec<Spot<S>>) {
    for column in columns.clone().step_by(LANES) {
        for sample in paint.samples {
            let batch = sample.mapping.batch(simd, column, row);
            let place = place(paint.shape, &sample.state, &batch);
            let squeezed = place.span(sample.state.texels()) / paint.squeezed;
            spots.push(Spot { place, depth: batch.depth, squeezed });
        }
    }
}

/// Averages all samples of the sixteen pixels from `pixel` on, `part` of the way between two exact rows.
#[inline(always)]
fn expose<S: Simd>(
    simd: S,
    paint: &Paint,
    spots: &[Spot<S>],
    changes: &[Spot<S>],
    part: f32,
    pixel: [usize; 2],
) -> Sums<S> {
    let mut sums = Sums::new(simd);
    for (index, (sample, spot)) in paint.samples.iter().zip(spots).enumerate() {
        let (place, depth) = match changes.get(index) {
            Some(change) => {
                (spot.place.moved(part, &change.place), change.depth.fma(spot.depth.broadcast(part), spot.depth))
            }
            None => (spot.place, spot.depth),
        };
        let Some(shade) = shade_place(paint.shape, paint.ramp, &sample.state, &place) else { continue };
        let squeezed = changes.get(index).map_or(spot.squeezed, |change| change.squeezed);
        if squeezed > 1.0 {
            let within: &[_] = if squeezed > 2.0 { &WITHIN } else { &WITHIN_LITTLE };
            add_squeezed(simd, paint, sample, pixel, within, &mut sums);
        } else {
            sums.add(&shade, depth, sample.luminance, paint.samples.len());
        }
    }
    sums
}

/// Adds a sample of sixteen pixels as the mean over several places in each.
fn add_squeezed<S: Simd>(
    simd: S,
    paint: &Paint,
    sample: &Sample,
    pixel: [usize; 2],
    within: &[[f32; 2]],
    sums: &mut Sums<S>,
) {
    simd.vectorize(
        #[inline(always)]
        || {
            let batch = sample.mapping.batch(simd, pixel[0], pixel[1]);
            let share = 1.0 / within.len() as f32;
            for &[across, up] in within {
                let near = batch.moved(0.5 * across * sample.state.pixel[0], up * sample.state.pixel[1]);
                let place = place(paint.shape, &sample.state, &near);
                if let Some(mut shade) = shade_place(paint.shape, paint.ramp, &sample.state, &place) {
                    for plane in &mut shade.light {
                        *plane *= share;
                    }
                    sums.add(&shade, batch.depth, sample.luminance, paint.samples.len());
                }
            }
        },
    );
}

/// Whether no flame can be in some columns between two rows.
#[inline(always)]
fn dark(shape: &Shape, sample: &Sample, columns: &Range<usize>, rows: [usize; 2]) -> bool {
    let (mut x, mut y) = ([0.0; 6], [0.0; 6]);
    let middle = (columns.start + columns.end) / 2;
    for (k, column) in [columns.start, middle, columns.end].into_iter().enumerate() {
        for (j, row) in rows.into_iter().enumerate() {
            let Some(point) = sample.mapping.glance(column, row) else { return false };
            let point = sample.state.moment.straighten_at(point);
            (x[3 * j + k], y[3 * j + k]) = (point[0], point[1]);
        }
    }
    shape.out_of_reach(&x, &y)
}

/// Mean light and opacity of sixteen pixels over the exposure, and the nearest depth at which they see anything.
struct Sums<S: Simd> {
    light: [Lanes<S>; 4],
    depth: Lanes<S>,
    touched: bool,
}

impl<S: Simd> Sums<S> {
    #[inline(always)]
    fn new(simd: S) -> Self {
        Self { light: [Lanes::splat(simd, 0.0); 4], depth: Lanes::splat(simd, f32::INFINITY), touched: false }
    }

    #[inline(always)]
    fn add(&mut self, shade: &Shade<S>, depth: Lanes<S>, luminance: f32, samples: usize) {
        for (k, weight) in [luminance, luminance, luminance, 1.0 / samples as f32].into_iter().enumerate() {
            self.light[k] = shade.light[k].fma(depth.broadcast(weight), self.light[k]);
        }
        let something = shade.light[0] + shade.light[2] + shade.light[3];
        self.depth = depth.broadcast(0.0).select_lt(something, self.depth.simd_min(depth), self.depth);
        self.touched = true;
    }

    /// Moves the pixels behind what the strip holds, where the plate does not hide them.
    #[inline(always)]
    fn compose(&self, column: usize, y: usize, rect: Rect, absorbs: bool, strip: &mut Strip) {
        if !self.touched {
            return;
        }
        let [red, green, blue, opacity] = self.light;
        if column >= rect.x && column + LANES <= rect.right() && !strip.has_plate() {
            let index = (y - strip.rect.y) * strip.rect.width + column - strip.rect.x;
            return strip.add_sixteen_behind(index, [red, green, blue], absorbs.then_some(opacity), self.depth);
        }
        let mut pixels = Exposed { light: [[0.0; LANES]; 4], depth: [0.0; LANES] };
        for k in 0..4 {
            self.light[k].store_slice(&mut pixels.light[k]);
        }
        self.depth.store_slice(&mut pixels.depth);
        compose(&pixels, column, y, rect, absorbs, strip);
    }
}

/// [`Sums`] as plain numbers.
struct Exposed {
    light: [[f32; LANES]; 4],
    depth: [f32; LANES],
}

/// Moves those of sixteen pixels that lie in `rect` behind what the strip holds, where the plate does not hide them.
fn compose(pixels: &Exposed, column: usize, y: usize, rect: Rect, absorbs: bool, strip: &mut Strip) {
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
