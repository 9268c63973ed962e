//! Smoke: a second sheet above the flame with the same texture and a soft threshold. It absorbs light and scatters it once.

use bansho_base::{
    camera::upright_quad::UprightQuad,
    color,
    image::Rect,
    math::{DVec2, DVec3},
    phenomenon::{strip::View, surroundings::Surroundings},
};

use super::{
    cells::{CellResolution, ProjectedCells, SheetCells, small_height},
    emitted_light::RowIntensities,
    projection::{PixelToSheet, bounds},
    shade::{
        SheetState, TimeSample,
        smoke::{LIGHT_SAMPLES, SmokeState},
    },
    time_samples::pixels_per_meter,
};
use crate::sheet::{
    animate::warp::{FlameWaves, WarpState, WindLean},
    model::{FlameInstance, FlameSheet},
    parameters::SheetShapeParameters,
    texture::{FilteredTexture, FractalLayers},
};

impl FlameSheet {
    /// Texture layers and fluctuations of a flame's smoke; `None` if it has none.
    pub(crate) fn smoke_layers(&self, flame: &FlameInstance) -> Option<(FractalLayers, FlameWaves)> {
        let smoke = &self.parameters.smoke;
        (smoke.optical_depth > 0.0).then(|| {
            let shape = SheetShapeParameters { flicker: 0.0, sway: 0.08, ..self.parameters.shape.clone() };
            let layers = FractalLayers::new([1.0, 0.35], smoke.speed, flame.key, &self.clock);
            (layers, FlameWaves::new(&shape, flame.key, &self.clock))
        })
    }

    /// A flame's smoke at the middle of the exposure, and the bounding rectangle of its pixels.
    pub(crate) fn smoke_sample(
        &self,
        flame: &FlameInstance,
        view: &View,
        surroundings: &Surroundings,
    ) -> Option<(TimeSample, Rect)> {
        let (layers, waves) = self.smoke_layers(flame)?;
        let smoke = &self.parameters.smoke;
        let t = view.shutter.middle();
        let size = self.sheet_size(flame);
        let base = self.base(flame, t);
        let right = self.right(flame, &view.camera, base);
        let plume = DVec2::new(size.x * smoke.width, size.y * smoke.height);
        let start = base + DVec3::Y * (smoke.base_height * size.y);
        let speed = (self.rise_speed(flame, t) * smoke.speed).max(0.3);
        let lean = WindLean::new(surroundings.wind, start, t, right, speed, self.parameters.wind_response);
        let quad = UprightQuad::new(start, right, plume, lean.toward);
        let across = WindLean { across: lean.across * plume.y / plume.x * size.x / size.y, ..lean };
        let time = self.flame_time(flame, t);
        let warp = WarpState::new(&self.parameters, self.shape(), &waves, &self.clock, time, across);
        let pixel_to_sheet = PixelToSheet::new(&view.camera, &quad)?;
        let scale = pixels_per_meter(&view.camera, &quad);
        let [low, high] = warp.center_range;
        let sides = [low.min(0.0), 1.0 + high.max(0.0)];
        let resolution = CellResolution { texels_up: layers.texels_up(), top: 1.0 };
        let grid = SheetCells::new(&view.camera, &quad, &resolution);
        let cells = grid.and_then(|grid| ProjectedCells::new(&view.camera, &quad, sides, grid));
        let (rect, filter_height) = match &cells {
            Some(cells) => (cells.bounds(view.size), small_height(layers.texels_up()).max(scale * plume.y)),
            None => (bounds(&view.camera, &quad, sides[0], sides[1], 1.0, view.size), scale * plume.y),
        };
        let source = FilteredTexture::fractal(layers, filter_height, &self.filter_cache);
        let pixel = [2.0 / (scale * plume.x) as f32, 1.0 / (scale * plume.y) as f32];
        let pixel = grid.filter(|_| cells.is_some()).map_or(pixel, |grid| grid.cell());
        let state = SheetState { texture: source.texture(warp.scroll), eddies: None, pixel, warp };
        let smoke_state = SmokeState {
            optical_depth: (smoke.optical_depth * self.flow_at(t)) as f32,
            base_width: (0.8 / smoke.width).min(1.0) as f32,
            scattered: self.smoke_light(flame, &quad, t, surroundings),
        };
        let smoke = Some(smoke_state);
        Some((TimeSample { pixel_to_sheet, state, quad, luminance: 1.0, smoke, cells }, rect))
    }

    /// Light that a flame's smoke scatters at each height.
    fn smoke_light(
        &self,
        flame: &FlameInstance,
        quad: &UprightQuad,
        t: f64,
        surroundings: &Surroundings,
    ) -> [[f32; 3]; LIGHT_SAMPLES] {
        let (smoke, size) = (&self.parameters.smoke, self.sheet_size(flame));
        let scattering = Scattering {
            albedo: smoke.albedo,
            tint: smoke.color,
            fire_light: smoke.fire_light,
            flame_center: self.base(flame, t) + DVec3::Y * (0.3 * size.y),
            flame_size: size,
        };
        scattering.radiance(&self.row_intensities(flame, t), quad, surroundings)
    }
}

/// Isotropic single scattering of the light of the flame below and of all other lights.
pub(crate) struct Scattering {
    /// Single-scattering albedo.
    pub(crate) albedo: f64,
    /// Tint, linear sRGB.
    pub(crate) tint: [f64; 3],
    /// Factor of the light of the flame.
    pub(crate) fire_light: f64,
    /// Center of the flame, m.
    pub(crate) flame_center: DVec3,
    /// Width and height of the flame, m.
    pub(crate) flame_size: DVec2,
}

impl Scattering {
    /// Radiance that opaque smoke on `quad` scatters toward the viewer at each height.
    pub(crate) fn radiance(
        &self,
        rows: &RowIntensities,
        quad: &UprightQuad,
        surroundings: &Surroundings,
    ) -> [[f32; 3]; LIGHT_SAMPLES] {
        let fire: [f32; 3] = std::array::from_fn(|k| rows.iter().map(|row| row[k]).sum());
        // The light of the flame is extended: within about its size the illuminance no longer increases.
        let extent_squared = 0.16 * self.flame_size.length_squared();
        let phase_albedo = self.albedo / (4.0 * std::f64::consts::PI);
        let tint = color::acescg_from_srgb(self.tint.map(|value| value as f32));
        std::array::from_fn(|i| {
            let point = quad.point(0.5, i as f64 / (LIGHT_SAMPLES - 1) as f64);
            let falloff = self.fire_light / ((point - self.flame_center).length_squared() + extent_squared);
            let mut light = fire.map(|value| value * falloff as f32);
            for other in &surroundings.others.lights {
                let (illuminance, _) = other.illuminance(point);
                light.iter_mut().zip(illuminance).for_each(|(sum, value)| *sum += value);
            }
            std::array::from_fn(|k| light[k] * tint[k] * phase_albedo as f32)
        })
    }
}
