//! One prepared frame of the gas.

use std::sync::OnceLock;

use bansho_base::{
    camera::Camera,
    host::{
        observer::{Cancelled, Observer, check},
        once::get_or_compute,
    },
    image::Rect,
    math::{DVec3, simd::LANES},
    phenomenon::{
        Deflection, Prepared,
        strip::{DepthInterval, Strip, View},
        surroundings::Surroundings,
    },
    world::wind::Wind,
};
use fearless_simd::{Level, dispatch};

use super::{
    aovs::{GasMotionField, min_max},
    deflection::{self, HeatHaze},
    depth_layers::DepthLayers,
    exposed::{ExposedGas, ExposureSample},
    gas::Gas,
    gas_view::GasView,
    samples::{GasExposure, GasState, pixel_subdivision},
};
use crate::{
    chemiluminescence_color,
    particles::{
        parameters::{GasRenderingParameters, HeatHazeModel, SpriteStyle},
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
    sparks::{SparkEmitter, SparkStreak},
};

/// The gas of one frame, ready to be drawn into strips.
pub struct PreparedGas<'a> {
    gas: Gas<'a>,
    rendering: &'a GasRenderingParameters,
    view: &'a View,
    /// The whole exposure as one sample.
    gas_view: GasView,
    level: Level,
    layers: DepthLayers,
    mode: DrawMode<'a>,
    /// Radiance that opaque soot of each layer scatters toward the camera, ACEScg, cd/m^2.
    scattered: Vec<[f32; 3]>,
    /// If AOVs are requested and any gas emits light.
    motion: Option<GasMotionField<'a>>,
    sparks: Vec<SparkStreak>,
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
    /// The mean of several samples.
    Exposed(ExposedGas),
    /// The paper's density squares.
    Squares(Squares),
}

/// Sums of one sample.
struct SplattedGas<'a> {
    grid: Grid<'a>,
    extents: ColumnExtents,
    weights: Vec<[f32; 4]>,
    row_interpolator: RowInterpolator,
    detail: Option<(Detail, Strain)>,
    temperatures: [f32; 2],
    camera: Camera,
}

/// Sparks of the fire.
fn spark_emitter<'a>(gas: &Gas, rendering: &'a GasRenderingParameters, view: &View) -> SparkEmitter<'a> {
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
        sheet: None,
    }
}

/// Depth intervals of the gas and its sparks.
pub fn depth_intervals(gas: &Gas, rendering: &GasRenderingParameters, view: &View, wind: &Wind) -> Vec<DepthInterval> {
    if gas.particles.is_empty() && rendering.sparks.rate <= 0.0 {
        return Vec::new();
    }
    let layers = GasStatistics::new(gas, rendering, &GasView::new(view)).layers(gas);
    let mut intervals: Vec<DepthInterval> = layers.intervals().collect();
    intervals.extend(spark_emitter(gas, rendering, view).depths(view, wind));
    intervals
}

impl<'a> PreparedGas<'a> {
    /// Prepares the gas for `view`, from one state, whose motion is extrapolated.
    ///
    /// # Errors
    /// The observer asked to stop.
    pub fn new(
        gas: Gas<'a>,
        rendering: &'a GasRenderingParameters,
        view: &'a View,
        surroundings: &Surroundings,
        observer: &dyn Observer,
    ) -> Result<Self, Cancelled> {
        let states = vec![GasState { gas, shutter: view.shutter }];
        let exposure = GasExposure { middle: gas, states, is_short: true };
        Self::of_exposure(&exposure, rendering, view, surroundings, observer)
    }

