//! Changes of an effect while it runs. Wind and values that can be keyframed do not jump: they get a key at the current time, and reach the new value within
//! a moment.

use std::sync::Arc;

use bansho_base::{
    camera::CameraParameters,
    color::MAX_EV100,
    image::Rect,
    math::DVec3,
    parameters::{Auto, Parameter, Parameters, Range, Reader},
    tables::PhenomenonTable,
    world::wind::WindParameters,
};
use bansho_environment::lamps::LightParameters;
use bansho_render::CompiledScene;
use bansho_scene::{Instance, ParameterProblems, Scene};

use super::{EffectError, LiveEffect};

/// Names of the quantities of [`PhenomenonTable::with_quantity`] that have calls of their own; flames have both.
const GAS_FLOW: &str = "gas flow";
const POSITION: &str = "position";

/// Duration in which wind and keyframed parameters reach a new value, s.
const TRANSITION_S: f64 = 0.25;
/// Duration in which a flame is lit or goes out, s.
const IGNITION_S: f64 = 0.5;

impl LiveEffect {
    /// Sets the mean wind, m/s (x to the right, y up, z toward the viewer of a camera that is not rotated), and its turbulence intensity: the standard
    /// deviation of the speed divided by the mean speed. It takes 0.25 s to reach them. May be called every frame: gusts, sparks, drops and waves go on
    /// from where they are. A wind that changes in every frame is followed with a lag of about 0.25 s.
    ///
    /// # Errors
    /// A component beyond 100 m/s, an intensity that is not within 0 to 2, or NaN: the last wind stays. The effect is a seamless loop.
    pub fn set_wind(&mut self, velocity: impl Into<[f64; 3]>, gust: f64) -> Result<(), EffectError> {
        let velocity = velocity.into();
        let mut reader = Reader::new();
        let parameters = WindParameters { velocity: velocity.into(), gust, ..WindParameters::default() };
        reader.within("wind", |reader| parameters.check_values(reader));
        checked(reader)?;
        self.shot.change_wind(DVec3::from(velocity), gust, TRANSITION_S)?;
        Ok(())
    }

    /// Sets the camera, from the next picture on: all of its parameters, the exposure time too. Begin with those of [`camera`](Self::camera).
    ///
    /// # Errors
    /// A value that is out of range or not finite.
    pub fn set_camera(&mut self, camera: CameraParameters) -> Result<(), EffectError> {
        let mut reader = Reader::new();
        reader.within("camera", |reader| camera.check_values(reader));
        checked(reader)?;
        self.recycle();
        let mut plan = self.shot.plan().clone();
        Arc::make_mut(&mut plan).camera = camera;
        self.shot.replace_plan(plan);
        Ok(())
    }

    /// Sets the exposure value at ISO 100, from the next picture on.
    ///
    /// # Errors
    /// It is not a number within -40 to 40.
    pub fn set_exposure_ev100(&mut self, exposure_ev100: f64) -> Result<(), EffectError> {
        let mut reader = Reader::new();
        let limits = Range::new(-MAX_EV100, MAX_EV100);
        reader.within("exposure_ev100", |reader| {
            Parameter::check(&exposure_ev100, &limits, "EV", reader);
        });
        checked(reader)?;
        self.recycle();
        let mut plan = self.shot.plan().clone();
        Arc::make_mut(&mut plan).exposure_ev100 = exposure_ev100 as f32;
        self.shot.replace_plan(plan);
        Ok(())
    }

    /// Sets width and height of the picture, pixels, from the next picture on.
    ///
    /// # Errors
    /// A size that is not possible; the last one stays.
    pub fn set_size(&mut self, width: usize, height: usize) -> Result<(), EffectError> {
        let crop = Rect::from_size(width, height);
        let plan = self.shot.plan().cropped([width, height], crop)?;
        self.recycle();
        self.shot.replace_plan(Arc::new(plan));
        Ok(())
    }

    /// Sets the lamps of the scene, which replace all others. May be called every frame.
    ///
    /// # Errors
    /// As for [`change_scene`](Self::change_scene).
    pub fn set_lights(&mut self, lights: Vec<LightParameters>) -> Result<(), EffectError> {
        if self.scene().tables.all::<LightParameters>().eq(&lights) {
            return Ok(());
        }
        self.change_scene(|scene| scene.tables.set_all(lights))
    }

