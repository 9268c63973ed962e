//! A prepared frame of fog.

use std::sync::Arc;

use bansho_base::{
    camera::directions::Directions,
    image::Rect,
    math::{
        DVec3, approximations,
        simd::{LANES, LaneArray, Real},
    },
    phenomenon::{
        Prepared,
        strip::{DepthInterval, Strip, View},
        surroundings::Surroundings,
    },
    world::sky::Sky,
};
use fearless_simd::{Level, dispatch};

use super::{
    light_in_fog::{LightInFog, Segments},
    row_cache::{CachedBatch, ENDLESS, FogBatch, FogCache, FogInputs, FogRows, SliceRows},
};
use crate::ground::height_of_level_ground;

/// Fog in one frame.
pub(super) struct PreparedFog<'a> {
    level: Level,
    /// Extinction coefficient, 1/m.
    extinction: f32,
    view: &'a View,
    sky: Sky,
    lights: Vec<LightInFog>,
    /// Height of the camera above the ground, at which lines of sight end, m; infinite without one.
    height: f32,
    /// Height of the mirror above the camera in a mirrored view, m: fog between the two dims the mirror itself.
    mirror: Option<f32>,
    /// Fog of earlier frames.
    cached_rows: Option<Arc<FogRows>>,
}

/// Optical depth behind which nothing is seen: 1e-9 of the light is left.
const OPAQUE: f32 = 20.0;

impl<'a> PreparedFog<'a> {
    pub(super) fn new(extinction: f64, view: &'a View, surroundings: &Surroundings, cache: &FogCache) -> Self {
        let camera = view.camera.position;
        let extinction = extinction as f32;
        let ground = height_of_level_ground(&surroundings.others.occluders);
        let height = ground.map(|ground| camera.y - ground).filter(|height| *height > 0.0);
        let height = height.map_or(f32::INFINITY, |height| height as f32);
        let inputs = FogInputs {
            camera: view.camera,
            size: view.size,
            window: view.window,
            mirror: view.mirror,
            extinction,
            sky: surroundings.sky,
            lights: surroundings.others.lights.clone(),
            height,
        };
        Self {
            level: bansho_base::math::simd::level(),
            extinction,
            view,
            sky: surroundings.sky,
            lights: surroundings.others.lights.iter().filter_map(|light| LightInFog::new(light, camera)).collect(),
            height,
            mirror: view.mirror.map(|mirror| (mirror - camera.y) as f32),
            cached_rows: cache.rows(inputs, view.camera_parameters.is_constant()),
        }
    }

    /// The parts of sixteen lines of sight that are within a slice and in front of the plate (depths, m) and the ground.
    #[inline(always)]
    fn segments(&self, directions: &mut Directions, slice: &DepthInterval, plate: &LaneArray) -> Segments {
        let lengths = directions.normalize();
        let (near, far) = (slice.near as f32, slice.far as f32);
        let (mut begin, mut end) = ([0.0; LANES], [0.0; LANES]);
        for i in 0..LANES {
            let climb = directions.components[1][i];
            let ground = if climb < 0.0 { self.height / -climb } else { f32::INFINITY };
            let start =
                self.mirror.map_or(0.0, |height| if climb > 0.0 { (height / climb).simd_max(0.0) } else { 0.0 });
            let from = (near * lengths[i]).simd_max(start);
            let to = (plate[i].simd_min(far) * lengths[i]).simd_min(ground);
            begin[i] = if directions.visible[i] { from } else { 0.0 };
            end[i] = if directions.visible[i] { to.simd_max(from) } else { 0.0 };
        }
        Segments { directions: directions.components, begin, end }
    }

    /// Radiance and opacity of sixteen segments.
    #[inline(always)]
    fn layer(&self, segments: &Segments) -> ([LaneArray; 3], LaneArray) {
        let (mut opacity, mut any_seen) = ([0.0; LANES], false);
        for i in 0..LANES {
            let width = segments.end[i] - segments.begin[i];
            opacity[i] = if width > 0.0 { 1.0 - approximations::exp(-self.extinction * width) } else { 0.0 };
            any_seen |= (opacity[i] > 0.0) & (self.extinction * segments.begin[i] < OPAQUE);
        }
        let mut light = [[0.0; LANES]; 3];
        if any_seen {
            self.add_airlight(segments, &opacity, &mut light);
            // A loop, not `for_each`: its closure would be compiled without the vector instructions of this function.
            for source in &self.lights {
                source.add(segments, self.extinction, &mut light);
            }
        }
        for i in 0..LANES {
            // What is farther is hidden by the fog itself, and its segments only close what is behind them.
            let is_seen = (opacity[i] > 0.0) & (self.extinction * segments.begin[i] < OPAQUE);
            for c in 0..3 {
                light[c][i] = if is_seen { light[c][i] } else { 0.0 };
            }
        }
        (light, opacity)
    }

