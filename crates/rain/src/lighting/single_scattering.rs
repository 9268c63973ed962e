//! Rain that is not drawn as streaks, as a participating medium: extinction of the background, and single scattering
//! (airlight, halos around lamps).

use std::{ops::Range, sync::Arc};

use bansho_base::{
    host::once::get_or_compute,
    image::Rect,
    math::{self, DVec2, MulAdd},
    phenomenon::strip::{DepthInterval, Strip, View},
};
use fearless_simd::{Level, dispatch};

use super::{
    drop_lighting::DropLighting,
    extinction::RainExtinction,
    in_scattering::{
        ExtinctionProfile, HALO_RADIUS, InScatterIntegrator, InScattering, LampHalo, LampScattering,
        LampScatteringCache, ray_distance,
    },
    sky::SkyLighting,
    tiles::{FINE_TILE, GridPosition, TileGrid, geometric_sequence, lerp_color},
};
use crate::drops::shutter_state::ShutterState;

/// First distance at which accumulated in-scattering is stored, m, and the ratio of successive distances.
const FIRST_DISTANCE: f64 = 0.5;
const DISTANCE_RATIO: f64 = 1.25;
/// Ratio of successive distances beyond the range of lamps.
const FAR_DISTANCE_RATIO: f64 = 2.0;
/// Optical depth beyond which light of lamps is neglected: the transmittance is below 1e-17.
const MAX_OPTICAL_DEPTH: f32 = 40.0;
/// Depth of the medium, m: it has none.
const NO_DEPTH: [f32; FINE_TILE] = [f32::INFINITY; FINE_TILE];
/// A position between two stored distances.
#[derive(Clone, Copy)]
struct Bracket {
    /// Index of the nearer one.
    index: usize,
    /// Interpolation fraction toward the next.
    fraction: f32,
}

/// An interval of a line of sight.
struct RaySegment {
    /// Its ends among the stored distances.
    brackets: [Bracket; 2],
    /// Optical depths of its ends.
    depths: [f32; 2],
    /// Inverse transmittance from the camera to its near end; 0 beyond the range of lamps and where nothing is
    /// transmitted.
    gain: f32,
}

impl RaySegment {
    /// Light of lamps scattered within it, at a corner of a grid, as seen from its near end.
    fn in_scattered(&self, in_scattering: &InScattering, corner: usize) -> [f32; 3] {
        if self.gain == 0.0 {
            return [0.0; 3];
        }
        let [near, far] = self.brackets.map(|Bracket { index, fraction }| {
            lerp_color(in_scattering.0[index][corner], in_scattering.0[index + 1][corner], fraction)
        });
        std::array::from_fn(|c| (far[c] - near[c]).max(0.0) * self.gain)
    }
}

