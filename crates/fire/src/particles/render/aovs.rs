//! AOVs of the gas: temperature, optical depth, deflection and motion.

use bansho_base::{
    image::Rect,
    phenomenon::strip::{AovDescriptor, AovRule, Strip},
};

use super::{gas::Gas, gas_view::GasView};
use crate::particles::{
    parameters::GasRenderingParameters,
    render::{
        project::{ProjectedParticle, SpriteKind, project_particles},
        resolve::{ColumnExtents, DepthLayer, GasResolver, LayerSums, ResolvedRow, mean_temperature},
        splat::{
            MIN_RADIUS_CELLS, SplatSettings, Sprite,
            grid::{Grid, weighted_sum},
            kernel::Profile,
            splat,
        },
    },
};

/// AOVs of a particle flame, in the order of a strip's planes.
pub const AOVS: &[AovDescriptor] = &[
    AovDescriptor {
        name: "temperature_k",
        unit: "K",
        doc: "Gas temperature, weighted by the luminance that its soot adds; 0 where no soot glows.",
        rule: AovRule::WeightedMean,
    },
    AovDescriptor {
        name: "optical_depth",
        unit: "",
        doc: "Optical depth of soot along the line of sight, without detail; 0 where there is none.",
        rule: AovRule::Sum,
    },
    AovDescriptor {
        name: "deflection.X",
        unit: "rad",
        doc: "Angle to the right by which hot gas deflects light from behind, including `heat_haze_gain`; 0 without deflection.",
        rule: AovRule::Sum,
    },
    AovDescriptor {
        name: "deflection.Y",
        unit: "rad",
        doc: "Angle upward by which hot gas deflects light from behind, including `heat_haze_gain`; 0 without deflection.",
        rule: AovRule::Sum,
    },
    AovDescriptor {
        name: "motion.X",
        unit: "pixels",
        doc: "Motion of the gas to the next frame, to the right, weighted by luminance; 0 where no soot glows.",
        rule: AovRule::WeightedMean,
    },
    AovDescriptor {
        name: "motion.Y",
        unit: "pixels",
        doc: "Motion of the gas to the next frame, downward, weighted by luminance; 0 where no soot glows.",
        rule: AovRule::WeightedMean,
    },
];

/// Indices of the planes among a strip's AOVs.
const TEMPERATURE: usize = 0;
const OPTICAL_DEPTH: usize = 1;
pub(crate) const DEFLECTION: [usize; 2] = [2, 3];
const MOTION: [usize; 2] = [4, 5];

/// Motion of the glowing gas: sums of luminance, and of luminance times motion in pixels to the right and down.
pub(crate) struct GasMotionField<'a> {
    grid: Grid<'a>,
    weights: Vec<[f32; 4]>,
    /// Minimum and maximum motion of all particles, for each component.
    min_max: [[f32; 2]; 2],
}

/// Glowing particles as sprites of their motion.
struct MotionSprites<'a> {
    gas: &'a Gas<'a>,
    rendering: &'a GasRenderingParameters,
}

impl MotionSprites<'_> {
    #[inline(always)]
    fn luminous_volume(&self, index: usize) -> f64 {
        self.gas.absorption(index, self.rendering) * self.gas.luminance(index) * self.gas.volume(index)
    }
}

impl SpriteKind for MotionSprites<'_> {
    type Record = Sprite<3>;

    #[inline(always)]
    fn includes(&self, index: usize) -> bool {
        self.luminous_volume(index) > 0.0
    }

    #[inline(always)]
    fn record(&self, projected: &ProjectedParticle) -> Sprite<3> {
        let weight = (self.luminous_volume(projected.index) * f64::from(projected.ellipse.peak)) as f32;
        let values = [weight, weight * projected.motion[0], weight * projected.motion[1]];
        Sprite { ellipse: projected.ellipse, layer: 0, next_layer_weight: 0.0, values }
    }
}

impl<'a> GasMotionField<'a> {
    pub(crate) fn new(gas: &Gas<'a>, rendering: &GasRenderingParameters, view: &GasView) -> Option<Self> {
        let sprites = project_particles(gas, view, &MotionSprites { gas, rendering });
        let min_max = [0, 1].map(|axis| {
            let all_sprites = sprites.iter().flat_map(|task| task.iter());
            min_max(all_sprites.map(|sprite| sprite.values[1 + axis] / sprite.values[0]))
        });
        let grid = splat(
            &SplatSettings {
                profile: Profile::LINE,
                min_radius_cells: MIN_RADIUS_CELLS,
                layers: 1,
                picture: view.size,
                window: view.window,
                camera: view.camera,
            },
            &sprites,
            gas.buffers,
        );
        let grid = grid.sums()?;
        Some(Self { weights: grid.cells.spline_weights(), grid, min_max })
    }