    /// Koschmieder's airlight: an endless medium has the radiance of the sky in that direction, below the horizon that at the horizon; what is within a
    /// segment has the share of it that is lost behind.
    #[inline(always)]
    fn add_airlight(&self, segments: &Segments, opacity: &LaneArray, light: &mut [LaneArray; 3]) {
        let [xs, ys, zs] = &segments.directions;
        for i in 0..LANES {
            if opacity[i] > 0.0 {
                let direction = DVec3::new(f64::from(xs[i]), f64::from(ys[i].max(0.0)), f64::from(zs[i]));
                let endless = self.sky.radiance(direction.normalize_or_zero());
                for c in 0..3 {
                    light[c][i] += endless[c] * opacity[i];
                }
            }
        }
    }

    /// Fog in sixteen pixels from the column `x` on, up to depths `plate`.
    #[inline(always)]
    fn batch(&self, [x, y]: [usize; 2], slice: &DepthInterval, plate: &LaneArray) -> FogBatch {
        let segments = self.segments(&mut Directions::new(&self.view.camera, x, y), slice, plate);
        let (light, opacity) = self.layer(&segments);
        FogBatch { light, opacity }
    }

    /// Draws a row of a strip, in batches that begin at the same columns whatever is drawn of the picture.
    #[inline(always)]
    fn draw_row(&self, y: usize, slice: &DepthInterval, cached: Option<&SliceRows>, strip: &mut Strip) {
        let (rect, window) = (strip.rect, self.view.window);
        let is_whole = rect.x == window.x && rect.width == window.width;
        let cached = cached.filter(|_| is_whole).map(|rows| rows.row(y - window.y));
        let known_row = cached.and_then(|row| row.get());
        let mut new_row = Vec::new();
        for (index, x) in (rect.x / LANES * LANES..rect.right()).step_by(LANES).enumerate() {
            let cached_batch = known_row.map(|row| &row[index]);
            if cached_batch.is_some_and(CachedBatch::is_empty) {
                continue;
            }
            let drawn = x.max(rect.x)..(x + LANES).min(rect.right());
            let first = (y - rect.y) * rect.width + drawn.start - rect.x;
            let mut plate = ENDLESS;
            for column in drawn.clone() {
                plate[column - x] = strip.plate_depth(first + column - drawn.start);
            }
            let part = drawn.start - x..drawn.end - x;
            let known = cached_batch.and_then(|batch| batch.up_to(&plate));
            let computed = if known.is_none() { Some(self.batch([x, y], slice, &plate)) } else { None };
            let Some(FogBatch { light, opacity }) = known.or(computed.as_ref()) else { continue };
            let [red, green, blue] = light.each_ref().map(|plane| &plane[part.clone()]);
            strip.add_row_behind(first, [red, green, blue], Some(&opacity[part.clone()]), &ENDLESS[part]);
            if let (Some(_), None, Some(batch)) = (cached, known_row, computed) {
                new_row.push(CachedBatch::new(batch, &plate));
            }
        }
        if let (Some(row), None) = (cached, known_row) {
            // Another thread may have computed it meanwhile, to the same numbers.
            let _ = row.set(new_row);
        }
    }
}

impl Prepared for PreparedFog<'_> {
    fn bounds(&self, _slice: &DepthInterval) -> Rect {
        Rect::from_size(self.view.size[0], self.view.size[1])
    }

    fn draw(&self, slice: &DepthInterval, strip: &mut Strip) {
        let cached = self.cached_rows.as_ref().and_then(|rows| rows.of_slice(slice));
        for y in strip.rect.y..strip.rect.bottom() {
            dispatch!(self.level, _simd => self.draw_row(y, slice, cached.as_deref(), strip));
        }
    }
}
