//! Flame sheet: a small, near flame (candle, torch, hearth, campfire) as a scrolling texture on an upright rectangle.
//!
//! # Model
//! A monochrome texture scrolls upward behind a rectangle. A threshold that rises with height cuts it; then it is sharpened and colored. The
//! coordinates of the rectangle are warped so that the gas accelerates and its edges flutter. Nothing is simulated: any frame is a function
//! of time alone. Lengths are in meters, speeds of the texture in sheet heights per second, luminance in cd/m^2.
//!
//! # References
//! - T. Ohshima and S. Itahashi, "Easy representation of flame by using 2-dimensional texture" (in Japanese). Equation numbers are theirs.
//! - K. Perlin, "An image synthesizer" (1985) and "Improving noise" (2002): the gradient noise of the default texture.
//!
//! # Equations
//! | equation | what it says | function |
//! |---|---|---|
//! | (1) | `(p, q) = (u, w - s (t - t0))`: the texture scrolls upward | `animate::clock::Clock::scroll` |
//! | (2) | `T0 = T(u, w - s (t - t0))`, in [0, 1]: value of the texture | `texture::Texture::sample` |
//! | (4) | `L = 1 - (1 - V(w)) (1 - H(u))`: threshold | [`equations::threshold`] |
//! | (5) | `T1 = max(0, T0 - L)`: cut at the threshold | [`equations::above_threshold`] |
//! | (6) | `T2 = C(T1)`: sharpen | `render::color_ramp::ColorRamp::new` |
//! | (7) | `(r, g, b) = (R, G, B)(T2)`: color | `render::color_ramp::unscaled_color` |
//! | (9) | `w_p = (1 - k) sqrt(y) + k y`: rise | [`equations::rise`] |
//! | (10) | `x' = 2 abs(x - 1/2)`: distance from the axis | [`equations::axis_distance`] |
//! | (11) | `K = h + (1 - h) F((x' - A) / D)`: speed profile | [`equations::fringe_position`], [`equations::speed_profile`] |
//! | (12) | `w = w_p / K`: slowed rise | [`equations::slowed_rise`] |
//! | (13) | `x' = 2 x - 1`: (10), right of the axis | [`equations::axis_distance`] |
//! | (14) | `u = (1 + u') / 2`: right of the axis | [`equations::texture_u`] |
//! | (15) | `E = A(w) + D(w) P(w - s (t - t0))`: fluttering edge | [`equations::fluttering_edge`] |
//! | (16) | `u' = x' / E` for `x' < E`: across the flame | [`equations::across`] |
//! | (17) | `x' = 1 - 2 x`: (10), left of the axis | [`equations::axis_distance`] |
//! | (18) | `u = (1 - u') / 2`: left of the axis | [`equations::texture_u`] |
//! | (20) | sum of products of cosines: the texture of the paper | [`paper_texture`], [`PaperTexture`] |
//!
//! (3) are bounds that follow from (1). (8) and (19) do not exist in the paper.
//!
//! # Data flow
//! 1. `parameters` holds the scene's values; [`FlameSheet::new`] checks them and makes one `FlameInstance` per entry of `instances`.
//! 2. `render::curve_tables::ShapeTables` tabulates the user's curves, and `render::color_ramp::ColorRamp` sharpening and color, on first use.
//! 3. For each time sample of the exposure, `animate::clock` gives time and scroll, `animate::fluctuation` the sums of sines, and
//!    `animate::warp` the warp of the coordinates, including wind.
//! 4. `texture` gives T0 at that scroll: layers of noise (`fractal`), or the paper's sum (`paper`), filtered for the sheet's size in pixels.
//! 5. `render::projection` maps pixels to sheet coordinates for any lens; `render::curve_tables` maps those to flame coordinates.
//! 6. `render::shade` turns flame coordinates into light and opacity; `render::smoke` does so for the smoke above the flame.
//! 7. `render::draw` evaluates bands of rows and composites them into strips; `render::aovs` writes AOVs.
//! 8. `render::prepared` sorts flames, smoke and [sparks](crate::sparks) by depth; `render::emitted_light` gives point lights for other objects.

pub(crate) mod animate;
pub mod equations;
mod parameters;
pub(crate) mod render;
mod texture;

