//! A prepared frame: builds the charts and samples them for pixels.

use std::{
    ops::Range,
    sync::{Arc, OnceLock},
};

use bansho_base::{
    camera::Camera,
    host::{
        observer::{Cancelled, Observer, check},
        parallel,
    },
    image::Rect,
    math::{self, DVec2, DVec3, MulAdd},
    phenomenon::{
        Prepared,
        strip::{DepthInterval, Strip, View},
    },
};
use fearless_simd::{Level, Simd, dispatch};

use super::{Blur, inputs::RenderInputs, shutter};
use crate::{
    physics::emission::{PerEmitter, SpectralEmitter},
    render::{
        aovs::{BRIGHTNESSES, CellMaps, brightnesses},
        bin::{Sources, source_bins::SortedSources},
        integrate::column_buffer::ColumnBuffer,
        project::{
            chart::{BLOCK_COLUMNS, Chart, Coverage, PIXEL_BATCH, PixelBatch},
            field_lines::{EARTH_RADIUS_KM, FieldLines},
        },
        shade::{ChartSampler, EmitterColors},
        single_collisions::{blur::BlurredImage, collision_block::COLLISION_BLOCK_COLUMNS},
    },
    simulate::AuroraSimulation,
};

/// Altitude that defines the aurora's depth, km.
const DEPTH_KM: f64 = 110.0;
/// Minimum brightness for a depth value, kR.
const MIN_BRIGHTNESS_KR: f32 = 0.05;

const TAU: f32 = std::f32::consts::TAU;

/// Depth range of auroras, m: behind terrain, in front of the sky.
pub(crate) const DEPTHS: DepthInterval = DepthInterval { near: 2e4, far: 1e10 };

/// A frame that is ready to be drawn in strips.
pub(crate) struct PreparedAurora<'a> {
    inputs: RenderInputs<'a>,
    view: &'a View,
    level: Level,
    cameras: Vec<Camera>,
    field: FieldLines,
    /// Sine of the horizon's elevation.
    horizon: f32,
    /// Distance of the observer from the Earth's center, km.
    observer_radius: f32,
    /// Colors of the emitters for this observer.
    emitter_colors: Arc<EmitterColors>,
    /// Image that pixels sample.
    displayed: DisplayedLight,
    /// Brightness by emitter on the sharp and the soft chart, kept if AOVs are requested.
    measured: Option<[ColumnBuffer; 2]>,
    /// Emitter of each brightness AOV, and its photons per counted photon.
    brightnesses: Vec<(SpectralEmitter, f64)>,
    /// Created on first use.
    maps: OnceLock<CellMaps<'a>>,
}

/// Light in the form that pixels sample.
enum DisplayedLight {
    /// A chart of colors.
    Chart(ColumnBuffer),
    /// Brightness by emitter, blurred in the picture.
    BlurredImage(BlurredImage),
}

impl<'a> PreparedAurora<'a> {
    pub(crate) fn new(inputs: RenderInputs<'a>, view: &'a View, observer: &dyn Observer) -> Result<Self, Cancelled> {
        let field = inputs.field_lines(view.camera.position);
        let sources = shutter::sources(inputs, view, &field);
        check(observer)?;
        let charts = ChartBuilder { inputs, field: &field, coverage: Coverage::of_view(view, &field) };
        let (sharp, soft) = parallel::join(|| charts.sharp(&sources), || charts.soft(&sources));
        check(observer)?;
        let rendering = &inputs.simulation.parameters().rendering;
        let measured = view.aovs_requested.then(|| [sharp.clone(), soft.clone()]);
        let emitter_colors = inputs.emitter_colors_above(field.observer_altitude_km());
        let displayed = if rendering.blur_space == Blur::Screen {
            let samplers = [sharp.sampler(), soft.sampler()];
            DisplayedLight::BlurredImage(BlurredImage::new(view, &field, &samplers, &rendering.blur_radii))
        } else {
            DisplayedLight::Chart(sharp.composite(&soft, &field, &emitter_colors))
        };
        // A blur in the picture is computed at one instant.
        let cameras =
            if matches!(displayed, DisplayedLight::BlurredImage(_)) { vec![view.camera] } else { view.cameras() };
        Ok(Self {
            inputs,
            view,
            level: bansho_base::math::simd::level(),
            cameras,
            // From above, what the Earth hides is left out of the charts instead.
            horizon: if field.is_above_light() { -2.0 } else { field.horizon_sine() as f32 },
            observer_radius: (EARTH_RADIUS_KM + field.observer_altitude_km()) as f32,
            field,
            emitter_colors,
            displayed,
            measured,
            brightnesses: brightnesses(inputs.simulation.emission().lines()).collect(),
            maps: OnceLock::new(),
        })
    }
}

