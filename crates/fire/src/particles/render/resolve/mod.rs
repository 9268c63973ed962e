//! Resolves summed sprites to light and opacity, row by row and layer by layer, sixteen pixels at a time.

use bansho_base::{
    camera::{Camera, Lens},
    color,
    image::Rect,
    math::{
        DVec2, DVec3, approximations,
        simd::{LANES, LaneArray},
    },
    phenomenon::strip::Strip,
};

use crate::particles::render::{
    resolve::{
        detail::{Detail, DetailFactors},
        strain::Strain,
        upsample::RowInterpolator,
    },
    splat::grid::{Grid, weighted_sum},
};

pub(crate) mod detail;
pub(crate) mod strain;
pub(crate) mod upsample;

/// Values per cell and layer: one SIMD vector.
pub(crate) const PLANES: usize = 8;
/// Plane of the optical depth of soot.
pub(crate) const TAU: usize = 0;
/// Plane of optical depth times luminance of a black body at the particle's temperature.
pub(crate) const LUMINANCE: usize = 1;
/// Plane of that times temperature.
pub(crate) const LUMINANCE_KELVIN: usize = 2;
/// Three planes of optical depth times offset in the detail noise.
pub(crate) const DETAIL_OFFSET: usize = 3;
/// Plane of the luminance of CH and C2.
pub(crate) const BLUE: usize = 6;
/// Plane of the optical path difference to air, in pixels, for heat haze.
pub(crate) const PATH: usize = 7;

/// Minimum of optical depths and luminances that are divided by.
const MIN_DEPTH: f32 = 1e-30;

/// Converts sums of sprites to light.
pub(crate) struct GasResolver<'a> {
    pub(crate) grid: &'a Grid<'a>,
    pub(crate) camera: &'a Camera,
    /// Origin of detail coordinates, m.
    pub(crate) origin: DVec3,
    pub(crate) detail: Option<(&'a Detail, &'a Strain)>,
    /// Whether soot absorbs its own light, `B (1 - exp(-tau))`, or emission is the plain sum (the paper).
    pub(crate) self_absorption: bool,
    /// Color of CH and C2: ACEScg of luminance 1.
    pub(crate) blue: [f32; 3],
    /// Radiance that opaque soot of each layer scatters toward the camera, ACEScg, cd/m^2.
    pub(crate) scattered: &'a [[f32; 3]],
    /// Spline weights for each pixel phase within a cell.
    pub(crate) weights: &'a [[f32; 4]],
    /// Interpolation along rows.
    pub(crate) row_interpolator: &'a RowInterpolator,
    /// Minimum and maximum temperature of the gas, K.
    pub(crate) temperatures: [f32; 2],
}

/// One depth layer of the gas.
pub(crate) struct DepthLayer {
    pub(crate) index: usize,
    /// Depth of its center, m.
    pub(crate) depth: f64,
    pub(crate) thickness: f64,
}

/// One row of cells, interpolated vertically.
pub(crate) struct ResolvedRow {
    /// Sums of all layers.
    sums: Vec<f32>,
    /// Detail strain of the layer that was filled last.
    strain: Vec<f32>,
}

/// Sums of one layer at sixteen pixels.
pub(crate) struct LayerSums {
    pub(crate) tau: LaneArray,
    pub(crate) luminance: LaneArray,
    pub(crate) luminance_kelvin: LaneArray,
    blue: LaneArray,
}