use std::sync::{Arc, OnceLock};

use bansho_base::{
    host::{
        constructions,
        observer::{Cancelled, Observer, check},
        once::get_or_make,
    },
    parameters::parameter_fault::{FaultKind, ParameterFault},
    phenomenon::{
        Phenomenon, PhenomenonInfo, Prepared, Run,
        kind::{BuildContext, BuildError, Describe},
        strip::{AovDescriptor, AovRule, DepthInterval, Shutter, View},
        surroundings::{Publication, Surroundings},
    },
};

use animate::{clock::Clock, warp::FlameWaves};
use render::{
    color_ramp::ColorRamp,
    curve_tables::{ShapeTables, instance_key},
    flame_instance::{FlameInstance, TextureSource},
};
use texture::{FractalLayers, PaperLayer};

pub use parameters::{
    ColorParameters, Coloring, Facing, FlameSheetParameters, Instance, LightParameters, ShapeParameters,
    SmokeParameters, Stage, TextureKind, TextureParameters,
};
pub use texture::{PaperTexture, paper_texture};

pub use crate::sparks::SparkParameters;

/// A flame sheet with all its instances, ready to be drawn at any time.
#[derive(Clone, Debug)]
pub struct FlameSheet {
    name: String,
    parameters: FlameSheetParameters,
    clock: Clock,
    /// Made when it is first seen: there may be thousands of sheets, each of which is made to be checked.
    tables: OnceLock<Tables>,
    flames: Vec<FlameInstance>,
}

impl FlameSheet {
    /// The flame sheet `name` of a scene; in a seamless loop it repeats every `loop_s` seconds.
    ///
    /// # Errors
    /// Parameters that do not go together; each alone is within its bounds.
    pub fn new(
        parameters: FlameSheetParameters,
        name: &str,
        seed: u64,
        loop_s: Option<f64>,
    ) -> Result<Self, ParameterFault> {
        if let Some(seconds) = loop_s.filter(|seconds| !(*seconds > 0.0 && seconds.is_finite())) {
            return Err(ParameterFault { key: "loop", kind: FaultKind::LoopLength { seconds } });
        }
        constructions::count("flame_sheet");
        let clock = Clock::new(parameters.speed.clone(), loop_s);
        ShapeTables::check(&parameters.shape)?;
        ColorRamp::check(&parameters.texture)?;
        let flames = flames(&parameters, name, seed, &clock);
        Ok(Self { name: name.to_owned(), parameters, clock, tables: OnceLock::new(), flames })
    }

    /// Its parameters.
    pub fn parameters(&self) -> &FlameSheetParameters {
        &self.parameters
    }

    fn tables(&self) -> &Tables {
        let FlameSheetParameters { shape, texture, colour, stage, .. } = &self.parameters;
        let make = || Tables {
            shape: Box::new(ShapeTables::new(shape, texture, colour)),
            ramp: Box::new(ColorRamp::new(texture, colour, *stage)),
        };
        get_or_make(&self.tables, make)
    }

    /// What of the chain does not change with time.
    pub(crate) fn shape(&self) -> &ShapeTables {
        &self.tables().shape
    }

    /// From gas to light.
    pub(crate) fn ramp(&self) -> &ColorRamp {
        &self.tables().ramp
    }
}

/// What a sheet is drawn with, and depends on its parameters alone.
#[derive(Clone, Debug)]
struct Tables {
    shape: Box<ShapeTables>,
    ramp: Box<ColorRamp>,
}

fn flames(parameters: &FlameSheetParameters, name: &str, seed: u64, clock: &Clock) -> Vec<FlameInstance> {
    let texture = &parameters.texture;
    let paper = (texture.kind == TextureKind::OhshimaItahashi)
        .then(|| Arc::new(PaperLayer::new(texture.octaves as u32, clock)));
    let placements =
        if parameters.instances.is_empty() { vec![Instance::default()] } else { parameters.instances.clone() };
    let flame = |(index, placement): (usize, Instance)| {
        let key = instance_key(seed, name, parameters.variation, index);
        let texture_source = match &paper {
            Some(layer) => TextureSource::Paper(layer.clone()),
            None => TextureSource::Fractal(FractalLayers::new(tongue_size(parameters), 1.0, key, clock)),
        };
        FlameInstance { placement, key, waves: FlameWaves::new(&parameters.shape, key, clock), texture_source }
    };
    placements.into_iter().enumerate().map(flame).collect()
}