    /// Changes what surrounds the phenomena: lights, sky, ground, air, obstacles, camera. What is equal is not built again, and simulations keep their state
    /// where they can; those that are new, or whose state is of no use any more, are simulated up to the current time. Wind and the parameters of
    /// phenomena jump here; they have calls of their own. The size stays: see [`set_size`](Self::set_size).
    ///
    /// # Errors
    /// Values that are out of range, not finite or contradict each other; assets that cannot be read. The effect is then unchanged.
    pub fn change_scene(&mut self, change: impl FnOnce(&mut Scene)) -> Result<(), EffectError> {
        let before = self.scene().clone();
        let mut scene = Scene::clone(&before);
        change(&mut scene);
        if scene.loop_s != before.loop_s {
            return Err(EffectError::FixedLoop);
        }
        scene.check()?;
        let compiled = self.shot.compiled();
        let assets = compiled.assets().clone();
        let compiled = self.pool.run(|| CompiledScene::build(Arc::new(scene), assets, Some(compiled)))?;
        let scene = compiled.scene().clone();
        self.targets.retain(|name, _| {
            let [before, after] = [&before, &scene].map(|scene| parameters_of(scene, name));
            before.zip(after).is_some_and(|(before, after)| Arc::ptr_eq(before, after))
        });
        self.replace_scene(compiled)?;
        let mut plan = self.shot.plan().clone();
        if scene.camera != before.camera {
            Arc::make_mut(&mut plan).camera = scene.camera.clone();
        }
        if let Auto::Set(exposure_ev100) = scene.picture.exposure_ev100
            && scene.picture.exposure_ev100 != before.picture.exposure_ev100
        {
            Arc::make_mut(&mut plan).exposure_ev100 = exposure_ev100 as f32;
        }
        self.shot.replace_plan(plan);
        Ok(())
    }

    /// The parameters of the phenomenon `name` that were set last; `None` if there is none of that name and kind.
    pub fn parameters<P: PhenomenonTable>(&self, name: &str) -> Option<&P> {
        let (_, instance) = self.instance(name).ok()?;
        self.target(instance).as_any().downcast_ref()
    }

    /// Sets the parameters of the phenomenon `name`: begin with those of [`parameters`](Self::parameters), since defaults would light a flame that is out. Only
    /// that phenomenon is rebuilt, and its tables that do not depend on the change are reused. A simulation keeps its state, unless its time step or the number
    /// of its burners changes; then it is simulated anew, up to the current time. Values that can be keyframed reach the new value within
    /// 0.25 s, others, and all in a seamless loop, change at once. Does nothing if the parameters are the same.
    ///
    /// # Errors
    /// There is no phenomenon of that name and kind, a value is out of range or not finite, values contradict each other. The effect is then
    /// unchanged.
    pub fn set_parameters<P: PhenomenonTable>(&mut self, name: &str, parameters: P) -> Result<(), EffectError> {
        let (index, instance) = self.instance(name)?;
        if instance.parameters.as_any().downcast_ref::<P>().is_none() {
            let found = instance.kind.key;
            return Err(EffectError::OtherKind { name: name.to_owned(), found, given: parameters.kind().key });
        }
        let changed = instance.with_parameters(parameters)?;
        self.replace(index, changed.parameters, TRANSITION_S)
    }

    /// Lights the flame `name`, which grows to full gas flow within half a second; of a particle flame, all burners.
    ///
    /// # Errors
    /// There is no phenomenon of that name, or it does not burn.
    pub fn ignite(&mut self, name: &str) -> Result<(), EffectError> {
        self.set_flow(name, 1.0)
    }

    /// Puts the flame `name` out, within half a second; gas that burns already burns out.
    ///
    /// # Errors
    /// There is no phenomenon of that name, or it does not burn.
    pub fn extinguish(&mut self, name: &str) -> Result<(), EffectError> {
        self.set_flow(name, 0.0)
    }

    /// Sets the gas flow of the flame `name` as a fraction of full flow.
    ///
    /// # Errors
    /// There is no phenomenon of that name, it does not burn, or the flow is not within 0 to 1.
    pub fn set_flow(&mut self, name: &str, flow: f64) -> Result<(), EffectError> {
        let mut reader = Reader::new();
        let limits = Range::new(0.0, 1.0);
        reader.within("flow", |reader| Parameter::check(&flow, &limits, "", reader));
        checked(reader)?;
        self.set_quantity(name, GAS_FLOW, &[flow], IGNITION_S)
    }

    /// Moves the flame `name` to a position, m, within `seconds`. Gas that burns already stays where it is.
    ///
    /// # Errors
    /// There is no phenomenon of that name, it has no position, or a number is not possible.
    pub fn move_to(&mut self, name: &str, position: impl Into<[f64; 3]>, seconds: f64) -> Result<(), EffectError> {
        let position = position.into();
        let mut reader = Reader::new();
        let (anywhere, durations) = (Range::default(), Range::new(0.0, 3600.0));
        reader.within("position", |reader| {
            Parameter::check(&position, &anywhere, "m", reader);
        });
        reader.within("seconds", |reader| {
            Parameter::check(&seconds, &durations, "s", reader);
        });
        checked(reader)?;
        self.set_quantity(name, POSITION, &position, seconds)
    }

