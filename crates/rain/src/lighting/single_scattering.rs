//! Rain that is not drawn as streaks, as a participating medium: extinction of the background, and single scattering
//! (airlight, halos around lamps).

use std::{ops::Range, sync::Arc};

use bansho_base::{
    camera::directions::Directions,
    image::Rect,
    math::{
        DVec2, DVec3,
        simd::{LANES, Lanes, Real},
    },
    phenomenon::strip::{DepthInterval, Strip, View},
};
use fearless_simd::{Level, Simd, dispatch, prelude::*};

use super::{
    drop_lighting::DropLighting,
    extinction::{ExtinctionProfile, RainExtinction},
    in_scattering::{InScatterIntegrator, LampScattering, LampScatteringCache},
    ray_segments::{MediumBounds, OpticalDepthTable, RaySegments, any_range},
    sky::SkyLighting,
    surface_pixels::{select_before_surfaces, surface_columns, surface_depths},
    tiles::{FINE_TILE, GridPosition, TileGrid, geometric_sequence, lerp_color},
};
use crate::{
    aovs::add_optical_depths,
    drops::shutter_state::ShutterState,
    lanes::{LaneArray, ZERO_LANES},
};

/// First distance at which accumulated in-scattering is stored, m, and the ratio of successive distances.
const FIRST_DISTANCE: f64 = 0.5;
const DISTANCE_RATIO: f64 = 1.25;
/// Ratio of successive distances beyond the range of lamps.
const FAR_DISTANCE_RATIO: f64 = 2.0;
/// Depth of the medium, m: it has none.
const NO_DEPTH: [f32; FINE_TILE] = [f32::INFINITY; FINE_TILE];
/// Positions of pixels across their tile, 0 to 1.
const ACROSS: LaneArray = {
    let mut across = ZERO_LANES;
    let mut i = 0;
    while i < LANES {
        across[i] = (i as f32 + 0.5) * (1.0 / FINE_TILE as f32);
        i += 1;
    }
    across
};
/// The lines of sight of a tile's row of pixels are computed at once.
const _: () = assert!(FINE_TILE == LANES);

/// Radiance (three colors) and opacity of sixteen segments.
type Layer = [LaneArray; 4];

/// Lines of sight through a row of pixels.
#[derive(Clone, Copy)]
struct LinesOfSight {
    /// The row of pixels.
    y: usize,
    /// Between which rows of corners its middle is.
    row: GridPosition,
    /// The first column of tiles.
    first: usize,
}

/// Extinction and single scattering along the lines of sight of one frame.
pub(crate) struct SingleScattering<'a> {
    pub(super) level: Level,
    pub(super) view: &'a View,
    /// The sky at the corners of the fine grid, at which in-scattering is stored too.
    sky: Arc<SkyLighting>,
    /// Optical depth by distance.
    pub(super) table: OpticalDepthTable,
    /// Light of lamps and fires that is scattered toward the camera.
    pub(super) lamps: Arc<LampScattering>,
    /// Range of the light of lamps, and end of the medium in front of a plate, m.
    pub(super) end: f32,
    /// End of the medium without a plate, m.
    farthest: f32,
    ground: f64,
}

impl<'a> SingleScattering<'a> {
    /// The medium up to the distance `end` (m) in front of a plate, and up to `farthest` (m) without a plate; `None` where
    /// there is no rain.
    pub(crate) fn new(
        shutter_state: &ShutterState,
        lighting: &DropLighting,
        sky: Arc<SkyLighting>,
        view: &'a View,
        extinction: RainExtinction,
        end: f64,
        farthest: f64,
        cache: &LampScatteringCache,
    ) -> Option<Self> {
        if end <= 0.0 || extinction.all <= 0.0 {
            return None;
        }
        let profile = ExtinctionProfile { shutter_state, extinction };
        let mut distances = geometric_sequence(FIRST_DISTANCE.min(end), end, DISTANCE_RATIO);
        distances.insert(0, 0.0);
        let last = distances.len() - 1;
        distances[last] = end;
        while distances[distances.len() - 1] < farthest {
            distances.push((FAR_DISTANCE_RATIO * distances[distances.len() - 1]).min(farthest));
        }
        let mut depths = vec![0.0];
        for pair in distances.windows(2) {
            let depth = f64::from(depths[depths.len() - 1]);
            depths.push((depth + (pair[1] - pair[0]) * 0.5 * (profile.at(pair[0]) + profile.at(pair[1]))) as f32);
        }
        let eye = shutter_state.cameras.middle().position;
        let integrator =
            InScatterIntegrator { lighting, extinction: profile, eye, distances: &distances, depths: &depths, end };
        let tiles = &sky.fine.tiles;
        let lamps = cache.scattering(&integrator, tiles, view);
        let lit_intervals = distances.windows(2).filter(|pair| pair[0] < end).count();
        Some(Self {
            level: bansho_base::math::simd::level(),
            view,
            table: OpticalDepthTable::new(&distances, &depths, lit_intervals),
            sky,
            lamps,
            end: end as f32,
            farthest: distances[distances.len() - 1] as f32,
            ground: shutter_state.ground,
        })
    }

