//! Time samples of a flame over the exposure, as a view sees them, and the parts into which its motion divides the exposure.

use bansho_base::{
    camera::{Camera, upright_quad::UprightQuad},
    image::Rect,
    math::DVec3,
    parameters::Auto,
    phenomenon::strip::{PathCameras, Shutter, View, parts_of_motion},
    world::wind::Wind,
};

use super::{
    cells::{ProjectedCells, SheetCells},
    projection::{PixelToSheet, bounds},
    shade::{SheetContent, SheetState, TimeSample},
};
use crate::sheet::{
    animate::warp::{WarpState, WindLean},
    model::{FlameInstance, FlameSheet},
    parameters::SheetStage,
    texture::FilteredTexture,
};

/// Motion of the gas between time samples, pixels, and the maximum number of time samples.
const PIXELS_PER_SAMPLE: f64 = 10.0;
const MAX_SAMPLES: f64 = 8.0;
/// Largest motion of the gas that the time samples resolve, pixels.
const MAX_SCROLL: f64 = PIXELS_PER_SAMPLE * MAX_SAMPLES;

/// Motion between the parts of an exposure, pixels; and where the motion is long.
const PIXELS_PER_PART: f64 = 0.5;
const PIXELS_PER_PART_IF_LONG: f64 = 1.0;
/// Most parts of an exposure, unless the motion is long.
const MAX_PARTS: usize = 32;
/// Exposure time up to which a flame keeps its form but for the rise of its gas, s; and length of the parts of longer exposures.
const KEEPS_FORM_S: f64 = 1.0 / 24.0;
const LONG_PART_S: f64 = 1.0 / 60.0;

impl FlameSheet {
    /// A flame at `t` with its sheet facing along `right x up`: its quad, which leans with the wind, and its warp.
    pub(crate) fn evaluate_at(
        &self,
        flame: &FlameInstance,
        right: DVec3,
        wind: &Wind,
        t: f64,
    ) -> (UprightQuad, WarpState) {
        let (base, size) = (self.base(flame, t), self.sheet_size(flame));
        let middle = base + DVec3::Y * (0.5 * size.y);
        let lean = WindLean::new(wind, middle, t, right, self.rise_speed(flame, t), self.parameters.wind_response);
        let quad = UprightQuad::new(base, right, size, lean.toward);
        let time = self.flame_time(flame, t);
        let warp = WarpState::new(&self.parameters, self.shape(), &flame.waves, &self.clock, time, lean);
        (quad, warp.with_height(self.height_fraction(t)))
    }

    /// Number of time samples of the exposure; by default the gas moves by 8 pixels between them.
    pub(crate) fn time_samples(&self, flame: &FlameInstance, shutter: Shutter, pixels_per_meter: f64) -> usize {
        match self.parameters.time_samples {
            Auto::Set(count) => count as usize,
            Auto::Auto => {
                let scrolled = self.rise_speed(flame, shutter.middle()) * shutter.duration() * pixels_per_meter;
                (scrolled / PIXELS_PER_SAMPLE).ceil().clamp(1.0, MAX_SAMPLES) as usize
            }
        }
    }

    /// What is drawn: the flame, or the texture square at a stage.
    pub(crate) fn content(&self) -> SheetContent {
        match self.parameters.stage {
            SheetStage::Flame => SheetContent::Flame,
            SheetStage::FlameTexture => SheetContent::FlatTexture,
            SheetStage::Thresholded | SheetStage::Sharpened | SheetStage::Colored => SheetContent::FlatThresholded,
        }
    }

