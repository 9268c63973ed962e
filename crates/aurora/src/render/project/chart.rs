//! The chart: the visible part of the sky in longitude and colatitude about the magnetic zenith, and where batches of pixels lie on it.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use bansho_base::{
    camera::{Camera, directions::Directions},
    math::{self, DVec2, MulAdd, approximations},
    phenomenon::strip::View,
};

use super::field_lines::{FieldLines, dot};

/// Columns per block. Blocks are the unit of work of a thread.
pub(crate) const BLOCK_COLUMNS: usize = 16;
/// Samples per side of the picture for the coverage.
const SAMPLES_PER_SIDE: usize = 24;
/// Maximum number of columns and of rows.
const MAX_SIZE: f64 = 16_384.0;
/// Maximum chart cells per pixel: more occur only where a camera zooms or pans far during the exposure, which blurs
/// them.
const MAX_CELLS_PER_PIXEL: f64 = 16.0;
/// Minimum sine of the elevation that is drawn for observers below the light.
const MIN_SINE_ELEVATION: f64 = -0.35;

/// Angular range of a chart, radians.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Coverage {
    /// Center and half-width of the longitude range; full circle from pi on.
    longitude: [f64; 2],
    /// Minimum and maximum colatitude.
    colatitude: [f64; 2],
    /// Angle of a pixel, or more where the chart would have too many cells.
    pub(crate) pixel: f64,
    /// Whether the rows end at the direction opposite to the magnetic zenith, so that they must be symmetric to it.
    ends_at_nadir: bool,
}

/// A grid of directions; columns are meridians, rows parallels.
#[derive(Clone, Debug)]
pub(crate) struct Chart {
    /// Number of columns, a multiple of [`BLOCK_COLUMNS`].
    pub(crate) columns: usize,
    /// Number of rows, at least 2.
    pub(crate) rows: usize,
    /// Width of a column, radians.
    pub(crate) column_step: f64,
    /// Height of a row, radians.
    pub(crate) row_step: f64,
    first_longitude: f64,
    first_colatitude: f64,
    /// Whether it spans the full circle of longitude.
    pub(crate) wraps: bool,
}

impl Coverage {
    /// Range of the whole picture over the exposure.
    pub(crate) fn of_view(view: &View, field: &FieldLines) -> Self {
        let cameras = [view.shutter.open, view.shutter.middle(), view.shutter.close].map(|t| view.camera_at(t));
        let directions: Vec<[f64; 3]> = cameras.iter().flat_map(|camera| directions(camera, field)).collect();
        // Circular mean of the longitudes.
        let sum = directions.iter().fold([0.0; 2], |sum, [_, x, y]| [sum[0] + x, sum[1] + y]);
        let middle = math::atan2(sum[1], sum[0]);
        let (mut reach, mut min_colatitude, mut max_colatitude) = (0.0_f64, PI, 0.0_f64);
        for [along, x, y] in &directions {
            let colatitude = math::atan2(math::hypot(*x, *y), *along);
            let wrapped = math::atan2(*y, *x) - middle;
            reach = reach.max((wrapped - TAU * (wrapped / TAU).round()).abs());
            (min_colatitude, max_colatitude) = (min_colatitude.min(colatitude), max_colatitude.max(colatitude));
        }
        let camera = &view.camera;
        let pixel = 1.0 / camera.focal_pixels;
        let margin = 1.5 * camera.size[0].max(camera.size[1]) / (SAMPLES_PER_SIDE - 1) as f64 * pixel;
        let sees_nadir = field.is_above_light() && max_colatitude > PI - margin;
        let sees_zenith = min_colatitude < margin || (reach > 0.8 * PI && !sees_nadir);
        let full_circle = sees_zenith || sees_nadir || reach > 0.8 * PI;
        let sine = math::sin(min_colatitude.min(FRAC_PI_2)).max(1e-3);
        let mut coverage = Self {
            longitude: [middle, if full_circle { PI } else { (reach + margin / sine).min(PI) }],
            colatitude: [
                if sees_zenith { 0.0 } else { min_colatitude - margin }.max(0.0),
                (max_colatitude + margin).min(PI),
            ],
            pixel,
            ends_at_nadir: sees_nadir,
        };
        let max_cells = MAX_CELLS_PER_PIXEL * camera.size[0] * camera.size[1];
        coverage.pixel = pixel.max(math::sqrt(coverage.area() / max_cells));
        coverage
    }

    /// Maximum sine of the colatitude.
    fn max_sine(&self) -> f64 {
        let [min_colatitude, max_colatitude] = self.colatitude;
        if min_colatitude < FRAC_PI_2 && max_colatitude > FRAC_PI_2 {
            return 1.0;
        }
        math::sin(min_colatitude).max(math::sin(max_colatitude)).max(1e-3)
    }

    /// Upper bound on the solid angle: all rows are counted as wide as the widest, square radians.
    fn area(&self) -> f64 {
        let [min_colatitude, max_colatitude] = self.colatitude;
        2.0 * self.longitude[1] * self.max_sine() * (max_colatitude - min_colatitude)
    }
}

