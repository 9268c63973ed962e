//! What an effect shows, before it is opened.

use std::{fmt, sync::Arc};

use bansho_base::{
    camera::CameraParameters,
    host::{
        assets::{Assets, MemoryAssets},
        observer::{Observer, Unobserved},
    },
    parameters::{Auto, Parameters},
    tables::{PhenomenonTable, SharedTable},
    world::{air::Air, wind::WindParameters},
};
use bansho_environment::{
    ground::GroundParameters, lamps::LightParameters, sky::SkyParameters, solids::ObstacleParameters,
};
use bansho_render::{CompiledScene, Plan, PlanOptions, Shot};
use bansho_scene::{Instance, Scene, SceneOptions};

use super::{EffectError, LiveEffect, Pool};
use crate::SceneBuilder;

/// Most simulation steps of one call by default. A flame of particles takes about 120 a second.
const DEFAULT_MAX_STEPS: u64 = 60;

/// Phenomena with their surroundings and the picture that is drawn of them. [`open`](Self::open) makes a [`LiveEffect`] of it.
///
/// ```
/// use bansho::{Effect, FlameSheetParameters, f16};
///
/// let mut torch = Effect::new(FlameSheetParameters { width: 0.4, height: 0.8, ..Default::default() }).size(64, 64).open()?;
/// let mut texture = vec![f16::ZERO; 64 * 64 * 4];
/// for frame in 0..3 {
///     torch.set_wind([0.3 * f64::from(frame), 0.0, 0.0], 0.8)?;
///     torch.advance(1.0 / 60.0)?.write_rgba16f(&mut texture)?;
/// }
/// assert!(texture.iter().any(|value| *value > f16::ZERO));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone)]
pub struct Effect {
    source: Source,
    size: Option<[usize; 2]>,
    seed: Option<u64>,
    loop_s: Option<f64>,
    exposure_ev100: Option<f64>,
    shutter_s: Option<f64>,
    implied_backdrop: bool,
    plan: PlanOptions,
    assets: Arc<dyn Assets>,
    preroll_in_pieces: bool,
    pub(super) max_steps: u64,
    pub(super) pool: Pool,
    observer: Arc<dyn Observer>,
}

impl fmt::Debug for Effect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Effect").field("size", &self.size).field("seed", &self.seed).finish_non_exhaustive()
    }
}

/// Where the scene comes from.
#[derive(Clone)]
enum Source {
    Tables(SceneBuilder),
    Scene(Box<Scene>),
}

impl Effect {
    /// An effect with one phenomenon. Its name is that of its kind, such as `flame_sheet`.
    pub fn new<P: PhenomenonTable + Parameters>(parameters: P) -> Self {
        let name = parameters.kind().key;
        Self::from_source(Source::Tables(SceneBuilder::new().phenomenon(name, &parameters)))
    }

    /// An effect that shows a scene, for example one that was read from a file.
    pub fn from_scene(scene: Scene) -> Self {
        Self::from_source(Source::Scene(Box::new(scene)))
    }

    fn from_source(source: Source) -> Self {
        Self {
            source,
            size: None,
            seed: None,
            loop_s: None,
            exposure_ev100: None,
            shutter_s: None,
            implied_backdrop: false,
            plan: PlanOptions::default(),
            assets: Arc::new(MemoryAssets::default()),
            preroll_in_pieces: false,
            max_steps: DEFAULT_MAX_STEPS,
            pool: Pool::default(),
            observer: Arc::new(Unobserved),
        }
    }

    /// Changes the scene, whether it is still made of tables or was given.
    fn change(mut self, tables: impl FnOnce(SceneBuilder) -> SceneBuilder, scene: impl FnOnce(&mut Scene)) -> Self {
        match &mut self.source {
            Source::Tables(builder) => *builder = tables(std::mem::take(builder)),
            Source::Scene(given) => scene(given),
        }
        self
    }

    /// Adds a phenomenon. Names are unique.
    #[must_use]
    pub fn with<P: PhenomenonTable + Parameters + Clone>(self, name: &str, parameters: P) -> Self {
        self.change(
            |builder| builder.phenomenon(name, &parameters),
            |scene| scene.instances.push(Instance::new(name, parameters.clone())),
        )
    }

    /// Sets the camera. Without one, phenomena of one kind with default position and size are seen from where they fill the picture.
    #[must_use]
    pub fn camera(self, parameters: CameraParameters) -> Self {
        self.change(|builder| builder.camera(&parameters), |scene| scene.camera = parameters.clone())
    }

    /// Sets the wind at the start; [`LiveEffect::set_wind`] changes it.
    #[must_use]
    pub fn wind(self, parameters: WindParameters) -> Self {
        self.change(|builder| builder.wind(&parameters), |scene| scene.wind = parameters.clone())
    }

    /// Sets temperature, pressure and humidity of the air.
    #[must_use]
    pub fn air(self, parameters: Air) -> Self {
        self.change(|builder| builder.air(&parameters), |scene| scene.air = parameters.clone())
    }

    /// Sets a table that all phenomena share; of a kind of which a scene may have many, adds one.
    #[must_use]
    pub fn shared(self, parameters: impl SharedTable + Clone) -> Self {
        self.change(|builder| builder.shared(&parameters), |scene| scene.tables.put(parameters.clone()))
    }

    /// Sets a sky, which lights the phenomena and is drawn behind them if it is visible.
    #[must_use]
    pub fn sky(self, parameters: SkyParameters) -> Self {
        self.shared(parameters)
    }

    /// Sets a ground.
    #[must_use]
    pub fn ground(self, parameters: GroundParameters) -> Self {
        self.shared(parameters)
    }

