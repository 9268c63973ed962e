//! A compiled scene: everything that is slow to build, built once and shared by checks, remarks, exposure, fingerprints and shots.

use std::{collections::BTreeMap, fmt, sync::Arc};

use bansho_base::{
    host::assets::Assets,
    parameters::Reader,
    phenomenon::{
        Phenomenon, PhenomenonInfo, Run, Stepped, Stepping,
        kind::{BuildContext, BuildError},
        strip::Shutter,
        surroundings::Occluder,
    },
    world::wind::Wind,
};
use bansho_environment::{
    ground::Ground,
    lamps::{Lamp, Lamps},
    sky::SkyBackdrop,
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
    obstacles: Vec<(Fingerprint, Occluder)>,
    /// Every phenomenon of the scene, those that are not drawn too, by what it was built from.
    built: BTreeMap<Fingerprint, Arc<dyn Phenomenon>>,
    /// What is drawn, in the order of the scene, then its own lamps, ground and sky.
    participants: Vec<Participant>,
}

/// A phenomenon that a scene shows, with the fingerprint of all that it was built from.
#[derive(Clone)]
pub(crate) struct Participant {
    pub(crate) fingerprint: Fingerprint,
    pub(crate) phenomenon: Arc<dyn Phenomenon>,
}

/// Faults that only building shows, each with the dotted path of the table that it is about.
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
    /// The faults at their places in the text that the scene was read from; `file` is what errors call it.
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
    /// Builds everything in `scene`. What `previous` has of equal parameters and assets is taken from it, so that an edit builds only what it
    /// changed; it must have been built with the same `assets`.
    ///
    /// # Errors
    /// Every fault that only building shows: parameters that do not go together, assets that cannot be had.
    pub fn build(scene: Arc<Scene>, assets: Arc<dyn Assets>, previous: Option<&Self>) -> Result<Self, BuildErrors> {
        let mut errors = Vec::new();
        let previous = previous.filter(|previous| Arc::ptr_eq(&previous.assets, &assets));
        let frame = scene.picture.first_frame;
        let same_plate =
            |previous: &Self| previous.scene.plate == scene.plate && previous.scene.picture.first_frame == frame;
        if !previous.is_some_and(same_plate)
            && let Err(error) = scene.plate.read_frame(assets.as_ref(), frame)
        {
            errors.push(("plate".to_owned(), error));
        }
        let obstacles = build_obstacles(&scene, assets.as_ref(), previous, &mut errors);
        let (built, enabled) = build_instances(&scene, assets.as_ref(), previous, &mut errors);
        if !errors.is_empty() {
            return Err(BuildErrors(errors));
        }
        let shown = enabled
            .into_iter()
            .filter_map(|fingerprint| Some(Participant { fingerprint, phenomenon: built.get(&fingerprint)?.clone() }));
        let participants = shown.chain(backdrop(&scene, previous)).collect();
        let wind = Wind::new(scene.wind.clone(), scene.seed, scene.loop_s);
        Ok(Self { wind, obstacles, built, participants, scene, assets })
    }

    /// The scene.
    pub fn scene(&self) -> &Arc<Scene> {
        &self.scene
    }

    /// Where its pictures come from.
    pub fn assets(&self) -> &Arc<dyn Assets> {
        &self.assets
    }

    /// The one wind.
    pub fn wind(&self) -> &Wind {
        &self.wind
    }

    /// Its obstacles.
    pub fn obstacles(&self) -> impl Iterator<Item = &Occluder> {
        self.obstacles.iter().map(|(_, obstacle)| obstacle)
    }

    /// Everything that it shows: its phenomena, then its own lamps, ground and sky.
    pub fn phenomena(&self) -> impl Iterator<Item = &Arc<dyn Phenomenon>> {
        self.participants.iter().map(|participant| &participant.phenomenon)
    }

    /// Whether any of them is simulated in steps.
    pub fn is_stepped(&self) -> bool {
        self.phenomena().any(|phenomenon| phenomenon.info().stepping.is_some())
    }

    pub(crate) fn participants(&self) -> &[Participant] {
        &self.participants
    }

    /// The same scene without some of its phenomena.
    pub(crate) fn without(&self, names: &[&str]) -> Self {
        let stays = |own: &&Participant| !names.contains(&own.phenomenon.info().name);
        Self { participants: self.participants.iter().filter(stays).cloned().collect(), ..self.clone() }
    }

    /// Runs of everything that it shows, at their beginnings; in a loop one run of what is stepped passes into the next.
    pub(crate) fn start(&self) -> Vec<ActiveRun> {
        self.participants.iter().map(|participant| ActiveRun::start(participant, self.scene.loop_s)).collect()
    }
}

/// A phenomenon in the course of a shot.
pub(crate) struct ActiveRun {
    pub(crate) participant: Participant,
    pub(crate) run: Box<dyn Run>,
    /// How it steps; in a loop otherwise than the phenomenon itself.
    pub(crate) stepping: Option<Stepping>,
    /// Steps taken; 0 at its beginning, before the preroll.
    pub(crate) taken: u64,
}

