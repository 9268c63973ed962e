//! A compiled scene: everything that is slow to build, built once and shared by checks, remarks, planning and shots.

use std::{collections::BTreeMap, fmt, sync::Arc};

use bansho_base::{
    color::View,
    host::{
        assets::{Assets, Picture, PictureAlpha},
        once::LastValue,
    },
    parameters::{BuildError, Reader},
    phenomenon::{Phenomenon, PhenomenonInfo, Run, Stepped, Stepping, strip::Shutter, surroundings::Occluder},
    tables::{BuildContext, BuiltTable, SharedRole},
    world::wind::Wind,
};

use crate::{
    crossfade::CrossfadeRun,
    fingerprint::{self, Fingerprint},
    plate_boxes::{BoxViews, BoxViewsKey, PlateBoxes, PlateBoxesKey},
};
use bansho_scene::{Instance, PlateSky, Scene, SceneError, SharedInstance};

/// A scene whose phenomena and shared tables are built.
#[derive(Clone)]
pub struct CompiledScene {
    scene: Arc<Scene>,
    assets: Arc<dyn Assets>,
    wind: Wind,
    /// Its shared tables, in the order of the scene.
    shared: Vec<BuiltShared>,
    /// Every phenomenon of the scene, including disabled ones, by the fingerprint of what it was built from.
    built: BTreeMap<Fingerprint, Arc<dyn Phenomenon>>,
    /// The enabled phenomena in the order of the scene, then those that draw its shared tables.
    enabled: Vec<BuiltPhenomenon>,
    /// The boxes of the last plate and view.
    plate_boxes: Arc<LastValue<PlateBoxesKey, PlateBoxes>>,
    /// Where the last camera saw the boxes: they stay while photographs of one size follow each other.
    box_views: Arc<LastValue<BoxViewsKey, BoxViews>>,
}

/// A phenomenon, with the fingerprint of all that it was built from.
#[derive(Clone)]
pub(crate) struct BuiltPhenomenon {
    pub(crate) fingerprint: Fingerprint,
    pub(crate) phenomenon: Arc<dyn Phenomenon>,
}