/// Size of the fractal's tongues in sheet widths and heights, beside the usual: they keep their form on a sheet of any aspect.
fn tongue_size(parameters: &FlameSheetParameters) -> [f64; 2] {
    /// Width over height of the sheet for which the usual size is meant.
    const USUAL: f64 = 0.65;
    let aspect = parameters.width / parameters.height / USUAL;
    [parameters.texture.tongue_width / aspect.clamp(0.05, 20.0), parameters.texture.tongue_length]
}

/// What a flame sheet can write beside its light, in the order of a strip's planes.
const AOVS: &[AovDescriptor] = &[
    AovDescriptor {
        name: "temperature_k",
        unit: "K",
        doc: "Soot temperature, weighted by the luminance that it adds; 0 where there is no flame.",
        rule: AovRule::WeightedMean,
    },
    AovDescriptor {
        name: "optical_depth",
        unit: "",
        doc: "Optical depth of soot and smoke along the line of sight, summed; 0 where there is none.",
        rule: AovRule::Sum,
    },
    AovDescriptor {
        name: "motion.X",
        unit: "pixels",
        doc: "Motion of the gas to the next frame, to the right, weighted by luminance; 0 where there is no flame.",
        rule: AovRule::WeightedMean,
    },
    AovDescriptor {
        name: "motion.Y",
        unit: "pixels",
        doc: "Motion of the gas to the next frame, downward, weighted by luminance; 0 where there is no flame.",
        rule: AovRule::WeightedMean,
    },
];

impl Describe for FlameSheetParameters {
    const KEY: &'static str = "flame_sheet";
    const PLACEMENT_KEYS: &'static [&'static str] = &["position", "width", "height"];
    // From where the flame nearly fills the height of the picture.
    const SETTING: &'static str = "camera = { position = [0.0, 0.76, 2.75], target = [0.0, 0.76, 0.0] }\n";
    const FIRST_KEYS: &'static [&'static str] = &[
        "position",
        "width",
        "height",
        "speed",
        "variation",
        "texture.contrast",
        "colour.luminance",
        "colour.core_temperature_k",
        "sparks.rate",
        "smoke.optical_depth",
    ];

    fn build(&self, context: &BuildContext) -> Result<Arc<dyn Phenomenon>, BuildError> {
        match FlameSheet::new(self.clone(), context.name, context.seed, context.loop_s) {
            Ok(sheet) => Ok(Arc::new(sheet)),
            Err(fault) => Err(BuildError::new(fault.key, fault.kind)),
        }
    }
}

impl Phenomenon for FlameSheet {
    fn info(&self) -> PhenomenonInfo<'_> {
        PhenomenonInfo { aovs: AOVS, ..PhenomenonInfo::new(&self.name) }
    }

    fn luminance(&self) -> f64 {
        /// Bright parts beside the very brightest: most of a flame is far dimmer than its hottest soot.
        const BRIGHT: f64 = 0.28;
        BRIGHT * self.parameters.colour.luminance.bounds()[1]
    }

    fn start(self: Arc<Self>) -> Box<dyn Run> {
        Box::new(self)
    }
}

impl Run for FlameSheet {
    fn publish(&self, shutter: Shutter) -> Publication {
        let lights = self.flames.iter().flat_map(|flame| self.point_lights(flame, shutter)).collect();
        Publication { lights, ..Publication::default() }
    }

    fn depth_intervals(&self, view: &View, _surroundings: &Surroundings) -> Vec<DepthInterval> {
        self.flames.iter().map(|flame| self.depth_interval(flame, view)).collect()
    }

    fn prepare<'a>(
        &'a self,
        view: &'a View,
        surroundings: &'a Surroundings<'a>,
        observer: &dyn Observer,
    ) -> Result<Box<dyn Prepared + 'a>, Cancelled> {
        check(observer)?;
        Ok(Box::new(render::prepared::PreparedSheet::new(self, view, surroundings, observer)?))
    }
}

#[cfg(test)]
mod tests;
