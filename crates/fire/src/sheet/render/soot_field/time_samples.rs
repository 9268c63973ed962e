//! Time samples of a soot field over the exposure, as a view sees them, and the light that it emits.

use bansho_base::{
    camera::upright_quad::UprightQuad,
    image::Rect,
    math::{
        DVec2, DVec3,
        simd::{LANES, Lanes, ramp},
    },
    phenomenon::{strip::View, surroundings::Surroundings},
};
use fearless_simd::{Simd, prelude::*};

use super::shade::{SootState, shade_soot};
use crate::sheet::{
    animate::warp::WarpState,
    model::{FlameInstance, FlameSheet},
    render::{
        cells::{ProjectedCells, SheetCells, small_height},
        draw_cells::CellSample,
        emitted_light::{ROWS, RowIntensities},
        projection::{PixelToSheet, SheetCoordinates, bounds},
        shade::{ShadedBatch, smoke::LIGHT_SAMPLES},
        smoke::Scattering,
        time_samples::pixels_per_meter,
    },
    soot_field::{
        displacement::{Displacement, layers},
        plume::PlumeTables,
    },
};

/// A soot field at one time of the exposure, seen by the camera at that time.
pub(crate) struct SootSample {
    /// Mapping from pixels to the sheet.
    pub(super) pixel_to_sheet: PixelToSheet,
    /// The sheet's quad in the world.
    pub(super) quad: UprightQuad,
    /// Its state at that time.
    pub(super) state: SootState,
    /// Its cells in the picture if it is small.
    pub(crate) cells: Option<ProjectedCells>,
}

impl CellSample for SootSample {
    fn cells(&self) -> Option<&ProjectedCells> {
        self.cells.as_ref()
    }

    fn shade<S: Simd>(&self, sheet: &FlameSheet, batch: &SheetCoordinates<S>) -> Option<ShadedBatch<S>> {
        let tables = sheet.soot_field()?;
        batch.x.simd.vectorize(
            #[inline(always)]
            || shade_soot(&tables.plume, &self.state, batch),
        )
    }

    fn luminance(&self, samples: usize) -> f32 {
        1.0 / samples as f32
    }

    fn temperature(&self, _sheet: &FlameSheet, t1: f32) -> Option<f32> {
        Some(t1)
    }

    fn geometry(&self) -> (&UprightQuad, &WarpState) {
        (&self.quad, &self.state.warp)
    }
}

impl FlameSheet {
    /// The time samples of a soot field, and the bounding rectangle of its pixels. The samples of a small one have cells, `grid`.
    pub(crate) fn soot_samples(
        &self,
        flame: &FlameInstance,
        view: &View,
        surroundings: &Surroundings,
        count: usize,
        grid: Option<SheetCells>,
    ) -> (Vec<SootSample>, Rect) {
        let (mut samples, mut rect) = (Vec::with_capacity(count), Rect::default());
        let Some(tables) = self.soot_field() else { return (samples, rect) };
        let layers = layers(&self.parameters, flame.key, &self.clock);
        // Of the first time sample: neither changes visibly during the exposure.
        let mut common = None;
        for index in 0..count {
            let t = view.shutter.instant(index, count);
            let camera = if count == 1 { view.camera } else { view.camera_at(t) };
            let right = self.right(flame, &camera, self.base(flame, t));
            let (quad, warp) = self.evaluate_at(flame, right, surroundings.wind, t);
            let Some(pixel_to_sheet) = PixelToSheet::new(&camera, &quad) else { continue };
            let [low, high] = warp.center_range;
            let sides = [low.min(0.0), 1.0 + high.max(0.0)];
            let cells = grid.and_then(|grid| ProjectedCells::new(&camera, &quad, sides, grid));
            if grid.is_some() && cells.is_none() {
                // A part of it cannot be projected, as when it is beside or behind the camera.
                return self.soot_samples(flame, view, surroundings, count, None);
            }
            let seen = match &cells {
                Some(cells) => cells.bounds(view.size),
                None => bounds(&camera, &quad, sides[0], sides[1], 1.0, view.size),
            };
            rect = rect.union(&seen);
            let (scattered, displacement) = common.get_or_insert_with(|| {
                let least = grid.map_or(0.0, |_| small_height(layers.texels_up()));
                let height_pixels = least.max(pixels_per_meter(&camera, &quad) * quad.size.y);
                let displacement = tables.displacement.filtered(&layers, height_pixels);
                (self.soot_light(flame, &quad, view, surroundings), displacement)
            });
            let displacement = displacement.at(&layers, warp.scroll);
            let state = self.soot_state(warp, displacement, *scattered, t);
            samples.push(SootSample { pixel_to_sheet, quad, state, cells });
        }
        (samples, rect)
    }

