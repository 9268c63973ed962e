//! Heat haze: hot gas has a lower refractive index than air, and light is refracted toward higher indices.
//!
//! In the paraxial approximation the deflection of a ray is the gradient of the optical path length across it. The path length is a
//! sum of sprites, like the optical depth.

use bansho_base::{
    host::parallel::prelude::*,
    image::{Image, Rect},
    phenomenon::strip::Strip,
    world::air::Air,
};
use fearless_simd::dispatch;

use super::{aovs::DEFLECTION, gas::Gas, gas_view::GasView};
use crate::particles::{
    parameters::{GasRenderingParameters, HeatHazeModel},
    render::{
        depth_layers::is_visible,
        project::{ProjectedParticle, SpriteKind, project_particles},
        resolve::{PATH, PLANES},
        splat::{
            MIN_RADIUS_CELLS, SplatSettings, Sprite,
            grid::{Grid, weighted_sum},
            kernel::Profile,
            splat,
        },
    },
};

/// n - 1 of air at [`REFERENCE_K`] and atmospheric pressure; proportional to 1/T (Gladstone-Dale).
const REFRACTIVITY: f64 = 2.72e-4;
const REFERENCE_K: f64 = 293.15;

/// Refractivity n - 1 of air and combustion gases at a temperature.
#[inline(always)]
pub(crate) fn refractivity(temperature_k: f64) -> f64 {
    REFRACTIVITY * REFERENCE_K / temperature_k.max(1.0)
}

/// Deflection angles of the light from behind the gas.
pub(crate) struct HeatHaze {
    pub(crate) rect: Rect,
    pub(crate) angle: Image<2>,
}

/// Optical path difference to air along a ray through the center of a particle's sprite, in pixels at its depth: the gradient of
/// the summed path differences, per pixel, is an angle.
#[inline(always)]
pub(crate) fn optical_path(gas: &Gas, rendering: &GasRenderingParameters, projected: &ProjectedParticle) -> f32 {
    let refractivity_excess = refractivity_excess(gas, projected.index);
    let volume = match rendering.heat_haze_model {
        HeatHazeModel::Refraction => gas.volume(projected.index),
        HeatHazeModel::Poly6 => emitted_volume(gas, projected.index),
    };
    let length = rendering.heat_haze_gain * refractivity_excess * volume * f64::from(projected.ellipse.peak);
    (length * f64::from(projected.scale)) as f32
}

/// Volume of a particle's gas when it was emitted, at the density of air of its temperature, m^3: the same for all particles of constant
/// temperature, wherever they are.
#[inline(always)]
fn emitted_volume(gas: &Gas, index: usize) -> f64 {
    f64::from(gas.particles.mass[index])
        / Air::default().density_at(f64::from(gas.particles.temperature[index]).max(1.0))
}

/// Profile of the optical path of a particle, whose gradient deflects light.
fn profile(rendering: &GasRenderingParameters) -> Profile {
    match rendering.heat_haze_model {
        HeatHazeModel::Refraction => Profile::LINE,
        // The gradient of poly6: figure 3 of the paper.
        HeatHazeModel::Poly6 => Profile::POLY6,
    }
}

/// Refractivity of a particle's gas minus that of the surrounding air.
#[inline(always)]
fn refractivity_excess(gas: &Gas, index: usize) -> f64 {
    refractivity(f64::from(gas.particles.temperature[index])) - refractivity(gas.air_temperature_k)
}

/// Particles as sprites of their optical path: those that neither emit nor absorb, or all.
struct RefractionSprites<'a> {
    gas: &'a Gas<'a>,
    rendering: &'a GasRenderingParameters,
    whole_gas: bool,
}

impl SpriteKind for RefractionSprites<'_> {
    type Record = Sprite<1>;

    #[inline(always)]
    fn includes(&self, index: usize) -> bool {
        (self.whole_gas || !is_visible(self.gas, self.rendering, index)) && refractivity_excess(self.gas, index) != 0.0
    }

    #[inline(always)]
    fn record(&self, projected: &ProjectedParticle) -> Sprite<1> {
        Sprite {
            ellipse: projected.ellipse,
            layer: 0,
            next_layer_weight: 0.0,
            values: [optical_path(self.gas, self.rendering, projected)],
        }
    }
}

