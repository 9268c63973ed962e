//! A flame sheet: what is built once from its parameters.

use std::sync::{Arc, OnceLock};

use bansho_base::{
    host::{constructions, once::get_or_compute},
    parameters::parameter_error::{ParameterError, ParameterErrorKind},
};

use super::{
    FlameSheetParameters, Instance, TextureKind,
    animate::{clock::Clock, warp::FlameWaves},
    render::{
        color_ramp::ColorRamp,
        curve_tables::{ShapeTables, instance_key},
        flame_instance::{FlameInstance, TextureSource},
    },
    texture::{FractalLayers, PaperLayer},
};

/// A flame sheet with all its instances, ready to be drawn at any time.
#[derive(Clone, Debug)]
pub struct FlameSheet {
    pub(super) name: String,
    pub(super) parameters: FlameSheetParameters,
    pub(super) clock: Clock,
    /// Made when it is first seen: there may be thousands of sheets, each of which is made to be checked.
    pub(super) tables: OnceLock<Tables>,
    pub(super) flames: Vec<FlameInstance>,
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
    ) -> Result<Self, ParameterError> {
        if let Some(seconds) = loop_s.filter(|seconds| !(*seconds > 0.0 && seconds.is_finite())) {
            return Err(ParameterError { key: "loop", kind: ParameterErrorKind::LoopLength { seconds } });
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

    pub(super) fn tables(&self) -> &Tables {
        let FlameSheetParameters { shape, texture, color, stage, .. } = &self.parameters;
        let make = || Tables {
            shape: Box::new(ShapeTables::new(shape, texture, color)),
            ramp: Box::new(ColorRamp::new(texture, color, *stage)),
        };
        get_or_compute(&self.tables, make)
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
pub(super) struct Tables {
    pub(super) shape: Box<ShapeTables>,
    pub(super) ramp: Box<ColorRamp>,
}

pub(super) fn flames(parameters: &FlameSheetParameters, name: &str, seed: u64, clock: &Clock) -> Vec<FlameInstance> {
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
pub(super) fn tongue_size(parameters: &FlameSheetParameters) -> [f64; 2] {
    /// Width over height of the sheet for which the usual size is meant.
    const USUAL: f64 = 0.65;
    let aspect = parameters.width / parameters.height / USUAL;
    [parameters.texture.tongue_width / aspect.clamp(0.05, 20.0), parameters.texture.tongue_length]
}
