//! The scene file: what it may say, and a checked scene that cannot be invalid.

mod check;
pub mod report;
pub mod schema;
mod suggest;
mod tables;
pub mod template;
mod text;

use std::{collections::HashSet, sync::Arc};

use bansho_base::{
    camera::{CameraParameters, SKY_FOV_DEG},
    parameters::{
        self, Parameter, Parameters, Problem, ProblemKind, Problems, Reader, Table, TableDescriptor, Value,
        animated::Animated,
    },
    phenomenon::kind::{CheckedParameters, PhenomenonKind},
    world::{air::Air, obstacle::ObstacleParameters, sky::SkyParameters, wind::WindParameters},
};

use bansho_environment::ground::GroundParameters;

pub use self::{
    check::{PLATE_LAYER, report_build_error},
    report::SceneError,
    tables::{
        defaults::ImpliedBackdrop,
        picture::{self, DepthKind, FrameRate, LightParameters, PictureParameters, PlateParameters},
        plate::PlatePictures,
    },
    text::{
        edit, operation,
        path::{Segment, ValuePath},
        positions::Positions,
    },
};
use self::{tables::defaults, text::toml};

/// The scene format that this version reads and writes.
pub const FORMAT: i64 = 2;

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
    close_loop: fn(&mut Scene, f64) -> Option<String>,
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
    pub parameters: Arc<dyn CheckedParameters>,
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
    /// Seed of everything random: that of `[picture]`, or another that was asked for.
    pub seed: u64,
    /// Length of the seamless loop that it is, s: a whole number of frames.
    pub loop_s: Option<f64>,
}

/// What may be asked of a scene beside its text.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SceneOptions {
    /// Another seed.
    pub seed: Option<u64>,
    /// A seamless loop of about so many seconds.
    pub loop_s: Option<f64>,
    /// Whether sky, ground and lamps that the scene's text does not state are seen; they light the scene either way.
    pub implied_backdrop: bool,
}

/// Why a scene is no loop.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LoopError {
    /// A loop shorter than two frames or longer than an hour.
    #[error("a loop of {seconds} s is out of range; allowed: {min} (two frames) to 3600 s")]
    Length {
        /// What was asked for.
        seconds: f64,
        /// Two frames.
        min: f64,
    },
    /// Something keyed does not end as it begins.
    #[error(
        "the loop of {seconds} s jumps: {what} differs between its first and its last moment; allowed: the same at 0 s and at {seconds} s"
    )]
    Jumps {
        /// Length of the loop.
        seconds: f64,
        /// What is keyed.
        what: String,
    },
}

/// The nearest whole number of frames.
fn loop_length(seconds: f64, fps: FrameRate) -> Result<f64, LoopError> {
    let min = 2.0 * fps.frame_s();
    if !(min * 0.999..=3600.0).contains(&seconds) {
        let min = (1e3 * min).ceil() / 1e3;
        return Err(LoopError::Length { seconds, min });
    }
    Ok((seconds / fps.frame_s()).round() * f64::from(fps.seconds) / f64::from(fps.frames))
}

impl Scene {
    /// Reads and checks the scene `text`; `file` is what errors call it. No asset is read and nothing is built: see
    /// `bansho_render::CompiledScene` for that.
    ///
    /// # Errors
    /// Every fault of the text, each with its place, what is wrong and what is allowed.
    pub fn parse(file: &str, text: &str, kinds: &[PhenomenonKind]) -> Result<Self, SceneError> {
        let fail = |Problems { listed, omitted }| SceneError {
            file: file.to_owned(),
            text: text.to_owned(),
            problems: listed,
            omitted,
        };
        let root = toml::parse(text).map_err(|problem| fail(Problems { listed: vec![problem], omitted: 0 }))?;
        let mut reader = Reader::new();
        if !check::format(&root, &mut reader) {
            return Err(fail(reader.into_problems()));
        }
        let scene = Self::read(&root, kinds, &mut reader);
        if reader.is_clean() {
            check::values(&scene, &root, &mut reader);
        }
        if reader.is_clean() { Ok(scene) } else { Err(fail(reader.into_problems())) }
    }

    /// The scene as a shot has it: with another seed, as a seamless loop of about so many seconds, without what its text only implies.
    ///
    /// # Errors
    /// A length that no loop has, or something keyed that does not end a loop as it begins it.
    pub fn adapted(mut self, options: &SceneOptions) -> Result<Self, LoopError> {
        if let Some(seed) = options.seed {
            self.seed = seed;
        }
        if !options.implied_backdrop {
            self.hide_implied_backdrop();
        }
        self.loop_s = options.loop_s.map(|seconds| loop_length(seconds, self.picture.fps)).transpose()?;
        let Some(seconds) = self.loop_s else { return Ok(self) };
        let jumps =
            |table: &SharedTable| (table.close_loop)(&mut self, seconds).map(|rest| parameters::path(table.key, &rest));
        match SHARED_TABLES.iter().find_map(jumps) {
            Some(what) => Err(LoopError::Jumps { seconds, what }),
            None => Ok(self),
        }
    }

    fn read(root: &Table, kinds: &[PhenomenonKind], reader: &mut Reader) -> Self {
        check::root_keys(root, kinds, reader);
        let (completed, implied) = defaults::complete(root, kinds);
        Self::read_completed(&completed, kinds, implied, reader).looking_up(&completed)
    }

    /// Reads a scene whose defaults that depend on other values are in `root`.
    fn read_completed(root: &Table, kinds: &[PhenomenonKind], implied: ImpliedBackdrop, reader: &mut Reader) -> Self {
        let picture: PictureParameters = read_shared(root, "picture", reader);
        Self {
            seed: picture.seed as u64,
            loop_s: None,
            picture,
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
        own.chain(self.instances.iter().flat_map(|instance| instance.parameters.assets())).collect()
    }

    /// Leaves sky, ground and lamps that the text does not state out of the picture; sky and lamps go on to light it.
    fn hide_implied_backdrop(&mut self) {
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
        parameters: Arc::from((kind.read)(table, reader)),
    }
}

fn default_name(key: &str, index: usize) -> String {
    if index == 0 { key.to_owned() } else { format!("{key} {}", index + 1) }
}
