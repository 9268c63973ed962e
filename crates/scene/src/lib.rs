//! The scene file: its text, its parameters, and [`Scene`], which is valid once it is constructed.
//!
//! The feature `schema` adds the module `schema`, the JSON schema of scene files.

mod check;
mod positions;
pub mod report;
#[cfg(feature = "schema")]
pub mod schema;
mod tables;
pub mod template;
mod text;

use std::{collections::HashSet, fmt, sync::Arc};

use bansho_base::{
    camera::{CameraParameters, SKY_FOV_DEG},
    parameters::{
        self, Parameter, Parameters, Problem, ProblemKind, Problems, Reader, Table, TableDescriptor, Value,
        animated::Animated,
    },
    phenomenon::kind::{self, CheckedParameters, Describe, PhenomenonKind},
    world::{air::Air, obstacle::ObstacleParameters, sky::SkyParameters, wind::WindParameters},
};

use bansho_environment::ground::GroundParameters;

pub use self::{
    check::{PLATE_LAYER, report_build_error},
    positions::Positions,
    report::SceneError,
    tables::{
        defaults::ImpliedBackdrop,
        depth::{DepthFit, DepthScale},
        ground_fit::{GroundFit, PlateView},
        picture::{self, DepthKind, FrameRate, LightParameters, PictureParameters, PlateAlpha, PlateParameters},
        plate::{PlateDepth, PlatePictures, PlateRemark},
    },
    text::{
        edit::{self, operation},
        lines::LineColumn,
        path::{Segment, ValuePath},
    },
};
use self::{tables::defaults, text::toml};

/// The scene format that this version reads and writes.
pub const FORMAT: i64 = 2;

/// Parses the TOML `text` of a scene to values with spans, without checking them.
///
/// # Errors
/// The text is not TOML.
pub fn parse_values(text: &str) -> Result<Table, Problem> {
    toml::parse(text)
}

/// A shared table of the scene file: a table that is not a phenomenon.
pub struct SharedTable {
    /// Its key.
    pub key: &'static str,
    /// Whether it is a list of tables (`[[light]]`).
    pub is_list: bool,
    /// Its parameters.
    pub table: fn() -> &'static TableDescriptor,
    /// Makes the animated parameters of a scene periodic. Returns the first one whose values at the beginning and at the end differ.
    close_loop: fn(&mut Scene, f64) -> Option<String>,
}

/// The shared tables in their recommended order.
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
    is_list: bool,
    table: fn() -> &'static TableDescriptor,
    close_loop: fn(&mut Scene, f64) -> Option<String>,
) -> SharedTable {
    SharedTable { key, is_list, table, close_loop }
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

impl Instance {
    /// A phenomenon with parameters that a program has set. [`Scene::check`] checks them.
    pub fn new<P: Describe>(name: impl Into<String>, parameters: P) -> Self {
        Self { kind: P::KIND, name: name.into(), enabled: true, parameters: kind::set_parameters(parameters) }
    }

    /// The same phenomenon with other parameters, which a program has set.
    ///
    /// # Errors
    /// Every value that is out of range or not finite, with the path of its parameter and what is allowed.
    pub fn with_parameters<P: Describe>(&self, parameters: P) -> Result<Self, ParameterProblems> {
        let changed = Self { enabled: self.enabled, ..Self::new(self.name.clone(), parameters) };
        let mut reader = Reader::new();
        reader.within(self.name.clone(), |reader| changed.parameters.check_values(reader));
        if reader.is_clean() { Ok(changed) } else { Err(ParameterProblems(reader.into_problems())) }
    }
}

/// Problems of parameters that a program has set, each with the path of the parameter, what is wrong and what is allowed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ParameterProblems(pub Problems);

impl std::error::Error for ParameterProblems {}

impl fmt::Display for ParameterProblems {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, problem) in self.0.listed.iter().enumerate() {
            write!(f, "{}{problem}", if index > 0 { "\n" } else { "" })?;
        }
        match self.0.omitted {
            0 => Ok(()),
            omitted => write!(f, "\nand {omitted} more"),
        }
    }
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
    /// Which of sky, ground and lights are implied, since the text does not state them.
    pub implied: ImpliedBackdrop,
    /// Seed of all random numbers: that of `[picture]`, or of [`SceneOptions`].
    pub seed: u64,
    /// Length of the seamless loop, a whole number of frames, s; `None` if the scene does not loop.
    pub loop_s: Option<f64>,
}