    /// A flame's time samples over the exposure, and the bounding rectangle of its pixels. The samples of a small sheet have cells, `grid`.
    pub(crate) fn samples(
        &self,
        flame: &FlameInstance,
        texture_source: &FilteredTexture,
        view: &View,
        wind: &Wind,
        count: usize,
        grid: Option<SheetCells>,
    ) -> (Vec<TimeSample>, Rect) {
        let mut samples = Vec::with_capacity(count);
        let mut rect = Rect::default();
        for index in 0..count {
            let t = view.shutter.instant(index, count);
            let camera = if count == 1 { view.camera } else { view.camera_at(t) };
            let right = self.right(flame, &camera, self.base(flame, t));
            let (quad, warp) = self.evaluate_at(flame, right, wind, t);
            let Some(pixel_to_sheet) = PixelToSheet::new(&camera, &quad) else { continue };
            let [low, high] = warp.center_range;
            let eddies = flame.eddies.as_ref().map(|eddies| eddies.after(warp.scroll));
            let reach = flame.eddies.as_ref().map_or(0.0, |eddies| f64::from(eddies.reach(0.5)[0]));
            let sides = [low.min(0.0) - reach, 1.0 + high.max(0.0) + reach];
            let cells = grid.and_then(|grid| ProjectedCells::new(&camera, &quad, sides, grid));
            if grid.is_some() && cells.is_none() {
                // A part of it cannot be projected, as when it is beside or behind the camera.
                return self.samples(flame, texture_source, view, wind, count, None);
            }
            let seen = match &cells {
                Some(cells) => cells.bounds(view.size),
                None => bounds(&camera, &quad, sides[0], sides[1], 1.0, view.size),
            };
            rect = rect.union(&seen);
            let pixels_per_meter = pixels_per_meter(&camera, &quad);
            let pixel = [2.0 / (pixels_per_meter * quad.size.x) as f32, 1.0 / (pixels_per_meter * quad.size.y) as f32];
            let pixel = grid.map_or(pixel, |grid| grid.cell());
            let state = SheetState { texture: texture_source.texture(warp.scroll), eddies, pixel, warp };
            let luminance = self.luminance_at(t) as f32 / count as f32;
            samples.push(TimeSample { pixel_to_sheet, quad, state, luminance, smoke: None, cells });
        }
        (samples, rect)
    }
}

impl FlameSheet {
    /// The parts of an exposure in which no flame is displaced by more than half a pixel. The motion of its gas is left to its time samples, as far as these
    /// suffice; where their number is given, so is the number of times at which the camera is taken.
    pub(crate) fn parts_of_exposure(&self, view: &View) -> usize {
        if self.parameters.time_samples != Auto::Auto {
            return 1;
        }
        let cameras = view.path_cameras();
        self.flames.iter().map(|flame| self.parts_of_flame(flame, view, &cameras)).max().unwrap_or(1)
    }

    fn parts_of_flame(&self, flame: &FlameInstance, view: &View, cameras: &PathCameras) -> usize {
        let height = self.sheet_size(flame).y;
        let displaced = if cameras.is_still() && self.parameters.position.constant().is_some() {
            1
        } else {
            // Base, middle and tip: where the camera moves, they move differently.
            let mut motion = 0.0_f64;
            for fraction in [0.0, 0.5, 1.0] {
                let path = cameras.path_pixels(|t| self.base(flame, t) + DVec3::Y * (fraction * height));
                motion = motion.max(path);
            }
            parts_of_motion(motion, PIXELS_PER_PART, MAX_PARTS).max(parts_of_motion(
                motion,
                PIXELS_PER_PART_IF_LONG,
                view.shutter.max_parts(),
            ))
        };
        let middle = self.base(flame, view.shutter.middle()) + DVec3::Y * (0.5 * height);
        let distance = (middle - view.camera.position).length().max(view.camera.near);
        let scrolled = self.rise_speed(flame, view.shutter.middle()) * view.shutter.duration();
        let scrolled_pixels = scrolled * view.camera.focal_pixels / distance;
        let duration = view.shutter.duration();
        let flickers =
            if duration > KEEPS_FORM_S * (1.0 + 1e-9) { parts_of_motion(duration, LONG_PART_S, MAX_PARTS) } else { 1 };
        displaced.max(flickers).max(parts_of_motion(scrolled_pixels, MAX_SCROLL, MAX_PARTS))
    }
}

/// Pixels per meter at the sheet's center.
pub(crate) fn pixels_per_meter(camera: &Camera, quad: &UprightQuad) -> f64 {
    let depth = camera.depth(quad.point(0.5, 0.5)).abs().max(camera.near);
    camera.focal_pixels / depth
}