/// Components along and across the field of sampled directions of the picture, without those far below the horizon.
fn directions<'a>(camera: &'a Camera, field: &'a FieldLines) -> impl Iterator<Item = [f64; 3]> + 'a {
    (0..SAMPLES_PER_SIDE * SAMPLES_PER_SIDE).filter_map(move |index| {
        let [x, y] = [index % SAMPLES_PER_SIDE, index / SAMPLES_PER_SIDE]
            .map(|sample| sample as f64 / (SAMPLES_PER_SIDE - 1) as f64);
        let pixel = DVec2::new(x * camera.size[0], y * camera.size[1]);
        let direction = camera.direction(pixel)?.normalize();
        (direction.y > MIN_SINE_ELEVATION || field.is_above_light())
            .then(|| [field.along, field.across[0], field.across[1]].map(|axis| direction.dot(axis)))
    })
}

impl Chart {
    /// A chart over `coverage` with cells of at most `column` by `row` radians where the columns are widest.
    pub(crate) fn new(coverage: &Coverage, column: f64, row: f64) -> Self {
        let ([min_colatitude, max_colatitude], max_sine) = (coverage.colatitude, coverage.max_sine());
        let [middle, reach] = coverage.longitude;
        let wraps = reach >= PI;
        let range = 2.0 * reach;
        let columns = (range * max_sine / column).min(MAX_SIZE).ceil() as usize;
        let columns = columns.max(1).next_multiple_of(BLOCK_COLUMNS);
        let column_step = if wraps { range / columns as f64 } else { (column / max_sine).max(range / columns as f64) };
        // Aligned to multiples of the step, so that the chart does not crawl as the camera turns.
        let first_longitude = if wraps { -PI } else { ((middle - reach) / column_step).floor() * column_step };
        let row = row.max((max_colatitude - min_colatitude) / MAX_SIZE);
        // No row may reach beyond the nadir, where its sine would be negative.
        let row = if coverage.ends_at_nadir { PI / (PI / row).floor().max(1.0) } else { row };
        let first_row = (min_colatitude / row).floor();
        let last_row = if coverage.ends_at_nadir { (PI / row).round() } else { (max_colatitude / row).ceil() };
        let rows = (last_row - first_row).max(2.0) as usize;
        Self { columns, rows, column_step, row_step: row, first_longitude, first_colatitude: first_row * row, wraps }
    }

    /// Longitude of the middle of a column.
    pub(crate) fn longitude(&self, column: usize) -> f64 {
        self.first_longitude + (column as f64 + 0.5) * self.column_step
    }

    /// Colatitude of the middle of a row.
    pub(crate) fn colatitude(&self, row: usize) -> f64 {
        self.first_colatitude + (row as f64 + 0.5) * self.row_step
    }

    /// Cosine and sine of the longitude of a column.
    pub(crate) fn longitude_cos_sin(&self, column: usize) -> [f64; 2] {
        let (sin, cos) = math::sin_cos(self.longitude(column));
        [cos, sin]
    }

    /// Cosines and sines of the longitudes of a block's columns.
    pub(crate) fn block_cos_sin(&self, block: usize) -> [[f32; BLOCK_COLUMNS]; 2] {
        let mut units = [[0.0; BLOCK_COLUMNS]; 2];
        for column in 0..BLOCK_COLUMNS {
            for (values, value) in units.iter_mut().zip(self.longitude_cos_sin(block * BLOCK_COLUMNS + column)) {
                values[column] = value as f32;
            }
        }
        units
    }

    /// Cotangents of the colatitudes of every row and of `padding` rows beyond, and inverse sines of those of every row.
    pub(crate) fn row_tables(&self, padding: usize) -> [Vec<f32>; 2] {
        let (mut cotangents, mut inverse_sines) = (Vec::new(), Vec::new());
        for row in 0..self.rows + padding {
            let (sin, cos) = math::sin_cos(self.colatitude(row));
            let sin = sin.max(1e-9);
            cotangents.push((cos / sin) as f32);
            inverse_sines.push((1.0 / sin) as f32);
        }
        inverse_sines.truncate(self.rows);
        [cotangents, inverse_sines]
    }

    /// Wraps or clamps a column that is at most one column outside the chart.
    #[inline(always)]
    pub(crate) fn wrap_column(&self, column: i32) -> usize {
        let columns = self.columns as i32;
        let wrapped = match (self.wraps, column < 0, column >= columns) {
            (true, true, _) => column + columns,
            (true, _, true) => column - columns,
            _ => column,
        };
        wrapped.clamp(0, columns - 1) as usize
    }

    /// The mapping from directions to cells.
    pub(crate) fn projection(&self) -> ChartProjection {
        ChartProjection {
            per_column: (1.0 / self.column_step) as f32,
            per_row: (1.0 / self.row_step) as f32,
            middle: (self.first_longitude + 0.5 * self.columns as f64 * self.column_step) as f32,
            half: 0.5 * self.columns as f32,
            first_row: (self.first_colatitude / self.row_step) as f32,
        }
    }
}

