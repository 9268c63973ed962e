//! One frame of an aurora: from its chart to pixels.

use std::sync::OnceLock;

use bansho_base::{
    camera::Camera,
    canvas::{DepthInterval, Strip, View},
    image::Rect,
    math::{self, DVec2, DVec3, Fused, lanes},
    observer::{Cancelled, Observer, check},
    phenomenon::Prepared,
};
use fearless_simd::{Level, Simd, dispatch, prelude::*};

use super::{
    Aurora, Blur,
    blur::Blurred,
    chart::{Chart, Coverage},
    footprint::Footprint,
    geometry::{EARTH_RADIUS_KM, FieldLines, dot},
    maps::Maps,
    meridians::{Meridians, Sampler, mixed},
    phenomenon::MEASURED,
    sources::{Moments, Sources},
};
use crate::{
    aurora::{
        light::{LINES, PerEmitter},
        particles::AuroraSimulation,
    },
    directions::Directions,
    lanes::FourLanes,
};

/// Pixels that are worked on at once.
pub(super) const BATCH: usize = 16;
/// Pixels from one to the next at which soft light is looked up: a divisor of the distance from the first of a batch to
/// the last.
const KNOT_PIXELS: usize = 5;
/// Altitude whose distance is an aurora's depth, km.
const DEPTH_KM: f64 = 110.0;
/// Fainter than this is no aurora to a depth, kR.
const FAINTEST: f32 = 0.05;
/// Motion of the picture while the shutter is open that one instant stands for, pixels, and the most instants.
const PIXELS_PER_INSTANT: f64 = 1.0;
const MOST_INSTANTS: f64 = 16.0;
/// The same for particles, beside their own spread: what is left between two instants adds to that.
const SPREADS_PER_INSTANT: f64 = 3.0;

/// The depths at which auroras are drawn, m: behind the highest mountain, before the sky.
pub(super) const DEPTHS: DepthInterval = DepthInterval { near: 2e4, far: 1e10 };

/// A frame, ready to draw in strips.
pub(super) struct PreparedAurora<'a> {
    aurora: &'a Aurora,
    view: &'a View,
    level: Level,
    cameras: Vec<Camera>,
    field: FieldLines,
    /// Sine of the horizon's elevation.
    horizon: f32,
    /// Distance of the observer from the Earth's middle, km.
    from_middle: f32,
    /// Chart of the sharp light, and a coarser one of what is soft.
    charts: [Meridians; 2],
    /// Whether the soft light is so coarse that not every pixel needs to look it up.
    soft_is_coarse: bool,
    /// The picture of both, where the blur is one of the picture.
    blurred: Option<Blurred>,
    /// Made where they are asked for.
    maps: OnceLock<Maps<'a>>,
}

impl<'a> PreparedAurora<'a> {
    pub(super) fn new(aurora: &'a Aurora, view: &'a View, observer: &dyn Observer) -> Result<Self, Cancelled> {
        let field = aurora.field_lines(view.camera.position);
        let sources = Sources::new(&aurora.light(view), &field, &aurora.moments(view));
        check(observer)?;
        let charts = Charts { aurora, field: &field, coverage: Coverage::of_view(view, &field) };
        let pixel = charts.coverage.pixel;
        let sharp = charts.sharp(&sources);
        check(observer)?;
        let soft = charts.soft(&sources);
        let drawing = &aurora.simulation.parameters().drawing;
        let blurred = (drawing.blur == Blur::Pixels)
            .then(|| Blurred::new(view, &field, &[sharp.sampler(), soft.sampler()], &drawing.blur_radii));
        Ok(Self {
            aurora,
            view,
            level: Level::new(),
            // What is blurred in the picture is blurred at one instant.
            cameras: if blurred.is_some() { vec![view.camera] } else { cameras(view) },
            blurred,
            horizon: -math::sqrt(2.0 * field.observer_altitude_km().max(0.0) / EARTH_RADIUS_KM) as f32,
            from_middle: (EARTH_RADIUS_KM + field.observer_altitude_km()) as f32,
            field,
            soft_is_coarse: soft.chart.column_step >= 2.0 * KNOT_PIXELS as f64 * pixel,
            charts: [sharp, soft],
            maps: OnceLock::new(),
        })
    }
}

