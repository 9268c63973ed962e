//! One prepared frame of the gas.

use std::sync::OnceLock;

use bansho_base::{
    host::{
        observer::{Cancelled, Observer, check},
        once::get_or_compute,
    },
    image::Rect,
    math::DVec3,
    phenomenon::{
        Deflection, Prepared,
        strip::{DepthInterval, Strip, View},
        surroundings::Surroundings,
    },
};
use fearless_simd::{Level, dispatch};

use super::{
    aovs::{MotionField, min_max},
    deflection::{self, HeatHaze},
    depth_layers::DepthLayers,
    gas::Gas,
};
use crate::{
    chemiluminescence_color,
    particles::{
        parameters::{RenderingParameters, SpriteStyle},
        render::{
            depth_layers::{GasStatistics, is_visible},
            paper_squares::Squares,
            project::{ProjectedParticle, SpriteKind, project_particles},
            resolve::{
                BLUE, ColumnExtents, DETAIL_OFFSET, DepthLayer, GasResolver, LUMINANCE, LUMINANCE_KELVIN, PATH, PLANES,
                TAU, detail::Detail, strain::Strain, upsample::RowInterpolator,
            },
            splat::{MIN_RADIUS_CELLS, SplatResult, SplatSettings, Sprite, grid::Grid, kernel::Profile, splat},
        },
    },
    sparks::{SparkEmitter, Streak},
};

/// The gas of one frame, ready to be drawn into strips.
pub struct PreparedGas<'a> {
    gas: Gas<'a>,
    look: &'a RenderingParameters,
    view: &'a View,
    level: Level,
    layers: DepthLayers,
    mode: DrawMode<'a>,
    sparks: Vec<Streak>,
    /// Computed where it is requested as an AOV or bends the light from behind.
    haze: OnceLock<Option<HeatHaze>>,
}

/// How the particles are drawn.
enum DrawMode<'a> {
    /// The view sees no particles.
    Empty,
    /// Particles are visible only outside the window that is drawn.
    OutsideWindow,
    /// Sprites summed on a grid.
    SplattedGas(Box<SplattedGas<'a>>),
    /// The paper's density squares.
    Squares(Squares),
}

struct SplattedGas<'a> {
    grid: Grid<'a>,
    extents: ColumnExtents,
    weights: Vec<[f32; 4]>,
    across: RowInterpolator,
    detail: Option<(Detail, Strain)>,
    scattered: Vec<[f32; 3]>,
    /// Where AOVs are requested, and anything glows.
    motion: Option<MotionField<'a>>,
    temperatures: [f32; 2],
}

/// Sparks of the fire.
fn spark_emitter<'a>(gas: &Gas, look: &'a RenderingParameters, view: &View) -> SparkEmitter<'a> {
    SparkEmitter {
        parameters: &look.sparks,
        key: gas.key,
        now: view.shutter.middle(),
        loop_s: None,
        base: gas.base,
        size: gas.size,
        scale: 1.0,
        wind_response: 1.0,
    }
}

/// Depth intervals of the gas and its sparks.
pub fn depth_intervals(gas: &Gas, look: &RenderingParameters, view: &View) -> Vec<DepthInterval> {
    if gas.particles.is_empty() && look.sparks.rate <= 0.0 {
        return Vec::new();
    }
    let layers = GasStatistics::new(gas, look, view).layers(gas);
    let mut intervals: Vec<DepthInterval> = layers.intervals().collect();
    if look.sparks.rate > 0.0 {
        let middle = layers.center(layers.count / 2);
        let reach = look.sparks.swirl + 0.5 * layers.thickness * layers.count as f64;
        intervals.push(DepthInterval { near: (middle - reach).max(0.0), far: middle + reach });
    }
    intervals
}

impl<'a> PreparedGas<'a> {
    /// Prepares the gas for `view`.
    ///
    /// # Errors
    /// The observer asked to stop.
    pub fn new(
        gas: Gas<'a>,
        look: &'a RenderingParameters,
        view: &'a View,
        surroundings: &Surroundings,
        observer: &dyn Observer,
    ) -> Result<Self, Cancelled> {
        check(observer)?;
        let statistics = GasStatistics::new(&gas, look, view);
        let layers = statistics.layers(&gas);
        let mode = match look.sprite {
            SpriteStyle::Squares => DrawMode::Squares(Squares::new(&gas, look, view)),
            _ => splat_gas(&gas, look, view, &statistics, surroundings),
        };
        check(observer)?;
        let mut sparks = spark_emitter(&gas, look, view).streaks(view, surroundings.wind);
        sparks.sort_by(|a, b| a.depth.total_cmp(&b.depth));
        let prepared = Self { gas, look, view, level: Level::new(), layers, mode, sparks, haze: OnceLock::new() };
        if view.aovs_requested {
            prepared.haze();
        }
        Ok(prepared)
    }

    /// The layers in a slice, nearest first.
    fn layers_in<'b>(&'b self, slice: &'b DepthInterval) -> impl Iterator<Item = DepthLayer> + 'b {
        let thickness = self.layers.thickness;
        let layer = move |index| DepthLayer { index, depth: self.layers.center(index), thickness };
        (0..self.layers.count).map(layer).filter(|layer| slice.contains(layer.depth))
    }

