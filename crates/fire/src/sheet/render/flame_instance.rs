//! One instance of a flame: its fluctuations, its texture, its placement, and its time samples in a view.

use std::sync::Arc;

use bansho_base::{
    camera::{
        Camera,
        upright_quad::{UprightQuad, right_facing},
    },
    image::Rect,
    math::{self, DVec2, DVec3, random::Key},
    parameters::Auto,
    phenomenon::strip::{Shutter, View},
    world::wind::Wind,
};

use crate::sheet::{
    FlameSheet,
    animate::warp::{FlameWaves, WarpState, WindLean},
    parameters::{Facing, Instance, Stage},
    render::{
        projection::{PixelToSheet, bounds},
        shade::{SheetContent, SheetState, TimeSample},
    },
    texture::{FRACTAL, FractalLayers, PaperLayer, Texture, TextureTable},
};

/// Source of a flame's texture.
#[derive(Clone, Debug)]
pub(crate) enum TextureSource {
    /// The layers of this flame on the common noise table.
    Fractal(FractalLayers),
    /// The paper's table, common to all instances.
    Paper(Arc<PaperLayer>),
}

impl TextureSource {
    /// Texels of the table per sheet height.
    fn texels_up(&self) -> f64 {
        match self {
            Self::Fractal(layers) => layers.texels_up(),
            Self::Paper(layer) => layer.texels_up(),
        }
    }
}

/// One flame among the instances of a sheet.
#[derive(Clone, Debug)]
pub(crate) struct FlameInstance {
    pub(crate) placement: Instance,
    pub(crate) key: Key,
    pub(crate) waves: FlameWaves,
    pub(crate) texture_source: TextureSource,
}

impl TextureSource {
    /// T0 after `scroll` sheet heights, at full resolution.
    pub(crate) fn texture(&self, scroll: f64) -> Texture {
        match self {
            Self::Fractal(layers) => layers.at(&FRACTAL, scroll),
            Self::Paper(layer) => layer.at(scroll),
        }
    }

    /// The same with its table filtered (as a mip level) for a sheet `height_pixels` tall.
    pub(crate) fn filtered(&self, height_pixels: f64) -> FilteredTexture {
        let level = math::log2(self.texels_up() / height_pixels.max(1.0)) as f32;
        match self {
            Self::Fractal(layers) if level > 0.0 => {
                FilteredTexture::Fractal(*layers, Arc::new(FRACTAL.filtered(level)))
            }
            Self::Fractal(layers) => FilteredTexture::Fractal(*layers, FRACTAL.clone()),
            Self::Paper(layer) if level > 0.0 => FilteredTexture::Paper(Arc::new(layer.filtered(level))),
            Self::Paper(layer) => FilteredTexture::Paper(layer.clone()),
        }
    }
}

/// A flame's texture, filtered for one frame.
pub(crate) enum FilteredTexture {
    /// Layers and their filtered table.
    Fractal(FractalLayers, Arc<TextureTable>),
    /// The paper's texture.
    Paper(Arc<PaperLayer>),
}

impl FilteredTexture {
    /// Fractal layers filtered for a sheet `height_pixels` tall.
    pub(crate) fn fractal(layers: FractalLayers, height_pixels: f64) -> Self {
        TextureSource::Fractal(layers).filtered(height_pixels)
    }

    /// T0 after `scroll` sheet heights.
    pub(crate) fn texture(&self, scroll: f64) -> Texture {
        match self {
            Self::Fractal(layers, table) => layers.at(table, scroll),
            Self::Paper(layer) => layer.at(scroll),
        }
    }
}

impl FlameSheet {
    /// Center of a flame's base at `t`, m.
    pub(crate) fn base(&self, flame: &FlameInstance, t: f64) -> DVec3 {
        DVec3::from(self.parameters.position.at(self.clock.time(t))) + DVec3::from(flame.placement.position)
    }

