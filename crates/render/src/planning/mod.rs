//! From a compiled scene to a plan: automatic exposure and the start of a loop are measured here. [`Plan`] itself is plain data.

pub(crate) mod exposure;
pub(crate) mod loop_start;

use std::sync::Arc;

use crate::{
    compiled::CompiledScene,
    plan::{Plan, PlanError, PlanOptions},
};

impl Plan {
    /// Plans a shot of `compiled`. Where the scene states no exposure, it is chosen from the luminances in the scene; the start of a loop is
    /// searched for.
    ///
    /// # Errors
    /// The options do not fit the scene.
    pub fn new(compiled: &Arc<CompiledScene>, options: &PlanOptions) -> Result<Self, PlanError> {
        let mut plan = Self::with_exposure_and_loop_start(compiled.scene().clone(), options, 0.0, 0)?;
        plan.exposure_ev100 = exposure::choose(compiled, &plan);
        plan.loop_start = loop_start::search(compiled, &plan);
        Ok(plan)
    }
}
