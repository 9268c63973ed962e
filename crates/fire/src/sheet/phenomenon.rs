//! `impl Phenomenon` for the flame sheet.

use std::{any::Any, sync::Arc};

use bansho_base::{
    host::observer::{Cancelled, Observer, check},
    parameters::{BuildError, Parameter},
    phenomenon::{
        Phenomenon, PhenomenonInfo, Prepared, Run,
        editor_hints::{EditorHints, PositionHandles, StageView},
        kind::{BuildContext, Describe},
        strip::{DepthInterval, Shutter, View},
        surroundings::{Publication, Surroundings},
    },
};

use super::{FlameSheetParameters, Stage, model::FlameSheet, render, render::aovs::AOVS};

impl Describe for FlameSheetParameters {
    const KEY: &'static str = "flame_sheet";
    const PLACEMENT_KEYS: &'static [&'static str] = &["position", "width", "height"];
    // The flame nearly fills the height of the picture.
    const SCENE_DEFAULTS: &'static str = "camera = { position = [0.0, 0.76, 2.75], target = [0.0, 0.76, 0.0] }\n";
    const FIRST_KEYS: &'static [&'static str] = &[
        "position",
        "width",
        "height",
        "speed",
        "variation",
        "texture.contrast",
        "color.luminance",
        "color.core_temperature_k",
        "sparks.rate",
        "smoke.optical_depth",
    ];
    const EDITOR_HINTS: EditorHints = EditorHints {
        position_handles: Some(PositionHandles { key: "position", items: Some("instances") }),
        stage_key: Some("stage"),
        ..EditorHints::NONE
    };

    fn stage_view(&self) -> Option<StageView> {
        // Before colors are assigned, gray levels are fractions of the highest luminance.
        let highest = self.color.luminance.bounds()[1].max(f64::MIN_POSITIVE);
        let is_gray = !matches!(self.stage, Stage::Colored | Stage::Flame);
        Some(StageView { size_m: [self.width, self.height], white_luminance: is_gray.then_some(highest) })
    }

    /// The speed is a function of each flame's own time. The key is at the latest of these, so that no texture has passed it already.
    fn continue_live(&mut self, before: &Self, t: f64, transition_s: f64) {
        let mut speed = self.speed.clone();
        self.continue_from(before, t, transition_s);
        let ahead = self.instances.iter().map(|instance| instance.phase_s).reduce(f64::max).unwrap_or(0.0);
        speed.continue_after(&before.speed, t + self.phase_s + ahead, transition_s);
        self.speed = speed;
    }

    fn with_flow(&self, flow: f64) -> Option<Self> {
        Some(Self { flow: flow.into(), ..self.clone() })
    }

    fn with_position(&self, position: [f64; 3]) -> Option<Self> {
        Some(Self { position: position.into(), ..self.clone() })
    }

    fn build(&self, context: &BuildContext) -> Result<Arc<dyn Phenomenon>, BuildError> {
        match FlameSheet::new(self.clone(), context.name, context.seed, context.loop_s) {
            Ok(mut sheet) => {
                if let Some(previous) = context.previous.and_then(|previous| previous.as_any()?.downcast_ref()) {
                    sheet.share_tables(previous);
                }
                Ok(Arc::new(sheet))
            }
            Err(error) => Err(BuildError::new(error.key, error.kind)),
        }
    }
}

impl Phenomenon for FlameSheet {
    fn info(&self) -> PhenomenonInfo<'_> {
        PhenomenonInfo { aovs: AOVS, ..PhenomenonInfo::new(&self.name) }
    }

    fn luminance(&self) -> f64 {
        /// Luminance of the bright parts relative to the maximum: most of a flame is far dimmer than its hottest soot.
        const BRIGHT_PARTS: f64 = 0.28;
        BRIGHT_PARTS * self.parameters.color.luminance.bounds()[1]
    }

    fn as_any(&self) -> Option<&dyn Any> {
        Some(self)
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