    /// The grid at whose corners in-scattering is stored.
    fn tiles(&self) -> &TileGrid {
        &self.sky.fine.tiles
    }

    /// The bounds of the medium: a plate shows its own far rain.
    pub(super) fn bounds(&self) -> MediumBounds<'_> {
        let camera = &self.view.camera;
        let end = if self.view.has_plate { self.end } else { self.farthest };
        MediumBounds { camera, height: (camera.position.y - self.ground) as f32, end }
    }

    /// Whether a plate bounds the medium at the depths of a strip.
    pub(super) fn is_before_plate(&self, strip: &Strip) -> bool {
        self.view.has_plate && strip.has_plate()
    }

    /// Sky light at a corner of the row of corners `row`, or between it and the next.
    #[inline(always)]
    fn sky_at(&self, column: usize, row: GridPosition) -> [[f32; 3]; 2] {
        let columns = self.tiles().size[0];
        let index = row.index * columns + column;
        [&self.sky.fine.radiance, &self.sky.endless]
            .map(|sky| lerp_color(sky[index], sky[index + columns], row.fraction))
    }

    /// A component of the sky light that is scattered within segments, from that of rain that scatters `once` and of `endless` rain.
    ///
    /// Approximation of multiple scattering: rain of opacity o shows `o (1 - o)` of the sky light that is scattered once, and `o^2` of that of infinitely
    /// deep rain.
    #[inline(always)]
    fn scattered_sky<R: Real>(once: R, endless: R, rescattered: R, opacity: R) -> R {
        (endless - once).fma(rescattered, once).simd_max(once.broadcast(0.0)) * opacity
    }

    /// Draws the pixels of `rows` under the contents of the strip. They are within a row of tiles, which spans the rows
    /// `tile` of the picture.
    pub(crate) fn draw(&self, slice: &DepthInterval, tile: Range<usize>, rows: Rect, strip: &mut Strip) {
        if self.is_before_plate(strip) {
            dispatch!(self.level, simd => self.draw_in_front_of_plate(simd, slice, rows, strip));
        } else {
            dispatch!(self.level, simd => self.draw_without_plate(simd, slice, tile, rows, strip));
        }
        self.add_halos(slice, rows, strip);
    }

    /// Without a plate only the ground bounds the medium in most pixels: intervals are evaluated at the corners of the grid. In pixels that show solids they are
    /// evaluated for each.
    #[inline(always)]
    fn draw_without_plate<S: Simd>(
        &self,
        simd: S,
        slice: &DepthInterval,
        tile: Range<usize>,
        rows: Rect,
        strip: &mut Strip,
    ) {
        let side = self.tiles().side;
        // Whole tiles, whatever part of them the strip shows: the corners, and so the pixels, do not depend on the crop.
        let columns = rows.x / side..rows.right().div_ceil(side) + 1;
        let edges = [tile.start, tile.end].map(|y| self.corners(y, columns.clone(), slice));
        let mut sums = Vec::new();
        for y in rows.y..rows.bottom() {
            let down = ((y - tile.start) as f32 + 0.5) / tile.len() as f32;
            let start = (y - strip.rect.y) * strip.rect.width;
            let behind = surface_columns(strip, Rect { y, height: 1, ..rows });
            let behind = behind.start / FINE_TILE..behind.end.div_ceil(FINE_TILE);
            let lines = LinesOfSight { y, row: self.tiles().row_at(y as f32 + 0.5), first: behind.start };
            self.interpolate_lamps(&lines, &behind, &mut sums);
            for column in columns.start..columns.end - 1 {
                let left = column * side;
                let visible = left.max(rows.x)..(left + side).min(rows.right());
                let mut values = [[0.0_f32; FINE_TILE]; 4];
                for (c, values) in values.iter_mut().enumerate() {
                    let index = column - columns.start;
                    let (from, to) = (between(&edges, index, c, down), between(&edges, index + 1, c, down));
                    for (x, value) in values.iter_mut().enumerate() {
                        *value = (to - from).fma((x as f32 + 0.5) * (1.0 / FINE_TILE as f32), from);
                    }
                }
                let first = start + visible.start - strip.rect.x;
                let within = visible.start - left..visible.end - left;
                if behind.contains(&column) {
                    let surfaces = surface_depths(strip, first, within.clone(), f32::INFINITY);
                    let bounded = self.sixteen_pixels(simd, column, &lines, &sums, slice, &surfaces);
                    select_before_surfaces(&mut values, &bounded.unwrap_or_default(), &surfaces);
                }
                add_layer(strip, first, &values, within);
            }
        }
    }

    /// The light of lamps between two rows of corners, at both sides of some columns of tiles.
    #[inline(always)]
    fn interpolate_lamps(&self, lines: &LinesOfSight, columns: &Range<usize>, sums: &mut Vec<[f32; 4]>) {
        if let (Some(lamps), false) = (&self.lamps.in_scattering, columns.is_empty()) {
            let corners = columns.start..columns.end + 1;
            lamps.interpolate_rows(self.tiles(), lines.row, corners, 0..lamps.distances, sums);
        }
    }

    /// Radiance and opacity at the corners of some columns of the grid, interpolated to the height `y` of the picture (pixels).
    #[inline(always)]
    fn corners(&self, y: usize, columns: Range<usize>, slice: &DepthInterval) -> Vec<[f32; 4]> {
        let row = self.tiles().row_at(y as f32);
        let mut corners = Vec::with_capacity(columns.len() + LANES);
        for first in columns.clone().step_by(LANES) {
            let layer = self.sixteen_corners(y, first, columns.end - 1, row, slice);
            for i in 0..LANES {
                corners.push([layer[0][i], layer[1][i], layer[2][i], layer[3][i]]);
            }
        }
        corners.truncate(columns.len());
        corners
    }

    /// Radiance and opacity at the corners of sixteen columns from `first` on, up to the column `last`.
    #[inline(always)]
    fn sixteen_corners(&self, y: usize, first: usize, last: usize, row: GridPosition, slice: &DepthInterval) -> Layer {
        let side = self.tiles().side;
        let mut directions =
            Directions { components: [[0.0; LANES], [1.0; LANES], [0.0; LANES]], visible: [false; LANES] };
        let (mut once, mut endless) = ([ZERO_LANES; 3], [ZERO_LANES; 3]);
        for i in 0..LANES {
            let column = (first + i).min(last);
            let direction = self.view.camera.direction(DVec2::new((column * side) as f64, y as f64));
            directions.visible[i] = direction.is_some();
            let components = direction.unwrap_or(DVec3::Y).as_vec3().to_array();
            let [seen_once, seen_endless] = self.sky_at(column, row);
            for c in 0..3 {
                directions.components[c][i] = components[c];
                (once[c][i], endless[c][i]) = (seen_once[c], seen_endless[c]);
            }
        }
        let ranges = self.bounds().ranges(&mut directions, slice, &[f32::INFINITY; LANES]);
        let segments = RaySegments::new(&self.table, &ranges, self.end);
        let (opacities, rescattered) = (segments.opacities(), segments.opacities_up_to_ends());
        let mut layer = [ZERO_LANES, ZERO_LANES, ZERO_LANES, opacities];
        for c in 0..3 {
            for i in 0..LANES {
                layer[c][i] = Self::scattered_sky(once[c][i], endless[c][i], rescattered[i], opacities[i]);
            }
        }
        if let Some(lamps) = self.lamps.in_scattering.as_ref().filter(|_| segments.any_lit()) {
            let (stride, gains) = (lamps.distances * self.tiles().size[0], segments.gains());
            for i in 0..LANES {
                let above = row.index * stride + (first + i).min(last) * lamps.distances;
                let light = segments.in_scattered(i, gains[i], &lamps.sums, [above, above + stride], row.fraction);
                for c in 0..3 {
                    layer[c][i] += light[c];
                }
            }
        }
        layer
    }

    /// A plate may bound the medium at any depth, so intervals are evaluated for each pixel.
    #[inline(always)]
    fn draw_in_front_of_plate<S: Simd>(&self, simd: S, slice: &DepthInterval, rows: Rect, strip: &mut Strip) {
        let columns = rows.x / FINE_TILE..rows.right().div_ceil(FINE_TILE);
        let mut sums = Vec::new();
        for y in rows.y..rows.bottom() {
            let lines = LinesOfSight { y, row: self.tiles().row_at(y as f32 + 0.5), first: columns.start };
            self.interpolate_lamps(&lines, &columns, &mut sums);
            for column in columns.clone() {
                let left = column * FINE_TILE;
                let visible = left.max(rows.x)..(left + FINE_TILE).min(rows.right());
                let first = (y - strip.rect.y) * strip.rect.width + visible.start - strip.rect.x;
                let within = visible.start - left..visible.end - left;
                // Other pixels are hidden.
                let plate = surface_depths(strip, first, within.clone(), 0.0);
                if let Some(layer) = self.sixteen_pixels(simd, column, &lines, &sums, slice, &plate) {
                    add_layer(strip, first, &layer, within);
                }
            }
        }
    }

    /// Radiance and opacity of the sixteen pixels of a tile, in front of a `plate` (depths, m); `None` where it hides all. `sums` has the light of lamps of these
    /// lines of sight.
    #[inline(always)]
    fn sixteen_pixels<S: Simd>(
        &self,
        simd: S,
        column: usize,
        lines: &LinesOfSight,
        sums: &[[f32; 4]],
        slice: &DepthInterval,
        plate: &LaneArray,
    ) -> Option<Layer> {
        let LinesOfSight { y, row, first } = *lines;
        let index = column - first;
        let mut directions = Directions::new(&self.view.camera, column * FINE_TILE, y);
        let ranges = self.bounds().ranges(&mut directions, slice, plate);
        if !any_range(&ranges) {
            return None;
        }
        let segments = RaySegments::new(&self.table, &ranges, self.end);
        let (opacities, rescattered) = (segments.opacities(), segments.opacities_up_to_ends());
        let mut layer = [ZERO_LANES, ZERO_LANES, ZERO_LANES, opacities];
        let corners = [self.sky_at(column, row), self.sky_at(column + 1, row)];
        let (across, rescattered) = (Lanes::from_slice(simd, &ACROSS), Lanes::from_slice(simd, &rescattered));
        let opacities = Lanes::from_slice(simd, &opacities);
        for c in 0..3 {
            // By explicit vectors: the compiler makes vectors of the three colors of each pixel otherwise, which take twice as long.
            let [[left_once, left_endless], [right_once, right_endless]] = corners;
            let [once, endless] = [Lanes::splat(simd, left_once[c]), Lanes::splat(simd, left_endless[c])];
            let left = Self::scattered_sky(once, endless, rescattered, opacities);
            let [once, endless] = [Lanes::splat(simd, right_once[c]), Lanes::splat(simd, right_endless[c])];
            let right = Self::scattered_sky(once, endless, rescattered, opacities);
            (right - left).fma(across, left).store_slice(&mut layer[c]);
        }
        if let Some(lamps) = self.lamps.in_scattering.as_ref().filter(|_| segments.any_lit()) {
            let corners = [index * lamps.distances, (index + 1) * lamps.distances];
            let gains = segments.gains();
            for i in 0..LANES {
                let light = segments.in_scattered(i, gains[i], sums, corners, ACROSS[i]);
                for c in 0..3 {
                    layer[c][i] += light[c];
                }
            }
        }
        Some(layer)
    }
}

/// A component at a column of corners, between two rows of corners: `down` of the way from the upper to the lower one.
#[inline(always)]
fn between(rows: &[Vec<[f32; 4]>; 2], column: usize, c: usize, down: f32) -> f32 {
    let (top, bottom) = (rows[0][column][c], rows[1][column][c]);
    (bottom - top).fma(down, top)
}

/// Adds a part of sixteen pixels under the contents of a strip, the first at its pixel `first`.
#[inline(always)]
fn add_layer(strip: &mut Strip, first: usize, layer: &Layer, part: Range<usize>) {
    if part.len() == LANES {
        // Of a length that is known when it is compiled.
        let [red, green, blue, opacity] = layer;
        strip.add_row_behind(first, [red, green, blue], Some(opacity), &NO_DEPTH);
        add_optical_depths(&mut strip.aovs, first, opacity);
        return;
    }
    let [red, green, blue, opacity] = layer.each_ref().map(|row| &row[part.clone()]);
    strip.add_row_behind(first, [red, green, blue], Some(opacity), &NO_DEPTH[..part.len()]);
    add_optical_depths(&mut strip.aovs, first, opacity);
}
