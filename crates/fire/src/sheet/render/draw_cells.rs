//! Shades the cells of a sheet, sixteen at a time, and spreads their light over pixels.

use bansho_base::{
    camera::{Camera, Lens, upright_quad::UprightQuad},
    color,
    image::Rect,
    math::{
        self, DVec2,
        simd::{LANES, Lanes, Real, ramp},
    },
    phenomenon::strip::{Strip, View},
};
use fearless_simd::{Simd, prelude::*};

use crate::sheet::{
    animate::warp::WarpState,
    model::{FlameInstance, FlameSheet},
    render::{
        aovs::{MOTION, OPTICAL_DEPTH, TEMPERATURE},
        cells::{PATCHES, Projected, ProjectedCells},
        projection::SheetCoordinates,
        shade::{ShadedBatch, SheetContent, TimeSample, shade_sample},
    },
};

/// A sheet at one time of the exposure that is drawn in cells.
pub(crate) trait CellSample {
    /// Its cells.
    fn cells(&self) -> Option<&ProjectedCells>;
    /// Light and opacity at sixteen points.
    fn shade<S: Simd>(&self, sheet: &FlameSheet, batch: &SheetCoordinates<S>) -> Option<ShadedBatch<S>>;
    /// Factor of the light for one of so many samples.
    fn luminance(&self, samples: usize) -> f32;
    /// Temperature at T1, K; `None` for smoke and textures, which have none.
    fn temperature(&self, sheet: &FlameSheet, t1: f32) -> Option<f32>;
    /// The sheet's quad in the world, and its warp.
    fn geometry(&self) -> (&UprightQuad, &WarpState);
}

/// A time sample of a small sheet, with what it shows.
pub(crate) struct TextureCells<'a>(pub(crate) &'a TimeSample, pub(crate) SheetContent);

impl CellSample for TextureCells<'_> {
    fn cells(&self) -> Option<&ProjectedCells> {
        self.0.cells.as_ref()
    }

    fn shade<S: Simd>(&self, sheet: &FlameSheet, batch: &SheetCoordinates<S>) -> Option<ShadedBatch<S>> {
        shade_sample(sheet.shape(), sheet.ramp(), self.0, self.1, batch)
    }

    fn luminance(&self, _samples: usize) -> f32 {
        self.0.luminance
    }

    fn temperature(&self, sheet: &FlameSheet, t1: f32) -> Option<f32> {
        (self.1 == SheetContent::Flame).then(|| sheet.ramp().temperature.at(t1)[0])
    }

    fn geometry(&self) -> (&UprightQuad, &WarpState) {
        (&self.0.quad, &self.0.state.warp)
    }
}

/// A small sheet with the inputs of drawing.
pub(crate) struct CellContext<'a, T> {
    pub(crate) sheet: &'a FlameSheet,
    pub(crate) flame: &'a FlameInstance,
    pub(crate) view: &'a View,
    pub(crate) samples: &'a [T],
    /// Whether it absorbs light from behind.
    pub(crate) absorbs: bool,
}

/// Sums over the pixels of a part of a strip. Their memory is reused from strip to strip.
#[derive(Default)]
pub(crate) struct CellSums {
    rect: Rect,
    /// Light and opacity.
    light: Vec<[f32; 4]>,
    /// Depth of the nearest cell with light or opacity, m.
    depth: Vec<f32>,
    /// Depth from which on cells are hidden, by the plate or outside the circle of a fisheye; empty if nothing hides them.
    limit: Vec<f32>,
    /// A row of pixels by component.
    planes: [Vec<f32>; 4],
}

impl CellSums {
    /// Starts empty sums over the pixels `rect` of a strip.
    fn reset(&mut self, rect: Rect, camera: &Camera, strip: &Strip) {
        let pixels = rect.width * rect.height;
        let may_hide = strip.has_plate() || camera.lens == Lens::Fisheye;
        self.rect = rect;
        self.light.clear();
        self.light.resize(pixels, [0.0; 4]);
        self.depth.clear();
        self.depth.resize(pixels, f32::INFINITY);
        self.limit.clear();
        if may_hide {
            for y in rect.y..rect.bottom() {
                for x in rect.x..rect.right() {
                    let is_shown = camera.direction(DVec2::new(x as f64 + 0.5, y as f64 + 0.5)).is_some();
                    let index = (y - strip.rect.y) * strip.rect.width + x - strip.rect.x;
                    self.limit.push(if is_shown { strip.plate_depth(index) } else { f32::NEG_INFINITY });
                }
            }
        }
    }

