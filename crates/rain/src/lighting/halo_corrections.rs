//! Light that is scattered close around a lamp in the picture: corrections of single pixels, from a finer grid.

use std::ops::Range;

use bansho_base::{
    camera::directions::Directions,
    math::simd::{LANES, Real},
    phenomenon::strip::DepthInterval,
};

use super::{
    equiangular::MIN_LAMP_DISTANCE,
    in_scattering::{HALO_RADIUS, LampHalo},
    ray_segments::{MediumBounds, OpticalDepthTable, RaySegments, any_range},
    tiles::TileGrid,
};
use crate::lanes::{LaneArray, ZERO_LANES, smoothstep};

/// Distance from a lamp, as a fraction of [`HALO_RADIUS`], from which its correction fades out.
const FADE_START: f32 = 0.6;

/// Scratch memory of a row of pixels: in-scattering between two rows of corners, of the picture's grid and of the finer one.
#[derive(Default)]
pub(super) struct HaloRows {
    coarse: Vec<[f32; 4]>,
    fine: Vec<[f32; 4]>,
}

/// Computes the corrections of pixels near a lamp.
pub(super) struct HaloCorrector<'a> {
    pub(super) halo: &'a LampHalo,
    pub(super) bounds: MediumBounds<'a>,
    pub(super) table: &'a OpticalDepthTable,
    /// Range of the light of lamps, m.
    pub(super) lit_end: f32,
    pub(super) slice: &'a DepthInterval,
}

impl HaloCorrector<'_> {
    /// Corrections of some columns of row `y`: the light by the finer grid less that by the picture's grid, faded toward the edge of the halo. `plate`
    /// has the depths of the plate at these columns, m; it is empty without a plate.
    #[inline(always)]
    pub(super) fn row(&self, y: usize, columns: Range<usize>, plate: &[f32], rows: &mut HaloRows) -> Vec<[f32; 3]> {
        let mut corrections = vec![[0.0; 3]; columns.len()];
        self.interpolate_rows(y, rows);
        // Batches are aligned to the picture, so that a crop changes no pixel.
        for first in (columns.start / LANES * LANES..columns.end).step_by(LANES) {
            let visible = first.max(columns.start)..(first + LANES).min(columns.end);
            let mut depths = ZERO_LANES;
            for x in visible.clone() {
                depths[x - first] = plate.get(x - columns.start).copied().unwrap_or(f32::INFINITY);
            }
            let light = self.sixteen(first, y, &depths, rows);
            for x in visible {
                corrections[x - columns.start] = light[x - first];
            }
        }
        corrections
    }

    #[inline(always)]
    fn interpolate_rows(&self, y: usize, rows: &mut HaloRows) {
        let halo = self.halo;
        // Distances are at least depths, so that light up to nearer distances is not needed.
        let indices = self.table.interval(self.slice.near as f32).saturating_sub(1)..self.table.lit_distances();
        let indices = indices.start.min(indices.end.saturating_sub(2))..indices.end;
        let grids = [
            (&halo.tiles, &halo.in_scattering, &mut rows.coarse),
            (&halo.fine_tiles, &halo.fine_in_scattering, &mut rows.fine),
        ];
        for (tiles, in_scattering, sums) in grids {
            let row = tiles.row_at(y as f32 + 0.5);
            in_scattering.interpolate_rows(tiles, row, 0..tiles.size[0], indices.clone(), sums);
        }
    }

    /// Corrections of the sixteen pixels from column `x` on.
    #[inline(always)]
    fn sixteen(&self, x: usize, y: usize, plate: &LaneArray, rows: &HaloRows) -> [[f32; 3]; LANES] {
        let mut corrections = [[0.0; 3]; LANES];
        let fades = self.fades(x, y);
        let mut directions = Directions::new(self.bounds.camera, x, y);
        let ranges = self.bounds.ranges(&mut directions, self.slice, plate);
        let segments = RaySegments::new(self.table, &ranges, self.lit_end);
        if !any_range(&ranges) || !segments.any_lit() {
            return corrections;
        }
        // The finer grid holds the light times the distance of the ray from the lamp, which is smooth; the exact distance of each pixel is divided
        // out here.
        let (inverse_distances, gains) = (self.inverse_ray_distances(&directions), segments.gains());
        for i in 0..LANES {
            if fades[i] <= 0.0 {
                continue;
            }
            let column = x as f32 + i as f32 + 0.5;
            let (fine_distances, distances) =
                (self.halo.fine_in_scattering.distances, self.halo.in_scattering.distances);
            let fine =
                light_at_column(&segments, i, gains[i], &self.halo.fine_tiles, &rows.fine, fine_distances, column);
            let coarse = light_at_column(&segments, i, gains[i], &self.halo.tiles, &rows.coarse, distances, column);
            for c in 0..3 {
                corrections[i][c] = fades[i] * (fine[c] * inverse_distances[i] - coarse[c]);
            }
        }
        corrections
    }

    /// Weights of the corrections of sixteen pixels.
    #[inline(always)]
    fn fades(&self, x: usize, y: usize) -> LaneArray {
        let [left, top] = self.halo.pixel.to_array();
        let (across, down) = ((x as f64 + 0.5 - left) as f32, (y as f64 + 0.5 - top) as f32);
        let mut fades = ZERO_LANES;
        for i in 0..LANES {
            let across = across + i as f32;
            let distance = across.fma(across, down * down).sqrt() * (1.0 / HALO_RADIUS as f32);
            fades[i] = 1.0 - smoothstep((distance - FADE_START) * (1.0 / (1.0 - FADE_START)));
        }
        fades
    }

    /// Inverse distances of the lamp from sixteen lines of sight, 1/m.
    #[inline(always)]
    fn inverse_ray_distances(&self, directions: &Directions) -> LaneArray {
        let [x, y, z] = self.halo.offset.as_vec3().to_array();
        let [xs, ys, zs] = &directions.components;
        let mut inverse = ZERO_LANES;
        for i in 0..LANES {
            let normal = [y * zs[i] - z * ys[i], z * xs[i] - x * zs[i], x * ys[i] - y * xs[i]];
            let distance = (normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]).sqrt();
            inverse[i] = 1.0 / distance.simd_min(f32::MAX).simd_max(MIN_LAMP_DISTANCE as f32);
        }
        inverse
    }
}

/// Light that is scattered within the segment of lane `i`, whose gain is `gain`, between the columns of corners of a grid on both sides of a `column` of the picture (pixels);
/// `sums` is a row of corners with so many distances each.
#[inline(always)]
fn light_at_column(
    segments: &RaySegments,
    i: usize,
    gain: f32,
    tiles: &TileGrid,
    sums: &[[f32; 4]],
    distances: usize,
    column: f32,
) -> [f32; 4] {
    let position = tiles.column_at(column);
    let left = position.index * distances;
    segments.in_scattered(i, gain, sums, [left, left + distances], position.fraction)
}