/// What the charts of a frame have in common.
pub(super) struct Charts<'a> {
    pub(super) aurora: &'a Aurora,
    pub(super) field: &'a FieldLines,
    pub(super) coverage: Coverage,
}

impl Charts<'_> {
    /// The chart of light with fine detail.
    pub(super) fn sharp(&self, sources: &Sources) -> Meridians {
        let (pixel, [spread_km, _]) = (self.coverage.pixel, sources.spread_km);
        // The angle at which the spread is seen from the nearest place where such light is.
        let row = (spread_km / 130.0).clamp(pixel, 2.0 * pixel);
        let chart = Chart::new(&self.coverage, pixel, row);
        let footprint = Footprint::new(&sources.sharp, &chart, spread_km);
        let Aurora { simulation, profiles, collisions, .. } = self.aurora;
        let Some(collisions) = collisions else { return Meridians::new(chart, self.field, profiles, &footprint) };
        let step = (simulation.time() / AuroraSimulation::STEP_S).round() as i64 as u32;
        collisions.draw(chart, self.field, &footprint, step)
    }

    /// The coarser chart of light that lingers and spreads.
    pub(super) fn soft(&self, sources: &Sources) -> Meridians {
        let (pixel, [_, spread_km]) = (self.coverage.pixel, sources.spread_km);
        let column = (spread_km / 500.0).clamp(pixel, 16.0 * pixel);
        // To the side it is as smooth as its sources, but upward it changes with the air.
        let chart = Chart::new(&self.coverage, column, (0.25 * column).max(pixel));
        let footprint = Footprint::new(&sources.soft, &chart, spread_km);
        // Always by the mean fall: in a cell that shines for a minute thousands of falls have come together.
        Meridians::new(chart, self.field, &self.aurora.profiles, &footprint)
    }
}