impl Drop for PreparedAurora<'_> {
    fn drop(&mut self) {
        if let DisplayedLight::Chart(chart) = &mut self.displayed {
            self.inputs.chart_memory.recycle(chart);
        }
    }
}

/// Shared inputs of the charts of a frame.
pub(super) struct ChartBuilder<'a> {
    pub(super) inputs: RenderInputs<'a>,
    pub(super) field: &'a FieldLines,
    pub(super) coverage: Coverage,
}

impl ChartBuilder<'_> {
    /// The chart of light with fine detail.
    pub(super) fn sharp(&self, sources: &Sources) -> ColumnBuffer {
        let (pixel, [spread_km, _]) = (self.coverage.pixel, sources.spread_km);
        // The angle of the spread at the minimum distance of such light.
        let row = (spread_km / 130.0).clamp(pixel, 2.0 * pixel);
        let chart = Chart::new(&self.coverage, pixel, row);
        let buffer = self.inputs.chart_memory.zeros(chart);
        let collisions = &self.inputs.tables.collisions;
        let columns = if collisions.is_some() { COLLISION_BLOCK_COLUMNS } else { BLOCK_COLUMNS };
        let sorted_sources = SortedSources::new(&sources.sharp, &buffer.chart, columns, self.field, spread_km);
        let Some(collisions) = collisions else {
            return buffer.integrate(self.field, &self.inputs.tables.profiles, &sorted_sources);
        };
        let step = (self.inputs.simulation.time() / AuroraSimulation::STEP_S).round() as i64 as u32;
        collisions.draw(buffer, self.field, &sorted_sources, step)
    }

    /// The coarser chart of the red afterglow and of the diffuse aurora.
    pub(super) fn soft(&self, sources: &Sources) -> ColumnBuffer {
        let (pixel, [_, spread_km]) = (self.coverage.pixel, sources.spread_km);
        let column = (spread_km / 500.0).clamp(pixel, 16.0 * pixel);
        // Laterally it is as smooth as its sources, vertically it follows the atmosphere.
        let chart = Chart::new(&self.coverage, column, (0.25 * column).max(pixel));
        let sorted_sources = SortedSources::new(&sources.soft, &chart, BLOCK_COLUMNS, self.field, spread_km);
        // Always from the mean profile: a cell that shines for a minute averages thousands of tracks.
        let mut buffer =
            ColumnBuffer::zeros(chart.clone()).integrate(self.field, &self.inputs.tables.red_profiles, &sorted_sources);
        buffer.sum_red_altitudes();
        if !sources.diffuse.is_empty() {
            let sorted_sources =
                SortedSources::new(&sources.diffuse, &chart, BLOCK_COLUMNS, self.field, sources.diffuse_spread_km);
            let diffuse =
                ColumnBuffer::zeros(chart).integrate(self.field, &self.inputs.tables.profiles, &sorted_sources);
            buffer.add(&diffuse);
        }
        buffer
    }
}