/// Maps directions to fractional cells: 0 is the chart's edge, 0.5 the center of the first column or row.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ChartProjection {
    per_column: f32,
    per_row: f32,
    middle: f32,
    half: f32,
    first_row: f32,
}

impl ChartProjection {
    /// For rows of so many radians, starting at the magnetic zenith.
    #[cfg(test)]
    pub(super) fn of_rows(step: f32) -> Self {
        Self { per_column: 1.0 / step, per_row: 1.0 / step, middle: 0.0, half: 0.0, first_row: 0.0 }
    }

    /// The column of a longitude in radians, within half a turn of the chart's middle.
    #[inline(always)]
    pub(crate) fn column(&self, longitude: f32) -> f32 {
        let wrapped = longitude - self.middle;
        let wrapped = wrapped - (wrapped * (1.0 / std::f32::consts::TAU)).round_ties_even() * std::f32::consts::TAU;
        wrapped.fma(self.per_column, self.half)
    }

    /// An angle in radians as a number of rows.
    #[inline(always)]
    pub(super) fn rows(&self, angle: f32) -> f32 {
        angle * self.per_row
    }

    /// The row of a colatitude in radians.
    #[inline(always)]
    pub(crate) fn row(&self, colatitude: f32) -> f32 {
        colatitude.fma(self.per_row, -self.first_row)
    }
}

/// Pixels per batch.
pub(crate) const PIXEL_BATCH: usize = 16;

/// Directions of a batch of pixels in the field frame.
#[derive(Default)]
pub(crate) struct PixelBatch {
    /// Colatitude and longitude about the magnetic zenith.
    pub(crate) colatitude: [f32; PIXEL_BATCH],
    pub(crate) longitude: [f32; PIXEL_BATCH],
    /// Sine of the elevation.
    pub(crate) sine: [f32; PIXEL_BATCH],
    /// Length of the direction that [`Camera::direction`] gives.
    pub(crate) length: [f32; PIXEL_BATCH],
    /// Whether the lens maps the pixel to a direction.
    pub(crate) in_view: [bool; PIXEL_BATCH],
}

impl PixelBatch {
    /// Pixels from `x` on in row `y`.
    #[inline(always)]
    pub(crate) fn new(camera: &Camera, field: &FieldLines, x: usize, y: usize) -> Self {
        let mut directions = Directions::new(camera, x, y);
        let mut batch = Self { length: directions.normalize(), in_view: directions.visible, ..Self::default() };
        let [xs, ys, zs] = directions.components;
        let [along, first, second] = field.axes_f32();
        for i in 0..PIXEL_BATCH {
            let direction = [xs[i], ys[i], zs[i]];
            let (x, y) = (dot(first, direction), dot(second, direction));
            batch.colatitude[i] = approximations::atan2(x.fma(x, y * y).sqrt(), dot(along, direction));
            batch.longitude[i] = approximations::atan2(y, x);
        }
        batch.sine = ys;
        batch
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::{
        camera::CameraParameters, math::curve::Interpolation, parameters::animated::Animated,
        phenomenon::strip::Shutter,
    };

    use super::*;

    const SIZE: [usize; 2] = [64, 48];

    /// Cells beside pixels, and the angle of a cell beside that of a pixel in the shutter's middle, with these fields of view when it opens
    /// and closes.
    fn cells(fov_deg: [f64; 2]) -> [f64; 2] {
        let mut camera = CameraParameters::default();
        camera.look_up();
        camera.vertical_fov_deg =
            Animated::keyed(vec![(0.0, fov_deg[0]), (1.0, fov_deg[1])], Interpolation::Linear).unwrap();
        let view = View::new(camera, Shutter { open: 0.0, close: 1.0 }, 0.0, SIZE, 0);
        let coverage = Coverage::of_view(&view, &FieldLines::new(77.0, 0.0, view.camera.position));
        let chart = Chart::new(&coverage, coverage.pixel, coverage.pixel);
        let pixels = (SIZE[0] * SIZE[1]) as f64;
        [(chart.columns * chart.rows) as f64 / pixels, coverage.pixel * view.camera.focal_pixels]
    }

    #[test]
    fn a_zoom_while_the_shutter_is_open_makes_no_chart_finer_than_the_picture() {
        let [still, angle] = cells([50.0, 50.0]);
        assert!((1.0..4.0).contains(&still) && angle == 1.0, "{still} {angle}");
        let [zoomed, angle] = cells([170.0, 0.1]);
        assert!(zoomed < 1.3 * MAX_CELLS_PER_PIXEL && angle == 1.0, "{zoomed} {angle}");
        let [narrow, angle] = cells([0.2, 170.0]);
        assert!(narrow < 1.3 * MAX_CELLS_PER_PIXEL, "{narrow} {angle}");
    }
}