impl GasResolver<'_> {
    /// Buffers for [`fill`](Self::fill).
    pub(crate) fn row(&self) -> ResolvedRow {
        ResolvedRow { sums: vec![0.0; self.grid.row_length()], strain: vec![0.0; self.grid.cells.columns] }
    }

    /// Fills the buffer with the sums of a layer along row `y` of the picture; returns the range of pixels that may not be empty.
    #[inline(always)]
    pub(crate) fn fill(
        &self,
        layer: usize,
        y: usize,
        extents: &ColumnExtents,
        row: &mut ResolvedRow,
    ) -> Option<[usize; 2]> {
        let (cells, depth) = (&self.grid.cells, self.grid.depth);
        let (cell, phase) = cells.cell_before(1, y);
        let [first, last] = extents.around(layer, cell)?;
        // Support of cubic interpolation.
        let pixels = [cells.left_of_column(i64::from(first) - 2), cells.left_of_column(i64::from(last) + 3)];
        // Whole batches of sixteen pixels are filled, since remains of earlier rows would depend on where a strip starts.
        let [begin, end] = [pixels[0] / LANES * LANES, pixels[1].next_multiple_of(LANES)];
        let from = self.grid.first_of_four(cells.cell_before(0, begin).0);
        let to = self.grid.first_of_four(cells.cell_before(0, end.saturating_sub(1)).0) + 4;
        let rows = [self.grid.row(cell - 1), self.grid.row(cell), self.grid.row(cell + 1), self.grid.row(cell + 2)];
        let weights = &self.weights[phase];
        for column in from..to {
            let start = column * depth + layer * PLANES;
            let Some(sums) = row.sums[start..].first_chunk_mut::<PLANES>() else { continue };
            *sums = weighted_cells(rows, [start; 4], weights);
        }
        if let Some((_, strain)) = self.detail {
            let rows = [-1, 0, 1, 2].map(|by| &strain.row(cell + by, layer)[from..to]);
            weighted_sum(&mut row.strain[from..to], rows, weights);
        }
        Some(pixels)
    }

    /// Sums of a layer at sixteen pixels; `None` if none is visible.
    #[inline(always)]
    pub(crate) fn sums(&self, row: &ResolvedRow, layer: usize, [x, y]: [usize; 2]) -> Option<LayerSums> {
        let mut planes = self.planes(row, layer, x, [TAU, LUMINANCE, LUMINANCE_KELVIN, BLUE]);
        if self.camera.lens == Lens::Fisheye {
            self.clear_outside_circle(&mut planes, [x, y]);
        }
        // Smaller values are visible neither as light nor as opacity.
        let (mut max_tau, mut max_blue) = (1e-6_f32, 1e-3_f32);
        for lane in 0..LANES {
            max_tau = max_tau.max(planes[0][lane]);
            max_blue = max_blue.max(planes[3][lane]);
        }
        if max_tau <= 1e-6 && max_blue <= 1e-3 {
            return None;
        }
        for plane in &mut planes {
            for lane in 0..LANES {
                // Cubic splines undershoot at edges.
                plane[lane] = plane[lane].max(0.0);
            }
        }
        let [tau, luminance, luminance_kelvin, blue] = planes;
        Some(LayerSums { tau, luminance, luminance_kelvin, blue })
    }

    /// Clears what is outside the circle of a fisheye, beyond which sprites extend.
    #[inline(always)]
    fn clear_outside_circle(&self, planes: &mut [LaneArray], [x, y]: [usize; 2]) {
        let center = self.camera.principal_point;
        let radius = self.camera.half_angle() * self.camera.focal_pixels;
        let down = y as f64 + 0.5 - center.y;
        for lane in 0..LANES {
            let right = (x + lane) as f64 + 0.5 - center.x;
            if right * right + down * down > radius * radius {
                planes.iter_mut().for_each(|plane| plane[lane] = 0.0);
            }
        }
    }

    /// Planes of a layer at sixteen pixels.
    #[inline(always)]
    fn planes<const N: usize>(
        &self,
        row: &ResolvedRow,
        layer: usize,
        x: usize,
        mut planes: [usize; N],
    ) -> [LaneArray; N] {
        for plane in &mut planes {
            *plane += layer * PLANES;
        }
        self.row_interpolator.at(&row.sums, self.grid.depth, x, planes)
    }

    /// Fraction of the detail that is visible at sixteen pixels.
    #[inline(always)]
    fn visible_fraction(&self, row: &ResolvedRow, x: usize) -> LaneArray {
        let [strain] = self.row_interpolator.at(&row.strain, 1, x, [0]);
        strain::visible_fraction(&strain)
    }

    /// Positions of sixteen pixels in the detail noise.
    #[inline(always)]
    fn noise_positions(
        &self,
        sums: &LayerSums,
        row: &ResolvedRow,
        detail: &Detail,
        layer: &DepthLayer,
        [x, y]: [usize; 2],
    ) -> Option<[LaneArray; 3]> {
        // Exact at the first and the last pixel, and linear between.
        let first = self.position_in_layer(layer, x as f64 + 0.5, y as f64 + 0.5);
        let last = self.position_in_layer(layer, (x + LANES) as f64 - 0.5, y as f64 + 0.5);
        let (first, last) = (first.or(last)?, last.or(first)?);
        let mut noise_positions =
            self.planes(row, layer.index, x, [DETAIL_OFFSET, DETAIL_OFFSET + 1, DETAIL_OFFSET + 2]);
        for axis in 0..3 {
            let start = first[axis] * detail.cells_per_meter[axis];
            let step = (last[axis] - first[axis]) * detail.cells_per_meter[axis] * (1.0 / (LANES - 1) as f32);
            for lane in 0..LANES {
                let offset = noise_positions[axis][lane] / sums.tau[lane].max(1e-20);
                noise_positions[axis][lane] = step.mul_add(lane as f32, start) + offset.clamp(-1e4, 1e4);
            }
        }
        Some(noise_positions)
    }

    /// Position of a layer at a point of the picture, m from the origin of detail coordinates; `None` where the lens shows nothing.
    #[inline(always)]
    fn position_in_layer(&self, layer: &DepthLayer, px: f64, py: f64) -> Option<[f32; 3]> {
        let direction = self.camera.direction(DVec2::new(px, py))?;
        Some((self.camera.position + direction * layer.depth - self.origin).as_vec3().to_array())
    }

    /// Composites a layer behind the contents of `rect` of a strip.
    #[inline(always)]
    pub(crate) fn draw_layer(
        &self,
        layer: &DepthLayer,
        extents: &ColumnExtents,
        rect: Rect,
        row: &mut ResolvedRow,
        strip: &mut Strip,
    ) {
        for y in rect.y..rect.bottom() {
            let Some([first, last]) = self.fill(layer.index, y, extents, row) else { continue };
            // Batches start at multiples of sixteen columns of the whole picture, so that pixels do not depend on crops.
            let from = first.max(rect.x) / LANES * LANES;
            for x in (from..last.min(rect.right())).step_by(LANES) {
                if let Some(sums) = self.sums(row, layer.index, [x, y]) {
                    self.draw_batch(&sums, row, layer, [x, y], rect, strip);
                }
            }
        }
    }

    #[inline(always)]
    fn draw_batch(
        &self,
        sums: &LayerSums,
        row: &ResolvedRow,
        layer: &DepthLayer,
        [x, y]: [usize; 2],
        rect: Rect,
        strip: &mut Strip,
    ) {
        let from = x.max(rect.x);
        let to = (x + LANES).min(rect.right());
        if from >= to {
            return;
        }
        self.light(sums, row, layer, x, y).composite(layer, [x, y], from..to, strip);
    }

    /// Red, green, blue and opacity of sixteen pixels of a layer.
    #[inline(always)]
    pub(crate) fn light(
        &self,
        sums: &LayerSums,
        row: &ResolvedRow,
        layer: &DepthLayer,
        x: usize,
        y: usize,
    ) -> PixelLight {
        let LayerSums { tau, luminance, luminance_kelvin, .. } = sums;
        let (mut depth_factor, mut temperature_factor) = ([1.0; LANES], [1.0; LANES]);
        if let Some((detail, _)) = self.detail
            && !detail.is_negligible(tau)
            && let Some(noise_positions) = self.noise_positions(sums, row, detail, layer, [x, y])
        {
            DetailFactors { depth: depth_factor, temperature: temperature_factor } =
                detail.factors(&noise_positions, tau, &self.visible_fraction(row, x));
        }
        let mut planes = [[0.0; LANES]; 4];
        let mut emission = [0.0; LANES];
        for lane in 0..LANES {
            let depth = tau[lane] * depth_factor[lane];
            planes[3][lane] = 1.0 - approximations::exp(-depth);
            emission[lane] = if self.self_absorption { planes[3][lane] } else { depth };
        }
        // Both denominators are clamped instead of branching per lane. Where they are clamped, the luminance is 0.
        let (mut emitted_luminance, mut kelvin) = ([0.0; LANES], [0.0; LANES]);
        for lane in 0..LANES {
            emitted_luminance[lane] = emission[lane] * luminance[lane] / tau[lane].max(MIN_DEPTH);
            kelvin[lane] = mean_temperature(luminance_kelvin[lane], luminance[lane].max(MIN_DEPTH), self.temperatures)
                * temperature_factor[lane];
        }
        let table = color::black_body();
        for lane in 0..LANES {
            let color = table.radiance(kelvin[lane]);
            for c in 0..3 {
                planes[c][lane] = color[c];
            }
        }
        for lane in 0..LANES {
            // The luminance is that of the sum. The color is that of a black body at the mean temperature, which detail makes slightly higher where gas burns.
            let unscaled = color::luminance([planes[0][lane], planes[1][lane], planes[2][lane]]);
            let factor = emitted_luminance[lane] / unscaled.max(1e-20);
            for c in 0..3 {
                planes[c][lane] *= factor;
            }
        }
        let scattered = &self.scattered[layer.index];
        for c in 0..3 {
            for lane in 0..LANES {
                let blue = self.blue[c] * sums.blue[lane];
                planes[c][lane] += scattered[c].mul_add(planes[3][lane], blue);
            }
        }
        PixelLight { planes }
    }
}