    /// Prepares the gas for `view`, from the states that it passes through while the shutter is open.
    ///
    /// # Errors
    /// The observer asked to stop.
    pub fn of_exposure(
        exposure: &GasExposure<'a>,
        rendering: &'a GasRenderingParameters,
        view: &'a View,
        surroundings: &Surroundings,
        observer: &dyn Observer,
    ) -> Result<Self, Cancelled> {
        check(observer)?;
        let gas = exposure.middle;
        let (gas_view, level) = (GasView::new(view), bansho_base::math::simd::level());
        let statistics = GasStatistics::new(&gas, rendering, &gas_view);
        let layers = statistics.layers(&gas);
        let scattered: Vec<[f32; 3]> = (0..layers.count)
            .map(|layer| scattered(&gas, rendering, view, layers.center(layer), surroundings))
            .collect();
        let scale = statistics.picture_scale(&gas);
        let samples = exposure.samples(view, scale);
        let finer = pixel_subdivision(scale, view);
        let mode = match (rendering.sprite, samples.as_slice()) {
            (SpriteStyle::Squares, _) => DrawMode::Squares(Squares::new(&gas, rendering, &gas_view)),
            (_, [GasState { gas, .. }]) if finer == 1 => splat_gas(gas, rendering, &gas_view, &statistics, &layers),
            _ => {
                let sampled = SampledExposure { rendering, view, layers: &layers, scattered: &scattered, finer, level };
                sampled.mean(&samples, observer)?
            }
        };
        check(observer)?;
        let mut sparks = spark_emitter(&gas, rendering, view).streaks(view, surroundings.wind);
        sparks.sort_by(|a, b| a.sorting_depth.total_cmp(&b.sorting_depth));
        let motion = if view.aovs_requested && matches!(mode, DrawMode::SplattedGas(_) | DrawMode::Exposed(_)) {
            GasMotionField::new(&gas, rendering, &gas_view)
        } else {
            None
        };
        let haze = OnceLock::new();
        let prepared = Self { gas, rendering, view, gas_view, level, layers, mode, scattered, motion, sparks, haze };
        if view.aovs_requested {
            prepared.haze();
        }
        Ok(prepared)
    }

    /// The layers in a slice, nearest first.
    fn layers_in<'b>(&'b self, slice: &'b DepthInterval) -> impl Iterator<Item = DepthLayer> + 'b {
        layers_of(&self.layers).filter(|layer| slice.contains(layer.depth))
    }
}

/// All layers, nearest first.
fn layers_of(layers: &DepthLayers) -> impl Iterator<Item = DepthLayer> {
    let layers = *layers;
    (0..layers.count).map(move |index| DepthLayer { index, depth: layers.center(index), thickness: layers.thickness })
}

impl SplattedGas<'_> {
    fn resolver<'b>(
        &'b self,
        gas: &Gas,
        rendering: &GasRenderingParameters,
        scattered: &'b [[f32; 3]],
    ) -> GasResolver<'b> {
        GasResolver {
            grid: &self.grid,
            camera: &self.camera,
            origin: gas.particles.origin,
            detail: self.detail.as_ref().map(|(detail, strain)| (detail, strain)),
            self_absorption: rendering.sprite == SpriteStyle::LineIntegral,
            blue: chemiluminescence_color(),
            scattered,
            weights: &self.weights,
            row_interpolator: &self.row_interpolator,
            temperatures: self.temperatures,
        }
    }
}

/// An exposure that is the mean of several samples.
struct SampledExposure<'a> {
    rendering: &'a GasRenderingParameters,
    view: &'a View,
    layers: &'a DepthLayers,
    scattered: &'a [[f32; 3]],
    /// Pixels of a sample along the side of one of the picture's.
    finer: usize,
    level: Level,
}

impl SampledExposure<'_> {
    /// The mean of samples, weighted by the times for which they are exposed.
    fn mean<'a>(&self, samples: &[GasState<'a>], observer: &dyn Observer) -> Result<DrawMode<'a>, Cancelled> {
        let total: f64 = samples.iter().map(|sample| sample.shutter.duration()).sum();
        let layers: Vec<DepthLayer> = layers_of(self.layers).collect();
        let mut exposed = ExposedGas::new(layers.len(), self.view.aovs_requested);
        let mut is_outside_window = false;
        for GasState { gas, shutter } in samples {
            check(observer)?;
            let sample_view = GasView::sample(self.view, *shutter, self.finer);
            let statistics = GasStatistics::new(gas, self.rendering, &sample_view);
            match splat_gas(gas, self.rendering, &sample_view, &statistics, self.layers) {
                DrawMode::SplattedGas(splatted) => {
                    let sample = ExposureSample {
                        resolver: &splatted.resolver(gas, self.rendering, self.scattered),
                        extents: &splatted.extents,
                        layers: &layers,
                        rect: sample_view.in_pixels_of_view(splatted.grid.covered()).intersection(&self.view.window),
                        finer: self.finer,
                        weight: if total > 0.0 { shutter.duration() / total } else { 1.0 / samples.len() as f64 }
                            as f32,
                    };
                    exposed.add(&sample, self.level);
                }
                DrawMode::OutsideWindow => is_outside_window = true,
                _ => {}
            }
        }
        Ok(match (exposed.rect.is_empty(), is_outside_window) {
            (false, _) => DrawMode::Exposed(exposed),
            (true, true) => DrawMode::OutsideWindow,
            (true, false) => DrawMode::Empty,
        })
    }
}

