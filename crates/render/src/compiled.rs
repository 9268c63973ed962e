//! A compiled scene: everything that is slow to build, built once and shared by checks, remarks, planning and shots.

use std::{collections::BTreeMap, fmt, sync::Arc};

use bansho_base::{
    host::assets::{Assets, Picture, PictureAlpha},
    parameters::{BuildError, Reader},
    phenomenon::{
        Phenomenon, PhenomenonInfo, Run, Stepped, Stepping, kind::BuildContext, strip::Shutter, surroundings::Occluder,
    },
    world::{obstacle::Obstacle, wind::Wind},
};
use bansho_environment::{
    ground::Ground,
    lamps::{Lamp, Lamps},
    sky::SkyBackdrop,
    solids::Solids,
};

use crate::{
    crossfade::CrossfadeRun,
    fingerprint::{self, Fingerprint},
};
use bansho_scene::{Instance, Scene, SceneError};

/// A scene whose phenomena, obstacles and distance fields are built.
#[derive(Clone)]
pub struct CompiledScene {
    scene: Arc<Scene>,
    assets: Arc<dyn Assets>,
    wind: Wind,
    obstacles: Vec<(Fingerprint, Obstacle)>,
    /// Every phenomenon of the scene, including disabled ones, by the fingerprint of what it was built from.
    built: BTreeMap<Fingerprint, Arc<dyn Phenomenon>>,
    /// The enabled phenomena in the order of the scene, then its lamps, visible obstacles, ground and sky.
    enabled: Vec<BuiltPhenomenon>,
}

/// A phenomenon, with the fingerprint of all that it was built from.
#[derive(Clone)]
pub(crate) struct BuiltPhenomenon {
    pub(crate) fingerprint: Fingerprint,
    pub(crate) phenomenon: Arc<dyn Phenomenon>,
}

/// Errors that only building finds, each with the dotted path of the table that it is about.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub struct BuildErrors(pub Vec<(String, BuildError)>);

impl fmt::Display for BuildErrors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, (path, error)) in self.0.iter().enumerate() {
            write!(f, "{}{path}.{}: {}", if index > 0 { "\n" } else { "" }, error.key, error.kind)?;
        }
        Ok(())
    }
}

impl BuildErrors {
    /// The errors with their positions in `text`, from which the scene was read. `file` is the file's name in messages.
    pub fn located(self, file: &str, text: &str) -> SceneError {
        let root = bansho_scene::parse_values(text).unwrap_or_default();
        let mut reader = Reader::new();
        for (path, error) in self.0 {
            bansho_scene::report_build_error(error, path, &root, &mut reader);
        }
        let problems = reader.into_problems();
        SceneError {
            file: file.to_owned(),
            text: text.to_owned(),
            problems: problems.listed,
            omitted: problems.omitted,
        }
    }
}

impl CompiledScene {
    /// Builds everything in `scene`. Objects with equal fingerprints (parameters and files) are taken from `previous`, so that after an edit
    /// only what changed is built. A `previous` with other `assets` is ignored.
    ///
    /// # Errors
    /// Every error that only building finds: parameters that contradict each other, assets that cannot be read.
    pub fn build(scene: Arc<Scene>, assets: Arc<dyn Assets>, previous: Option<&Self>) -> Result<Self, BuildErrors> {
        let mut errors = Vec::new();
        let previous = previous.filter(|previous| Arc::ptr_eq(&previous.assets, &assets));
        let frame = scene.picture.first_frame;
        let view = scene.plate_view(frame);
        let same_view = |previous: &Scene| !scene.plate.fits_ground() || previous.plate_view(frame) == view;
        let same_plate = |previous: &Self| {
            let before = &previous.scene;
            before.plate == scene.plate && before.picture.first_frame == frame && same_view(before)
        };
        if !previous.is_some_and(same_plate)
            && let Err(error) = scene.plate.read_frame(assets.as_ref(), frame, &view)
        {
            errors.push(("plate".to_owned(), error));
        }
        let obstacles = build_obstacles(&scene, assets.as_ref(), previous, &mut errors);
        let (built, fingerprints) = build_instances(&scene, assets.as_ref(), previous, &mut errors);
        if !errors.is_empty() {
            return Err(BuildErrors(errors));
        }
        let phenomena = fingerprints.into_iter().filter_map(|fingerprint| {
            Some(BuiltPhenomenon { fingerprint, phenomenon: built.get(&fingerprint)?.clone() })
        });
        let enabled = phenomena.chain(backdrop(&scene, assets.as_ref(), &obstacles, previous)).collect();
        let wind = Wind::new(scene.wind.clone(), scene.seed, scene.loop_s);
        Ok(Self { wind, obstacles, built, enabled, scene, assets })
    }