    /// Changes a quantity of the phenomenon `name` within `seconds`.
    fn set_quantity(
        &mut self,
        name: &str,
        quantity: &'static str,
        value: &[f64],
        seconds: f64,
    ) -> Result<(), EffectError> {
        let (index, instance) = self.instance(name)?;
        let Some(changed) = self.target(instance).with_quantity(quantity, value) else {
            let kind = instance.kind.key;
            return Err(EffectError::NotChangeable { name: name.to_owned(), kind, what: quantity });
        };
        self.replace(index, changed, seconds)
    }

    /// Goes on with other random numbers. Simulations keep their state; what has a closed form jumps to another flame, another rain.
    ///
    /// # Errors
    /// Assets that cannot be read any more.
    pub fn reseed(&mut self, seed: u64) -> Result<(), EffectError> {
        let scene = Arc::new(Scene { seed, ..Scene::clone(self.scene()) });
        let compiled = self.shot.compiled();
        let assets = compiled.assets().clone();
        let compiled = self.pool.run(|| CompiledScene::build(scene, assets, Some(compiled)))?;
        self.replace_scene(compiled)
    }

    /// Goes on with another scene. Simulations that cannot continue their state are simulated anew, up to the current time.
    fn replace_scene(&mut self, compiled: CompiledScene) -> Result<(), EffectError> {
        let is_in_preroll = self.shot.preroll_steps_left() > 0;
        self.recycle();
        self.shot.replace_scene(Arc::new(compiled));
        if !is_in_preroll {
            let time = self.time();
            let (shot, observer) = (&mut self.shot, self.observer.as_ref());
            self.pool.run(|| shot.advance_to(time, u64::MAX, observer))?;
        }
        Ok(())
    }

    /// Makes what was set live hold from the beginning, instead of from when it was set.
    pub(super) fn apply_targets_from_time_0(&mut self) -> Result<(), EffectError> {
        for (name, parameters) in std::mem::take(&mut self.targets) {
            let Ok((index, before)) = self.instance(&name) else { continue };
            let instance = Instance { parameters, ..before.clone() };
            let (compiled, revision) = (self.shot.compiled(), self.revision + 1);
            let compiled = self.pool.run(|| compiled.with_instance(index, instance, revision))?;
            self.revision = revision;
            self.shot.replace_scene(Arc::new(compiled));
        }
        Ok(())
    }

    fn scene(&self) -> &Arc<Scene> {
        self.shot.compiled().scene()
    }

    /// The phenomenon `name` and its index.
    fn instance(&self, name: &str) -> Result<(usize, &Instance), EffectError> {
        let instances = &self.scene().instances;
        let found = instances.iter().enumerate().find(|(_, instance)| instance.name == name);
        found.ok_or_else(|| EffectError::UnknownName {
            name: name.to_owned(),
            allowed: instances.iter().map(|instance| instance.name.clone()).collect(),
        })
    }

    /// The parameters of a phenomenon that were set last.
    fn target<'a>(&'a self, instance: &'a Instance) -> &'a Arc<dyn PhenomenonTable> {
        self.targets.get(&instance.name).unwrap_or(&instance.parameters)
    }

    /// Replaces the parameters of the phenomenon at `index`; keyframed values continue those before. Does nothing if they are the ones that were set last.
    fn replace(
        &mut self,
        index: usize,
        target: Arc<dyn PhenomenonTable>,
        transition_s: f64,
    ) -> Result<(), EffectError> {
        let before = &self.scene().instances[index];
        if target.equals(self.target(before).as_ref()) {
            return Ok(());
        }
        // What is drawn already stays as it was.
        let now = self.shot.plan().shutter_at(self.time()).close;
        // In a loop, a value that changes at one time would have to change back.
        let is_loop = self.scene().loop_s.is_some();
        let continuing = if is_loop { None } else { target.continuing(before.parameters.as_ref(), now, transition_s) };
        let instance = Instance { parameters: continuing.unwrap_or_else(|| target.clone()), ..before.clone() };
        let (compiled, revision) = (self.shot.compiled(), self.revision + 1);
        let compiled = self.pool.run(|| compiled.with_instance(index, instance, revision))?;
        self.revision = revision;
        self.targets.insert(compiled.scene().instances[index].name.clone(), target);
        self.replace_scene(compiled)
    }
}

/// The parameters of the phenomenon `name` of a scene.
fn parameters_of<'a>(scene: &'a Scene, name: &str) -> Option<&'a Arc<dyn PhenomenonTable>> {
    scene.instances.iter().find(|instance| instance.name == name).map(|instance| &instance.parameters)
}

fn checked(reader: Reader) -> Result<(), ParameterProblems> {
    if reader.is_clean() { Ok(()) } else { Err(ParameterProblems(reader.into_problems())) }
}
