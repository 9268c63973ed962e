//! The scene file: what it may say, and a checked scene that cannot be invalid.

pub(crate) mod check;
pub mod defaults;
pub mod edit;
mod lines;
pub mod obstacle;
pub mod operation;
pub mod picture;
mod place;
pub(crate) mod plate;
mod positions;
pub mod report;
pub mod schema;
pub mod source;
mod suggest;
pub mod template;
mod toml;

use std::{collections::HashSet, sync::Arc};

use bansho_base::{
    camera::{CameraParameters, SKY_FOV_DEG},
    host::assets::Assets,
    parameters::{
        Parameter, Parameters, Problem, ProblemKind, Problems, Reader, Table, TableDescriptor, Value,
        animated::Animated,
    },
    world::{air::Air, sky::SkyParameters, wind::WindParameters},
};

use bansho_environment::ground::GroundParameters;

pub use self::{
    defaults::ImpliedBackdrop,
    obstacle::{ObstacleParameters, ObstacleShape},
    picture::{DepthKind, FrameRate, LightParameters, PictureParameters, PlateParameters},
    place::{Place, Segment},
    positions::Positions,
    report::SceneError,
    source::{Describe, Memo, Opening, OpeningFault, PhenomenonKind, Source},
};

/// The scene format that this version reads and writes.
pub const FORMAT: i64 = 1;

/// What the TOML `text` says, with the place of every value, unchecked.
///
/// # Errors
/// The text is not TOML; the problem says where and why.
pub fn values(text: &str) -> Result<Table, Problem> {
    toml::parse(text)
}

/// A shared table of the scene file: one that is not a phenomenon.
pub struct SharedTable {
    /// Its name.
    pub key: &'static str,
    /// Whether there may be many (`[[light]]`).
    pub many: bool,
    /// Its parameters.
    pub table: fn() -> &'static TableDescriptor,
    /// Makes those of a scene that are keyed repeat every so many seconds, which must come back to where they began; the first that do not.
    pub(crate) close_loop: fn(&mut Scene, f64) -> Option<String>,
}

/// Shared tables, in the order in which a scene should state them.
pub const SHARED_TABLES: [SharedTable; 9] = [
    shared("picture", false, PictureParameters::table, |scene, seconds| scene.picture.close_loop(seconds)),
    shared("camera", false, CameraParameters::table, |scene, seconds| scene.camera.close_loop(seconds)),
    shared("plate", false, PlateParameters::table, |scene, seconds| scene.plate.close_loop(seconds)),
    shared("wind", false, WindParameters::table, |scene, seconds| scene.wind.close_loop(seconds)),
    shared("air", false, Air::table, |scene, seconds| scene.air.close_loop(seconds)),
    shared("sky", false, SkyParameters::table, |scene, seconds| scene.sky.close_loop(seconds)),
    shared("ground", false, GroundParameters::table, |scene, seconds| scene.ground.close_loop(seconds)),
    shared("light", true, LightParameters::table, |scene, seconds| scene.lights.close_loop(seconds)),
    shared("obstacle", true, ObstacleParameters::table, |scene, seconds| scene.obstacles.close_loop(seconds)),
];

const fn shared(
    key: &'static str,
    many: bool,
    table: fn() -> &'static TableDescriptor,
    close_loop: fn(&mut Scene, f64) -> Option<String>,
) -> SharedTable {
    SharedTable { key, many, table, close_loop }
}

/// A phenomenon of the scene.
#[derive(Clone)]
pub struct Instance {
    /// Its kind.
    pub kind: PhenomenonKind,
    /// Its name, unique in the scene.
    pub name: String,
    /// Whether it is drawn.
    pub enabled: bool,
    /// Its parameters.
    pub source: Arc<dyn Source>,
    /// Luminance of its bright parts, cd/m^2, where it was made once to see whether it can be: with the scene's own seed, in no loop.
    pub luminance: Option<f64>,
}

/// A checked scene.
#[derive(Clone)]
pub struct Scene {
    /// `[picture]`.
    pub picture: PictureParameters,
    /// `[camera]`.
    pub camera: CameraParameters,
    /// `[plate]`.
    pub plate: PlateParameters,
    /// `[wind]`.
    pub wind: WindParameters,
    /// `[air]`.
    pub air: Air,
    /// `[sky]`, if there is one.
    pub sky: Option<SkyParameters>,
    /// `[ground]`, if there is one.
    pub ground: Option<GroundParameters>,
    /// `[[light]]`.
    pub lights: Vec<LightParameters>,
    /// `[[obstacle]]`.
    pub obstacles: Vec<ObstacleParameters>,
    /// Phenomena in the order of the file.
    pub instances: Vec<Instance>,
    /// Which of sky, ground and lights the text does not state.
    pub implied: ImpliedBackdrop,
}