    /// The image of the plate in the first frame; `None` without a plate, or if it cannot be read.
    pub fn plate_image(&self) -> Option<Arc<Picture>> {
        plate_image(&self.scene, self.assets.as_ref())
    }

    /// Whether the plate covers the picture: it has one, whose image is opaque in the first frame.
    pub fn has_opaque_plate(&self) -> bool {
        self.plate_image().is_some_and(is_opaque)
    }

    /// The same scene with another instance at `index`, as a program changes parameters while a shot runs: only that phenomenon is built, and may
    /// reuse tables of the one before. The fingerprints of what is built by `revision`, a number of its own for each change, replace those of the
    /// parameters.
    ///
    /// # Errors
    /// Parameters that contradict each other, or assets that cannot be read.
    pub fn with_instance(&self, index: usize, instance: Instance, revision: u64) -> Result<Self, BuildErrors> {
        let mut scene = Scene::clone(&self.scene);
        let others = scene.instances.iter().enumerate().filter(|(other, each)| *other != index && each.enabled);
        let budget = others.map(|(_, each)| each).chain(Some(&instance).filter(|own| own.enabled));
        let error = |error| BuildErrors(vec![(instance.name.clone(), error)]);
        budget.clone().try_fold(0, |total, each| each.parameters.check_particle_budget(total)).map_err(error)?;
        let before = self.phenomenon(&instance.name);
        let phenomenon = build_instance(&instance, &self.scene, self.assets.as_ref(), before).map_err(error)?;
        let fingerprint = fingerprint::of_revision(&instance.name, revision);
        let built = BuiltPhenomenon { fingerprint, phenomenon };
        let mut enabled = self.enabled.clone();
        if let Some(old) = enabled.iter_mut().find(|old| old.phenomenon.info().name == instance.name) {
            *old = built;
        }
        if let Some(old) = scene.instances.get_mut(index) {
            *old = instance;
        }
        Ok(Self { enabled, scene: Arc::new(scene), ..self.clone() })
    }

    /// The scene.
    pub fn scene(&self) -> &Arc<Scene> {
        &self.scene
    }

    /// The pictures, meshes, drawings and texts that the scene names.
    pub fn assets(&self) -> &Arc<dyn Assets> {
        &self.assets
    }

    /// The wind, gusts included.
    pub fn wind(&self) -> &Wind {
        &self.wind
    }

    /// Its obstacles at time `t`.
    pub fn obstacles(&self, t: f64) -> impl Iterator<Item = Occluder> {
        self.obstacles.iter().map(move |(_, obstacle)| obstacle.at(t))
    }

    /// Its enabled phenomena, then its lamps, visible obstacles, ground and sky.
    pub fn phenomena(&self) -> impl Iterator<Item = &Arc<dyn Phenomenon>> {
        self.enabled.iter().map(|built| &built.phenomenon)
    }

    /// Whether any of them is simulated in steps.
    pub fn is_stepped(&self) -> bool {
        self.phenomena().any(|phenomenon| phenomenon.info().stepping.is_some())
    }

    /// A fingerprint of all that the state of stepped phenomena depends on: not the camera, the size or the exposure.
    pub fn state_fingerprint(&self) -> Fingerprint {
        let mut hasher = blake3::Hasher::new();
        fingerprint::hash_state(&self.scene, self.assets.as_ref(), &mut hasher);
        *hasher.finalize().as_bytes()
    }

    /// The enabled phenomenon of this name.
    fn phenomenon(&self, name: &str) -> Option<&dyn Phenomenon> {
        self.phenomena().map(Arc::as_ref).find(|phenomenon| phenomenon.info().name == name)
    }

    /// As [`phenomena`](Self::phenomena), with fingerprints.
    pub(crate) fn enabled(&self) -> &[BuiltPhenomenon] {
        &self.enabled
    }

