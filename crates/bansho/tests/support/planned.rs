//! A parsed, compiled and planned scene, for tests of pictures.

#![allow(dead_code, reason = "each test file uses a part of it")]

use std::{ops::Deref, sync::Arc};

use bansho_base::{host::assets::Assets, phenomenon::Remark};
use bansho_render::{CompiledScene, Plan, PlanOptions, Shot};
use bansho_scene::{Scene, SceneOptions};

#[derive(Clone)]
pub(crate) struct Planned {
    pub(crate) compiled: Arc<CompiledScene>,
    pub(crate) plan: Arc<Plan>,
}

impl Deref for Planned {
    type Target = Plan;

    fn deref(&self) -> &Plan {
        &self.plan
    }
}

impl Planned {
    /// # Errors
    /// What a job would refuse it for.
    pub(crate) fn of(
        scene: Scene,
        (adapted, options): (&SceneOptions, &PlanOptions),
        assets: Arc<dyn Assets>,
    ) -> Result<Self, String> {
        let scene = scene.with_options(adapted).map_err(|error| error.to_string())?;
        let compiled = CompiledScene::build(Arc::new(scene), assets, None);
        let compiled = Arc::new(compiled.map_err(|errors| errors.located("test.toml", "").to_string())?);
        let plan = Arc::new(Plan::new(&compiled, options).map_err(|error| error.to_string())?);
        Ok(Self { compiled, plan })
    }

    pub(crate) fn new(scene: Scene, options: &PlanOptions, assets: Arc<dyn Assets>) -> Self {
        Self::of(scene, (&SceneOptions::default(), options), assets).unwrap_or_else(|error| panic!("{error}"))
    }

    pub(crate) fn open(&self) -> Shot {
        Shot::open(self.compiled.clone(), self.plan.clone())
    }

    pub(crate) fn remarks(&self) -> Vec<(String, Remark)> {
        bansho_render::remarks::remarks(&self.compiled, &self.plan)
    }
}
