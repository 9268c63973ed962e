//! One frame of an aurora: from its chart to pixels.

use std::sync::OnceLock;

use bansho_base::{
    camera::Camera,
    canvas::{DepthInterval, Strip, View},
    image::Rect,
    math::{self, DVec2, DVec3, lanes},
    observer::{Cancelled, Observer, check},
    phenomenon::Prepared,
};
use fearless_simd::{Level, dispatch};

use super::{
    Aurora,
    chart::{Chart, Coverage},
    footprint::{Footprint, REACH},
    geometry::{EARTH_RADIUS_KM, FieldLines},
    maps::Maps,
    meridians::{Meridians, Sampler},
    phenomenon::MEASURED,
    sources::Sources,
};
use crate::aurora::{
    light::{LINES, PerEmitter},
    particles::AuroraSimulation,
};

/// Pixels that are worked on at once.
const BATCH: usize = 16;
/// Altitude whose distance is an aurora's depth, km.
const DEPTH_KM: f64 = 110.0;
/// Fainter than this is no aurora to a depth, kR.
const FAINTEST: f32 = 0.05;
/// Motion of the picture while the shutter is open that one instant stands for, pixels, and the most instants.
const PIXELS_PER_INSTANT: f64 = 1.0;
const MOST_INSTANTS: f64 = 16.0;
/// The same for particles, beside their own spread.
const SPREADS_PER_INSTANT: f64 = 1.0;

/// The depths at which auroras are drawn, m: behind the highest mountain, before the sky.
pub(super) const DEPTHS: DepthInterval = DepthInterval { near: 2e4, far: 1e10 };

/// A frame, ready to draw in strips.
pub(super) struct PreparedAurora<'a> {
    aurora: &'a Aurora,
    view: &'a View,
    level: Level,
    cameras: Vec<Camera>,
    field: FieldLines,
    /// Chart of the sharp light, and a coarser one of what is soft.
    charts: [Meridians; 2],
    /// Made where they are asked for.
    maps: OnceLock<Maps<'a>>,
}

impl<'a> PreparedAurora<'a> {
    pub(super) fn new(aurora: &'a Aurora, view: &'a View, observer: &dyn Observer) -> Result<Self, Cancelled> {
        let field = aurora.field_lines(view.camera.position);
        let sources = Sources::new(&aurora.light(view), &field, &aurora.instants(view));
        check(observer)?;
        let coverage = Coverage::of_view(view, &field);
        let [sharp, soft] = sources.spread_km;
        let step = (aurora.simulation.time() / AuroraSimulation::STEP_S).round() as i64 as u32;
        let draw = |sources: &[_], spread_km: f64, [column, row]: [f64; 2]| {
            let chart = Chart::new(&coverage, column, row);
            let bins = (spread_km * f64::from(REACH) / 250.0).clamp(row, 4.0 * row);
            let footprint = Footprint::new(sources, &chart, bins);
            match &aurora.collisions {
                Some(collisions) => collisions.draw(chart, &field, &footprint, step),
                None => Meridians::new(chart, &field, &aurora.profiles, &footprint),
            }
        };
        let pixel = coverage.pixel;
        // The angle at which the spread is seen from the nearest place where such light is.
        let row = (sharp / 130.0).clamp(pixel, 2.0 * pixel);
        let coarse = (soft / 500.0).clamp(pixel, 16.0 * pixel);
        let sharp = draw(&sources.sharp, sharp, [pixel, row]);
        check(observer)?;
        let soft = draw(&sources.soft, soft, [coarse, coarse]);
        Ok(Self {
            aurora,
            view,
            level: Level::new(),
            cameras: cameras(view),
            field,
            charts: [sharp, soft],
            maps: OnceLock::new(),
        })
    }
}