    /// The same scene without some of its phenomena.
    pub(crate) fn without(&self, names: &[&str]) -> Self {
        let is_kept = |built: &&BuiltPhenomenon| !names.contains(&built.phenomenon.info().name);
        Self { enabled: self.enabled.iter().filter(is_kept).cloned().collect(), ..self.clone() }
    }

    /// Runs of all enabled phenomena in their initial states. In a loop, stepped phenomena get a [`CrossfadeRun`].
    pub(crate) fn start(&self) -> Vec<ActiveRun> {
        self.enabled.iter().map(|built| ActiveRun::start(built, self.scene.loop_s)).collect()
    }
}

/// A phenomenon with its run in a shot.
pub(crate) struct ActiveRun {
    pub(crate) built: BuiltPhenomenon,
    pub(crate) run: Box<dyn Run>,
    /// How the run steps. In a loop its preroll is longer than the phenomenon's own.
    pub(crate) stepping: Option<Stepping>,
    /// Steps taken; 0 in the initial state, before the preroll.
    pub(crate) steps_taken: u64,
}

impl ActiveRun {
    pub(crate) fn start(built: &BuiltPhenomenon, loop_s: Option<f64>) -> Self {
        let phenomenon = &built.phenomenon;
        let start = || phenomenon.clone().start();
        let stepping = phenomenon.info().stepping;
        let (run, stepping): (Box<dyn Run>, _) = match (loop_s, stepping) {
            (Some(loop_s), Some(stepping)) => {
                let crossfade = CrossfadeRun::new(loop_s, stepping, phenomenon.info().aovs, [start(), start()]);
                let stepping = crossfade.stepping();
                (Box::new(crossfade), Some(stepping))
            }
            _ => (start(), stepping),
        };
        Self { built: built.clone(), run, stepping, steps_taken: 0 }
    }

    pub(crate) fn info(&self) -> PhenomenonInfo<'_> {
        self.built.phenomenon.info()
    }

    pub(crate) fn as_stepped(&self) -> Option<&dyn Stepped> {
        self.run.as_stepped()
    }

    /// Number of steps to the last state that is not after the time from which this exposure is drawn; 0 for closed forms.
    pub(crate) fn steps_until(&self, shutter: Shutter) -> u64 {
        match (self.stepping, self.as_stepped()) {
            (Some(stepping), Some(stepped)) => stepping.steps_until(stepped.time_for(shutter)),
            _ => 0,
        }
    }
}

fn build_obstacles(
    scene: &Scene,
    assets: &dyn Assets,
    previous: Option<&CompiledScene>,
    errors: &mut Vec<(String, BuildError)>,
) -> Vec<(Fingerprint, Obstacle)> {
    let mut obstacles = Vec::new();
    for (index, obstacle) in scene.obstacles.iter().enumerate() {
        // Fingerprinting reads every file that a mesh names, whatever their total size, whereas building refuses too many bytes. So only
        // what has been built, now or in `previous`, is fingerprinted.
        let fingerprint = || fingerprint::of_obstacle(obstacle, scene, assets);
        let candidate = previous.filter(|previous| previous.scene.obstacles.contains(obstacle));
        let known = candidate.and_then(|previous| {
            let fingerprint = fingerprint();
            previous.obstacles.iter().find(|(known, _)| *known == fingerprint).cloned()
        });
        match known.map_or_else(|| obstacle.build(assets).map(|occluder| (fingerprint(), occluder)), Ok) {
            Ok(obstacle) => obstacles.push(obstacle),
            Err(error) => errors.push((format!("obstacle.{index}"), error)),
        }
    }
    obstacles
}

