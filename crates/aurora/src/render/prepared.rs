//! One frame of an aurora: from its chart to pixels.

use std::{ops::Range, sync::OnceLock};

use bansho_base::{
    camera::{Camera, directions::Directions},
    host::observer::{Cancelled, Observer, check},
    image::Rect,
    math::{self, DVec2, DVec3, MulAdd, approximations},
    phenomenon::{
        Prepared,
        strip::{DepthInterval, Strip, View},
    },
};

use super::{Aurora, Blur, maps::Maps};
use crate::{
    phenomenon::{BRIGHTNESSES, brightnesses},
    physics::emission::{Emitter, PerEmitter},
    render::{
        bin::{source_bins::Footprint, sources::Sources},
        integrate::{column_block::GROUP, columns::Meridians},
        project::{
            chart::{Chart, Coverage, STRIP},
            field_lines::{EARTH_RADIUS_KM, FieldLines, dot},
        },
        shade::{attenuation::Shading, chart_sampler::Sampler},
    },
    simulate::AuroraSimulation,
    single_collisions::blur::Blurred,
};
use fearless_simd::{Level, Simd, dispatch};

/// Pixels that are worked on at once.
pub(crate) const BATCH: usize = 16;
/// Altitude whose distance is an aurora's depth, km.
const DEPTH_KM: f64 = 110.0;
/// Fainter than this is no aurora to a depth, kR.
const FAINTEST: f32 = 0.05;

const TAU: f32 = std::f32::consts::TAU;

/// The depths at which auroras are drawn, m: behind the highest mountain, before the sky.
pub(crate) const DEPTHS: DepthInterval = DepthInterval { near: 2e4, far: 1e10 };

/// A frame, ready to draw in strips.
pub(crate) struct PreparedAurora<'a> {
    aurora: &'a Aurora,
    view: &'a View,
    level: Level,
    cameras: Vec<Camera>,
    field: FieldLines,
    /// Sine of the horizon's elevation.
    horizon: f32,
    /// Distance of the observer from the Earth's middle, km.
    from_middle: f32,
    /// What pixels look up.
    shown: Shown,
    /// Light by emitter on a sharp and a coarser chart, where it is measured.
    measured: Option<[Meridians; 2]>,
    /// What radiates each brightness that is measured, and its photons for each counted one.
    brightnesses: Vec<(Emitter, f64)>,
    /// Made where they are asked for.
    maps: OnceLock<Maps<'a>>,
}

/// An aurora's light as pixels look it up.
enum Shown {
    /// A chart of colours.
    Seen(Meridians),
    /// Light by emitter, where the blur is one of the picture.
    Blurred(Blurred),
}

