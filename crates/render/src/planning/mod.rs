//! From a compiled scene to a plan: automatic exposure and the start of a loop are measured here. [`Plan`] itself is plain data.

pub(crate) mod exposure;
pub(crate) mod loop_start;

use std::sync::Arc;

use bansho_base::host::observer::{Observer, Unobserved};

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
        Self::observed(compiled, options, &Unobserved)
    }

    /// As [`new`](Self::new), and asks `observer` whether to stop while the start of a loop is searched for. The plan of work that was stopped has a loop that
    /// begins anywhere, and is of no use.
    ///
    /// # Errors
    /// The options do not fit the scene.
    pub fn observed(
        compiled: &Arc<CompiledScene>,
        options: &PlanOptions,
        observer: &dyn Observer,
    ) -> Result<Self, PlanError> {
        let mut plan = Self::with_exposure_and_loop_start(compiled.scene().clone(), options, 0.0, 0)?;
        plan.exposure_ev100 = exposure::choose(compiled, &plan);
        plan.loop_start = loop_start::search(compiled, &plan, observer);
        Ok(plan)
    }
}