/// Cameras at as many instants as the picture's motion while the shutter is open needs.
fn cameras(view: &View) -> Vec<Camera> {
    let [open, close] = [view.shutter.open, view.shutter.close].map(|t| view.camera_at(t));
    let moved = |x: f64, y: f64| {
        let place = |camera: &Camera| camera.direction(DVec2::new(x * camera.size[0], y * camera.size[1]));
        let pair = place(&open).zip(place(&close));
        pair.map_or(0.0, |(a, b)| math::acos(a.normalize().dot(b.normalize()).clamp(-1.0, 1.0)) * open.focal_pixels)
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
    /// When particles are drawn: more often where they get far while the shutter is open.
    fn moments(&self, view: &View) -> Moments {
        let particles = self.simulation.particles();
        let squares: f64 = particles.velocities.iter().flatten().map(|speed| f64::from(speed * speed)).sum();
        let speed = math::sqrt(squares / particles.len().max(1) as f64);
        let spread = self.light(view).spread_km();
        let way = speed * view.shutter.duration();
        let count = (2.0 * way / (SPREADS_PER_INSTANT * spread)).ceil().clamp(1.0, MOST_INSTANTS);
        // Standard deviation of an even spread over the way of one instant, along each of the two directions.
        let smear_km = way / count * math::sqrt(1.0 / 24.0);
        let count = count as usize;
        let now = self.simulation.time();
        // A long exposure has its own afterglow: particles are never taken further than a step.
        let step = AuroraSimulation::STEP_S;
        let later = (0..count).map(|instant| (view.shutter.instant(instant, count) - now).clamp(-step, step)).collect();
        Moments { later, smear_km }
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
        let mut directions = Directions::new(camera, x, y);
        let mut batch = Self { length: directions.normalize(), seen: directions.seen, ..Self::default() };
        let [xs, ys, zs] = directions.axes;
        let [along, first, second] = field.single();
        for i in 0..BATCH {
            let direction = [xs[i], ys[i], zs[i]];
            let (x, y) = (dot(first, direction), dot(second, direction));
            batch.colatitude[i] = lanes::atan2(x.fused(x, y * y).sqrt(), dot(along, direction));
            batch.longitude[i] = lanes::atan2(y, x);
        }
        batch.sine = ys;
        batch
    }
}

/// Adds the light at a few pixels of a batch, and straight between them.
#[inline(always)]
fn add_at_knots<S: Simd>(simd: S, sampler: &Sampler, batch: &Batch, light: &mut [PerEmitter<f32>; BATCH]) {
    const KNOTS: usize = (BATCH - 1) / KNOT_PIXELS + 1;
    let (mut longitude, mut colatitude) = ([0.0; KNOTS], [0.0; KNOTS]);
    for knot in 0..KNOTS {
        longitude[knot] = batch.longitude[knot * KNOT_PIXELS];
        colatitude[knot] = batch.colatitude[knot * KNOT_PIXELS];
    }
    let mut knots = [[0.0; 4]; KNOTS];
    sampler.add(simd, &longitude, &colatitude, &mut knots);
    if knots == [[0.0; 4]; KNOTS] {
        return;
    }
    for i in 0..BATCH {
        let knot = (i / KNOT_PIXELS).min(KNOTS - 2);
        let part = (i - knot * KNOT_PIXELS) as f32 * (1.0 / KNOT_PIXELS as f32);
        let between = mixed(simd, &knots[knot], &knots[knot + 1], part);
        light[i] = (between + FourLanes::simd_from(simd, light[i])).into();
    }
}

impl PreparedAurora<'_> {
    #[inline(always)]
    fn rows<S: Simd>(&self, simd: S, slice: &DepthInterval, strip: &mut Strip) {
        let samplers = [self.charts[0].sampler(), self.charts[1].sampler()];
        let rect = strip.rect;
        // Batches lie on the picture's own grid, so that a crop changes no pixel; those of one column follow each
        // other, since they look up the same part of the chart.
        let mut x = rect.x / BATCH * BATCH;
        while x < rect.right() {
            for y in rect.y..rect.bottom() {
                self.batch(simd, &samplers, slice, strip, [x, y]);
            }
            x += BATCH;
        }
    }

    #[inline(always)]
    fn batch<S: Simd>(
        &self,
        simd: S,
        samplers: &[Sampler; 2],
        slice: &DepthInterval,
        strip: &mut Strip,
        [x, y]: [usize; 2],
    ) {
        let rect = strip.rect;
        let inside = rect.x.max(x) - x..rect.right().min(x + BATCH) - x;
        let first = (y - rect.y) * rect.width + x + inside.start - rect.x;
        let share = 1.0 / self.cameras.len() as f32;
        for camera in &self.cameras {
            let batch = Batch::new(camera, &self.field, x, y);
            let (sky, mut depths) = self.sky(&batch, share);
            if sky == [0.0; BATCH] {
                continue;
            }
            let mut light = match &self.blurred {
                Some(blurred) => blurred.batch(x, y),
                None => self.look_up(simd, samplers, &batch),
            };
            if strip.aovs.is_empty() && light == [[0.0; 4]; BATCH] {
                continue;
            }
            let mut colours = [[0.0; BATCH]; 3];
            let mut shown = [false; BATCH];
            for i in inside.clone() {
                let (index, depth) = (first + i - inside.start, depths[i]);
                shown[i] = sky[i] > 0.0 && slice.contains(f64::from(depth)) && strip.visible(index, depth);
                let sky = if shown[i] { sky[i] } else { 0.0 };
                let light = &mut light[i];
                for emitter in 0..4 {
                    light[emitter] *= sky;
                }
                let brightness = light[0] + light[1] + light[2];
                depths[i] = if brightness > FAINTEST * share { depth } else { f32::INFINITY };
                let colour = self.aurora.shading.colour(simd, light, batch.sine[i]);
                for c in 0..3 {
                    colours[c][i] = colour[c];
                }
            }
            let [red, green, blue] = &colours;
            let radiance = [&red[inside.clone()], &green[inside.clone()], &blue[inside.clone()]];
            strip.add_row_behind(first, radiance, None, &depths[inside.clone()]);
            if !strip.aovs.is_empty() {
                for i in inside.clone().filter(|i| shown[*i]) {
                    let direction = camera.direction(DVec2::new((x + i) as f64 + 0.5, y as f64 + 0.5));
                    self.measure(strip, first + i - inside.start, &light[i], direction, share);
                }
            }
        }
    }

    /// The light that the charts have for a batch.
    #[inline(always)]
    fn look_up<S: Simd>(&self, simd: S, samplers: &[Sampler; 2], batch: &Batch) -> [PerEmitter<f32>; BATCH] {
        let mut light = [[0.0; 4]; BATCH];
        samplers[0].add(simd, &batch.longitude, &batch.colatitude, &mut light);
        if self.soft_is_coarse && batch.seen == [true; BATCH] {
            add_at_knots(simd, &samplers[1], batch, &mut light);
        } else {
            samplers[1].add(simd, &batch.longitude, &batch.colatitude, &mut light);
        }
        light
    }

    /// How much of each pixel is sky, times `share`, and the depth of an aurora there, m.
    #[inline(always)]
    fn sky(&self, batch: &Batch, share: f32) -> ([f32; BATCH], [f32; BATCH]) {
        let (mut sky, mut depths) = ([0.0; BATCH], [0.0; BATCH]);
        for i in 0..BATCH {
            let pixels = (batch.sine[i] - self.horizon) * self.view.camera.focal_pixels as f32;
            let above = (pixels + 0.5).clamp(0.0, 1.0) * share;
            sky[i] = if batch.seen[i] { above } else { 0.0 };
            depths[i] = self.depth(batch.sine[i]) / batch.length[i];
        }
        (sky, depths)
    }

    /// Adds what the AOVs tell of a pixel.
    #[inline(never)]
    fn measure(&self, strip: &mut Strip, index: usize, light: &PerEmitter<f32>, direction: Option<DVec3>, share: f32) {
        for (plane, line) in strip.aovs.iter_mut().zip(MEASURED) {
            let line = &LINES[line];
            plane.add(index, light[line.emitter.index()] * line.photons as f32, 1.0);
        }
        let maps = self.maps.get_or_init(|| Maps::new(&self.aurora.simulation));
        let Some(place) = direction.and_then(|direction| self.field.drawn(direction)) else { return };
        for (plane, value) in strip.aovs.iter_mut().skip(MEASURED.len()).zip(maps.at(place)) {
            plane.add(index, value, share);
        }
    }

    /// Distance of the aurora in a direction of that elevation, m.
    #[inline(always)]
    fn depth(&self, sine: f32) -> f32 {
        const SHELL: f32 = (EARTH_RADIUS_KM + DEPTH_KM) as f32;
        let along = self.from_middle * sine;
        let squared = along.fused(along, (SHELL - self.from_middle) * (SHELL + self.from_middle));
        1e3 * (squared.max(0.0).sqrt() - along).abs()
    }
}

impl Prepared for PreparedAurora<'_> {
    fn bounds(&self, slice: &DepthInterval) -> Rect {
        if slice.overlaps(&DEPTHS) { Rect::of_size(self.view.size[0], self.view.size[1]) } else { Rect::default() }
    }

    fn draw(&self, slice: &DepthInterval, strip: &mut Strip) {
        if slice.overlaps(&DEPTHS) {
            dispatch!(self.level, simd => self.rows(simd, slice, strip));
        }
    }
}