    /// Adds a light.
    #[must_use]
    pub fn light(self, parameters: LightParameters) -> Self {
        self.shared(parameters)
    }

    /// Adds a solid obstacle.
    #[must_use]
    pub fn obstacle(self, parameters: ObstacleParameters) -> Self {
        self.shared(parameters)
    }

    /// Width and height of the picture, pixels: 1 to 16384 each. Without this call it has the size of the scene, 1280 x 720 by default.
    #[must_use]
    pub fn size(self, width: usize, height: usize) -> Self {
        Self { size: Some([width, height]), ..self }
    }

    /// Seed of all random numbers.
    #[must_use]
    pub fn seed(self, seed: u64) -> Self {
        Self { seed: Some(seed), ..self }
    }

    /// Makes it a seamless loop of this length, s, rounded to whole frames of the scene, of which 30 are a second by default. The wind of a loop is fixed.
    #[must_use]
    pub fn looping(self, seconds: f64) -> Self {
        Self { loop_s: Some(seconds), ..self }
    }

    /// Exposure value at ISO 100. Without one it is chosen from the luminance of the phenomena when the effect is opened.
    #[must_use]
    pub fn exposure_ev100(self, exposure_ev100: f64) -> Self {
        Self { exposure_ev100: Some(exposure_ev100), ..self }
    }

    /// Exposure time of a picture, s; 0 for no motion blur. Without one it is half the frame interval of the scene, 1/60 s by default.
    #[must_use]
    pub fn shutter(self, seconds: f64) -> Self {
        Self { shutter_s: Some(seconds), ..self }
    }

    /// Whether the sky, ground and lamps that a kind of phenomenon implies are visible, such as the street lamps of rain. They light it in any case, unless
    /// the effect has a [`light`](Self::light) or a [`sky`](Self::sky) of its own.
    #[must_use]
    pub fn backdrop(self, is_visible: bool) -> Self {
        Self { implied_backdrop: is_visible, ..self }
    }

    /// Whether phenomena write their arbitrary output variables, such as `rain.streak_opacity`; see [`Picture::write_channel32f`](super::Picture::write_channel32f).
    #[must_use]
    pub fn aovs(mut self, aovs: bool) -> Self {
        self.plan.aovs = aovs;
        self
    }

    /// Whether each phenomenon is also drawn into a layer of its own, with the channels `NAME.R`, `.G`, `.B` and `.A`.
    #[must_use]
    pub fn layers(mut self, layers: bool) -> Self {
        self.plan.layers = layers;
        self
    }

    /// Pictures, meshes and drawings that the parameters name.
    #[must_use]
    pub fn assets(self, assets: Arc<dyn Assets>) -> Self {
        Self { assets, ..self }
    }

    /// Sets who is asked during work whether to stop, from the preroll on: see [`LiveEffect::set_observer`].
    #[must_use]
    pub fn observer(self, observer: Arc<dyn Observer>) -> Self {
        Self { observer, ..self }
    }

    /// Most simulation steps of all phenomena together that one call of [`LiveEffect::advance`] takes, at least 1; what is left is owed. 60 by default. A
    /// particle flame takes about 120 steps a second.
    #[must_use]
    pub fn max_steps(self, steps: u64) -> Self {
        Self { max_steps: steps.max(1), ..self }
    }

    /// Leaves the preroll of simulations, which takes seconds for large flames and auroras, to [`LiveEffect::preroll`], so that a program can spread it over
    /// its own frames.
    #[must_use]
    pub fn preroll_in_pieces(self) -> Self {
        Self { preroll_in_pieces: true, ..self }
    }

    /// The thread pool in which all work is done; no other thread is used. Without one it is the pool of the calling thread, or rayon's global pool.
    #[cfg(feature = "rayon")]
    #[must_use]
    pub fn pool(self, pool: Arc<rayon::ThreadPool>) -> Self {
        Self { pool: Pool::new(pool), ..self }
    }

    /// The checked scene.
    ///
    /// # Errors
    /// Parameters that are out of range, not finite or contradict each other; a loop that is not possible.
    pub fn scene(&self) -> Result<Scene, EffectError> {
        let mut scene = match &self.source {
            Source::Tables(builder) => builder.build()?,
            Source::Scene(scene) => Scene::clone(scene),
        };
        if let Some(exposure_ev100) = self.exposure_ev100 {
            scene.picture.exposure_ev100 = Auto::Set(exposure_ev100);
        }
        if self.shutter_s.is_some() {
            scene.camera.shutter_s = self.shutter_s;
        }
        scene.check()?;
        let options = SceneOptions { seed: self.seed, loop_s: self.loop_s, implied_backdrop: self.implied_backdrop };
        Ok(scene.with_options(&options)?)
    }

    /// Builds the phenomena, runs their simulations up to time 0 and draws the first picture, so that later ones take equally long.
    ///
    /// # Errors
    /// Parameters that are out of range, not finite or contradict each other; a size that is not possible; assets that cannot be read.
    pub fn open(self) -> Result<LiveEffect, EffectError> {
        let scene = Arc::new(self.scene()?);
        let options = PlanOptions { size: self.size, ..self.plan };
        let shot = self.pool.run(|| {
            let compiled = Arc::new(CompiledScene::build(scene, self.assets.clone(), None)?);
            let mut plan = Plan::observed(&compiled, &options, self.observer.as_ref())?;
            plan.fingerprint_frames = false;
            Ok::<Shot, EffectError>(Shot::open(compiled, Arc::new(plan)))
        })?;
        let mut live = LiveEffect::new(shot, self.max_steps, self.pool, self.observer);
        if !self.preroll_in_pieces {
            live.preroll(u64::MAX)?;
            live.picture()?;
        }
        Ok(live)
    }
}
