//! A grid over the picture for values that vary slowly: evaluated at tile corners, interpolated bilinearly.

use bansho_base::{
    camera::Camera,
    host::parallel::prelude::*,
    image::Rect,
    math::{DVec2, DVec3},
    phenomenon::strip::View,
};

/// Tile side for light that varies slowly, pixels.
pub(crate) const COARSE_TILE: usize = 32;
/// Tile side for the light of lamps and the edges of their cones, pixels.
pub(crate) const FINE_TILE: usize = 16;

/// Tile side close to a lamp, pixels.
pub(crate) const FINEST_TILE: usize = 4;

/// Tile corners of a picture, or of a rectangle of it.
#[derive(Clone, Debug)]
pub(crate) struct TileGrid {
    /// Pixel of the first corner.
    origin: [usize; 2],
    /// Side of a tile, pixels.
    pub(crate) side: usize,
    /// Number of corners in a row, and number of rows.
    pub(crate) size: [usize; 2],
    /// Unit vectors of the lines of sight at the corners, row by row; 0 where the lens sees nothing.
    pub(crate) directions: Vec<DVec3>,
}

/// A position between two rows or columns of corners.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct GridPosition {
    /// Index of the first.
    pub(crate) index: usize,
    /// Interpolation fraction toward the second.
    pub(crate) fraction: f32,
}

impl TileGrid {
    pub(crate) fn new(view: &View, side: usize) -> Self {
        Self::over(view, side, Rect::from_size(view.size[0], view.size[1]))
    }

    /// The grid over a rectangle of the picture.
    pub(crate) fn over(view: &View, side: usize, rect: Rect) -> Self {
        let origin = [rect.x, rect.y];
        let size = [rect.width, rect.height].map(|pixels| pixels.max(1).div_ceil(side) + 1);
        let mut grid = Self { origin, side, size, directions: Vec::new() };
        grid.directions =
            (0..size[0] * size[1]).map(|index| pixel_direction(&view.camera, grid.pixel(index))).collect();
        grid
    }

    /// Pixel of a corner.
    pub(crate) fn pixel(&self, corner: usize) -> [usize; 2] {
        let [column, row] = [corner % self.size[0], corner / self.size[0]];
        [self.origin[0] + column * self.side, self.origin[1] + row * self.side]
    }

    /// One value for each corner, computed in parallel.
    pub(crate) fn map<T: Send>(&self, value: impl Fn(usize, DVec3) -> T + Sync) -> Vec<T> {
        self.directions.par_iter().enumerate().map(|(index, direction)| value(index, *direction)).collect()
    }

    /// Interpolates colors at corners to a position in the picture (pixels), clamped to its edge.
    pub(crate) fn at(&self, corners: &[[f32; 3]], [x, y]: [f32; 2]) -> [f32; 3] {
        let (column, row) = (self.column_at(x), self.row_at(y));
        let index = row.index * self.size[0] + column.index;
        let [above, below] =
            [index, index + self.size[0]].map(|left| lerp_color(corners[left], corners[left + 1], column.fraction));
        lerp_color(above, below, row.fraction)
    }

    /// Row of corners at a vertical position (pixels).
    pub(crate) fn row_at(&self, y: f32) -> GridPosition {
        self.split(y, 1)
    }

    /// Column of corners at a horizontal position (pixels).
    pub(crate) fn column_at(&self, x: f32) -> GridPosition {
        self.split(x, 0)
    }

    fn split(&self, coordinate: f32, axis: usize) -> GridPosition {
        let corners = self.size[axis];
        let position = ((coordinate - self.origin[axis] as f32) / self.side as f32).clamp(0.0, (corners - 1) as f32);
        let index = (position as usize).min(corners.saturating_sub(2));
        GridPosition { index, fraction: position - index as f32 }
    }
}

fn pixel_direction(camera: &Camera, pixel: [usize; 2]) -> DVec3 {
    let pixel = DVec2::new(pixel[0] as f64, pixel[1] as f64);
    camera.direction(pixel).map_or(DVec3::ZERO, DVec3::normalize_or_zero)
}

/// Geometric sequence from `first` to at least `last`.
pub(crate) fn geometric_sequence(first: f64, last: f64, ratio: f64) -> Vec<f64> {
    let mut terms = vec![first];
    let mut next = first;
    while next < last {
        next *= ratio;
        terms.push(next);
    }
    terms
}

/// Linear interpolation of colors. Not fused, because it is used in scalar code too, where a fused multiply-add is
/// slow.
#[inline(always)]
pub(crate) fn lerp_color(from: [f32; 3], to: [f32; 3], t: f32) -> [f32; 3] {
    let mut mixed = from;
    for c in 0..3 {
        mixed[c] += (to[c] - from[c]) * t;
    }
    mixed
}