impl PixelLight {
    /// Composites the columns `lit` of a layer, of which the first of all is `x`, behind the contents of a strip.
    #[inline(always)]
    pub(crate) fn composite(
        mut self,
        layer: &DepthLayer,
        [x, y]: [usize; 2],
        columns: std::ops::Range<usize>,
        strip: &mut Strip,
    ) {
        let start = (y - strip.rect.y) * strip.rect.width + columns.start - strip.rect.x;
        let mut visible_fraction = [1.0; LANES];
        if strip.has_plate() {
            for pixel in columns.clone() {
                let plate_depth = strip.plate_depth(start + pixel - columns.start);
                let distance = (f64::from(plate_depth) - layer.depth) / layer.thickness;
                visible_fraction[pixel - x] = (distance + 0.5).clamp(0.0, 1.0) as f32;
            }
        }
        for plane in &mut self.planes {
            for lane in 0..LANES {
                plane[lane] *= visible_fraction[lane];
            }
        }
        let lit = columns.start - x..columns.end - x;
        let mut depth = [f32::INFINITY; LANES];
        for lane in lit.clone() {
            if self.planes[3][lane] > 1e-3 || self.planes[1][lane] > 1e-2 {
                depth[lane] = layer.depth as f32;
            }
        }
        let [red, green, blue, opacity] = self.planes.each_ref().map(|plane| &plane[lit.clone()]);
        strip.add_row_behind(start, [red, green, blue], Some(opacity), &depth[lit]);
    }
}