    /// Texels of the displacement per sheet height.
    pub(crate) fn soot_texels_up(&self, flame: &FlameInstance) -> f64 {
        layers(&self.parameters, flame.key, &self.clock).texels_up()
    }

    /// The state of a soot field at `t`.
    fn soot_state(
        &self,
        warp: WarpState,
        displacement: Displacement,
        scattered: [[f32; 3]; LIGHT_SAMPLES],
        t: f64,
    ) -> SootState {
        let aspect = self.parameters.width / self.parameters.height;
        let stir = self.parameters.soot_field.stir;
        SootState {
            warp,
            displacement,
            stir: [stir, stir * aspect].map(|value| value as f32),
            initial_speed: self.parameters.shape.initial_speed as f32,
            luminance: self.luminance_at(t) as f32,
            scattered,
        }
    }

    /// Light that the soot scatters at each height, at the middle of the exposure.
    fn soot_light(
        &self,
        flame: &FlameInstance,
        quad: &UprightQuad,
        view: &View,
        surroundings: &Surroundings,
    ) -> [[f32; 3]; LIGHT_SAMPLES] {
        let (field, size, t) = (&self.parameters.soot_field, self.sheet_size(flame), view.shutter.middle());
        let scattering = Scattering {
            albedo: field.albedo,
            tint: [1.0; 3],
            fire_light: field.fire_light,
            flame_center: self.base(flame, t) + DVec3::Y * (0.5 * field.flame_height * size.y),
            flame_size: DVec2::new(4.0 * field.base_half_width, 2.0 * field.flame_height) * size,
        };
        scattering.radiance(&self.row_intensities(flame, t), quad, surroundings)
    }

    /// Luminous intensity of the rows of a soot field in still air: of the light that it emits, not of what it scatters.
    pub(crate) fn soot_row_intensities(&self, flame: &FlameInstance, warp: WarpState, t: f64) -> RowIntensities {
        let Some(tables) = self.soot_field() else { return [[0.0; 3]; ROWS] };
        let layers = layers(&self.parameters, flame.key, &self.clock);
        let displacement = tables.displacement.at(&layers, warp.scroll);
        let state = self.soot_state(warp, displacement, [[0.0; 3]; LIGHT_SAMPLES], t);
        let size = self.sheet_size(flame);
        let cell_area = (size.x * size.y / (LANES * ROWS) as f64) as f32;
        fearless_simd::dispatch!(bansho_base::math::simd::level(), simd => row_intensities(simd, &tables.plume, &state, cell_area))
    }
}

#[inline(always)]
fn row_intensities<S: Simd>(simd: S, plume: &PlumeTables, state: &SootState, cell_area: f32) -> RowIntensities {
    let mut intensities = [[0.0; 3]; ROWS];
    let x = ramp(simd, 0.5 / LANES as f32, 1.0 / LANES as f32);
    for (index, row) in intensities.iter_mut().enumerate() {
        let y = Lanes::splat(simd, (index as f32 + 0.5) / ROWS as f32);
        if let Some(shade) = shade_soot(plume, state, &SheetCoordinates { x, y, depth: y }) {
            for k in 0..3 {
                row[k] = shade.light[k].as_slice().iter().sum::<f32>() * cell_area;
            }
        }
    }
    intensities
}