    /// Composites the pixels behind the contents of the strip.
    fn composite(&mut self, absorbs: bool, strip: &mut Strip) {
        let planes = &mut self.planes;
        for row in 0..self.rect.height {
            let pixels = row * self.rect.width..(row + 1) * self.rect.width;
            for (k, plane) in planes.iter_mut().enumerate() {
                plane.clear();
                plane.extend(self.light[pixels.clone()].iter().map(|light| light[k]));
            }
            planes[3].iter_mut().for_each(|opacity| *opacity = opacity.min(1.0));
            let first = (self.rect.y + row - strip.rect.y) * strip.rect.width + self.rect.x - strip.rect.x;
            let [red, green, blue, opacity] = planes.each_ref().map(Vec::as_slice);
            strip.add_row_behind(first, [red, green, blue], absorbs.then_some(opacity), &self.depth[pixels]);
        }
    }
}

/// A cell in the picture: an upright box with the area that the cell covers.
#[derive(Clone, Copy)]
struct CellBox {
    /// Pixel from which the center counts, itself counted from the corner of the sums.
    pixel: [isize; 2],
    /// Low sides, pixels.
    low: [f32; 2],
    /// High sides, pixels.
    high: [f32; 2],
    /// 1 over its sides, 1/pixel.
    inverse: [f32; 2],
    /// Area, pixels.
    area: f32,
    depth: f32,
}

impl CellBox {
    /// The pixels along an axis that it covers, of `count`, and the fraction of it that each covers.
    #[inline(always)]
    fn covered(&self, axis: usize, count: usize) -> impl Iterator<Item = (usize, f32)> + use<> {
        let (low, high, inverse) = (self.low[axis], self.high[axis], self.inverse[axis]);
        let shift = self.pixel[axis];
        let (first, end) = (low.floor() as isize, high.ceil() as isize);
        (first.max(-shift)..end.min(count as isize - shift)).map(move |pixel| {
            let (start, end) = (pixel as f32, (pixel + 1) as f32);
            let (left, right) = (if low > start { low } else { start }, if high < end { high } else { end });
            let fraction = (right - left) * inverse;
            ((pixel + shift) as usize, if fraction > 0.0 { fraction } else { 0.0 })
        })
    }
}

/// The boxes of sixteen cells of a row, by component. Computed for all at once, since that takes longer than adding them to the sums one by one.
struct CellBoxes {
    low: [[f32; LANES]; 2],
    high: [[f32; LANES]; 2],
    inverse: [[f32; LANES]; 2],
    area: [f32; LANES],
    depth: [f32; LANES],
}

impl CellBoxes {
    /// The boxes of the cells from column `first` on of a row whose center line has these knots, with the vectors up to the next row there.
    #[inline(always)]
    fn new(
        first: usize,
        knots: &[Projected; PATCHES + 1],
        ups: &[[f32; 2]; PATCHES + 1],
        knots_per_column: f32,
        place: Place,
    ) -> Self {
        const MIN_HALF: f32 = 1e-6;
        // Those of the knots on both sides of each cell: x, y and depth, and the vectors up.
        let (mut fractions, mut left_knots, mut right_knots) = ([0.0; LANES], [[0.0; LANES]; 3], [[0.0; LANES]; 3]);
        let (mut left_ups, mut right_ups) = ([[0.0; LANES]; 2], [[0.0; LANES]; 2]);
        for lane in 0..LANES {
            let along = (first as f32 + lane as f32 + 0.5) * knots_per_column;
            let left = (along as usize).min(PATCHES - 1);
            fractions[lane] = along - left as f32;
            let (knot, next) = (&knots[left], &knots[left + 1]);
            [left_knots[0][lane], left_knots[1][lane], left_knots[2][lane]] = [knot.x, knot.y, knot.depth];
            [right_knots[0][lane], right_knots[1][lane], right_knots[2][lane]] = [next.x, next.y, next.depth];
            [left_ups[0][lane], left_ups[1][lane]] = ups[left];
            [right_ups[0][lane], right_ups[1][lane]] = ups[left + 1];
        }
        let [fraction_x, fraction_y] = place.fraction;
        let mut boxes = Self {
            low: [[0.0; LANES]; 2],
            high: [[0.0; LANES]; 2],
            inverse: [[0.0; LANES]; 2],
            area: [0.0; LANES],
            depth: [0.0; LANES],
        };
        for lane in 0..LANES {
            let fraction = fractions[lane];
            let [dx, dy, dz] = [0, 1, 2].map(|c| right_knots[c][lane] - left_knots[c][lane]);
            let across = [dx * knots_per_column, dy * knots_per_column];
            let up_x = (right_ups[0][lane] - left_ups[0][lane]).fma(fraction, left_ups[0][lane]);
            let up_y = (right_ups[1][lane] - left_ups[1][lane]).fma(fraction, left_ups[1][lane]);
            let area = (across[0] * up_y - across[1] * up_x).abs();
            let (width, height) = (across[0].abs() + up_x.abs(), across[1].abs() + up_y.abs());
            // A parallelogram fills its bounds only if its sides are those of the picture; the box is smaller by as much.
            let scale = 0.5 * (area / (width * height).max(f32::MIN_POSITIVE)).min(1.0).sqrt();
            let (half_x, half_y) = ((width * scale).max(MIN_HALF), (height * scale).max(MIN_HALF));
            let center_x = dx.fma(fraction, left_knots[0][lane]) + fraction_x;
            let center_y = dy.fma(fraction, left_knots[1][lane]) + fraction_y;
            (boxes.low[0][lane], boxes.high[0][lane]) = (center_x - half_x, center_x + half_x);
            (boxes.low[1][lane], boxes.high[1][lane]) = (center_y - half_y, center_y + half_y);
            (boxes.inverse[0][lane], boxes.inverse[1][lane]) = (0.5 / half_x, 0.5 / half_y);
            boxes.area[lane] = area;
            boxes.depth[lane] = dz.fma(fraction, left_knots[2][lane]);
        }
        boxes
    }

