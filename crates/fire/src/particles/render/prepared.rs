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
        parameters::{HeatHazeModel, RenderingParameters, SpriteStyle},
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
    rendering: &'a RenderingParameters,
    view: &'a View,
    level: Level,
    layers: DepthLayers,
    mode: DrawMode<'a>,
    sparks: Vec<Streak>,
    /// Computed on demand: for its AOV, or to refract light from behind.
    haze: OnceLock<Option<HeatHaze>>,
}

/// How the particles are drawn in this view.
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
    row_interpolator: RowInterpolator,
    detail: Option<(Detail, Strain)>,
    scattered: Vec<[f32; 3]>,
    /// If AOVs are requested and any gas emits light.
    motion: Option<MotionField<'a>>,
    temperatures: [f32; 2],
}

/// Sparks of the fire.
fn spark_emitter<'a>(gas: &Gas, rendering: &'a RenderingParameters, view: &View) -> SparkEmitter<'a> {
    SparkEmitter {
        parameters: &rendering.sparks,
        key: gas.key,
        now: view.shutter.middle(),
        loop_s: None,
        flow: None,
        phase_s: 0.0,
        base: gas.base,
        size: gas.size,
        scale: 1.0,
        wind_response: 1.0,
    }
}

/// Depth intervals of the gas and its sparks.
pub fn depth_intervals(gas: &Gas, rendering: &RenderingParameters, view: &View) -> Vec<DepthInterval> {
    if gas.particles.is_empty() && rendering.sparks.rate <= 0.0 {
        return Vec::new();
    }
    let layers = GasStatistics::new(gas, rendering, view).layers(gas);
    let mut intervals: Vec<DepthInterval> = layers.intervals().collect();
    if rendering.sparks.rate > 0.0 {
        let middle = layers.center(layers.count / 2);
        let half_depth = rendering.sparks.swirl + 0.5 * layers.thickness * layers.count as f64;
        intervals.push(DepthInterval { near: (middle - half_depth).max(0.0), far: middle + half_depth });
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
        rendering: &'a RenderingParameters,
        view: &'a View,
        surroundings: &Surroundings,
        observer: &dyn Observer,
    ) -> Result<Self, Cancelled> {
        check(observer)?;
        let statistics = GasStatistics::new(&gas, rendering, view);
        let layers = statistics.layers(&gas);
        let mode = match rendering.sprite {
            SpriteStyle::Squares => DrawMode::Squares(Squares::new(&gas, rendering, view)),
            _ => splat_gas(&gas, rendering, view, &statistics, surroundings),
        };
        check(observer)?;
        let mut sparks = spark_emitter(&gas, rendering, view).streaks(view, surroundings.wind);
        sparks.sort_by(|a, b| a.depth.total_cmp(&b.depth));
        let prepared = Self {
            gas,
            rendering,
            view,
            level: bansho_base::math::simd::level(),
            layers,
            mode,
            sparks,
            haze: OnceLock::new(),
        };
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

    fn resolver<'b>(&'b self, splatted: &'b SplattedGas<'_>) -> GasResolver<'b> {
        GasResolver {
            grid: &splatted.grid,
            camera: &self.view.camera,
            origin: self.gas.particles.origin,
            detail: splatted.detail.as_ref().map(|(detail, strain)| (detail, strain)),
            self_absorption: self.rendering.sprite == SpriteStyle::LineIntegral,
            blue: chemiluminescence_color(),
            scattered: &splatted.scattered,
            weights: &splatted.weights,
            row_interpolator: &splatted.row_interpolator,
            temperatures: splatted.temperatures,
        }
    }
}