impl<'a> PreparedAurora<'a> {
    pub(crate) fn new(aurora: &'a Aurora, view: &'a View, observer: &dyn Observer) -> Result<Self, Cancelled> {
        let field = aurora.field_lines(view.camera.position);
        let sources = aurora.sources(view, &field);
        check(observer)?;
        let charts = Charts { aurora, field: &field, coverage: Coverage::of_view(view, &field) };
        let (sharp, soft) = rayon::join(|| charts.sharp(&sources), || charts.soft(&sources));
        check(observer)?;
        let drawing = &aurora.simulation().parameters().drawing;
        let measured = view.measured.then(|| [sharp.clone(), soft.clone()]);
        let shown = if drawing.blur == Blur::Pixels {
            let samplers = [sharp.sampler(), soft.sampler()];
            Shown::Blurred(Blurred::new(view, &field, &samplers, &drawing.blur_radii))
        } else {
            Shown::Seen(sharp.seen(&soft, &field, aurora.shading()))
        };
        // What is blurred in the picture is blurred at one instant.
        let cameras = if matches!(shown, Shown::Blurred(_)) { vec![view.camera] } else { view.cameras() };
        Ok(Self {
            aurora,
            view,
            level: Level::new(),
            cameras,
            horizon: -math::sqrt(2.0 * field.observer_altitude_km().max(0.0) / EARTH_RADIUS_KM) as f32,
            from_middle: (EARTH_RADIUS_KM + field.observer_altitude_km()) as f32,
            field,
            shown,
            measured,
            brightnesses: brightnesses().collect(),
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
        let sorted = |strip| Footprint::new(&sources.sharp, (&chart, strip), self.field, spread_km);
        let Some(collisions) = self.aurora.collisions() else {
            let footprint = sorted(STRIP);
            return Meridians::new(chart, self.field, self.aurora.profiles(), &footprint);
        };
        let footprint = sorted(GROUP);
        let step = (self.aurora.simulation().time() / AuroraSimulation::STEP_S).round() as i64 as u32;
        collisions.draw(chart, self.field, &footprint, step)
    }

    /// The coarser chart of light that lingers and spreads.
    pub(super) fn soft(&self, sources: &Sources) -> Meridians {
        let (pixel, [_, spread_km]) = (self.coverage.pixel, sources.spread_km);
        let column = (spread_km / 500.0).clamp(pixel, 16.0 * pixel);
        // To the side it is as smooth as its sources, but upward it changes with the air.
        let chart = Chart::new(&self.coverage, column, (0.25 * column).max(pixel));
        let footprint = Footprint::new(&sources.soft, (&chart, STRIP), self.field, spread_km);
        // Always by the mean fall: in a cell that shines for a minute thousands of falls have come together.
        let mut picture = Meridians::new(chart, self.field, self.aurora.red_profiles(), &footprint);
        picture.add_up_heights();
        picture
    }
}

/// Directions of a batch of pixels in the field's frame, and what is needed of them.
#[derive(Default)]
pub(crate) struct Batch {
    /// Colatitude and longitude about the magnetic zenith.
    pub(crate) colatitude: [f32; BATCH],
    pub(crate) longitude: [f32; BATCH],
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
    pub(crate) fn new(camera: &Camera, field: &FieldLines, x: usize, y: usize) -> Self {
        let mut directions = Directions::new(camera, x, y);
        let mut batch = Self { length: directions.normalize(), seen: directions.seen, ..Self::default() };
        let [xs, ys, zs] = directions.axes;
        let [along, first, second] = field.single();
        for i in 0..BATCH {
            let direction = [xs[i], ys[i], zs[i]];
            let (x, y) = (dot(first, direction), dot(second, direction));
            batch.colatitude[i] = approximations::atan2(x.fma(x, y * y).sqrt(), dot(along, direction));
            batch.longitude[i] = approximations::atan2(y, x);
        }
        batch.sine = ys;
        batch
    }
}

impl PreparedAurora<'_> {
    #[inline(always)]
    fn rows<S: Simd>(&self, simd: S, slice: &DepthInterval, strip: &mut Strip) {
        let sampler = match &self.shown {
            Shown::Seen(chart) => Some(chart.sampler()),
            Shown::Blurred(_) => None,
        };
        let rect = strip.rect;
        // Batches lie on the picture's own grid, so that a crop changes no pixel; those of one column follow each
        // other, since they look up the same part of the chart.
        let mut x = rect.x / BATCH * BATCH;
        while x < rect.right() {
            let measured = !strip.aovs.is_empty();
            if measured || !sampler.as_ref().is_some_and(|sampler| self.is_dark(sampler, x, [rect.y, rect.bottom()])) {
                for y in rect.y..rect.bottom() {
                    self.batch(simd, sampler.as_ref(), slice, strip, [x, y]);
                }
            }
            x += BATCH;
        }
    }

    /// Whether there is surely no light in the batches from `x` on between two rows, by the sky between their corners and as far again as that
    /// may bend.
    fn is_dark(&self, sampler: &Sampler, x: usize, rows: [usize; 2]) -> bool {
        if self.cameras.len() > 1 {
            return false;
        }
        let (mut longitudes, mut colatitudes) = ([f32::INFINITY, -f32::INFINITY], [f32::INFINITY, -f32::INFINITY]);
        let mut middle = None;
        for y in rows {
            for x in [x, x + BATCH] {
                let Some(direction) = self.view.camera.direction(DVec2::new(x as f64, y as f64)) else { return false };
                let direction = direction.normalize();
                let [along, first, second] = self.field.turned(direction);
                let colatitude = math::atan2(math::hypot(first, second), along) as f32;
                let longitude = math::atan2(second, first) as f32;
                // About the first one's, so that no part is torn where longitudes begin anew.
                let about = *middle.get_or_insert(longitude);
                let turned = longitude - about;
                let longitude = longitude - (turned * (1.0 / TAU)).round() * TAU;
                longitudes = [longitudes[0].min(longitude), longitudes[1].max(longitude)];
                colatitudes = [colatitudes[0].min(colatitude), colatitudes[1].max(colatitude)];
            }
        }
        let size = ((longitudes[1] - longitudes[0]) * math::sin(f64::from(colatitudes[1])) as f32)
            .max(colatitudes[1] - colatitudes[0]);
        // Near the magnetic zenith corners say little.
        if colatitudes[0] < 4.0 * size || longitudes[1] - longitudes[0] > 0.5 {
            return false;
        }
        let bend = 0.5 * size * size / colatitudes[0];
        sampler.is_dark(
            [longitudes[0] - bend / colatitudes[0], longitudes[1] + bend / colatitudes[0]],
            [colatitudes[0] - bend, colatitudes[1] + bend],
        )
    }

    #[inline(always)]
    fn batch<S: Simd>(
        &self,
        simd: S,
        sampler: Option<&Sampler>,
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
            let (mut sky, mut depths) = self.sky(&batch, share);
            if sky == [0.0; BATCH] {
                continue;
            }
            let colours = self.look_up(simd, sampler, &batch, [x, y]);
            if strip.aovs.is_empty() && colours == [[0.0; 4]; BATCH] {
                continue;
            }
            hide(&mut sky, &depths, slice, strip, (first, inside.clone()));
            let mut planes = [[0.0; BATCH]; 3];
            for i in 0..BATCH {
                let [red, green, blue, brightness] = colours[i];
                (planes[0][i], planes[1][i], planes[2][i]) = (sky[i] * red, sky[i] * green, sky[i] * blue);
                depths[i] = if sky[i] * brightness > FAINTEST * share { depths[i] } else { f32::INFINITY };
            }
            let [red, green, blue] = &planes;
            let radiance = [&red[inside.clone()], &green[inside.clone()], &blue[inside.clone()]];
            strip.add_row_behind(first, radiance, None, &depths[inside.clone()]);
            if !strip.aovs.is_empty() {
                self.measure(simd, camera, &batch, (strip, first), ([x, y], &inside), (&sky, share));
            }
        }
    }