impl PreparedAurora<'_> {
    #[inline(always)]
    fn draw_rows<S: Simd>(&self, simd: S, slice: &DepthInterval, strip: &mut Strip) {
        let sampler = match &self.displayed {
            DisplayedLight::Chart(chart) => Some(chart.sampler()),
            DisplayedLight::BlurredImage(_) => None,
        };
        let rect = strip.rect;
        // Batches are aligned to the picture's grid, so that crops are identical; batches of a column are consecutive
        // because they sample nearby parts of the chart.
        let mut x = rect.x / PIXEL_BATCH * PIXEL_BATCH;
        while x < rect.right() {
            let measured = !strip.aovs.is_empty();
            if measured || !sampler.as_ref().is_some_and(|sampler| self.is_dark(sampler, x, [rect.y, rect.bottom()])) {
                for y in rect.y..rect.bottom() {
                    self.draw_batch(simd, sampler.as_ref(), slice, strip, [x, y]);
                }
            }
            x += PIXEL_BATCH;
        }
    }

    /// Conservative test whether the batches at `x` between two rows are dark, from the chart bounds of their corners
    /// plus the maximum curvature.
    fn is_dark(&self, sampler: &ChartSampler, x: usize, rows: [usize; 2]) -> bool {
        if self.cameras.len() > 1 {
            return false;
        }
        let (mut longitudes, mut colatitudes) = ([f32::INFINITY, -f32::INFINITY], [f32::INFINITY, -f32::INFINITY]);
        let mut reference = None;
        for y in rows {
            for x in [x, x + PIXEL_BATCH] {
                let Some(direction) = self.view.camera.direction(DVec2::new(x as f64, y as f64)) else { return false };
                let direction = direction.normalize();
                let [along, first, second] = self.field.field_frame_components(direction);
                let colatitude = math::atan2(math::hypot(first, second), along) as f32;
                let longitude = math::atan2(second, first) as f32;
                // Relative to the first corner, so that the region is not split at the seam of longitude.
                let difference = longitude - *reference.get_or_insert(longitude);
                let longitude = longitude - (difference * (1.0 / TAU)).round() * TAU;
                longitudes = [longitudes[0].min(longitude), longitudes[1].max(longitude)];
                colatitudes = [colatitudes[0].min(colatitude), colatitudes[1].max(colatitude)];
            }
        }
        let sine = colatitudes.map(|colatitude| math::sin(f64::from(colatitude)) as f32);
        let size = ((longitudes[1] - longitudes[0]) * sine[0].max(sine[1])).max(colatitudes[1] - colatitudes[0]);
        // Near the magnetic zenith and opposite to it the corners are not a bound.
        let from_poles = colatitudes[0].min(std::f32::consts::PI - colatitudes[1]);
        if from_poles < 4.0 * size || longitudes[1] - longitudes[0] > 0.5 {
            return false;
        }
        let bend = 0.5 * size * size / colatitudes[0];
        sampler.is_dark(
            [longitudes[0] - bend / colatitudes[0], longitudes[1] + bend / colatitudes[0]],
            [colatitudes[0] - bend, colatitudes[1] + bend],
        )
    }

    #[inline(always)]
    fn draw_batch<S: Simd>(
        &self,
        simd: S,
        sampler: Option<&ChartSampler>,
        slice: &DepthInterval,
        strip: &mut Strip,
        [x, y]: [usize; 2],
    ) {
        let rect = strip.rect;
        let inside = rect.x.max(x) - x..rect.right().min(x + PIXEL_BATCH) - x;
        let first = (y - rect.y) * rect.width + x + inside.start - rect.x;
        let camera_weight = 1.0 / self.cameras.len() as f32;
        for camera in &self.cameras {
            let batch = PixelBatch::new(camera, &self.field, x, y);
            let (mut sky, mut depths) = self.sky_coverage(&batch, camera_weight);
            if sky == [0.0; PIXEL_BATCH] {
                continue;
            }
            let colors = self.sample_colors(simd, sampler, &batch, [x, y]);
            if strip.aovs.is_empty() && colors == [[0.0; 4]; PIXEL_BATCH] {
                continue;
            }
            mask_occluded(&mut sky, &depths, slice, strip, first, inside.clone());
            let mut planes = [[0.0; PIXEL_BATCH]; 3];
            for i in 0..PIXEL_BATCH {
                let [red, green, blue, brightness] = colors[i];
                (planes[0][i], planes[1][i], planes[2][i]) = (sky[i] * red, sky[i] * green, sky[i] * blue);
                depths[i] =
                    if sky[i] * brightness > MIN_BRIGHTNESS_KR * camera_weight { depths[i] } else { f32::INFINITY };
            }
            let [red, green, blue] = &planes;
            let radiance = [&red[inside.clone()], &green[inside.clone()], &blue[inside.clone()]];
            strip.add_row_behind(first, radiance, None, &depths[inside.clone()]);
            if !strip.aovs.is_empty() {
                self.measure(simd, camera, &batch, strip, first, [x, y], &inside, &sky, camera_weight);
            }
        }
    }

    /// Colors and brightness of a batch.
    #[inline(always)]
    fn sample_colors<S: Simd>(
        &self,
        simd: S,
        sampler: Option<&ChartSampler>,
        batch: &PixelBatch,
        [x, y]: [usize; 2],
    ) -> [[f32; 4]; PIXEL_BATCH] {
        let mut colors = [[0.0; 4]; PIXEL_BATCH];
        match (&self.displayed, sampler) {
            (DisplayedLight::BlurredImage(blurred), _) => {
                let light = blurred.batch(x, y);
                for i in 0..PIXEL_BATCH {
                    let position = EmitterColors::table_coordinate(batch.sine[i]);
                    colors[i] = self.emitter_colors.attenuated(simd, &light[i], position).into();
                }
            }
            (DisplayedLight::Chart(_), Some(sampler)) => {
                sampler.add(simd, &batch.longitude, &batch.colatitude, &mut colors);
            }
            (DisplayedLight::Chart(_), None) => {}
        }
        colors
    }

    /// Sky coverage of each pixel times `camera_weight`, and the depth of an aurora there, m.
    #[inline(always)]
    fn sky_coverage(&self, batch: &PixelBatch, camera_weight: f32) -> ([f32; PIXEL_BATCH], [f32; PIXEL_BATCH]) {
        let (mut sky, mut depths) = ([0.0; PIXEL_BATCH], [0.0; PIXEL_BATCH]);
        for i in 0..PIXEL_BATCH {
            let pixels = (batch.sine[i] - self.horizon) * self.view.camera.focal_pixels as f32;
            let above = (pixels + 0.5).clamp(0.0, 1.0) * camera_weight;
            sky[i] = if batch.in_view[i] { above } else { 0.0 };
            // Light about the observer is given the depth at which auroras begin.
            depths[i] = (self.depth(batch.sine[i]) / batch.length[i]).max(DEPTHS.near as f32);
        }
        (sky, depths)
    }

    /// Accumulates the AOVs of a batch whose first pixel is `[x, y]`. Its pixels `inside` start at index `first` of the strip.
    #[inline(always)]
    fn measure<S: Simd>(
        &self,
        simd: S,
        camera: &Camera,
        batch: &PixelBatch,
        strip: &mut Strip,
        first: usize,
        [x, y]: [usize; 2],
        inside: &Range<usize>,
        sky: &[f32; PIXEL_BATCH],
        camera_weight: f32,
    ) {
        let mut light = [[0.0; 4]; PIXEL_BATCH];
        match &self.displayed {
            DisplayedLight::BlurredImage(blurred) => light = blurred.batch(x, y),
            DisplayedLight::Chart(_) => {
                for chart in self.measured.iter().flatten() {
                    chart.sampler().add(simd, &batch.longitude, &batch.colatitude, &mut light);
                }
            }
        }
        for i in inside.clone().filter(|i| sky[*i] > 0.0) {
            let direction = camera.direction(DVec2::new((x + i) as f64 + 0.5, y as f64 + 0.5));
            let radiance = light[i].map(|value| sky[i] * value);
            self.measure_pixel(strip, first + i - inside.start, &radiance, direction, camera_weight);
        }
    }

    /// Accumulates the AOVs of a pixel.
    #[inline(never)]
    fn measure_pixel(
        &self,
        strip: &mut Strip,
        index: usize,
        light: &PerEmitter<f32>,
        direction: Option<DVec3>,
        camera_weight: f32,
    ) {
        for (plane, (emitter, photons)) in strip.aovs.iter_mut().zip(&self.brightnesses) {
            plane.add(index, light[emitter.index()] * *photons as f32, 1.0);
        }
        let maps = self.maps.get_or_init(|| CellMaps::new(self.inputs.simulation));
        let Some(position) = direction.and_then(|direction| self.field.foot_position(direction)) else { return };
        for (plane, value) in strip.aovs.iter_mut().skip(BRIGHTNESSES).zip(maps.at(position)) {
            plane.add(index, value, camera_weight);
        }
    }

    /// Distance of the aurora in a direction with this sine of elevation, m.
    #[inline(always)]
    fn depth(&self, sine: f32) -> f32 {
        const SHELL: f32 = (EARTH_RADIUS_KM + DEPTH_KM) as f32;
        let along = self.observer_radius * sine;
        let squared = along.fma(along, (SHELL - self.observer_radius) * (SHELL + self.observer_radius));
        let half_chord = squared.max(0.0).sqrt();
        if self.observer_radius < SHELL {
            return 1e3 * (half_chord - along).abs();
        }
        // From above: where the line of sight enters the shell, or is nearest to it.
        1e3 * (-half_chord - along).max(0.0)
    }
}

/// Clears the sky coverage where the aurora's depth is outside the slice or behind the plate; pixels `inside` start at
/// index `first` of the strip.
#[inline(always)]
fn mask_occluded(
    sky: &mut [f32; PIXEL_BATCH],
    depths: &[f32; PIXEL_BATCH],
    slice: &DepthInterval,
    strip: &Strip,
    first: usize,
    inside: Range<usize>,
) {
    for i in 0..PIXEL_BATCH {
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
        if slice.overlaps(&DEPTHS) { Rect::from_size(self.view.size[0], self.view.size[1]) } else { Rect::default() }
    }

    fn draw(&self, slice: &DepthInterval, strip: &mut Strip) {
        if slice.overlaps(&DEPTHS) {
            dispatch!(self.level, simd => self.draw_rows(simd, slice, strip));
        }
    }
}