    fn resolve<'b>(&'b self, splat_gas: &'b SplattedGas<'_>) -> GasResolver<'b> {
        GasResolver {
            grid: &splat_gas.grid,
            camera: &self.view.camera,
            origin: self.gas.particles.origin,
            detail: splat_gas.detail.as_ref().map(|(detail, strain)| (detail, strain)),
            self_absorption: self.look.sprite == SpriteStyle::LineIntegral,
            blue: chemiluminescence_color(),
            scattered: &splat_gas.scattered,
            weights: &splat_gas.weights,
            across: &splat_gas.across,
            temperatures: splat_gas.temperatures,
        }
    }
}

/// Splats all sprites into their depth layers.
fn splat_gas<'a>(
    gas: &Gas<'a>,
    look: &RenderingParameters,
    view: &View,
    statistics: &GasStatistics,
    surroundings: &Surroundings,
) -> DrawMode<'a> {
    let layers = statistics.layers(gas);
    let detail = statistics.scale(gas, view).and_then(|scale| Detail::new(gas, look, &scale));
    let radiance = RadianceSprites {
        gas,
        look,
        layers: &layers,
        opacity: mean_density(gas).map_or(0.0, |density| look.opacity / density),
        detail: detail.as_ref(),
        seconds_since_state: view.shutter.middle() - gas.time,
    };
    let sprites = project_particles(gas, view, &radiance);
    let profile = if look.sprite == SpriteStyle::Poly6 { Profile::POLY6 } else { Profile::LINE };
    let grid = match splat(
        &SplatSettings {
            profile,
            min_radius_cells: MIN_RADIUS_CELLS,
            layers: layers.count,
            picture: view.size,
            window: view.window,
        },
        &sprites,
        gas.buffers,
    ) {
        SplatResult::Sums(grid) => grid,
        SplatResult::OutsideWindow => return DrawMode::OutsideWindow,
        SplatResult::Empty => return DrawMode::Empty,
    };
    let extents = ColumnExtents::new(&grid, layers.count);
    let with_strain = |detail: Detail| {
        let strain = Strain::new(&grid, &extents, layers.count, detail.cell_pixels);
        (detail, strain)
    };
    let detail = detail.map(with_strain);
    let scattered = (0..layers.count).map(|layer| scattered(gas, look, view, layers.center(layer), surroundings));
    DrawMode::SplattedGas(Box::new(SplattedGas {
        extents,
        weights: grid.cells.spline_weights(),
        across: RowInterpolator::new(&grid, view.size[0], &grid.cells.spline_weights()),
        grid,
        detail,
        scattered: scattered.collect(),
        motion: if view.aovs_requested { MotionField::new(gas, look, view) } else { None },
        temperatures: min_max(gas.particles.temperature.iter().copied()),
    }))
}

/// Visible particles as sprites of emission and absorption.
struct RadianceSprites<'a> {
    gas: &'a Gas<'a>,
    look: &'a RenderingParameters,
    layers: &'a DepthLayers,
    /// Opacity of a poly6 sprite per density.
    opacity: f64,
    detail: Option<&'a Detail>,
    /// Time since the particles' state, s.
    seconds_since_state: f64,
}

impl SpriteKind for RadianceSprites<'_> {
    type Record = Sprite<PLANES>;

    #[inline(always)]
    fn includes(&self, index: usize) -> bool {
        is_visible(self.gas, self.look, index)
    }

    #[inline(always)]
    fn record(&self, seen: &ProjectedParticle) -> Sprite<PLANES> {
        let (layer, next_layer_weight) = self.layers.layer_at(seen.depth);
        let mut values = match self.look.sprite {
            SpriteStyle::Poly6 => self.density_values(seen.index),
            _ => self.values(seen),
        };
        if let Some(detail) = self.detail {
            let offset = detail.detail_offset(self.gas, seen.index, self.seconds_since_state);
            for axis in 0..3 {
                values[DETAIL_OFFSET + axis] = values[TAU] * offset[axis];
            }
        }
        Sprite { ellipse: seen.ellipse, layer, next_layer_weight, values }
    }
}

impl RadianceSprites<'_> {
    /// Line integrals through the center of a particle's sprite.
    #[inline(always)]
    fn values(&self, seen: &ProjectedParticle) -> [f32; PLANES] {
        let (gas, index) = (self.gas, seen.index);
        let length = gas.volume(index) * f64::from(seen.ellipse.peak);
        let tau = length * gas.absorption(index, self.look);
        let mut values = self.emission_values(index, tau);
        values[BLUE] = (length * gas.blue_luminance(index, self.look)) as f32;
        values[PATH] = deflection::path(gas, self.look, seen);
        values
    }

    /// The paper's sprite (section 5.2): opacity by density, color by temperature.
    #[inline(always)]
    fn density_values(&self, index: usize) -> [f32; PLANES] {
        self.emission_values(index, self.opacity * f64::from(self.gas.particles.density[index]))
    }

    /// Optical depth, and the luminance that goes with it.
    #[inline(always)]
    fn emission_values(&self, index: usize, tau: f64) -> [f32; PLANES] {
        let glow = tau * self.gas.luminance(index);
        let mut values = [0.0; PLANES];
        values[TAU] = tau as f32;
        values[LUMINANCE] = glow as f32;
        values[LUMINANCE_KELVIN] = (glow * f64::from(self.gas.particles.temperature[index])) as f32;
        values
    }
}