impl ActiveRun {
    pub(crate) fn start(participant: &Participant, loop_s: Option<f64>) -> Self {
        let phenomenon = &participant.phenomenon;
        let start = || phenomenon.clone().start();
        let stepping = phenomenon.info().stepping;
        let (run, stepping): (Box<dyn Run>, _) = match (loop_s, stepping) {
            (Some(turn), Some(stepping)) => {
                let crossfade = CrossfadeRun::new(turn, stepping, phenomenon.info().aovs, [start(), start()]);
                let stepping = crossfade.stepping();
                (Box::new(crossfade), Some(stepping))
            }
            _ => (start(), stepping),
        };
        Self { participant: participant.clone(), run, stepping, taken: 0 }
    }

    pub(crate) fn info(&self) -> PhenomenonInfo<'_> {
        self.participant.phenomenon.info()
    }

    pub(crate) fn as_stepped(&self) -> Option<&dyn Stepped> {
        self.run.as_stepped()
    }

    /// Steps after which its state is the last one not after that which an exposure is drawn from; none for closed forms.
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
) -> Vec<(Fingerprint, Occluder)> {
    let mut obstacles = Vec::new();
    for (index, obstacle) in scene.obstacles.iter().enumerate() {
        // A fingerprint reads every file that a mesh names, however many bytes they have together; building refuses too many. So it is
        // taken only of what has been built, now or before.
        let fingerprint = || fingerprint::of_obstacle(obstacle, scene, assets);
        let same = previous.filter(|previous| previous.scene.obstacles.contains(obstacle));
        let known = same.and_then(|previous| {
            let fingerprint = fingerprint();
            previous.obstacles.iter().find(|(own, _)| *own == fingerprint).cloned()
        });
        match known.map_or_else(|| obstacle.build(assets).map(|occluder| (fingerprint(), occluder)), Ok) {
            Ok(obstacle) => obstacles.push(obstacle),
            Err(error) => errors.push((format!("obstacle.{index}"), error)),
        }
    }
    obstacles
}

/// Every phenomenon by its fingerprint, and the fingerprints of those that are enabled.
fn build_instances(
    scene: &Scene,
    assets: &dyn Assets,
    previous: Option<&CompiledScene>,
    errors: &mut Vec<(String, BuildError)>,
) -> (BTreeMap<Fingerprint, Arc<dyn Phenomenon>>, Vec<Fingerprint>) {
    let (mut built, mut enabled) = (BTreeMap::new(), Vec::new());
    let mut positions: BTreeMap<&str, usize> = BTreeMap::new();
    let mut particles = 0;
    for instance in &scene.instances {
        let index = positions.entry(instance.kind.key).or_default();
        let path = format!("{}.{index}", instance.kind.key);
        *index += 1;
        // Memory is estimated before anything is built.
        if instance.enabled {
            match instance.parameters.check_particle_budget(particles) {
                Ok(together) => particles = together,
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
        let build = || build_instance(instance, scene, assets).map(|phenomenon| (fingerprint(), phenomenon));
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

fn build_instance(instance: &Instance, scene: &Scene, assets: &dyn Assets) -> Result<Arc<dyn Phenomenon>, BuildError> {
    let context = BuildContext { name: &instance.name, seed: scene.seed, loop_s: scene.loop_s, assets };
    instance.parameters.build(&context)
}

/// The scene's own lamps that are seen, its ground, and its sky where there is no plate.
fn backdrop(scene: &Scene, previous: Option<&CompiledScene>) -> Vec<Participant> {
    let mut backdrop = Vec::new();
    let mut add = |fingerprint: Fingerprint, build: &dyn Fn() -> Arc<dyn Phenomenon>| {
        let known = previous
            .and_then(|previous| previous.participants.iter().find(|own| own.fingerprint == fingerprint).cloned());
        backdrop.push(known.unwrap_or_else(|| Participant { fingerprint, phenomenon: build() }));
    };
    let visible: Vec<_> = scene.lights.iter().filter(|light| light.visible).cloned().collect();
    if !visible.is_empty() {
        add(fingerprint::of_lamps(&visible, scene), &|| {
            let lights = visible.clone();
            let at = move |t| lights.iter().map(|light| Lamp { light: light.at(t), radius: light.radius }).collect();
            Arc::new(Lamps::new(at))
        });
    }
    if let Some(ground) = &scene.ground {
        add(fingerprint::of_ground(ground, scene), &|| Arc::new(Ground::new(ground.clone(), scene.seed, scene.loop_s)));
    }
    if let Some(sky) = scene.sky.as_ref().filter(|sky| sky.visible && !scene.has_plate()) {
        add(fingerprint::of_sky(sky, scene), &|| Arc::new(SkyBackdrop::new(sky.clone(), scene.seed)));
    }
    backdrop
}
