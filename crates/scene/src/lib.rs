//! The scene file: its text, its parameters, and [`Scene`], which is valid once it is constructed.
//!
//! The feature `schema` adds the module `schema`, the JSON schema of scene files.

mod check;
mod paper;
pub mod report;
#[cfg(feature = "schema")]
pub mod schema;
mod shared;
mod tables;
pub mod template;
mod text;

use std::{collections::HashSet, fmt, sync::Arc};

use bansho_base::{
    camera::{CameraParameters, SKY_FOV_DEG},
    host::memory,
    parameters::{
        self, Auto, Parameter, Parameters, Problem, ProblemKind, Problems, Reader, Table, Value, animated::Animated,
    },
    tables::{PhenomenonTable, ReadPhenomenon, TableKind, TableRole, find, phenomena},
    world::{air::Air, wind::WindParameters},
};

pub use self::{
    check::report_build_error,
    paper::PaperDeparture,
    report::{Positions, SceneError},
    shared::{SharedInstance, SharedTables},
    tables::{
        depth::{DepthDoubt, DepthFit, DepthScale, DepthValues},
        ground_fit::{GroundFit, PlateView},
        kinds::{self, GLARE_LAYER, PLATE_LAYER},
        picture::{self, DepthKind, FrameRate, PictureParameters, PlateAlpha, PlateParameters, PlateSky},
        plate::{PlateDepth, PlatePictures},
        plate_checks::PlateRemark,
        plate_surfaces::PlateSurfaces,
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

/// A phenomenon of the scene.
#[derive(Clone)]
pub struct Instance {
    /// Its kind.
    pub kind: TableKind,
    /// Its name, unique in the scene.
    pub name: String,
    /// Whether it is drawn.
    pub enabled: bool,
    /// Its parameters.
    pub parameters: Arc<dyn PhenomenonTable>,
}

impl Instance {
    /// A phenomenon with parameters that a program has set. [`Scene::check`] checks them.
    pub fn new(name: impl Into<String>, parameters: impl PhenomenonTable) -> Self {
        Self { kind: parameters.kind(), name: name.into(), enabled: true, parameters: Arc::new(parameters) }
    }

    /// The same phenomenon with other parameters, which a program has set.
    ///
    /// # Errors
    /// Every value that is out of range or not finite, with the path of its parameter and what is allowed.
    pub fn with_parameters(&self, parameters: impl PhenomenonTable) -> Result<Self, ParameterProblems> {
        let changed = Self { enabled: self.enabled, ..Self::new(self.name.clone(), parameters) };
        let mut reader = Reader::new();
        reader.within(self.name.clone(), |reader| changed.parameters.report_values(reader));
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
    /// The kinds of tables that it may have.
    pub kinds: Arc<[TableKind]>,
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
    /// The tables that all phenomena share, such as sky, ground, lights and obstacles.
    pub tables: SharedTables,
    /// Phenomena in the order of the file.
    pub instances: Vec<Instance>,
    /// Keys of the shared tables that the text omits and the phenomena imply. These always light the scene; they are visible if
    /// [`SceneOptions::implied_backdrop`] is set.
    pub implied: Vec<&'static str>,
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
    #[error("a loop of {seconds} s; allowed: {min} s (two frames) to 3600 s")]
    Length {
        /// The requested length.
        seconds: f64,
        /// The length of two frames.
        min: f64,
    },
    /// An animated parameter has different values at the beginning and at the end.
    #[error(
        "the loop of {seconds} s is not seamless: {path} differs between its beginning and its end; allowed: equal values at 0 s and at {seconds} s"
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
    pub fn parse(file: &str, text: &str, kinds: &[TableKind]) -> Result<Self, SceneError> {
        let parsed = Self::parse_text(text, kinds);
        parsed.map_err(|Problems { listed, omitted }| SceneError {
            file: file.to_owned(),
            text: text.to_owned(),
            problems: listed,
            omitted,
        })
    }

    fn parse_text(text: &str, kinds: &[TableKind]) -> Result<Self, Problems> {
        let root = toml::parse(text).map_err(|problem| Problems { listed: vec![problem], omitted: 0 })?;
        let mut reader = Reader::new();
        if !check::format(&root, &mut reader) {
            return Err(reader.into_problems());
        }
        let scene = Self::read(&root, kinds, &mut reader);
        // A check of values that could not be read would report them twice.
        if reader.is_clean() {
            check::values(&scene, &root, &mut reader);
        }
        if reader.is_clean() { Ok(scene) } else { Err(reader.into_problems()) }
    }

    /// Reads and checks a scene whose tables a program has made. No text is printed or parsed.
    ///
    /// # Errors
    /// All problems, each with the path of its parameter, what is wrong and what is allowed.
    pub fn from_table(root: &Table, kinds: &[TableKind]) -> Result<Self, ParameterProblems> {
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
        self.tables.report_values(&mut reader);
        self.check_instances(&mut reader);
        check::values(self, &Table::default(), &mut reader);
        if reader.is_clean() { Ok(()) } else { Err(ParameterProblems(reader.into_problems())) }
    }

    fn check_instances(&self, reader: &mut Reader) {
        let mut names = HashSet::new();
        for instance in &self.instances {
            reader.within(instance.name.clone(), |reader| {
                check::instance_name(&instance.name, &self.kinds, reader);
                if !names.insert(instance.name.as_str()) {
                    reader.report_value(ProblemKind::DuplicateName { name: instance.name.clone() });
                }
                instance.parameters.report_values(reader);
            });
        }
    }

    /// The view from which the plate of frame `frame` was taken: the camera at the middle of the exposure, and the height of the ground.
    pub fn plate_view(&self, frame: i64) -> PlateView {
        let size = self.picture.size.map(|side| side as usize);
        let frame_s = self.picture.fps.frame_s();
        let exposed_s = self.camera.shutter_s.unwrap_or(0.5 * frame_s);
        let time = (frame - self.picture.first_frame) as f64 * frame_s + self.camera.shutter_offset_s + 0.5 * exposed_s;
        let ground_height = self.tables.level_ground(time).map(|ground| ground.height);
        let camera = self.camera.of_exposure(time, frame_s).at(time, size);
        PlateView { camera, size, ground_height }
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
            self.tables.hide(&self.implied);
        }
        self.loop_s = options.loop_s.map(|seconds| loop_length(seconds, self.picture.fps)).transpose()?;
        let Some(seconds) = self.loop_s else { return Ok(self) };
        match self.repeat_after(seconds) {
            Some(path) => Err(LoopError::NotSeamless { seconds, path }),
            None => Ok(self),
        }
    }

    /// Makes the keyframed values of all shared tables repeat. Returns the path of the first whose values at the beginning and at the end differ. Phenomena
    /// do so when they are built.
    fn repeat_after(&mut self, seconds: f64) -> Option<String> {
        let tables = [
            ("picture", self.picture.close_loop(seconds)),
            ("camera", self.camera.close_loop(seconds)),
            ("plate", self.plate.close_loop(seconds)),
            ("wind", self.wind.close_loop(seconds)),
            ("air", self.air.close_loop(seconds)),
        ];
        let jump = tables.into_iter().find_map(|(key, jump)| Some(parameters::path(key, &jump?)));
        jump.or_else(|| self.tables.repeat_after(seconds))
    }

    fn read(root: &Table, kinds: &[TableKind], reader: &mut Reader) -> Self {
        check::root_keys(root, kinds, reader);
        let (completed, implied) = defaults::with_defaults(root, kinds);
        let scene = Self::read_completed(&completed, kinds, implied, reader).with_camera_toward_sky(&completed);
        // Of values that are wrong in themselves it is not asked whether they go together.
        if reader.is_clean() {
            check::exposure(root, reader);
        }
        scene
    }

    /// Reads a scene from a `root` that includes the defaults of [`defaults::with_defaults`].
    fn read_completed(root: &Table, kinds: &[TableKind], implied: Vec<&'static str>, reader: &mut Reader) -> Self {
        let mut picture: PictureParameters = read_field(root, "picture", reader);
        // Settings of a camera come before the default exposure of the scene's phenomena.
        if let Some(ev100) = picture.ev100_of_camera() {
            picture.exposure_ev100 = Auto::Set(ev100);
        }
        reader.set_frame_rate(picture.fps.frames, picture.fps.seconds);
        let mut scene = Self {
            kinds: kinds.into(),
            seed: picture.seed as u64,
            loop_s: None,
            picture,
            camera: read_field(root, "camera", reader),
            plate: read_field(root, "plate", reader),
            wind: read_field(root, "wind", reader),
            air: read_field(root, "air", reader),
            tables: SharedTables::read(root, kinds, reader),
            instances: read_instances(root, kinds, reader),
            implied,
        };
        if scene.picture.white_balance_k.is_none() {
            scene.picture.white_balance_k = scene.tables.iter().find_map(|table| table.parameters.white_balance_k());
        }
        scene
    }

    /// Points a camera without position and target at the sky if all phenomena are in the sky.
    fn with_camera_toward_sky(mut self, root: &Table) -> Self {
        let all_in_the_sky =
            !self.instances.is_empty() && self.instances.iter().all(|instance| instance.kind.in_the_sky);
        if all_in_the_sky
            && !self.tables.iter().any(determines_view)
            && !self.has_plate()
            && !states_in(root, "camera", "position")
            && !states_in(root, "camera", "target")
        {
            self.camera.look_up();
            if !states_in(root, "camera", "vertical_fov_deg") {
                self.camera.vertical_fov_deg = Animated::from(SKY_FOV_DEG);
            }
        }
        self
    }

    /// The paths of all files that the scene names, as they are in its text.
    pub fn asset_paths(&self) -> Vec<String> {
        let shared = self.tables.iter().flat_map(|table| table.parameters.asset_paths());
        self.plate
            .files()
            .map(|(_, path)| path.0.clone())
            .chain(shared)
            .chain(self.instances.iter().flat_map(|instance| instance.parameters.asset_paths()))
            .collect()
    }

    /// Whether a sky, a ground or another table that fills the background is visible, and stated by the text.
    pub fn shows_stated_backdrop(&self) -> bool {
        let mut stated = self.tables.iter().filter(|table| !self.implied.contains(&table.kind.key));
        stated.any(|table| table.parameters.fills_background())
    }

    /// Whether the phenomena are composited over a plate.
    pub fn has_plate(&self) -> bool {
        self.plate.image.is_some()
    }

    /// Whether the lights of the scene light what its plate shows.
    pub fn lights_plate(&self) -> bool {
        self.has_plate() && self.plate.albedo.is_some()
    }
}

/// Whether the scene `root` states `key` of one of its tables.
fn states_in(root: &Table, table: &str, key: &str) -> bool {
    match root.get(table).map(|node| &node.value) {
        Some(Value::Table(table)) => table.get(key).is_some(),
        _ => false,
    }
}

fn read_field<P: Parameters>(root: &Table, key: &'static str, reader: &mut Reader) -> P {
    let Some(table) = shared::single(root, key, reader) else { return P::default() };
    reader.within(key, |reader| P::read_table(table, reader, &[]))
}

/// Whether a table determines what a picture shows, so that the camera is not aimed by the phenomena.
fn determines_view(table: &SharedInstance) -> bool {
    table.kind.shared_role().is_some_and(|role| role.determines_view)
}

fn read_instances(root: &Table, kinds: &[TableKind], reader: &mut Reader) -> Vec<Instance> {
    let mut instances: Vec<Instance> = Vec::new();
    if !check_instance_memory(root, kinds, reader) {
        return instances;
    }
    let mut names = HashSet::new();
    for entry in &root.entries {
        let Some(kind) = find(kinds, &entry.key) else { continue };
        let TableRole::Phenomenon(read) = kind.role else { continue };
        for (index, table) in shared::items(root, kind.key, reader).into_iter().enumerate() {
            let instance = reader.within(format!("{}.{index}", kind.key), |reader| {
                let name = table.get("name").and_then(|node| reader.within("name", |r| check::name(node, kinds, r)));
                let name = name.unwrap_or_else(|| default_name(kind.key, index));
                let instance = read_instance(*kind, name, read, table, reader);
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

/// Whether the system can allocate the memory of all phenomena, before any is read; reports the most that fit.
fn check_instance_memory(root: &Table, kinds: &[TableKind], reader: &mut Reader) -> bool {
    let mut bytes = 0.0;
    for entry in &root.entries {
        let Some(kind) = phenomena(kinds).find(|kind| kind.key == entry.key) else { continue };
        let Some(Value::List(items)) = root.get(kind.key).map(|node| &node.value) else { continue };
        let count = items.len();
        let others = bytes;
        bytes += count as f64 * kind.built_bytes;
        if memory::can_allocate(bytes) {
            continue;
        }
        let most = memory::largest_fitting_count(count as i64, |count| {
            memory::can_allocate(others + count as f64 * kind.built_bytes)
        });
        let required = memory::format_bytes(bytes as u64);
        let message = format!("{count} tables [[{}]] would take {required}; allowed: up to {most}", kind.key);
        reader.report_at(Some(entry.key_span.clone()), ProblemKind::Conflict(message));
        return false;
    }
    true
}

fn read_instance(kind: TableKind, name: String, read: ReadPhenomenon, table: &Table, reader: &mut Reader) -> Instance {
    let enabled = table.get("enabled").and_then(|node| reader.within("enabled", |r| bool::read(node, &(), "", r)));
    Instance { kind, name, enabled: enabled.unwrap_or(true), parameters: read(table, reader) }
}

fn default_name(key: &str, index: usize) -> String {
    if index == 0 { key.to_owned() } else { format!("{key} {}", index + 1) }
}
