//! What a shot draws from: the compiled scene, the plan, and what follows from both.

use std::sync::{Arc, OnceLock};

use bansho_base::{
    frame::FrameHeader,
    host::once::get_or_compute,
    world::sky::{ElevationProfile, Sky},
};

use crate::{compiled::CompiledScene, composite::plate_light, fingerprint, plan::Plan};
use bansho_scene::Scene;

/// A compiled scene under a plan.
pub(crate) struct ShotContext {
    pub(crate) compiled: Arc<CompiledScene>,
    pub(crate) plan: Arc<Plan>,
    /// The light that the plate shows, beside its display white; measured when it is first asked for.
    plate_light: OnceLock<Option<ElevationProfile>>,
}

impl ShotContext {
    pub(crate) fn new(compiled: Arc<CompiledScene>, plan: Arc<Plan>) -> Self {
        Self { compiled, plan, plate_light: OnceLock::new() }
    }

    pub(crate) fn scene(&self) -> &Scene {
        &self.plan.scene
    }

    /// The light of the sky at time `t`: the scene's own, or where there is a plate in its place what that plate shows, which is as bright
    /// as the plate looks at the shot's exposure.
    pub(crate) fn sky(&self, t: f64) -> Sky {
        if let Some(sky) = &self.scene().sky {
            return sky.at(t);
        }
        let light = get_or_compute(&self.plate_light, || plate_light(self));
        light.map_or(Sky::DARK, |light| Sky::measured(light.scaled(1.0 / self.plan.exposure_scale())))
    }

    /// The header of frame `number`.
    pub(crate) fn header(&self, number: i64) -> FrameHeader {
        self.plan.header(number, fingerprint::of_frame(&self.compiled, &self.plan, number))
    }
}