/// Extinction and single scattering along the lines of sight of one frame.
pub(crate) struct SingleScattering<'a> {
    level: Level,
    view: &'a View,
    /// The sky at the corners of the fine grid, at which in-scattering is stored too.
    sky: Arc<SkyLighting>,
    /// Stored distances, ascending from 0, m.
    distances: Vec<f64>,
    /// Optical depth up to each distance.
    depths: Vec<f32>,
    /// Light of lamps and fires that is scattered toward the camera.
    lamps: Arc<LampScattering>,
    /// Range of the light of lamps, and end of the medium in front of a plate, m.
    end: f64,
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
        Some(Self {
            level: bansho_base::math::simd::level(),
            view,
            sky,
            distances,
            depths,
            lamps,
            end,
            ground: shutter_state.ground,
        })
    }

    /// The grid at whose corners in-scattering is stored.
    fn tiles(&self) -> &TileGrid {
        &self.sky.fine.tiles
    }

    /// Position of a distance among the stored ones.
    fn bracket(&self, distance: f64) -> Bracket {
        let last = self.distances.len() - 1;
        let next = self.distances.partition_point(|stored| *stored <= distance).clamp(1, last);
        let (near, far) = (self.distances[next - 1], self.distances[next]);
        Bracket { index: next - 1, fraction: ((distance - near) / (far - near)).clamp(0.0, 1.0) as f32 }
    }

    /// The interval between two distances.
    fn segment(&self, [near, far]: [f64; 2]) -> RaySegment {
        let brackets = [near, far.max(near)].map(|distance| self.bracket(distance));
        let depths = brackets.map(|Bracket { index, fraction }| {
            self.depths[index] + (self.depths[index + 1] - self.depths[index]) * fraction
        });
        // Beyond the maximum optical depth nothing is visible, and the gain would overflow.
        let is_lit = near < self.end && depths[0] < MAX_OPTICAL_DEPTH;
        let gain = if is_lit { math::approximations::exp(depths[0]) } else { 0.0 };
        RaySegment { brackets, depths, gain }
    }

    /// Radiance and transmittance of an interval at a column of the grid, interpolated between `row` and the next.
    fn radiance_and_transmittance(&self, column: usize, row: GridPosition, segment: &RaySegment) -> [f32; 4] {
        let columns = self.tiles().size[0];
        let index = row.index * columns + column;
        let below = index + columns;
        let down = row.fraction;
        let [near, far] = segment.depths;
        let transmittance = math::approximations::exp(near - far);
        let opacities = segment.depths.map(|depth| 1.0 - math::approximations::exp(-depth));
        let lit = match &self.lamps.in_scattering {
            Some(in_scattering) => {
                lerp_color(segment.in_scattered(in_scattering, index), segment.in_scattered(in_scattering, below), down)
            }
            None => [0.0; 3],
        };
        let [once, endless] =
            [&self.sky.fine.radiance, &self.sky.endless].map(|sky| lerp_color(sky[index], sky[below], down));
        // Approximation of multiple scattering: rain of opacity o shows `o (1 - o)` of the sky light that is scattered
        // once, and `o^2` of that of infinitely deep rain.
        let rescattered = opacities[0] + opacities[1];
        let sky: [f32; 3] = std::array::from_fn(|c| (once[c] + (endless[c] - once[c]) * rescattered).max(0.0));
        let light: [f32; 3] = std::array::from_fn(|c| lit[c] + sky[c] * (1.0 - transmittance));
        [light[0], light[1], light[2], transmittance]
    }

    /// Correction of a pixel near a lamp: the value of the finer grid less that of the picture's grid.
    fn halo_correction(
        &self,
        halo: &LampHalo,
        x: usize,
        y: usize,
        slice: &DepthInterval,
        plate: Option<f64>,
    ) -> Option<[f32; 3]> {
        let pixel = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
        let range = self.distance_range(pixel, slice, plate).filter(|range| range[0] < range[1])?;
        let direction = self.view.camera.direction(pixel)?.normalize_or_zero();
        let position = pixel.as_vec2().to_array();
        let mut correction = [0.0_f32; 3];
        let segment = self.segment(range);
        let nearest = ray_distance(halo.offset, direction);
        for (corner, t) in halo.fine_tiles.corner_weights(position) {
            let factor = t * halo.ray_distance[corner] / nearest;
            let lit = segment.in_scattered(&halo.fine_in_scattering, corner);
            (0..3).for_each(|c| correction[c] += lit[c] * factor);
        }
        for (corner, t) in self.tiles().corner_weights(position) {
            let lit = segment.in_scattered(&halo.in_scattering, corner);
            (0..3).for_each(|c| correction[c] -= lit[c] * t);
        }
        Some(correction)
    }

    /// The correction of a pixel near a lamp, faded toward the edge of its halo; 0 where there is none.
    fn faded_correction(
        &self,
        halo: &LampHalo,
        x: usize,
        y: usize,
        slice: &DepthInterval,
        plate: Option<f64>,
    ) -> [f32; 3] {
        let distance = (DVec2::new(x as f64 + 0.5, y as f64 + 0.5) - halo.pixel).length() / HALO_RADIUS;
        let fade = 1.0 - math::smoothstep(0.6, 1.0, distance) as f32;
        if fade <= 0.0 {
            return [0.0; 3];
        }
        self.halo_correction(halo, x, y, slice, plate).map_or([0.0; 3], |light| light.map(|value| fade * value))
    }

    /// Adds the corrections near lamps to a row of tiles.
    fn add_halos(&self, slice: &DepthInterval, rows: Rect, strip: &mut Strip) {
        for halo in &self.lamps.halos {
            let rect = halo.rect.intersection(&rows);
            if rect.is_empty() {
                continue;
            }
            let cached = (!strip.has_plate()).then(|| halo.corrections.rows(slice, halo.rect.height));
            for y in rect.y..rect.bottom() {
                let row = cached.as_ref().map(|rows| {
                    let columns = halo.rect.x..halo.rect.right();
                    let compute = || columns.map(|x| self.faded_correction(halo, x, y, slice, None)).collect();
                    get_or_compute(&rows[y - halo.rect.y], compute)
                });
                for x in rect.x..rect.right() {
                    let index = (y - strip.rect.y) * strip.rect.width + x - strip.rect.x;
                    let light = match row {
                        Some(row) => row[x - halo.rect.x],
                        None => {
                            let plate = Some(f64::from(strip.plate_depth(index)));
                            self.faded_correction(halo, x, y, slice, plate)
                        }
                    };
                    if light == [0.0; 3] {
                        continue;
                    }
                    // The medium in front of it is contained in the strip's transmittance too; its effect is small.
                    (0..3).for_each(|c| strip.radiance[c][index] = (strip.radiance[c][index] + light[c]).max(0.0));
                }
            }
        }
    }

    /// The distances between which a pixel shows the medium in a depth interval, in front of a `plate` (depth, m).
    fn distance_range(&self, pixel: DVec2, slice: &DepthInterval, plate: Option<f64>) -> Option<[f64; 2]> {
        let hidden = plate.unwrap_or(f64::INFINITY);
        let end = if plate.is_some() { self.end } else { self.distances[self.distances.len() - 1] };
        let camera = &self.view.camera;
        let direction = camera.direction(pixel)?;
        let length = direction.length();
        let ground = (camera.position.y - self.ground) / -direction.y;
        let far = slice.far.min(hidden).min(if ground > 0.0 { ground } else { f64::INFINITY });
        // In a mirrored view the camera is beneath the ground, and the rain begins there.
        let beneath = camera.position.y < self.ground;
        let near = if beneath { slice.near.max(ground) } else { slice.near };
        let far = if beneath { slice.far.min(hidden) } else { far };
        (!beneath || ground > 0.0).then(|| [near, far].map(|depth| (depth * length).min(end)))
    }

    /// Draws the pixels of `rows` under the contents of the strip. They are within a row of tiles, which spans the rows
    /// `tile` of the picture.
    pub(crate) fn draw(&self, slice: &DepthInterval, tile: Range<usize>, rows: Rect, strip: &mut Strip) {
        if strip.has_plate() {
            self.draw_in_front_of_plate(slice, rows, strip);
        } else {
            dispatch!(self.level, _simd => self.draw_without_plate(slice, tile, rows, strip));
        }
        self.add_halos(slice, rows, strip);
    }

    /// Without a plate only the ground bounds the medium: intervals are evaluated at the corners of the grid.
    #[inline(always)]
    fn draw_without_plate(&self, slice: &DepthInterval, tile: Range<usize>, rows: Rect, strip: &mut Strip) {
        let side = self.tiles().side;
        let columns = rows.x / side..rows.right().div_ceil(side) + 1;
        let edge = |y: f64| -> Vec<[f32; 4]> {
            let position = self.tiles().row_at(y as f32);
            let corner = |column: usize| {
                let range = self.distance_range(DVec2::new((column * side) as f64, y), slice, None);
                range.map_or([0.0, 0.0, 0.0, 1.0], |range| {
                    self.radiance_and_transmittance(column, position, &self.segment(range))
                })
            };
            columns.clone().map(corner).collect()
        };
        let edges = [edge(tile.start as f64), edge(tile.end as f64)];
        for y in rows.y..rows.bottom() {
            let down = ((y - tile.start) as f32 + 0.5) / tile.len() as f32;
            let corner = |column: usize, c: usize| {
                let (top, bottom) = (edges[0][column][c], edges[1][column][c]);
                (bottom - top).fma(down, top)
            };
            let start = (y - strip.rect.y) * strip.rect.width;
            for column in 0..edges[0].len() - 1 {
                let left = (columns.start + column) * side;
                let visible = left.max(rows.x)..(left + side).min(rows.right());
                let mut values = [[0.0_f32; FINE_TILE]; 4];
                for (c, values) in values.iter_mut().enumerate() {
                    let (from, to) = (corner(column, c), corner(column + 1, c));
                    for (x, value) in values.iter_mut().enumerate() {
                        *value = (to - from).fma((x as f32 + 0.5) * (1.0 / FINE_TILE as f32), from);
                    }
                }
                values[3].iter_mut().for_each(|transmittance| *transmittance = 1.0 - *transmittance);
                let [red, green, blue, opacity] =
                    values.each_ref().map(|row| &row[visible.start - left..visible.end - left]);
                let first = start + visible.start - strip.rect.x;
                strip.add_row_behind(first, [red, green, blue], Some(opacity), &NO_DEPTH[..visible.len()]);
            }
        }
    }

    /// A plate may bound the medium at any depth, so intervals are evaluated for each pixel.
    fn draw_in_front_of_plate(&self, slice: &DepthInterval, rows: Rect, strip: &mut Strip) {
        for y in rows.y..rows.bottom() {
            let position = self.tiles().row_at(y as f32 + 0.5);
            for x in rows.x..rows.right() {
                let index = (y - strip.rect.y) * strip.rect.width + x - strip.rect.x;
                let pixel = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
                let Some(range) = self.distance_range(pixel, slice, Some(f64::from(strip.plate_depth(index)))) else {
                    continue;
                };
                if range[1] <= range[0] {
                    continue;
                }
                let side = self.tiles().side;
                let column = x / side;
                let across = ((x % side) as f32 + 0.5) / side as f32;
                let segment = self.segment(range);
                let [left, right] =
                    [column, column + 1].map(|column| self.radiance_and_transmittance(column, position, &segment));
                composite_pixel(strip, index, std::array::from_fn(|c| (right[c] - left[c]).fma(across, left[c])));
            }
        }
    }
}

#[inline(always)]
fn composite_pixel(strip: &mut Strip, index: usize, [red, green, blue, transmittance]: [f32; 4]) {
    strip.add_row_behind(index, [&[red], &[green], &[blue]], Some(&[1.0 - transmittance]), &[f32::INFINITY]);
}