/// Cameras at as many instants as the picture's motion while the shutter is open needs.
fn cameras(view: &View) -> Vec<Camera> {
    let [open, close] = [view.shutter.open, view.shutter.close].map(|t| view.camera_at(t));
    let moved = |x: f64, y: f64| {
        let place = |camera: &Camera| camera.direction(DVec2::new(x * camera.size[0], y * camera.size[1]));
        let pair = place(&open).zip(place(&close));
        pair.map_or(0.0, |(a, b)| a.normalize().angle_between(b.normalize()) * open.focal_pixels)
    };
    let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0], [0.5, 0.5]].map(|[x, y]| moved(x, y));
    let most = corners.into_iter().fold(0.0, f64::max);
    let count = (most / PIXELS_PER_INSTANT).ceil().clamp(1.0, MOST_INSTANTS) as usize;
    if count == 1 {
        return vec![view.camera];
    }
    (0..count).map(|instant| view.camera_at(view.shutter.instant(instant, count))).collect()
}

impl Aurora {
    /// Instants at which particles are drawn, s after their step: more where they get far while the shutter is open.
    fn instants(&self, view: &View) -> Vec<f64> {
        let particles = self.simulation.particles();
        let squares: f64 = particles.velocities.iter().flatten().map(|speed| f64::from(speed * speed)).sum();
        let fast = 2.0 * math::sqrt(squares / particles.len().max(1) as f64);
        let spread = self.light(view).spread_km();
        let ways = fast * view.shutter.duration() / (SPREADS_PER_INSTANT * spread);
        let count = ways.ceil().clamp(1.0, MOST_INSTANTS) as usize;
        let now = self.simulation.time();
        // A long exposure has its own afterglow: particles are never taken further than a step.
        let step = AuroraSimulation::STEP_S;
        (0..count).map(|instant| (view.shutter.instant(instant, count) - now).clamp(-step, step)).collect()
    }
}

/// Directions of a batch of pixels in the field's frame, and what is needed of them.
#[derive(Default)]
pub(super) struct Batch {
    /// Colatitude and longitude about the magnetic zenith.
    pub(super) colatitude: [f32; BATCH],
    pub(super) longitude: [f32; BATCH],
    /// Sine of the elevation.
    sine: [f32; BATCH],
    /// Length of the direction that [`Camera::direction`] gives.
    length: [f32; BATCH],
    /// Whether the lens sees anything there.
    seen: [bool; BATCH],
}

impl Batch {
    /// Pixels from `x` on in row `y`.
    #[inline(always)]
    pub(super) fn new(camera: &Camera, field: &FieldLines, x: usize, y: usize) -> Self {
        let mut batch = Self::default();
        let at = |x: usize| camera.direction(DVec2::new(x as f64 + 0.5, y as f64 + 0.5));
        let mut directions = [DVec3::Y.as_vec3(); BATCH];
        if let (Some(first), Some(last)) = (at(x), at(x + BATCH)) {
            // Exact for a perspective lens; elsewhere within a few hundredths of a pixel.
            let (first, step) = (first.as_vec3(), ((last - first) / BATCH as f64).as_vec3());
            directions = std::array::from_fn(|i| first + step * i as f32);
            batch.seen = [true; BATCH];
        } else {
            for i in 0..BATCH {
                if let Some(direction) = at(x + i) {
                    (directions[i], batch.seen[i]) = (direction.as_vec3(), true);
                }
            }
        }
        let [along, first, second] =
            [field.along, field.across[0], field.across[1]].map(|axis| axis.as_vec3().to_array());
        let dot = |axis: [f32; 3], d: [f32; 3]| axis[0].mul_add(d[0], axis[1].mul_add(d[1], axis[2] * d[2]));
        for i in 0..BATCH {
            let direction = directions[i].to_array();
            let (x, y) = (dot(first, direction), dot(second, direction));
            let length = dot(direction, direction).sqrt();
            batch.colatitude[i] = lanes::atan2(x.mul_add(x, y * y).sqrt(), dot(along, direction));
            batch.longitude[i] = lanes::atan2(y, x);
            batch.sine[i] = direction[1] / length;
            batch.length[i] = length;
        }
        batch
    }
}