/// Splats all sprites of a sample into their depth layers.
fn splat_gas<'a>(
    gas: &Gas<'a>,
    rendering: &GasRenderingParameters,
    view: &GasView,
    statistics: &GasStatistics,
    layers: &DepthLayers,
) -> DrawMode<'a> {
    let detail = statistics.detail_scale(gas, view).and_then(|scale| Detail::new(gas, rendering, &scale));
    let radiance = RadianceSprites {
        gas,
        rendering,
        layers,
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
            camera: view.camera,
        },
        &sprites,
        gas.buffers,
    ) {
        SplatResult::Sums(grid) => grid,
        SplatResult::OutsideWindow => return DrawMode::OutsideWindow,
        SplatResult::Empty => return DrawMode::Empty,
    };
    let extents = ColumnExtents::new(&grid, layers.count);
    let detail = detail.map(|detail| {
        let strain = Strain::new(&grid, &extents, layers.count, detail.cell_pixels);
        (detail, strain)
    });
    let (weights, covered) = (grid.cells.spline_weights(), grid.covered());
    let end = covered.right().next_multiple_of(LANES).min(view.size[0]);
    DrawMode::SplattedGas(Box::new(SplattedGas {
        extents,
        row_interpolator: RowInterpolator::new(&grid, covered.x..end, &weights),
        weights,
        grid,
        detail,
        temperatures: min_max(gas.particles.temperature.iter().copied()),
        camera: view.camera,
    }))
}

/// Visible particles as sprites of emission and absorption.
struct RadianceSprites<'a> {
    gas: &'a Gas<'a>,
    rendering: &'a GasRenderingParameters,
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
    rendering: &GasRenderingParameters,
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
            DrawMode::Exposed(exposed) if self.layers_in(slice).next().is_some() => exposed.rect,
            DrawMode::Squares(squares) => squares.bounds(slice),
            _ => Rect::default(),
        };
        // The gas that refracts extends beyond the gas that emits.
        let all = self.haze_for_aovs(slice).map_or(gas, |haze| gas.union(&haze.rect));
        let sparks = self.sparks.iter().filter(|spark| slice.contains(spark.sorting_depth));
        sparks.fold(all, |all, spark| all.union(&spark.bounds(self.view.size)))
    }

    fn draw(&self, slice: &DepthInterval, strip: &mut Strip) {
        let mut sparks = self.sparks.iter().filter(|spark| slice.contains(spark.sorting_depth)).peekable();
        if let DrawMode::SplattedGas(splatted) = &self.mode {
            let resolver = splatted.resolver(&self.gas, self.rendering, &self.scattered);
            let mut row = resolver.row();
            let rect = splatted.grid.covered().intersection(&strip.rect);
            for layer in self.layers_in(slice) {
                while let Some(spark) = sparks.next_if(|spark| spark.sorting_depth < layer.depth) {
                    spark.draw(self.view, strip);
                }
                if rect.is_empty() {
                    continue;
                }
                dispatch!(self.level, _simd => resolver.draw_layer(&layer, &splatted.extents, rect, &mut row, strip));
                if !strip.aovs.is_empty() {
                    resolver.write_layer_aovs(&layer, &splatted.extents, self.motion.as_ref(), rect, &mut row, strip);
                }
            }
        }
        if let DrawMode::Exposed(exposed) = &self.mode {
            for layer in self.layers_in(slice) {
                while let Some(spark) = sparks.next_if(|spark| spark.sorting_depth < layer.depth) {
                    spark.draw(self.view, strip);
                }
                exposed.draw_layer(&layer, strip);
                if !strip.aovs.is_empty() {
                    exposed.write_layer_aovs(&layer, self.motion.as_ref(), strip);
                }
            }
        }
        if let DrawMode::Squares(squares) = &self.mode {
            squares.draw(slice, strip);
        }
        if !strip.aovs.is_empty() {
            self.write_deflection_aovs(slice, strip);
        }
        sparks.for_each(|spark| spark.draw(self.view, strip));
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
        get_or_compute(&self.haze, || HeatHaze::new(&self.gas, self.rendering, &self.gas_view, splatted, whole_gas))
            .as_ref()
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