/// Mean temperature, K, limited to the range of the particles: at very low luminance it is a quotient of rounding errors.
#[inline(always)]
pub(crate) fn mean_temperature(luminance_kelvin: f32, luminance: f32, [coldest, hottest]: [f32; 2]) -> f32 {
    (luminance_kelvin / luminance).max(coldest).min(hottest)
}

/// Weighted sum of the values of four cells of a layer, which start at `starts` in `rows`.
#[inline(always)]
fn weighted_cells(rows: [&[f32]; 4], starts: [usize; 4], weights: &[f32; 4]) -> [f32; PLANES] {
    let mut sums = [0.0; PLANES];
    for k in 0..4 {
        let Some(values) = rows[k][starts[k]..].first_chunk::<PLANES>() else { continue };
        for plane in 0..PLANES {
            sums[plane] = weights[k].mul_add(values[plane], sums[plane]);
        }
    }
    sums
}

/// Red, green, blue and opacity.
pub(crate) struct PixelLight {
    pub(crate) planes: [LaneArray; 4],
}

/// First and last occupied column of cells, for each row and layer.
pub(crate) struct ColumnExtents {
    layers: usize,
    rows: Vec<[u32; 2]>,
}

impl ColumnExtents {
    pub(crate) fn new(grid: &Grid, layers: usize) -> Self {
        use bansho_base::host::parallel::prelude::*;
        let indices = (0..grid.cells.rows * layers).into_par_iter().with_min_len(64);
        let rows = indices.map(|index| Self::of_row(grid.row((index / layers) as i32), grid.depth, index % layers));
        Self { layers, rows: rows.collect() }
    }

    /// First and last column of a row of cells, of `depth` values each, where a layer absorbs or emits; the first after the last if there is none.
    fn of_row(cells: &[f32], depth: usize, layer: usize) -> [u32; 2] {
        let start = layer * PLANES;
        let mut occupied =
            cells.chunks_exact(depth).map(|values| values[start + TAU] > 0.0 || values[start + BLUE] > 0.0);
        let first = occupied.clone().position(|is_occupied| is_occupied);
        let last = occupied.rposition(|is_occupied| is_occupied);
        first.zip(last).map_or([u32::MAX, 0], |(first, last)| [first as u32, last as u32])
    }

    /// First and last occupied column of a row of cells.
    pub(crate) fn of(&self, row: usize, layer: usize) -> Option<[u32; 2]> {
        let [first, last] = self.rows[row * self.layers + layer];
        (first <= last).then_some([first, last])
    }

    /// First and last column within the support of interpolation in the rows around `cell`.
    fn around(&self, layer: usize, cell: i32) -> Option<[u32; 2]> {
        let rows = (self.rows.len() / self.layers) as i32;
        let extents = (cell - 1..=cell + 2)
            .filter(|row| (0..rows).contains(row))
            .map(|row| self.rows[row as usize * self.layers + layer]);
        let [first, last] = extents.fold([u32::MAX, 0], |all, own| [all[0].min(own[0]), all[1].max(own[1])]);
        (first <= last).then_some([first, last])
    }
}