/// Options of a scene that are not part of its text.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SceneOptions {
    /// Replaces the scene's seed.
    pub seed: Option<u64>,
    /// Makes the scene a seamless loop of this length, rounded to whole frames, s.
    pub loop_s: Option<f64>,
    /// Whether the implied sky, ground and lamps are visible. They light the scene in any case.
    pub implied_backdrop: bool,
}

/// Why a scene cannot loop.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LoopError {
    /// A loop shorter than two frames or longer than an hour.
    #[error("a loop of {seconds} s is out of range; allowed: {min} (two frames) to 3600 s")]
    Length {
        /// The requested length.
        seconds: f64,
        /// The length of two frames.
        min: f64,
    },
    /// An animated parameter has different values at the beginning and at the end.
    #[error(
        "the loop of {seconds} s jumps: {path} differs between its beginning and its end; allowed: equal values at 0 s and at {seconds} s"
    )]
    NotSeamless {
        /// Length of the loop.
        seconds: f64,
        /// Path of the parameter.
        path: String,
    },
}

/// The length of a loop, rounded to whole frames.
fn loop_length(seconds: f64, fps: FrameRate) -> Result<f64, LoopError> {
    let min = 2.0 * fps.frame_s();
    if !(min * 0.999..=3600.0).contains(&seconds) {
        let min = (1e3 * min).ceil() / 1e3;
        return Err(LoopError::Length { seconds, min });
    }
    Ok((seconds / fps.frame_s()).round() * f64::from(fps.seconds) / f64::from(fps.frames))
}

impl Scene {
    /// Parses and checks the scene `text`; `file` is its name in messages. No asset is read and nothing is built: see
    /// `bansho_render::CompiledScene` for that.
    ///
    /// # Errors
    /// All problems of the text, each with its position, what is wrong and what is allowed.
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

    /// Reads and checks a scene whose tables a program has made. No text is printed or parsed.
    ///
    /// # Errors
    /// All problems, each with the path of its parameter, what is wrong and what is allowed.
    pub fn from_table(root: &Table, kinds: &[PhenomenonKind]) -> Result<Self, ParameterProblems> {
        let mut reader = Reader::new();
        let scene = Self::read(root, kinds, &mut reader);
        if reader.is_clean() {
            check::values(&scene, root, &mut reader);
        }
        if reader.is_clean() { Ok(scene) } else { Err(ParameterProblems(reader.into_problems())) }
    }

    /// Checks all values and how they fit together, after a program has changed them.
    ///
    /// # Errors
    /// All problems, each with the path of its parameter, what is wrong and what is allowed.
    pub fn check(&self) -> Result<(), ParameterProblems> {
        let mut reader = Reader::new();
        reader.within("picture", |reader| self.picture.check_values(reader));
        reader.within("camera", |reader| self.camera.check_values(reader));
        reader.within("plate", |reader| self.plate.check_values(reader));
        reader.within("wind", |reader| self.wind.check_values(reader));
        reader.within("air", |reader| self.air.check_values(reader));
        reader.within("sky", |reader| self.sky.iter().for_each(|sky| sky.check_values(reader)));
        reader.within("ground", |reader| self.ground.iter().for_each(|ground| ground.check_values(reader)));
        check_list("light", &self.lights, &mut reader);
        check_list("obstacle", &self.obstacles, &mut reader);
        self.check_instances(&mut reader);
        check::values(self, &Table::default(), &mut reader);
        if reader.is_clean() { Ok(()) } else { Err(ParameterProblems(reader.into_problems())) }
    }

    fn check_instances(&self, reader: &mut Reader) {
        let mut names = HashSet::new();
        for instance in &self.instances {
            reader.within(instance.name.clone(), |reader| {
                check::instance_name(&instance.name, reader);
                if !names.insert(instance.name.as_str()) {
                    reader.report_value(ProblemKind::DuplicateName { name: instance.name.clone() });
                }
                instance.parameters.check_values(reader);
            });
        }
    }

