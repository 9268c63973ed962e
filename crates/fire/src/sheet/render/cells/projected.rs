//! The cells of a sheet in the picture.

use bansho_base::{
    camera::{Camera, upright_quad::UprightQuad},
    image::Rect,
    math::{DVec2, MulAdd},
};

use super::SheetCells;

/// Patches of the projected sheet across and up, in which the projection is interpolated bilinearly.
pub(crate) const PATCHES: usize = 8;
/// Largest extent of a sheet in the picture, pixels: beyond, as near the poles of a panorama, pixels are no larger than its structure.
const MAX_EXTENT: f64 = 8192.0;

/// A point of the projected sheet.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Projected {
    /// Pixels to the right of [`ProjectedCells::origin`].
    pub(crate) x: f32,
    /// Pixels below it.
    pub(crate) y: f32,
    /// Depth, m.
    pub(crate) depth: f32,
}

impl Projected {
    #[inline(always)]
    pub(crate) fn lerp(&self, other: &Self, fraction: f32) -> Self {
        Self {
            x: (other.x - self.x).fma(fraction, self.x),
            y: (other.y - self.y).fma(fraction, self.y),
            depth: (other.depth - self.depth).fma(fraction, self.depth),
        }
    }

    /// The difference from another point, times `scale`.
    #[inline(always)]
    pub(crate) fn step_from(&self, other: &Self, scale: f32) -> [f32; 2] {
        [(self.x - other.x) * scale, (self.y - other.y) * scale]
    }
}

/// The cells of a sheet at one time, seen by the camera at that time.
#[derive(Clone, Debug)]
pub(crate) struct ProjectedCells {
    pub(crate) grid: SheetCells,
    /// The first column, counted from the left side of the sheet, and the number of columns.
    pub(crate) first_column: isize,
    pub(crate) columns: usize,
    /// Pixel from which the points count.
    pub(crate) origin: [f64; 2],
    /// Points of the sheet between the patches, row by row.
    pub(crate) points: [[Projected; PATCHES + 1]; PATCHES + 1],
    /// Bounds of the points, pixels from the origin.
    size: [f64; 2],
    /// Width in pixels after which the picture repeats.
    period: Option<f64>,
}

impl ProjectedCells {
    /// The cells of `quad` between `left` and `right` (x); `None` where a part of it cannot be projected.
    pub(crate) fn new(camera: &Camera, quad: &UprightQuad, [left, right]: [f64; 2], grid: SheetCells) -> Option<Self> {
        let camera = camera.with_unlimited_angle();
        let per_width = grid.columns as f64;
        let [first, end] = [(left * per_width).floor(), (right * per_width).ceil()];
        let center = camera.project(quad.point(0.5, 0.5 * grid.top))?.pixel;
        let mut pixels = [[(DVec2::ZERO, 0.0); PATCHES + 1]; PATCHES + 1];
        let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for (j, row) in pixels.iter_mut().enumerate() {
            for (i, point) in row.iter_mut().enumerate() {
                let x = (first + (end - first) * i as f64 / PATCHES as f64) / per_width;
                let seen = camera.project(quad.point(x, grid.top * j as f64 / PATCHES as f64))?;
                let pixel = camera.nearest_repetition(seen.pixel, center);
                *point = (pixel, seen.depth);
                (low, high) = (low.min(pixel), high.max(pixel));
            }
        }
        let origin = low.floor();
        let size = high - origin;
        if !size.is_finite() || size.max_element() > MAX_EXTENT {
            return None;
        }
        let points = pixels.map(|row| {
            row.map(|(pixel, depth)| {
                let [x, y] = (pixel - origin).as_vec2().to_array();
                Projected { x, y, depth: depth as f32 }
            })
        });
        Some(Self {
            grid,
            first_column: first as isize,
            columns: (end - first) as usize,
            origin: origin.to_array(),
            points,
            size: size.to_array(),
            period: camera.horizontal_period(),
        })
    }

    /// Offsets in pixels at which a picture of this width shows the sheet: more than one where a panorama shows it at both of its sides.
    pub(crate) fn repetitions(&self, width: usize) -> impl Iterator<Item = f64> + use<> {
        let (left, right, period) = (self.origin[0], self.origin[0] + self.size[0], self.period);
        let [first, last] = match period {
            Some(period) => [(-right / period).ceil(), ((width as f64 - left) / period).floor()],
            None => [0.0, 0.0],
        };
        (first as i64..=last as i64).map(move |index| index as f64 * period.unwrap_or(0.0))
    }

    /// The pixels that the cells may cover.
    pub(crate) fn bounds(&self, picture: [usize; 2]) -> Rect {
        let [top, bottom] = pixels_around(self.origin[1], self.size[1], picture[1]);
        let mut all = Rect::default();
        for offset in self.repetitions(picture[0]) {
            let [left, right] = pixels_around(self.origin[0] + offset, self.size[0], picture[0]);
            let rect = Rect { x: left, y: top, width: right - left, height: bottom - top };
            if !rect.is_empty() {
                all = all.union(&rect);
            }
        }
        all
    }
}

/// The first pixel and the one after the last of `count` that an interval and a pixel on both sides of it touch.
fn pixels_around(start: f64, length: f64, count: usize) -> [usize; 2] {
    [start - 1.0, (start + length + 1.0).ceil()].map(|edge| edge.clamp(0.0, count as f64) as usize)
}