    /// A flame's own time, with its phase.
    pub(crate) fn flame_time(&self, flame: &FlameInstance, t: f64) -> f64 {
        t + self.parameters.phase_s + flame.placement.phase_s
    }

    /// Width and height of a flame's sheet, m.
    pub(crate) fn sheet_size(&self, flame: &FlameInstance) -> DVec2 {
        DVec2::new(self.parameters.width, self.parameters.height) * flame.placement.scale
    }

    /// Mean speed of the rising gas, m/s.
    pub(crate) fn rise_speed(&self, flame: &FlameInstance, t: f64) -> f64 {
        // The texture passes over a height in 1/s seconds, whatever the acceleration.
        self.clock.speed(t) * self.sheet_size(flame).y
    }

    /// Horizontal direction across a flame's sheet.
    pub(crate) fn right(&self, flame: &FlameInstance, camera: &Camera, base: DVec3) -> DVec3 {
        match self.parameters.facing {
            Facing::Camera => right_facing(camera, base),
            Facing::Fixed => {
                let (sin, cos) = math::sin_cos((self.parameters.yaw_deg + flame.placement.yaw_deg).to_radians());
                DVec3::new(cos, 0.0, -sin)
            }
        }
    }

    /// A flame at `t` with its sheet turned to `right`: its quad, leaned by the wind, and its warp.
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
        (quad, WarpState::new(&self.parameters, self.shape(), &flame.waves, &self.clock, time, lean))
    }

    /// Number of time samples of the exposure: the gas scrolls by a few pixels between them.
    pub(crate) fn time_samples(&self, flame: &FlameInstance, shutter: Shutter, pixels_per_meter: f64) -> usize {
        const PIXELS_APART: f64 = 8.0;
        const MOST: f64 = 8.0;
        match self.parameters.time_samples {
            Auto::Set(count) => count as usize,
            Auto::Auto => {
                let scrolled = self.rise_speed(flame, shutter.middle()) * shutter.duration() * pixels_per_meter;
                (scrolled / PIXELS_APART).ceil().clamp(1.0, MOST) as usize
            }
        }
    }

    /// What is drawn: the flame, or the texture square at a stage.
    pub(crate) fn content(&self) -> SheetContent {
        match self.parameters.stage {
            Stage::Flame => SheetContent::Flame,
            Stage::Texture => SheetContent::FlatTexture,
            Stage::Thresholded | Stage::Sharpened | Stage::Colored => SheetContent::FlatThresholded,
        }
    }

    /// A flame's time samples over the exposure, and the pixels they may touch.
    pub(crate) fn samples(
        &self,
        flame: &FlameInstance,
        texture_source: &FilteredTexture,
        view: &View,
        wind: &Wind,
        count: usize,
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
            rect = rect.union(&bounds(&camera, &quad, low.min(0.0), 1.0 + high.max(0.0), 1.0, view.size));
            let pixels_per_meter = pixels_per_meter(&camera, &quad);
            let state = SheetState {
                texture: texture_source.texture(warp.scroll),
                pixel: [2.0 / (pixels_per_meter * quad.size.x) as f32, 1.0 / (pixels_per_meter * quad.size.y) as f32],
                warp,
            };
            let luminance = self.luminance_at(t) as f32 / count as f32;
            samples.push(TimeSample { pixel_to_sheet, quad, state, luminance, smoke: None });
        }
        (samples, rect)
    }

    /// Luminance of the brightest color at `t`, cd/m^2.
    pub(crate) fn luminance_at(&self, t: f64) -> f64 {
        self.parameters.color.luminance.at(self.clock.time(t))
    }
}

/// Pixels per meter at the sheet's center.
pub(crate) fn pixels_per_meter(camera: &Camera, quad: &UprightQuad) -> f64 {
    let depth = camera.depth(quad.point(0.5, 0.5)).abs().max(camera.near);
    camera.focal_pixels / depth
}