/// Splats all sprites into their depth layers.
fn splat_gas<'a>(
    gas: &Gas<'a>,
    rendering: &RenderingParameters,
    view: &View,
    statistics: &GasStatistics,
    surroundings: &Surroundings,
) -> DrawMode<'a> {
    let layers = statistics.layers(gas);
    let detail = statistics.detail_scale(gas, view).and_then(|scale| Detail::new(gas, rendering, &scale));
    let radiance = RadianceSprites {
        gas,
        rendering,
        layers: &layers,
        opacity: mean_density(gas).map_or(0.0, |density| rendering.opacity / density),
        detail: detail.as_ref(),
        seconds_since_state: view.shutter.middle() - gas.time,
    };
    let sprites = project_particles(gas, view, &radiance);
    let profile = if rendering.sprite == SpriteStyle::Poly6 { Profile::POLY6 } else { Profile::LINE };
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
    let scattered = (0..layers.count).map(|layer| scattered(gas, rendering, view, layers.center(layer), surroundings));
    DrawMode::SplattedGas(Box::new(SplattedGas {
        extents,
        weights: grid.cells.spline_weights(),
        row_interpolator: RowInterpolator::new(&grid, view.size[0], &grid.cells.spline_weights()),
        grid,
        detail,
        scattered: scattered.collect(),
        motion: if view.aovs_requested { MotionField::new(gas, rendering, view) } else { None },
        temperatures: min_max(gas.particles.temperature.iter().copied()),
    }))
}

/// Visible particles as sprites of emission and absorption.
struct RadianceSprites<'a> {
    gas: &'a Gas<'a>,
    rendering: &'a RenderingParameters,
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
        is_visible(self.gas, self.rendering, index)
    }

    #[inline(always)]
    fn record(&self, projected: &ProjectedParticle) -> Sprite<PLANES> {
        let (layer, next_layer_weight) = self.layers.layer_at(projected.depth);
        let mut values = match self.rendering.sprite {
            SpriteStyle::Poly6 => self.density_values(projected.index),
            _ => self.values(projected),
        };
        if let Some(detail) = self.detail {
            let offset = detail.detail_offset(self.gas, projected.index, self.seconds_since_state);
            for axis in 0..3 {
                values[DETAIL_OFFSET + axis] = values[TAU] * offset[axis];
            }
        }
        Sprite { ellipse: projected.ellipse, layer, next_layer_weight, values }
    }
}

impl RadianceSprites<'_> {
    /// Line integrals through the center of a particle's sprite.
    #[inline(always)]
    fn values(&self, projected: &ProjectedParticle) -> [f32; PLANES] {
        let (gas, index) = (self.gas, projected.index);
        let length = gas.volume(index) * f64::from(projected.ellipse.peak);
        let tau = length * gas.absorption(index, self.rendering);
        let mut values = self.emission_values(index, tau);
        values[BLUE] = (length * gas.blue_luminance(index, self.rendering)) as f32;
        values[PATH] = deflection::optical_path(gas, self.rendering, projected);
        values
    }

    /// The paper's sprite (section 5.2): opacity by density, color by temperature.
    #[inline(always)]
    fn density_values(&self, index: usize) -> [f32; PLANES] {
        self.emission_values(index, self.opacity * f64::from(self.gas.particles.density[index]))
    }

    /// Optical depth, and the luminance of soot of that depth.
    #[inline(always)]
    fn emission_values(&self, index: usize, tau: f64) -> [f32; PLANES] {
        let luminance = tau * self.gas.luminance(index);
        let mut values = [0.0; PLANES];
        values[TAU] = tau as f32;
        values[LUMINANCE] = luminance as f32;
        values[LUMINANCE_KELVIN] = (luminance * f64::from(self.gas.particles.temperature[index])) as f32;
        values
    }
}

fn mean_density(gas: &Gas) -> Option<f64> {
    let densities = &gas.particles.density;
    let sum: f64 = densities.iter().map(|density| f64::from(*density)).sum();
    (sum > 0.0).then(|| sum / densities.len() as f64)
}