    /// That of one cell.
    #[inline(always)]
    fn get(&self, lane: usize, place: Place) -> CellBox {
        CellBox {
            pixel: place.pixel,
            low: [self.low[0][lane], self.low[1][lane]],
            high: [self.high[0][lane], self.high[1][lane]],
            inverse: [self.inverse[0][lane], self.inverse[1][lane]],
            area: self.area[lane],
            depth: self.depth[lane],
        }
    }
}

/// Draws all time samples of a small sheet into `rect` of `strip`, behind its current contents, and adds the AOVs that it has planes for.
///
/// The cells of a pixel are added in one order, whatever the strip.
#[inline(always)]
pub(crate) fn draw_cells<S: Simd, T: CellSample>(
    simd: S,
    context: &CellContext<T>,
    rect: Rect,
    sums: &mut CellSums,
    strip: &mut Strip,
) {
    sums.reset(rect, &context.view.camera, strip);
    for sample in context.samples {
        let Some(cells) = sample.cells() else { continue };
        for offset in cells.repetitions(context.view.size[0]) {
            let place = Place::new([cells.origin[0] + offset, cells.origin[1]], rect);
            for row in 0..cells.grid.rows {
                draw_cell_row(simd, context, sample, cells, (row, place), sums, strip);
            }
        }
    }
    sums.composite(context.absorbs, strip);
}

/// Where the points of a projected sheet are in the sums. Fractions of pixels do not depend on the sums, so that the cells of a pixel add to the same bits.
#[derive(Clone, Copy)]
struct Place {
    /// Pixels from a corner of a pixel to the origin of the points.
    fraction: [f32; 2],
    /// That pixel, counted from the corner of the sums.
    pixel: [isize; 2],
}

impl Place {
    fn new(origin: [f64; 2], rect: Rect) -> Self {
        let [x, y] = origin.map(|at| at.floor() as isize);
        Self { fraction: origin.map(|at| (at - at.floor()) as f32), pixel: [x - rect.x as isize, y - rect.y as isize] }
    }
}

/// Draws a row of cells at a place.
#[inline(always)]
fn draw_cell_row<S: Simd, T: CellSample>(
    simd: S,
    context: &CellContext<T>,
    sample: &T,
    cells: &ProjectedCells,
    (row, place): (usize, Place),
    sums: &mut CellSums,
    strip: &mut Strip,
) {
    let grid = &cells.grid;
    let height = (row as f32 + 0.5) / grid.rows as f32 * PATCHES as f32;
    let below = (height as usize).min(PATCHES - 1);
    let fraction = height - below as f32;
    let up_scale = PATCHES as f32 / grid.rows as f32;
    // The row's center line between the patches, and the vectors up to the next row.
    let (mut knots, mut ups) = (cells.points[below], [[0.0; 2]; PATCHES + 1]);
    for (i, above) in cells.points[below + 1].iter().enumerate() {
        ups[i] = above.step_from(&knots[i], up_scale);
        knots[i] = knots[i].lerp(above, fraction);
    }
    if misses_rows(&knots, &ups, place.pixel[1], sums.rect.height) {
        return;
    }
    let knots_per_column = PATCHES as f32 / cells.columns as f32;
    let cell_width = 1.0 / grid.columns as f32;
    let y = Lanes::splat(simd, ((row as f64 + 0.5) / grid.rows as f64 * grid.top) as f32);
    for first in (0..cells.columns).step_by(LANES) {
        let x = ramp(simd, ((cells.first_column + first as isize) as f32 + 0.5) * cell_width, cell_width);
        let batch = SheetCoordinates { x, y, depth: y.broadcast(1.0) };
        let Some(shade) = sample.shade(context.sheet, &batch) else { continue };
        let mut light = [[0.0; LANES]; 4];
        for (plane, values) in shade.light.iter().zip(&mut light) {
            plane.store_slice(values);
        }
        let boxes = CellBoxes::new(first, &knots, &ups, knots_per_column, place);
        for lane in 0..LANES.min(cells.columns - first) {
            let values = [light[0][lane], light[1][lane], light[2][lane], light[3][lane]];
            if values == [0.0; 4] {
                continue;
            }
            let cell = boxes.get(lane, place);
            let coordinates = [x[lane], y[lane]];
            add_cell(context, sample, &cell, (values, shade.t1[lane], coordinates), sums, strip);
        }
    }
}

