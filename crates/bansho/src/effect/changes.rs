//! Changes of an effect while it runs. Nothing jumps: keyframed values get a key at the present time, and reach the new value within a moment.

use std::sync::Arc;

use bansho_base::{
    camera::CameraParameters,
    color::MAX_EV100,
    image::Rect,
    math::DVec3,
    parameters::{Parameter, Parameters, Range, Reader},
    phenomenon::kind::{CheckedParameters, Describe},
    world::wind::WindParameters,
};
use bansho_render::CompiledScene;
use bansho_scene::{Instance, ParameterProblems, Scene};

use super::{EffectError, LiveEffect};

/// Duration in which wind and keyframed parameters reach a new value, s.
const TRANSITION_S: f64 = 0.25;
/// Duration in which a flame is lit or goes out, s.
const IGNITION_S: f64 = 0.5;

impl LiveEffect {
    /// Sets the mean wind, m/s (x to the right, y up, z toward the viewer of a camera that is not rotated), and its turbulence intensity: the standard
    /// deviation of the speed divided by the mean speed. It takes 0.25 s to reach them. May be called every frame: gusts, sparks, drops and waves go on
    /// from where they are.
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

    /// Changes what surrounds the phenomena: lights, sky, ground, air, obstacles. What is equal is not built again, and simulations keep their state. Wind,
    /// camera and phenomena have calls of their own, which are faster and do not jump.
    ///
    /// # Errors
    /// Values that are out of range, not finite or contradict each other; assets that cannot be read. The effect is then unchanged.
    pub fn change_scene(&mut self, change: impl FnOnce(&mut Scene)) -> Result<(), EffectError> {
        let mut scene = Scene::clone(self.scene());
        change(&mut scene);
        scene.check()?;
        let compiled = self.shot.compiled();
        let assets = compiled.assets().clone();
        let compiled = self.pool.run(|| CompiledScene::build(Arc::new(scene), assets, Some(compiled)))?;
        self.recycle();
        self.shot.replace_scene(Arc::new(compiled));
        Ok(())
    }

    /// The current parameters of the phenomenon `name`; `None` if there is none of that name and kind. Values that were changed live are keyframed.
    pub fn parameters<P: Describe>(&self, name: &str) -> Option<&P> {
        let instance = self.scene().instances.iter().find(|instance| instance.name == name)?;
        instance.parameters.as_any().downcast_ref()
    }

    /// Sets the parameters of the phenomenon `name`. Only that phenomenon is built again, from the one before where parts of it are the same; simulations keep
    /// their state. Values that can be keyframed reach the new value within 0.25 s, others jump.
    ///
    /// # Errors
    /// There is no phenomenon of that name and kind, a value is out of range or not finite, values contradict each other. The effect is then
    /// unchanged.
    pub fn set_parameters<P: Describe>(&mut self, name: &str, parameters: P) -> Result<(), EffectError> {
        let (index, instance) = self.instance(name)?;
        if instance.parameters.as_any().downcast_ref::<P>().is_none() {
            let found = instance.kind.key;
            return Err(EffectError::OtherKind { name: name.to_owned(), found, given: P::KEY });
        }
        let changed = instance.with_parameters(parameters)?;
        self.replace(index, changed.parameters, TRANSITION_S)
    }

    /// Lights the flame `name`, which grows to its full size within half a second.
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
        let (index, instance) = self.instance(name)?;
        let kind = instance.kind.key;
        let not_changeable = || EffectError::NotChangeable { name: name.to_owned(), kind, what: "gas flow" };
        let changed = instance.parameters.with_flow(flow).ok_or_else(not_changeable)?;
        self.replace(index, changed, IGNITION_S)
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
        let (index, instance) = self.instance(name)?;
        let kind = instance.kind.key;
        let not_changeable = || EffectError::NotChangeable { name: name.to_owned(), kind, what: "position" };
        let changed = instance.parameters.with_position(position).ok_or_else(not_changeable)?;
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
        self.recycle();
        self.shot.replace_scene(Arc::new(compiled));
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

    /// Replaces the parameters of the phenomenon at `index`; keyframed values continue those before.
    fn replace(
        &mut self,
        index: usize,
        parameters: Arc<dyn CheckedParameters>,
        transition_s: f64,
    ) -> Result<(), EffectError> {
        let before = &self.scene().instances[index];
        // What is drawn already stays as it was.
        let now = self.shot.plan().shutter_at(self.time()).close;
        let parameters = parameters.continuing(before.parameters.as_ref(), now, transition_s).unwrap_or(parameters);
        let instance = Instance { parameters, ..before.clone() };
        let (compiled, revision) = (self.shot.compiled(), self.revision + 1);
        let compiled = self.pool.run(|| compiled.with_instance(index, instance, revision))?;
        self.revision = revision;
        self.recycle();
        self.shot.replace_scene(Arc::new(compiled));
        Ok(())
    }
}

fn checked(reader: Reader) -> Result<(), ParameterProblems> {
    if reader.is_clean() { Ok(()) } else { Err(ParameterProblems(reader.into_problems())) }
}