impl PreparedAurora<'_> {
    #[inline(always)]
    fn rows(&self, slice: &DepthInterval, strip: &mut Strip) {
        let samplers = self.charts.each_ref().map(Meridians::sampler);
        let rect = strip.rect;
        for row in 0..rect.height {
            // Batches lie on the picture's own grid, so that a crop changes no pixel.
            for x in (rect.x / BATCH * BATCH..rect.right()).step_by(BATCH) {
                self.batch(&samplers, slice, strip, [x, rect.y + row]);
            }
        }
    }

    #[inline(always)]
    fn batch(&self, samplers: &[Sampler; 2], slice: &DepthInterval, strip: &mut Strip, [x, y]: [usize; 2]) {
        let rect = strip.rect;
        let inside = rect.x.max(x) - x..rect.right().min(x + BATCH) - x;
        let share = 1.0 / self.cameras.len() as f32;
        for camera in &self.cameras {
            let batch = Batch::new(camera, &self.field, x, y);
            for i in inside.clone() {
                let index = (y - rect.y) * rect.width + x + i - rect.x;
                let sky = self.above_horizon(batch.sine[i]) * share;
                if !batch.seen[i] || sky <= 0.0 {
                    continue;
                }
                let depth = self.depth(batch.sine[i]) / batch.length[i];
                if !slice.contains(f64::from(depth)) || !strip.visible(index, depth) {
                    continue;
                }
                let [sharp, soft] =
                    samplers.each_ref().map(|sampler| sampler.light(batch.longitude[i], batch.colatitude[i]));
                let light: PerEmitter<f32> = std::array::from_fn(|e| (sharp[e] + soft[e]) * sky);
                let brightness = light[0] + light[1] + light[2];
                let seen = if brightness > FAINTEST * share { depth } else { f32::INFINITY };
                strip.emit(index, self.aurora.shading.colour(&light, batch.sine[i]), seen);
                for (plane, line) in strip.aovs.iter_mut().zip(MEASURED) {
                    let line = &LINES[line];
                    plane.add(index, light[line.emitter.index()] * line.photons as f32, 1.0);
                }
                if !strip.aovs.is_empty() {
                    self.map(strip, index, camera.direction(DVec2::new((x + i) as f64 + 0.5, y as f64 + 0.5)), share);
                }
            }
        }
    }

    /// Adds what the cells in a direction hold.
    #[inline(never)]
    fn map(&self, strip: &mut Strip, index: usize, direction: Option<DVec3>, share: f32) {
        let maps = self.maps.get_or_init(|| Maps::new(&self.aurora.simulation));
        let Some(place) = direction.and_then(|direction| self.field.drawn(direction)) else { return };
        for (plane, value) in strip.aovs.iter_mut().skip(MEASURED.len()).zip(maps.at(place)) {
            plane.add(index, value, share);
        }
    }

    /// Distance of the aurora in a direction of that elevation, m.
    #[inline(always)]
    fn depth(&self, sine: f32) -> f32 {
        let from_middle = (EARTH_RADIUS_KM + self.field.observer_altitude_km()) as f32;
        let shell = (EARTH_RADIUS_KM + DEPTH_KM) as f32;
        let along = from_middle * sine;
        let squared = along.mul_add(along, (shell - from_middle) * (shell + from_middle));
        1e3 * (squared.max(0.0).sqrt() - along).abs()
    }

    /// How much of a pixel of that elevation is above the horizon.
    #[inline(always)]
    fn above_horizon(&self, sine: f32) -> f32 {
        let height = self.field.observer_altitude_km().max(0.0);
        let horizon = -(2.0 * height / EARTH_RADIUS_KM).sqrt();
        let pixels = (sine - horizon as f32) * self.view.camera.focal_pixels as f32;
        (pixels + 0.5).clamp(0.0, 1.0)
    }
}

impl Prepared for PreparedAurora<'_> {
    fn bounds(&self, slice: &DepthInterval) -> Rect {
        if slice.overlaps(&DEPTHS) { Rect::of_size(self.view.size[0], self.view.size[1]) } else { Rect::default() }
    }

    fn draw(&self, slice: &DepthInterval, strip: &mut Strip) {
        if slice.overlaps(&DEPTHS) {
            dispatch!(self.level, _simd => self.rows(slice, strip));
        }
    }
}