    /// Motion of the gas at a pixel until the next frame, pixels to the right and down.
    fn at(&self, x: usize, y: usize) -> [f32; 2] {
        let cells = &self.grid.cells;
        let ((column, across), (row, down)) = (cells.cell_before(0, x), cells.cell_before(1, y));
        let start = 3 * self.grid.first_of_four(column);
        let rows = [-1, 0, 1, 2].map(|k| &self.grid.row(row + k)[start..start + 12]);
        let mut columns = [0.0; 12];
        weighted_sum(&mut columns, rows, &self.weights[down]);
        let [weight, right, below] =
            [0, 1, 2].map(|plane| (0..4).map(|k| columns[3 * k + plane] * self.weights[across][k]).sum::<f32>());
        if weight <= 0.0 || weight.is_nan() {
            return [0.0; 2];
        }
        // Cubic splines overshoot: no pixel moves more than all particles do.
        let mut motion = [right, below];
        for (value, [min_value, max_value]) in motion.iter_mut().zip(self.min_max) {
            *value = (*value / weight).max(min_value).min(max_value);
        }
        motion
    }
}

/// Minimum and maximum.
pub(crate) fn min_max(values: impl Iterator<Item = f32>) -> [f32; 2] {
    values.fold([f32::INFINITY, f32::NEG_INFINITY], |[min_value, max_value], value| {
        [min_value.min(value), max_value.max(value)]
    })
}

/// What a layer of the gas shows at a pixel, without self-absorption.
pub(crate) struct Measured {
    pub(crate) tau: f32,
    pub(crate) luminance: f32,
    pub(crate) luminance_kelvin: f32,
}

impl Measured {
    /// Adds it to the AOVs of a pixel, unless the plate hides it. Temperatures are limited to those of the gas.
    #[inline(always)]
    pub(crate) fn write(
        &self,
        strip: &mut Strip,
        depth: f32,
        [x, y]: [usize; 2],
        temperatures: [f32; 2],
        motion: Option<&GasMotionField<'_>>,
    ) {
        /// Luminance above which temperature and motion are recorded, cd/m^2.
        const MIN_LUMINANCE: f32 = 1e-3;
        let index = (y - strip.rect.y) * strip.rect.width + x - strip.rect.x;
        if !strip.visible(index, depth) {
            return;
        }
        strip.aovs[OPTICAL_DEPTH].add(index, self.tau, 1.0);
        if self.luminance > MIN_LUMINANCE {
            let kelvin = mean_temperature(self.luminance_kelvin, self.luminance, temperatures);
            strip.aovs[TEMPERATURE].add(index, kelvin, self.luminance);
            let motion_pixels = motion.map_or([0.0; 2], |motion| motion.at(x, y));
            (0..2).for_each(|axis| strip.aovs[MOTION[axis]].add(index, motion_pixels[axis], self.luminance));
        }
    }
}

impl GasResolver<'_> {
    /// Adds the AOVs of a layer in `rect` of a strip. Evaluated only where AOVs are requested, one pixel at a time.
    pub(crate) fn write_layer_aovs(
        &self,
        layer: &DepthLayer,
        extents: &ColumnExtents,
        motion: Option<&GasMotionField<'_>>,
        rect: Rect,
        row: &mut ResolvedRow,
        strip: &mut Strip,
    ) {
        for y in rect.y..rect.bottom() {
            let Some([first, last]) = self.fill(layer.index, y, extents, row) else { continue };
            let from = first.max(rect.x) / 16 * 16;
            for x in (from..last.min(rect.right())).step_by(16) {
                let Some(sums) = self.sums(row, layer.index, [x, y]) else { continue };
                for pixel in x.max(rect.x)..(x + 16).min(rect.right()) {
                    let lane = pixel - x;
                    let LayerSums { tau, luminance, luminance_kelvin, .. } = &sums;
                    let measured = Measured {
                        tau: tau[lane],
                        luminance: luminance[lane],
                        luminance_kelvin: luminance_kelvin[lane],
                    };
                    measured.write(strip, layer.depth as f32, [pixel, y], self.temperatures, motion);
                }
            }
        }
    }
}
