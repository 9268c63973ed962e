//! A shot that goes on with another scene or plan: which state stays, and how the wind continues.

use std::sync::Arc;

use bansho_base::{
    math::DVec3,
    world::wind::{Wind, WindParameters},
};

use super::Shot;
use crate::{
    compiled::{ActiveRun, BuiltPhenomenon, CompiledScene},
    composite::plate_cache::PlateCache,
    context::ShotContext,
    plan::Plan,
};
use bansho_scene::Scene;

/// Duration over which a wind that was edited takes the place of the one before, s.
const WIND_TRANSITION_S: f64 = 0.25;

impl Shot {
    /// Continues with another scene or plan, as an editor does during playback. Simulations keep their state where the edited phenomenon can
    /// restore it; the others restart.
    pub fn replan(&mut self, compiled: Arc<CompiledScene>, plan: Arc<Plan>) {
        let is_same_scene = self.context.compiled.state_fingerprint() == compiled.state_fingerprint();
        self.continue_with(compiled, plan, is_same_scene);
    }

    /// Continues with a scene of which a program has changed parameters, as [`replan`](Self::replan) does, but compares nothing but what was built.
    pub fn replace_scene(&mut self, compiled: Arc<CompiledScene>) {
        let plan = Arc::new(self.context.plan.of_scene(compiled.scene().clone()));
        self.continue_with(compiled, plan, false);
    }

    /// Continues with another plan of the same scene, such as one with another camera. Nothing is compared.
    pub fn replace_plan(&mut self, plan: Arc<Plan>) {
        let wind = self.context.wind.clone();
        self.context = ShotContext::new(self.context.compiled.clone(), plan);
        self.context.wind = wind;
    }

    fn continue_with(&mut self, compiled: Arc<CompiledScene>, plan: Arc<Plan>, is_same_scene: bool) {
        let mut old: Vec<Option<ActiveRun>> = std::mem::take(&mut self.runs).into_iter().map(Some).collect();
        let kept: Vec<Option<ActiveRun>> =
            compiled.enabled().iter().map(|built| take_equal_run(&mut old, built)).collect();
        let loop_s = compiled.scene().loop_s;
        for (built, kept) in compiled.enabled().iter().zip(kept) {
            self.runs.push(match kept {
                Some(run) => run,
                None => restored_from_namesake(&old, ActiveRun::start(built, loop_s)),
            });
        }
        let has_stepped = self.runs.iter().any(|run| run.steps_taken > 0);
        self.has_earlier_state = has_stepped && (self.has_earlier_state || !is_same_scene);
        let former_scene = &self.context.plan.scene;
        if former_scene.plate != plan.scene.plate || ground_height(former_scene) != ground_height(&plan.scene) {
            self.plates = PlateCache::default();
        }
        let wind = self.wind_after_edit(&compiled);
        self.has_earlier_state |= !wind.is_planned();
        self.context = ShotContext::new(compiled, plan);
        self.context.wind = wind;
    }

    /// The wind with which the shot continues in another scene: a changed wind blows from now on, as if it had been changed live, so that nothing jumps.
    fn wind_after_edit(&self, compiled: &CompiledScene) -> Wind {
        let (old, new) = (self.context.compiled.scene(), compiled.scene());
        let is_same_wind =
            WindParameters { velocity: new.wind.velocity.clone(), gust: new.wind.gust, ..old.wind.clone() } == new.wind;
        if old.loop_s.is_some() || new.loop_s.is_some() {
            return compiled.wind().clone();
        }
        let mut wind = if old.seed == new.seed && is_same_wind {
            self.context.wind.clone()
        } else {
            let mut reseeded = compiled.wind().clone();
            reseeded.take_changes(&self.context.wind);
            reseeded
        };
        if (&old.wind.velocity, old.wind.gust) != (&new.wind.velocity, new.wind.gust) {
            let close = self.context.plan.shutter_at(self.time).close;
            let velocity = DVec3::from(new.wind.velocity.at(close));
            if wind.change(close, velocity, new.wind.gust, WIND_TRANSITION_S).is_err() {
                return compiled.wind().clone();
            }
        }
        wind
    }
}

/// Height of the level ground of a scene at time 0, m.
fn ground_height(scene: &Scene) -> Option<f64> {
    scene.tables.level_ground(0.0).map(|ground| ground.height)
}

/// Takes the run of an equal phenomenon, one with the same fingerprint, out of `old`.
fn take_equal_run(old: &mut [Option<ActiveRun>], built: &BuiltPhenomenon) -> Option<ActiveRun> {
    for run in old {
        if let Some(equal) = run.take_if(|run| run.built.fingerprint == built.fingerprint) {
            return Some(ActiveRun { built: built.clone(), ..equal });
        }
    }
    None
}

/// `run`, which is in its initial state, with the state of the run in `old` whose phenomenon has the same name, at the same time. Unchanged
/// where it cannot restore that state.
fn restored_from_namesake(old: &[Option<ActiveRun>], mut run: ActiveRun) -> ActiveRun {
    let namesake = old.iter().flatten().find(|old| old.info().name == run.info().name);
    let steps = namesake.and_then(|old| run.stepping?.steps_for(&old.stepping?, old.steps_taken));
    if let (Some(steps), Some(state)) = (steps, namesake.and_then(|old| old.as_stepped()).map(|old| old.snapshot()))
        && run.run.as_stepped_mut().is_some_and(|stepped| stepped.restore(&state).is_ok())
    {
        run.steps_taken = steps;
    }
    run
}