/// Every phenomenon by its fingerprint, and the fingerprints of the enabled ones in the order of the scene.
fn build_instances(
    scene: &Scene,
    assets: &dyn Assets,
    previous: Option<&CompiledScene>,
    errors: &mut Vec<(String, BuildError)>,
) -> (BTreeMap<Fingerprint, Arc<dyn Phenomenon>>, Vec<Fingerprint>) {
    let (mut built, mut enabled) = (BTreeMap::new(), Vec::new());
    let mut indices: BTreeMap<&str, usize> = BTreeMap::new();
    let mut particles = 0;
    for instance in &scene.instances {
        let index = indices.entry(instance.kind.key).or_default();
        let path = format!("{}.{index}", instance.kind.key);
        *index += 1;
        // Memory is estimated before anything is built.
        if instance.enabled {
            match instance.parameters.check_particle_budget(particles) {
                Ok(total) => particles = total,
                Err(error) => {
                    errors.push((path, error));
                    continue;
                }
            }
        }
        let fingerprint = || fingerprint::of_instance(instance, scene, assets);
        let known = previous.and_then(|previous| {
            let fingerprint = fingerprint();
            previous.built.get(&fingerprint).map(|phenomenon| (fingerprint, phenomenon.clone()))
        });
        let before = previous.and_then(|previous| previous.phenomenon(&instance.name));
        let build = || build_instance(instance, scene, assets, before).map(|phenomenon| (fingerprint(), phenomenon));
        match known.map_or_else(build, Ok) {
            Ok((fingerprint, phenomenon)) => {
                built.insert(fingerprint, phenomenon);
                enabled.extend(instance.enabled.then_some(fingerprint));
            }
            Err(error) => errors.push((path, error)),
        }
    }
    (built, enabled)
}

fn build_instance(
    instance: &Instance,
    scene: &Scene,
    assets: &dyn Assets,
    previous: Option<&dyn Phenomenon>,
) -> Result<Arc<dyn Phenomenon>, BuildError> {
    let context = BuildContext { name: &instance.name, seed: scene.seed, loop_s: scene.loop_s, assets, previous };
    instance.parameters.build(&context)
}

/// The image of the plate in the first frame; `None` without a plate, or if it cannot be read.
fn plate_image(scene: &Scene, assets: &dyn Assets) -> Option<Arc<Picture>> {
    scene.plate.read_image(assets, scene.picture.first_frame).ok()?
}

fn is_opaque(picture: Arc<Picture>) -> bool {
    picture.alpha == PictureAlpha::Opaque
}

/// The scene's visible lamps and obstacles, its ground, and its visible sky unless there is a plate that is opaque in the first frame.
fn backdrop(
    scene: &Scene,
    assets: &dyn Assets,
    obstacles: &[(Fingerprint, Obstacle)],
    previous: Option<&CompiledScene>,
) -> Vec<BuiltPhenomenon> {
    let mut backdrop = Vec::new();
    let mut add = |fingerprint: Fingerprint, build: &dyn Fn() -> Arc<dyn Phenomenon>| {
        let known = previous
            .and_then(|previous| previous.enabled.iter().find(|built| built.fingerprint == fingerprint).cloned());
        backdrop.push(known.unwrap_or_else(|| BuiltPhenomenon { fingerprint, phenomenon: build() }));
    };
    let visible: Vec<_> = scene.lights.iter().filter(|light| light.visible).cloned().collect();
    if !visible.is_empty() {
        add(fingerprint::of_lamps(&visible, scene), &|| {
            let lights = visible.clone();
            let at = move |t| lights.iter().map(|light| Lamp { light: light.at(t), radius: light.radius }).collect();
            Arc::new(Lamps::new(at))
        });
    }
    let solid: Vec<_> = obstacles.iter().filter(|(_, obstacle)| Solids::draws(obstacle)).cloned().collect();
    if !solid.is_empty() {
        let fingerprints: Vec<Fingerprint> = solid.iter().map(|(fingerprint, _)| *fingerprint).collect();
        add(fingerprint::of_solids(&fingerprints, scene), &|| {
            Arc::new(Solids::new(solid.iter().map(|(_, obstacle)| obstacle.clone()).collect()))
        });
    }
    if let Some(ground) = &scene.ground {
        add(fingerprint::of_ground(ground, scene), &|| Arc::new(Ground::new(ground.clone(), scene.seed, scene.loop_s)));
    }
    let is_seen = || !scene.has_plate() || !plate_image(scene, assets).is_none_or(is_opaque);
    if let Some(sky) = scene.sky.as_ref().filter(|sky| sky.visible && is_seen()) {
        add(fingerprint::of_sky(sky, scene), &|| Arc::new(SkyBackdrop::new(sky.clone(), scene.seed)));
    }
    backdrop
}