/// A shared table that is built, with the fingerprint of all that it was built from.
#[derive(Clone)]
struct BuiltShared {
    fingerprint: Fingerprint,
    instance: SharedInstance,
    table: BuiltTable,
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
        let is_plate_known = previous.is_some_and(|Self { scene: before, .. }| {
            let is_same_plate = before.plate == scene.plate && before.picture.first_frame == frame;
            // A depth that is fitted to the ground depends on the camera too.
            is_same_plate && (!scene.plate.fits_ground() || before.plate_view(frame) == view)
        });
        if !is_plate_known && let Err(error) = scene.plate.read_frame(assets.as_ref(), frame, &view) {
            errors.push(("plate".to_owned(), error));
        }
        let shared = build_shared(&scene, assets.as_ref(), previous, &mut errors);
        let (built, fingerprints) = build_instances(&scene, assets.as_ref(), previous, &mut errors);
        if !errors.is_empty() {
            return Err(BuildErrors(errors));
        }
        let phenomena = fingerprints.into_iter().filter_map(|fingerprint| {
            Some(BuiltPhenomenon { fingerprint, phenomenon: built.get(&fingerprint)?.clone() })
        });
        let enabled = phenomena.chain(drawn_tables(&scene, assets.as_ref(), &shared, previous)).collect();
        let wind = Wind::new(scene.wind.clone(), scene.seed, scene.loop_s);
        let plate_boxes = previous.map(|previous| previous.plate_boxes.clone()).unwrap_or_default();
        let box_views = previous.map(|previous| previous.box_views.clone()).unwrap_or_default();
        Ok(Self { wind, shared, built, enabled, scene, assets, plate_boxes, box_views })
    }

    /// The image of the plate in the first frame; `None` without a plate, or if it cannot be read.
    pub fn plate_image(&self) -> Option<Arc<Picture>> {
        plate_image(&self.scene, self.assets.as_ref())
    }

    /// The light of the plate in the first frame, computed once for each picture; `None` without a plate, or if it cannot be read.
    pub(crate) fn plate_boxes(&self, view: View) -> Option<Arc<PlateBoxes>> {
        let (picture, plate) = (self.plate_image()?, &self.scene.plate);
        let alpha = plate.alpha_of(&picture);
        let path = plate.image.as_ref()?;
        let Ok(digest) = self.assets.digest(&path.0, self.scene.picture.first_frame) else {
            return Some(Arc::new(PlateBoxes::new(&picture, alpha, &view)));
        };
        let key = PlateBoxesKey { digest, alpha, view };
        Some(self.plate_boxes.get_or_compute(key, || PlateBoxes::new(&picture, alpha, &view)))
    }

    /// Where the camera sees the boxes of the plate, computed by `compute` if that is not known.
    pub(crate) fn box_views(&self, key: BoxViewsKey, compute: impl FnOnce() -> BoxViews) -> Arc<BoxViews> {
        self.box_views.get_or_compute(key, compute)
    }

    /// Where the boxes of the plate are kept, if frame `number` shows them and no other sky lights the scene.
    pub(crate) fn plate_boxes_cache(&self, number: i64) -> Option<&LastValue<PlateBoxesKey, PlateBoxes>> {
        let is_shown = number == self.scene.picture.first_frame && self.scene.tables.sky(0.0).is_none();
        is_shown.then_some(self.plate_boxes.as_ref())
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
        let mut counted = others.map(|(_, each)| each).chain(Some(&instance).filter(|own| own.enabled));
        let before = self.phenomenon(&instance.name);
        // Memory is estimated before anything is built.
        let phenomenon = counted
            .try_fold(0, |total, each| each.parameters.check_particle_budget(total))
            .and_then(|_| build_instance(&instance, &self.scene, self.assets.as_ref(), before))
            .map_err(|error| BuildErrors(vec![(instance.name.clone(), error)]))?;
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

    /// The solids of its shared tables at time `t`.
    pub fn solids(&self, t: f64) -> impl Iterator<Item = Occluder> {
        self.shared.iter().filter_map(move |built| built.table.object.as_ref()?.solid(t))
    }

    /// Its enabled phenomena, then those that draw its shared tables.
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
        let mut remaining = self.clone();
        remaining.enabled.retain(|built| !names.contains(&built.phenomenon.info().name));
        remaining
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
        let stepping = phenomenon.info().stepping;
        let (run, stepping): (Box<dyn Run>, _) = match (loop_s, stepping) {
            (Some(loop_s), Some(stepping)) => {
                let runs = [phenomenon.clone().start(), phenomenon.clone().start()];
                let crossfade = CrossfadeRun::new(loop_s, stepping, phenomenon.info().aovs, runs);
                let stepping = crossfade.stepping();
                (Box::new(crossfade), Some(stepping))
            }
            _ => (phenomenon.clone().start(), stepping),
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

fn build_shared(
    scene: &Scene,
    assets: &dyn Assets,
    previous: Option<&CompiledScene>,
    errors: &mut Vec<(String, BuildError)>,
) -> Vec<BuiltShared> {
    let mut shared = Vec::new();
    for (path, instance) in scene.tables.with_paths() {
        let known = previous.and_then(|previous| known_shared(instance, scene, assets, previous));
        match known.map_or_else(|| new_shared(instance, scene, assets), Ok) {
            Ok(built) => shared.push(built),
            Err(error) => errors.push((path, error)),
        }
    }
    shared
}

/// What `previous` has built from an equal table and equal files.
///
/// Fingerprinting reads every file that a mesh names, whatever their total size, whereas building refuses too many bytes. So only what has been
/// built, now or in `previous`, is fingerprinted.
fn known_shared(
    instance: &SharedInstance,
    scene: &Scene,
    assets: &dyn Assets,
    previous: &CompiledScene,
) -> Option<BuiltShared> {
    let mut built = previous.shared.iter();
    if !built.any(|built| built.instance.parameters.equals(instance.parameters.as_ref())) {
        return None;
    }
    let fingerprint = fingerprint::of_shared(instance, scene, assets);
    previous.shared.iter().find(|built| built.fingerprint == fingerprint).cloned()
}

fn new_shared(instance: &SharedInstance, scene: &Scene, assets: &dyn Assets) -> Result<BuiltShared, BuildError> {
    let object = instance.parameters.build(assets)?;
    let table = BuiltTable { parameters: instance.parameters.clone(), object };
    let fingerprint = fingerprint::of_shared(instance, scene, assets);
    Ok(BuiltShared { fingerprint, instance: instance.clone(), table })
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
        let known = previous.and_then(|previous| {
            let fingerprint = fingerprint::of_instance(instance, scene, assets);
            previous.built.get(&fingerprint).map(|phenomenon| (fingerprint, phenomenon.clone()))
        });
        let (fingerprint, phenomenon) = match known {
            Some(known) => known,
            None => {
                let before = previous.and_then(|previous| previous.phenomenon(&instance.name));
                match build_instance(instance, scene, assets, before) {
                    // After it was built: building refuses too many bytes, which a fingerprint would read.
                    Ok(phenomenon) => (fingerprint::of_instance(instance, scene, assets), phenomenon),
                    Err(error) => {
                        errors.push((path, error));
                        continue;
                    }
                }
            }
        };
        built.insert(fingerprint, phenomenon);
        enabled.extend(instance.enabled.then_some(fingerprint));
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
    instance.parameters.build_in_loop(&context)
}

/// The image of the plate in the first frame; `None` without a plate, or if it cannot be read.
fn plate_image(scene: &Scene, assets: &dyn Assets) -> Option<Arc<Picture>> {
    scene.plate.read_image(assets, scene.picture.first_frame).ok()?
}

fn is_opaque(picture: Arc<Picture>) -> bool {
    picture.alpha == PictureAlpha::Opaque
}

/// The phenomena that draw the visible shared tables, one for each kind. What is behind plates is left out if the plate is opaque in the first frame.
fn drawn_tables(
    scene: &Scene,
    assets: &dyn Assets,
    shared: &[BuiltShared],
    previous: Option<&CompiledScene>,
) -> Vec<BuiltPhenomenon> {
    let mut visible: Vec<&BuiltShared> = shared.iter().filter(|built| built.table.parameters.is_visible()).collect();
    visible.sort_by_key(|built| built.instance.kind.shared_role().map(|role| role.draw_order));
    let mut drawn = Vec::new();
    for tables in visible.chunk_by(|a, b| a.instance.kind.key == b.instance.kind.key) {
        let kind = tables[0].instance.kind;
        let Some(SharedRole { draw: Some(draw), is_behind_plates, .. }) = kind.shared_role() else { continue };
        let shows_sky = || scene.plate.sky == PlateSky::Scene || !plate_image(scene, assets).is_none_or(is_opaque);
        if *is_behind_plates && scene.has_plate() && !shows_sky() {
            continue;
        }
        let fingerprints: Vec<Fingerprint> = tables.iter().map(|built| built.fingerprint).collect();
        let fingerprint = fingerprint::of_drawn(kind.key, &fingerprints, scene);
        let known = previous
            .and_then(|previous| previous.enabled.iter().find(|built| built.fingerprint == fingerprint).cloned());
        drawn.push(known.unwrap_or_else(|| {
            let name = kind.layer.unwrap_or(kind.key);
            let context = BuildContext { name, seed: scene.seed, loop_s: scene.loop_s, assets, previous: None };
            let tables: Vec<BuiltTable> = tables.iter().map(|built| built.table.clone()).collect();
            BuiltPhenomenon { fingerprint, phenomenon: draw(&tables, &context) }
        }));
    }
    drawn
}