impl Scene {
    /// Reads and checks the scene `text`; `file` is what errors call it.
    ///
    /// # Errors
    /// Every fault of the text and of the assets it names, each with its place, what is wrong and what is allowed.
    pub fn parse(file: &str, text: &str, kinds: &[PhenomenonKind], assets: &dyn Assets) -> Result<Self, SceneError> {
        Self::parse_after(None, file, text, kinds, assets)
    }

    /// [`parse`](Self::parse) after an edit: phenomena that are as they were in `good`, which was parsed with the same assets, are not
    /// made again to see whether they can be.
    ///
    /// # Errors
    /// Those of [`parse`](Self::parse).
    pub fn parse_after(
        good: Option<&Self>,
        file: &str,
        text: &str,
        kinds: &[PhenomenonKind],
        assets: &dyn Assets,
    ) -> Result<Self, SceneError> {
        Self::parse_and(file, text, kinds, |scene, root, reader| {
            check::assets_and_openings(scene, good, root, assets, reader);
        })
    }

    /// Reads a scene `text` in which [`parse`](Self::parse) found no fault elsewhere: no asset is read and no phenomenon made.
    ///
    /// # Errors
    /// Every fault of the text alone.
    pub fn reparse(file: &str, text: &str, kinds: &[PhenomenonKind]) -> Result<Self, SceneError> {
        Self::parse_and(file, text, kinds, |_, _, _| {})
    }

    fn parse_and(
        file: &str,
        text: &str,
        kinds: &[PhenomenonKind],
        check: impl FnOnce(&mut Self, &Table, &mut Reader),
    ) -> Result<Self, SceneError> {
        let fail = |Problems { listed, omitted }| SceneError {
            file: file.to_owned(),
            text: text.to_owned(),
            problems: listed,
            omitted,
        };
        let root = toml::parse(text).map_err(|problem| fail(Problems { listed: vec![problem], omitted: 0 }))?;
        let mut reader = Reader::new();
        let mut scene = Self::read(&root, kinds, &mut reader);
        if reader.is_clean() {
            check(&mut scene, &root, &mut reader);
        }
        if reader.is_clean() { Ok(scene) } else { Err(fail(reader.into_problems())) }
    }

    fn read(root: &Table, kinds: &[PhenomenonKind], reader: &mut Reader) -> Self {
        check::format(root, reader);
        check::root_keys(root, kinds, reader);
        let (completed, implied) = defaults::complete(root, kinds);
        Self::read_completed(&completed, kinds, implied, reader).looking_up(&completed)
    }

    /// Reads a scene whose defaults that depend on other values are in `root`.
    fn read_completed(root: &Table, kinds: &[PhenomenonKind], implied: ImpliedBackdrop, reader: &mut Reader) -> Self {
        Self {
            picture: read_shared(root, "picture", reader),
            camera: read_shared(root, "camera", reader),
            plate: read_shared(root, "plate", reader),
            wind: read_shared(root, "wind", reader),
            air: read_shared(root, "air", reader),
            sky: root.get("sky").map(|_| read_shared(root, "sky", reader)),
            ground: root.get("ground").map(|_| read_shared(root, "ground", reader)),
            lights: read_many(root, "light", reader),
            obstacles: read_many(root, "obstacle", reader),
            instances: read_instances(root, kinds, reader),
            implied,
        }
    }

    /// A camera that is not told where to look, nor stands in the setting of its phenomena, sees the sky where that is all there is.
    fn looking_up(mut self, root: &Table) -> Self {
        let told = |key: &str| match root.get("camera").map(|node| &node.value) {
            Some(Value::Table(camera)) => camera.get(key).is_some(),
            _ => false,
        };
        let all_in_the_sky =
            !self.instances.is_empty() && self.instances.iter().all(|instance| instance.kind.in_the_sky);
        if all_in_the_sky && self.obstacles.is_empty() && !self.has_plate() && !told("position") && !told("target") {
            self.camera.look_up();
            if !told("vertical_fov_deg") {
                self.camera.vertical_fov_deg = Animated::from(SKY_FOV_DEG);
            }
        }
        self
    }

    /// Where the text of a scene states a parameter of the phenomenon `name`, or the nearest part of it: one-based line and column; of its
    /// plate where that is the name. None where it states no such phenomenon.
    pub fn position(&self, text: &str, name: &str, key: Option<&str>) -> Option<(usize, usize)> {
        Positions::new(self, text).of(name, key)
    }