/// Whether a row of cells certainly covers none of the rows of pixels.
fn misses_rows(knots: &[Projected; PATCHES + 1], ups: &[[f32; 2]; PATCHES + 1], first_row: isize, rows: usize) -> bool {
    let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
    for (index, (knot, up)) in knots.iter().zip(ups).enumerate() {
        let along = knots[(index + 1).min(PATCHES)].y - knots[index.saturating_sub(1)].y;
        let reach = up[0].abs() + up[1].abs() + along.abs();
        (low, high) = (low.min(knot.y - reach), high.max(knot.y + reach));
    }
    // The fraction of the place is less than a pixel.
    let first = first_row as f32;
    high + first + 1.0 < 0.0 || low + first > rows as f32
}

/// Spreads a cell, of light and opacity `values`, over the pixels that it covers.
#[inline(always)]
fn add_cell<T: CellSample>(
    context: &CellContext<T>,
    sample: &T,
    cell: &CellBox,
    (values, t1, coordinates): ([f32; 4], f32, [f32; 2]),
    sums: &mut CellSums,
    strip: &mut Strip,
) {
    let luminance = sample.luminance(context.samples.len()) * cell.area;
    let opacity_weight = cell.area / context.samples.len() as f32;
    let [width, height] = [sums.rect.width, sums.rect.height];
    for (y, fraction_y) in cell.covered(1, height) {
        for (x, fraction_x) in cell.covered(0, width) {
            let (index, fraction) = (y * width + x, fraction_x * fraction_y);
            if fraction <= 0.0 || sums.limit.get(index).is_some_and(|limit| cell.depth >= *limit) {
                continue;
            }
            let (light_weight, sum) = (fraction * luminance, &mut sums.light[index]);
            *sum = [
                values[0].fma(light_weight, sum[0]),
                values[1].fma(light_weight, sum[1]),
                values[2].fma(light_weight, sum[2]),
                values[3].fma(fraction * opacity_weight, sum[3]),
            ];
            let nearest = &mut sums.depth[index];
            *nearest = if cell.depth < *nearest { cell.depth } else { *nearest };
        }
    }
    if !strip.aovs.is_empty() {
        add_cell_aovs(context, sample, cell, (values, t1, coordinates), sums, strip);
    }
}

/// Adds the AOVs of a cell to those of the pixels that it covers.
fn add_cell_aovs<T: CellSample>(
    context: &CellContext<T>,
    sample: &T,
    cell: &CellBox,
    (values, t1, coordinates): ([f32; 4], f32, [f32; 2]),
    sums: &CellSums,
    strip: &mut Strip,
) {
    let count = context.samples.len();
    let optical_depth = -math::f32::ln_1p(-values[3].min(0.999_999)) * cell.area / count as f32;
    let weight = color::luminance([values[0], values[1], values[2]]) * sample.luminance(count) * cell.area;
    let temperature = sample.temperature(context.sheet, t1).filter(|_| weight > 0.0);
    let (quad, warp) = sample.geometry();
    let motion =
        temperature.map(|_| context.sheet.motion(context.flame, context.view, quad, warp, coordinates.map(f64::from)));
    let rect = sums.rect;
    for (y, fraction_y) in cell.covered(1, rect.height) {
        for (x, fraction_x) in cell.covered(0, rect.width) {
            let fraction = fraction_x * fraction_y;
            if fraction <= 0.0 || sums.limit.get(y * rect.width + x).is_some_and(|limit| cell.depth >= *limit) {
                continue;
            }
            let index = (rect.y + y - strip.rect.y) * strip.rect.width + rect.x + x - strip.rect.x;
            strip.aovs[OPTICAL_DEPTH].add(index, optical_depth * fraction, 1.0);
            if let (Some(kelvin), Some(motion)) = (temperature, motion) {
                strip.aovs[TEMPERATURE].add(index, kelvin, weight * fraction);
                for (plane, value) in MOTION.into_iter().zip(motion) {
                    strip.aovs[plane].add(index, value, weight * fraction);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests;
