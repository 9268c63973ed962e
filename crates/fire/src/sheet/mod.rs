//! The flame sheet: a small, near flame from a scrolling two-dimensional texture.
//!
//! T. Ohshima and S. Itahashi, "Easy representation of flame by using 2-dimensional texture". A monochrome texture scrolls up
//! behind an upright rectangle; it is cut by a threshold that rises with height, sharpened and coloured, and the rectangle's
//! coordinates are warped so that the gas accelerates and its edges flutter. Nothing is simulated: any moment is a function of
//! time alone. [`equations`] holds the paper's equations one by one; the rest turns them into pictures quickly.

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

use animate::{clock::Clock, moment::Motion};
use render::{
    flame::{Flame, Source},
    ramp::Ramp,
    shape_tables::{Shape, instance_key},
};
use texture::{FractalLayers, PaperLayer};

pub use parameters::{
    ColourParameters, Colouring, Facing, FlameSheetParameters, Instance, LightParameters, ShapeParameters,
    SmokeParameters, StageShown, TextureKind, TextureParameters,
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
    flames: Vec<Flame>,
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
        Shape::check(&parameters.shape)?;
        Ramp::check(&parameters.texture)?;
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
            shape: Box::new(Shape::new(shape, texture, colour)),
            ramp: Box::new(Ramp::new(texture, colour, *stage)),
        };
        get_or_make(&self.tables, make)
    }

    /// What of the chain does not change with time.
    pub(crate) fn shape(&self) -> &Shape {
        &self.tables().shape
    }

    /// From gas to light.
    pub(crate) fn ramp(&self) -> &Ramp {
        &self.tables().ramp
    }
}

/// What a sheet is drawn with, and depends on its parameters alone.
#[derive(Clone, Debug)]
struct Tables {
    shape: Box<Shape>,
    ramp: Box<Ramp>,
}

fn flames(parameters: &FlameSheetParameters, name: &str, seed: u64, clock: &Clock) -> Vec<Flame> {
    let texture = &parameters.texture;
    let paper = (texture.kind == TextureKind::OhshimaItahashi)
        .then(|| Arc::new(PaperLayer::new(texture.octaves as u32, clock)));
    let places = if parameters.instances.is_empty() { vec![Instance::default()] } else { parameters.instances.clone() };
    let flame = |(index, place): (usize, Instance)| {
        let key = instance_key(seed, name, parameters.variation, index);
        let source = match &paper {
            Some(layer) => Source::Paper(layer.clone()),
            None => Source::Fractal(FractalLayers::new(tongues(parameters), 1.0, key, clock)),
        };
        Flame { place, key, motion: Motion::new(&parameters.shape, key, clock), source }
    };
    places.into_iter().enumerate().map(flame).collect()
}

/// Size of the fractal's tongues in sheet widths and heights, beside the usual: they keep their form on a sheet of any aspect.
fn tongues(parameters: &FlameSheetParameters) -> [f64; 2] {
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