    /// Colours and brightness of a batch.
    #[inline(always)]
    fn look_up<S: Simd>(
        &self,
        simd: S,
        sampler: Option<&Sampler>,
        batch: &Batch,
        [x, y]: [usize; 2],
    ) -> [[f32; 4]; BATCH] {
        let mut colours = [[0.0; 4]; BATCH];
        match (&self.shown, sampler) {
            (Shown::Blurred(blurred), _) => {
                let light = blurred.batch(x, y);
                for i in 0..BATCH {
                    let place = Shading::place(batch.sine[i]);
                    colours[i] = self.aurora.shading().arriving(simd, &light[i], place).into();
                }
            }
            (Shown::Seen(_), Some(sampler)) => {
                sampler.add(simd, &batch.longitude, &batch.colatitude, &mut colours);
            }
            (Shown::Seen(_), None) => {}
        }
        colours
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

    /// Adds what the AOVs tell of a batch, of which the pixels `inside` stand in the strip from number `first` on.
    #[inline(always)]
    fn measure<S: Simd>(
        &self,
        simd: S,
        camera: &Camera,
        batch: &Batch,
        (strip, first): (&mut Strip, usize),
        ([x, y], inside): ([usize; 2], &Range<usize>),
        (sky, share): (&[f32; BATCH], f32),
    ) {
        let mut light = [[0.0; 4]; BATCH];
        match &self.shown {
            Shown::Blurred(blurred) => light = blurred.batch(x, y),
            Shown::Seen(_) => {
                for chart in self.measured.iter().flatten() {
                    chart.sampler().add(simd, &batch.longitude, &batch.colatitude, &mut light);
                }
            }
        }
        for i in inside.clone().filter(|i| sky[*i] > 0.0) {
            let direction = camera.direction(DVec2::new((x + i) as f64 + 0.5, y as f64 + 0.5));
            let seen = light[i].map(|value| sky[i] * value);
            self.measure_pixel(strip, first + i - inside.start, &seen, direction, share);
        }
    }

    /// Adds what the AOVs tell of a pixel.
    #[inline(never)]
    fn measure_pixel(
        &self,
        strip: &mut Strip,
        index: usize,
        light: &PerEmitter<f32>,
        direction: Option<DVec3>,
        share: f32,
    ) {
        for (plane, (emitter, photons)) in strip.aovs.iter_mut().zip(&self.brightnesses) {
            plane.add(index, light[emitter.index()] * *photons as f32, 1.0);
        }
        let maps = self.maps.get_or_init(|| Maps::new(self.aurora.simulation()));
        let Some(place) = direction.and_then(|direction| self.field.drawn(direction)) else { return };
        for (plane, value) in strip.aovs.iter_mut().skip(BRIGHTNESSES).zip(maps.at(place)) {
            plane.add(index, value, share);
        }
    }

    /// Distance of the aurora in a direction of that elevation, m.
    #[inline(always)]
    fn depth(&self, sine: f32) -> f32 {
        const SHELL: f32 = (EARTH_RADIUS_KM + DEPTH_KM) as f32;
        let along = self.from_middle * sine;
        let squared = along.fma(along, (SHELL - self.from_middle) * (SHELL + self.from_middle));
        1e3 * (squared.max(0.0).sqrt() - along).abs()
    }
}

/// Leaves no sky where an aurora at those depths lies outside the slice or behind the plate; pixels `inside` stand in the strip from number
/// `first` on.
#[inline(always)]
fn hide(
    sky: &mut [f32; BATCH],
    depths: &[f32; BATCH],
    slice: &DepthInterval,
    strip: &Strip,
    (first, inside): (usize, Range<usize>),
) {
    for i in 0..BATCH {
        let depth = f64::from(depths[i]);
        sky[i] = if depth >= slice.near && depth < slice.far { sky[i] } else { 0.0 };
    }
    if strip.has_plate() {
        for i in inside.clone() {
            sky[i] = if strip.visible(first + i - inside.start, depths[i]) { sky[i] } else { 0.0 };
        }
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