/// Radiance that opaque soot at a depth scatters toward the camera: isotropic single scattering of other lights.
fn scattered(
    gas: &Gas,
    rendering: &RenderingParameters,
    view: &View,
    depth: f64,
    surroundings: &Surroundings,
) -> [f32; 3] {
    let toward = (gas.particles.origin - view.camera.position).normalize_or(DVec3::NEG_Z);
    let position = view.camera.position + toward * depth;
    let scale = (rendering.smoke_albedo / (4.0 * std::f64::consts::PI)) as f32;
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
            DrawMode::SplattedGas(splatted) if self.layers_in(slice).next().is_some() => splatted.grid.covered(),
            DrawMode::Squares(squares) => squares.bounds(slice),
            _ => Rect::default(),
        };
        // The gas that refracts extends beyond the gas that emits.
        let all = self.haze_for_aovs(slice).map_or(gas, |haze| gas.union(&haze.rect));
        let sparks = self.sparks.iter().filter(|spark| slice.contains(spark.depth));
        sparks.fold(all, |all, spark| all.union(&spark.bounds(self.view.size)))
    }

    fn draw(&self, slice: &DepthInterval, strip: &mut Strip) {
        let mut sparks = self.sparks.iter().filter(|spark| slice.contains(spark.depth)).peekable();
        if let DrawMode::SplattedGas(splatted) = &self.mode {
            let resolver = self.resolver(splatted);
            let mut row = resolver.row();
            let rect = splatted.grid.covered().intersection(&strip.rect);
            for layer in self.layers_in(slice) {
                while let Some(spark) = sparks.next_if(|spark| spark.depth < layer.depth) {
                    spark.draw(self.view.size, strip);
                }
                if rect.is_empty() {
                    continue;
                }
                dispatch!(self.level, _simd => resolver.draw_layer(&layer, &splatted.extents, rect, &mut row, strip));
                if !strip.aovs.is_empty() {
                    resolver.write_layer_aovs(
                        &layer,
                        &splatted.extents,
                        splatted.motion.as_ref(),
                        rect,
                        &mut row,
                        strip,
                    );
                }
            }
        }
        if let DrawMode::Squares(squares) = &self.mode {
            squares.draw(slice, strip);
        }
        if !strip.aovs.is_empty() {
            self.write_deflection_aovs(slice, strip);
        }
        sparks.for_each(|spark| spark.draw(self.view.size, strip));
    }

    fn may_refract(&self) -> bool {
        self.rendering.heat_haze_gain > 0.0 && !self.gas.particles.is_empty()
    }

    fn deflection(&self) -> Option<Deflection<'_>> {
        let haze = self.haze()?;
        let depth = self.layers.center(self.layers.count - 1) + 0.5 * self.layers.thickness;
        Some(Deflection { depth, rect: haze.rect, angle: &haze.angle })
    }
}

impl PreparedGas<'_> {
    /// The haze, computed by all threads of the pool. If AOVs are requested it is computed before strips are drawn.
    fn haze(&self) -> Option<&HeatHaze> {
        // Line integrals of the optical path are summed with those of the visible gas.
        let is_splatted = self.rendering.sprite == SpriteStyle::LineIntegral
            && self.rendering.heat_haze_model == HeatHazeModel::Refraction;
        let (splatted, whole_gas) = match &self.mode {
            DrawMode::SplattedGas(gas) if is_splatted => (Some(&gas.grid), false),
            DrawMode::OutsideWindow if is_splatted => (None, false),
            _ => (None, true),
        };
        get_or_compute(&self.haze, || HeatHaze::new(&self.gas, self.rendering, self.view, splatted, whole_gas)).as_ref()
    }

    /// The haze, if its AOVs are requested and are written in this slice, that of the last layer.
    fn haze_for_aovs(&self, slice: &DepthInterval) -> Option<&HeatHaze> {
        let is_written_here = self.view.aovs_requested && slice.contains(self.layers.center(self.layers.count - 1));
        self.haze.get().and_then(Option::as_ref).filter(|_| is_written_here)
    }

    fn write_deflection_aovs(&self, slice: &DepthInterval, strip: &mut Strip) {
        if let Some(haze) = self.haze_for_aovs(slice) {
            haze.write_aovs(strip);
        }
    }
}