impl HeatHaze {
    /// The deflection in the window of a view; `None` if there is none.
    ///
    /// `splatted` contains the optical paths of the visible gas, if any is inside the window. The remaining gas is splatted here; with `whole_gas`, for
    /// when no gas has been splatted at all, all of it.
    pub(crate) fn new(
        gas: &Gas,
        rendering: &GasRenderingParameters,
        view: &GasView,
        splatted: Option<&Grid<'_>>,
        whole_gas: bool,
    ) -> Option<Self> {
        if rendering.heat_haze_gain <= 0.0 {
            return None;
        }
        let settings = SplatSettings {
            profile: profile(rendering),
            min_radius_cells: MIN_RADIUS_CELLS,
            layers: 1,
            picture: view.size,
            window: view.window,
            camera: view.camera,
        };
        let remaining = splat(
            &settings,
            &project_particles(gas, view, &RefractionSprites { gas, rendering, whole_gas }),
            gas.buffers,
        )
        .sums();
        let paths: Vec<OpticalPathField> = [(splatted, PATH, PLANES), (remaining.as_ref(), 0, 1)]
            .into_iter()
            .filter_map(|(grid, plane, planes)| Some(OpticalPathField::new(grid?, plane, planes)))
            .collect();
        Self::from_paths(&paths, view.window)
    }

    /// The gradient of the summed paths at every pixel, to the right and upward.
    fn from_paths(paths: &[OpticalPathField], window: Rect) -> Option<Self> {
        let covered = paths.iter().map(|paths| paths.sums.covered().intersection(&window));
        let rect = covered.reduce(|union, covered| union.union(&covered))?;
        let mut angle = Image::filled(rect.width, rect.height, [0.0; 2]);
        let level = bansho_base::math::simd::level();
        // Outside its cells a grid contributes nothing.
        let fields = paths.iter().map(|paths| {
            let covered = paths.sums.covered().intersection(&rect);
            (paths, covered, paths.sums.columns(covered.x, covered.width))
        });
        let fields: Vec<_> = fields.collect();
        angle.pixels_mut().par_chunks_mut(rect.width.max(1)).enumerate().for_each(|(row, out)| {
            let y = rect.y + row;
            for (paths, covered, columns) in
                fields.iter().filter(|(_, covered, _)| (covered.y..covered.bottom()).contains(&y))
            {
                let out = &mut out[covered.x - rect.x..][..covered.width];
                dispatch!(level, _simd => paths.add_gradient(columns, y, out));
            }
        });
        Some(Self { rect, angle })
    }

    /// Writes the angles to the AOVs of a strip.
    pub(crate) fn write_aovs(&self, strip: &mut Strip) {
        let rect = self.rect.intersection(&strip.rect);
        for y in rect.y..rect.bottom() {
            for x in rect.x..rect.right() {
                let index = (y - strip.rect.y) * strip.rect.width + x - strip.rect.x;
                let angle = self.angle.at(x - self.rect.x, y - self.rect.y);
                for (plane, value) in DEFLECTION.into_iter().zip(angle) {
                    strip.aovs[plane].add(index, value, 1.0);
                }
            }
        }
    }
}

/// Summed optical paths, with spline weights for values and slopes.
struct OpticalPathField<'a> {
    sums: Grid<'a>,
    weights: Vec<[f32; 4]>,
    slopes: Vec<[f32; 4]>,
}

impl<'a> OpticalPathField<'a> {
    fn new(grid: &Grid<'a>, plane: usize, planes: usize) -> Self {
        Self {
            sums: grid.sum_of_plane(plane, planes),
            weights: grid.cells.spline_weights(),
            slopes: grid.cells.spline_slopes(),
        }
    }

    /// Adds the gradient along row `y` for pixels in `columns`.
    #[inline(always)]
    fn add_gradient(&self, columns: &[(usize, usize)], y: usize, out: &mut [[f32; 2]]) {
        let cells = &self.sums.cells;
        let (cell, phase) = cells.cell_before(1, y);
        let rows = [-1, 0, 1, 2].map(|k| self.sums.row(cell + k));
        let (mut values, mut gradients) = (vec![0.0; cells.columns], vec![0.0; cells.columns]);
        weighted_sum(&mut values, rows, &self.weights[phase]);
        weighted_sum(&mut gradients, rows, &self.slopes[phase]);
        for (angle, &(first, phase)) in out.iter_mut().zip(columns) {
            let (along, across) = (&self.slopes[phase], &self.weights[phase]);
            let (mut right, mut down) = (0.0_f32, 0.0_f32);
            for k in 0..4 {
                right = along[k].mul_add(values[first + k], right);
                down = across[k].mul_add(gradients[first + k], down);
            }
            // Rows are counted downward, angles upward.
            *angle = [angle[0] + right, angle[1] - down];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Refractive index of air at many temperatures (Ciddor 1996).
    const REFERENCE: &str = include_str!("../data/air_index.csv");

    #[test]
    fn refractivity_is_that_of_air_at_every_temperature() {
        let rows: Vec<Vec<f64>> = REFERENCE
            .lines()
            .skip(1)
            .map(|line| line.split(',').map(|value| value.parse().unwrap()).collect())
            .collect();
        assert_eq!(rows.len(), 16);
        for row in rows {
            // The sodium D line, and green light.
            for (column, allowed) in [(2, 2e-3), (6, 5e-3)] {
                let off = refractivity(row[0]) / row[column] - 1.0;
                assert!(off.abs() < allowed, "{off} off at {} K", row[0]);
            }
        }
    }
}