    /// Whence the plate of frame `frame` was taken: by the camera at the middle of the exposure, above the ground.
    pub fn plate_view(&self, frame: i64) -> PlateView {
        let size = self.picture.size.map(|side| side as usize);
        let frame_s = self.picture.fps.frame_s();
        let exposed_s = self.camera.shutter_s.unwrap_or(0.5 * frame_s);
        let time = (frame - self.picture.first_frame) as f64 * frame_s + self.camera.shutter_offset_s + 0.5 * exposed_s;
        let ground_height = self.ground.as_ref().map(|ground| ground.height);
        PlateView { camera: self.camera.at(time, size), size, ground_height }
    }

    /// Applies the options: replaces the seed, closes the loop, hides the implied backdrop.
    ///
    /// # Errors
    /// The length of the loop is out of range, or an animated parameter has different values at its beginning and its end.
    pub fn with_options(mut self, options: &SceneOptions) -> Result<Self, LoopError> {
        if let Some(seed) = options.seed {
            self.seed = seed;
        }
        if !options.implied_backdrop {
            self.hide_implied_backdrop();
        }
        self.loop_s = options.loop_s.map(|seconds| loop_length(seconds, self.picture.fps)).transpose()?;
        let Some(seconds) = self.loop_s else { return Ok(self) };
        let discontinuity =
            |table: &SharedTable| (table.close_loop)(&mut self, seconds).map(|rest| parameters::path(table.key, &rest));
        match SHARED_TABLES.iter().find_map(discontinuity) {
            Some(path) => Err(LoopError::NotSeamless { seconds, path }),
            None => Ok(self),
        }
    }

    fn read(root: &Table, kinds: &[PhenomenonKind], reader: &mut Reader) -> Self {
        check::root_keys(root, kinds, reader);
        let (completed, implied) = defaults::with_defaults(root, kinds);
        Self::read_completed(&completed, kinds, implied, reader).with_camera_toward_sky(&completed)
    }

    /// Reads a scene from a `root` that includes the defaults of [`defaults::with_defaults`].
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

    /// Points a camera without position and target at the sky if all phenomena are in the sky.
    fn with_camera_toward_sky(mut self, root: &Table) -> Self {
        let states = |key: &str| match root.get("camera").map(|node| &node.value) {
            Some(Value::Table(camera)) => camera.get(key).is_some(),
            _ => false,
        };
        let all_in_the_sky =
            !self.instances.is_empty() && self.instances.iter().all(|instance| instance.kind.in_the_sky);
        if all_in_the_sky && self.obstacles.is_empty() && !self.has_plate() && !states("position") && !states("target")
        {
            self.camera.look_up();
            if !states("vertical_fov_deg") {
                self.camera.vertical_fov_deg = Animated::from(SKY_FOV_DEG);
            }
        }
        self
    }

    /// The paths of all files that the scene names, as they are in its text.
    pub fn asset_paths(&self) -> Vec<String> {
        let plate = [&self.plate.image, &self.plate.depth].into_iter().flatten();
        let obstacles = self.obstacles.iter().filter_map(|obstacle| obstacle.file.as_ref());
        let shared = plate.chain(obstacles).map(|path| path.0.clone());
        shared.chain(self.instances.iter().flat_map(|instance| instance.parameters.assets())).collect()
    }

    /// Hides the implied sky, ground and lamps; sky and lamps still light the scene.
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

    /// Whether a sky or a ground that the text states is visible.
    pub fn shows_stated_backdrop(&self) -> bool {
        let sky = self.sky.as_ref().is_some_and(|sky| sky.visible) && !self.implied.sky;
        sky || self.ground.is_some() && !self.implied.ground
    }

    /// Whether the phenomena are composited over a plate.
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

/// The tables of the list `[[key]]`.
fn tables<'a>(root: &'a Table, key: &'static str, reader: &mut Reader) -> Vec<&'a Table> {
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

fn check_list<P: Parameters>(key: &'static str, list: &[P], reader: &mut Reader) {
    for (index, parameters) in list.iter().enumerate() {
        reader.within(key, |reader| reader.within(index.to_string(), |reader| parameters.check_values(reader)));
    }
}

fn default_name(key: &str, index: usize) -> String {
    if index == 0 { key.to_owned() } else { format!("{key} {}", index + 1) }
}