    /// Paths of all files that the scene names, as it names them.
    pub fn asset_paths(&self) -> Vec<String> {
        let plate = [&self.plate.image, &self.plate.depth].into_iter().flatten();
        let solids = self.obstacles.iter().filter_map(|obstacle| obstacle.file.as_ref());
        let own = plate.chain(solids).map(|path| path.0.clone());
        own.chain(self.instances.iter().flat_map(|instance| instance.source.assets())).collect()
    }

    /// Leaves sky, ground and lamps that the text does not state out of the picture; sky and lamps go on to light it.
    pub(crate) fn hide_implied_backdrop(&mut self) {
        if let Some(sky) = self.sky.as_mut().filter(|_| self.implied.sky) {
            sky.visible = false;
        }
        if self.implied.ground {
            self.ground = None;
        }
        if self.implied.lights {
            self.lights.iter_mut().for_each(|light| light.visible = false);
        }
    }

    /// Whether a sky or a ground that the text states is seen.
    pub fn shows_stated_backdrop(&self) -> bool {
        let sky = self.sky.as_ref().is_some_and(|sky| sky.visible) && !self.implied.sky;
        sky || self.ground.is_some() && !self.implied.ground
    }

    /// Whether phenomena lie over a plate.
    pub fn has_plate(&self) -> bool {
        self.plate.image.is_some()
    }
}

fn read_shared<P: Parameters>(root: &Table, key: &'static str, reader: &mut Reader) -> P {
    let Some(node) = root.get(key) else { return P::default() };
    reader.within(key, |reader| match &node.value {
        Value::Table(table) => P::read_table(table, reader, &[]),
        _ => {
            let found = node.value.type_name();
            reader.report(node, ProblemKind::WrongType { expected: format!("a table [{key}]"), found });
            P::default()
        }
    })
}

/// The tables of a list `[[key]]`, each with its place in the list.
fn tables<'a>(root: &'a Table, key: &str, reader: &mut Reader) -> Vec<&'a Table> {
    let Some(node) = root.get(key) else { return Vec::new() };
    let mut tables = Vec::new();
    let items = match &node.value {
        Value::List(items) => items.as_slice(),
        _ => std::slice::from_ref(node),
    };
    for item in items {
        match &item.value {
            Value::Table(table) if matches!(node.value, Value::List(_)) => tables.push(table),
            value => {
                let kind = ProblemKind::WrongType {
                    expected: format!("tables [[{key}]], with double brackets"),
                    found: value.type_name(),
                };
                reader.within(key, |reader| reader.report(item, kind));
            }
        }
    }
    tables
}

fn read_many<P: Parameters>(root: &Table, key: &'static str, reader: &mut Reader) -> Vec<P> {
    let tables = tables(root, key, reader);
    let read = |(index, table): (usize, &&Table)| {
        reader.within(format!("{key}.{index}"), |reader| P::read_table(table, reader, &[]))
    };
    tables.iter().enumerate().map(read).collect()
}

fn read_instances(root: &Table, kinds: &[PhenomenonKind], reader: &mut Reader) -> Vec<Instance> {
    let mut instances: Vec<Instance> = Vec::new();
    let mut names = HashSet::new();
    for entry in &root.entries {
        let Some(kind) = kinds.iter().find(|kind| kind.key == entry.key) else { continue };
        for (index, table) in tables(root, kind.key, reader).into_iter().enumerate() {
            let instance = reader.within(format!("{}.{index}", kind.key), |reader| {
                let instance = read_instance(*kind, index, table, reader);
                if !names.insert(instance.name.clone()) {
                    let span = table.get("name").map_or(entry.key_span.clone(), |node| node.span.clone());
                    reader.report_at(Some(span), ProblemKind::DuplicateName { name: instance.name.clone() });
                }
                instance
            });
            instances.push(instance);
        }
    }
    instances
}

fn read_instance(kind: PhenomenonKind, index: usize, table: &Table, reader: &mut Reader) -> Instance {
    let name = table.get("name").and_then(|node| reader.within("name", |reader| check::name(node, reader)));
    let enabled = table.get("enabled").and_then(|node| reader.within("enabled", |r| bool::read(node, &(), "", r)));
    Instance {
        kind,
        name: name.unwrap_or_else(|| default_name(kind.key, index)),
        enabled: enabled.unwrap_or(true),
        source: Arc::from((kind.read)(table, reader)),
        luminance: None,
    }
}

fn default_name(key: &str, index: usize) -> String {
    if index == 0 { key.to_owned() } else { format!("{key} {}", index + 1) }
}
