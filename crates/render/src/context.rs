//! What a shot draws from: the compiled scene, the plan, and values that follow from both.

use std::sync::{Arc, OnceLock};

use bansho_base::{
    frame::FrameHeader,
    host::once::get_or_compute,
    world::{
        sky::{ElevationProfile, Sky},
        wind::Wind,
    },
};

use crate::{compiled::CompiledScene, composite::plate_light, plan::Plan};
use bansho_scene::Scene;

/// A compiled scene with the plan of a shot.
pub(crate) struct ShotContext {
    pub(crate) compiled: Arc<CompiledScene>,
    pub(crate) plan: Arc<Plan>,
    /// The wind of the scene, with its changes during the shot.
    pub(crate) wind: Wind,
    /// The light that the plate shows, relative to display white; computed on first use.
    plate_light: OnceLock<Option<ElevationProfile>>,
}

impl ShotContext {
    pub(crate) fn new(compiled: Arc<CompiledScene>, plan: Arc<Plan>) -> Self {
        Self { wind: compiled.wind().clone(), compiled, plan, plate_light: OnceLock::new() }
    }

    pub(crate) fn scene(&self) -> &Scene {
        &self.plan.scene
    }

    /// The light of the sky at time `t`: the scene's own sky; without one, the light that the plate shows, which is as bright as the plate
    /// looks at the shot's exposure.
    pub(crate) fn sky(&self, t: f64) -> Sky {
        if let Some(stated) = self.scene().tables.sky(t) {
            return stated.sky;
        }
        let light = get_or_compute(&self.plate_light, || plate_light(&self.compiled, &self.plan));
        light.map_or(Sky::DARK, |light| Sky::measured(light.scaled(1.0 / self.plan.exposure_scale())))
    }

    /// The header of frame `number`, which begins at time `t`.
    pub(crate) fn header(&self, number: i64, t: f64) -> FrameHeader {
        let fingerprint = if self.plan.fingerprint_frames {
            self.plan.frame_fingerprint(number, self.compiled.assets().as_ref())
        } else {
            [0; 32]
        };
        self.plan.header_at(number, t, fingerprint)
    }
}