fn mean_density(gas: &Gas) -> Option<f64> {
    let densities = &gas.particles.density;
    let sum: f64 = densities.iter().map(|density| f64::from(*density)).sum();
    (sum > 0.0).then(|| sum / densities.len() as f64)
}

/// Radiance that opaque soot at a depth scatters toward the camera: isotropic single scattering of other lights.
fn scattered(gas: &Gas, look: &RenderingParameters, view: &View, depth: f64, surroundings: &Surroundings) -> [f32; 3] {
    let toward = (gas.particles.origin - view.camera.position).normalize_or(DVec3::NEG_Z);
    let position = view.camera.position + toward * depth;
    let scale = (look.smoke_albedo / (4.0 * std::f64::consts::PI)) as f32;
    let mut sum = [0.0; 3];
    for light in &surroundings.others.lights {
        let (illuminance, _) = light.illuminance(position);
        (0..3).for_each(|c| sum[c] += illuminance[c] * scale);
    }
    sum
}

impl Prepared for PreparedGas<'_> {
    fn bounds(&self, slice: &DepthInterval) -> Rect {
        let gas = match &self.mode {
            DrawMode::SplattedGas(splat_gas) if self.layers_in(slice).next().is_some() => splat_gas.grid.covered(),
            DrawMode::Squares(squares) => squares.bounds(slice),
            _ => Rect::default(),
        };
        // Gas that refracts extends farther than gas that emits.
        let all = self.measured_haze(slice).map_or(gas, |haze| gas.union(&haze.rect));
        let sparks = self.sparks.iter().filter(|spark| slice.contains(spark.depth));
        sparks.fold(all, |all, spark| all.union(&spark.bounds(self.view.size)))
    }

    fn draw(&self, slice: &DepthInterval, strip: &mut Strip) {
        let mut sparks = self.sparks.iter().filter(|spark| slice.contains(spark.depth)).peekable();
        if let DrawMode::SplattedGas(splat_gas) = &self.mode {
            let resolve = self.resolve(splat_gas);
            let mut row = resolve.row();
            let rect = splat_gas.grid.covered().intersection(&strip.rect);
            for layer in self.layers_in(slice) {
                while let Some(spark) = sparks.next_if(|spark| spark.depth < layer.depth) {
                    spark.draw(self.view.size, strip);
                }
                if rect.is_empty() {
                    continue;
                }
                dispatch!(self.level, _simd => resolve.draw_layer(&layer, &splat_gas.extents, rect, &mut row, strip));
                if !strip.aovs.is_empty() {
                    resolve.measure_layer(&layer, &splat_gas.extents, splat_gas.motion.as_ref(), rect, &mut row, strip);
                }
            }
        }
        if let DrawMode::Squares(squares) = &self.mode {
            squares.draw(slice, strip);
        }
        if !strip.aovs.is_empty() {
            self.measure_deflection(slice, strip);
        }
        sparks.for_each(|spark| spark.draw(self.view.size, strip));
    }

    fn may_bend(&self) -> bool {
        self.look.heat_haze_gain > 0.0 && !self.gas.particles.is_empty()
    }

    fn deflection(&self) -> Option<Deflection<'_>> {
        let haze = self.haze()?;
        let depth = self.layers.center(self.layers.count - 1) + 0.5 * self.layers.thickness;
        Some(Deflection { depth, rect: haze.rect, angle: &haze.angle })
    }
}

impl PreparedGas<'_> {
    /// The haze, computed by all threads. Where AOVs are requested it exists before strips are drawn.
    fn haze(&self) -> Option<&HeatHaze> {
        let (summed, all) = match &self.mode {
            DrawMode::SplattedGas(splat_gas) if self.look.sprite == SpriteStyle::LineIntegral => {
                (Some(&splat_gas.grid), false)
            }
            DrawMode::OutsideWindow if self.look.sprite == SpriteStyle::LineIntegral => (None, false),
            _ => (None, true),
        };
        get_or_compute(&self.haze, || HeatHaze::new(&self.gas, self.look, self.view, summed, all)).as_ref()
    }

    /// The haze, in the one slice in which its AOV is written.
    fn measured_haze(&self, slice: &DepthInterval) -> Option<&HeatHaze> {
        let is_here = self.view.aovs_requested && slice.contains(self.layers.center(self.layers.count - 1));
        self.haze.get().and_then(Option::as_ref).filter(|_| is_here)
    }

    fn measure_deflection(&self, slice: &DepthInterval, strip: &mut Strip) {
        if let Some(haze) = self.measured_haze(slice) {
            haze.measure(strip);
        }
    }
}
