//! The text of a scene, where it lies, and changes made to it for one job.

use std::{
    fs,
    io::{self, Read},
    path::{Path, PathBuf},
    sync::Arc,
};

use bansho_base::{
    host::assets::Assets,
    parameters::{ProblemKind, nearest},
};
use bansho_media::{
    assets::InputLimits,
    files::input::{self, InputError},
};
use bansho_render::CompiledScene;
use bansho_scene::{
    Scene, SceneError,
    edit::{self, EditError},
};

use super::error::JobError;
use crate::{KINDS, parse_scene};

/// Most bytes of a scene's text.
pub const SCENE_BYTES: u64 = 16 << 20;

/// A scene that was read, not yet checked.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SceneFile {
    /// What errors call it.
    pub name: String,
    /// Name without folder and extension, for outputs.
    pub stem: String,
    /// Folder that paths in it are relative to.
    pub folder: PathBuf,
    /// The TOML.
    pub text: String,
    /// Changes for this job, each `key.path=value`.
    pub changes: Vec<String>,
    /// What the files that it names may take, and where they may lie.
    pub inputs: InputLimits,
}

impl SceneFile {
    /// Reads the scene at `path`.
    ///
    /// # Errors
    /// There is no such file, it is no ordinary one, it has more than [`SCENE_BYTES`], it cannot be read, or it is not UTF-8.
    pub fn read(path: &Path) -> Result<Self, JobError> {
        let bytes = input::read(path, SCENE_BYTES).map_err(|source| {
            let near = if is_missing(&source) { near(path) } else { None };
            JobError::Unreadable { path: path.to_path_buf(), source, near }
        })?;
        Ok(Self {
            name: path.display().to_string(),
            stem: path.file_stem().unwrap_or(path.as_os_str()).to_string_lossy().into_owned(),
            folder: path.parent().map(Path::to_path_buf).unwrap_or_default(),
            text: text(path, bytes)?,
            changes: Vec::new(),
            inputs: InputLimits::default(),
        })
    }

    /// Reads a scene from a `stream`, which errors and outputs call `name`; paths in it are relative to the current folder.
    ///
    /// # Errors
    /// It has more than [`SCENE_BYTES`], it cannot be read, or it is not UTF-8.
    pub fn read_stream(name: &str, stream: impl Read) -> Result<Self, JobError> {
        let path = Path::new(name);
        let bytes = input::read_stream(stream, SCENE_BYTES);
        let bytes = bytes.map_err(|source| JobError::Unreadable { path: path.to_path_buf(), source, near: None })?;
        Ok(Self {
            name: name.to_owned(),
            stem: name.to_owned(),
            folder: PathBuf::new(),
            text: text(path, bytes)?,
            changes: Vec::new(),
            inputs: InputLimits::default(),
        })
    }

    /// Makes the changes and reads the scene, without anything that it names.
    ///
    /// # Errors
    /// Faults of the file if it has any, at their lines; else those of the changes.
    pub fn parse(&self) -> Result<Scene, JobError> {
        let changed = match self.changed() {
            // The text itself is at fault, which the parser says better.
            Err(JobError::Edit { source: EditError::Syntax(_), .. }) => self.text.clone(),
            changed => changed?,
        };
        let error = match parse_scene(&self.name, &changed) {
            Ok(scene) => return Ok(scene),
            Err(error) => Box::new(error),
        };
        match parse_scene(&self.name, &self.text) {
            _ if self.changes.is_empty() => Err(JobError::Scene(error)),
            Err(own) => Err(JobError::Scene(Box::new(own))),
            Ok(_) => Err(self.as_changed(*error)),
        }
    }

    /// Builds all that a `scene` that was read from this file shows, and reads what it names.
    ///
    /// # Errors
    /// Faults that only building shows, as those of [`parse`](Self::parse).
    pub fn compile(&self, scene: Scene, assets: &Arc<dyn Assets>) -> Result<Arc<CompiledScene>, JobError> {
        let errors = match CompiledScene::build(Arc::new(scene), assets.clone(), None) {
            Ok(compiled) => return Ok(Arc::new(compiled)),
            Err(errors) => errors,
        };
        if self.changes.is_empty() {
            return Err(JobError::Scene(Box::new(errors.located(&self.name, &self.text))));
        }
        // Whose fault it is: the file's, if it has faults of its own.
        let own = parse_scene(&self.name, &self.text).ok();
        match own.map(|own| CompiledScene::build(Arc::new(own), assets.clone(), None)) {
            Some(Err(own)) => Err(JobError::Scene(Box::new(own.located(&self.name, &self.text)))),
            _ => Err(self.as_changed(errors.located(&self.name, &self.changed()?))),
        }
    }

    fn as_changed(&self, error: SceneError) -> JobError {
        JobError::SetScene(Box::new(SceneError { file: format!("{} as changed", self.name), ..error }))
    }

    /// A fault of what stands at the dotted `path`, which only showed when the scene was looked at from outside its text.
    pub(crate) fn fault(&self, path: &str, kind: ProblemKind) -> JobError {
        let own = SceneError::at(&self.name, &self.text, path, kind.clone());
        let changed = self.changed().unwrap_or_else(|_| self.text.clone());
        let as_changed = SceneError::at(&format!("{} as changed", self.name), &changed, path, kind);
        // Whose fault it is: the file's, if it says the same.
        if stated(&own) == stated(&as_changed) {
            JobError::Scene(Box::new(own))
        } else {
            JobError::SetScene(Box::new(as_changed))
        }
    }

    fn changed(&self) -> Result<String, JobError> {
        self.changes.iter().try_fold(self.text.clone(), |text, assignment| {
            let refused = |source| JobError::Edit { assignment: assignment.clone(), source };
            edit::set(&text, assignment, KINDS).map_err(refused)
        })
    }
}

fn is_missing(error: &InputError) -> bool {
    matches!(error, InputError::Io(error) if error.kind() == io::ErrorKind::NotFound)
}

/// The bytes of a scene as text.
fn text(path: &Path, bytes: Vec<u8>) -> Result<String, JobError> {
    String::from_utf8(bytes).map_err(|error| {
        let good = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        let line = 1 + good.iter().filter(|&&byte| byte == b'\n').count();
        JobError::NotUtf8 { path: path.to_path_buf(), line }
    })
}

/// The scene file beside `path`, which is not there, whose name is most like its.
fn near(path: &Path) -> Option<PathBuf> {
    let folder = path.parent()?;
    let listed = fs::read_dir(if folder.as_os_str().is_empty() { Path::new(".") } else { folder }).ok()?;
    let scenes =
        listed.filter_map(|entry| Some(entry.ok()?.file_name().into_string().ok()?.strip_suffix(".toml")?.to_owned()));
    let mut scenes: Vec<String> = scenes.collect();
    scenes.sort_unstable();
    let name = path.file_name()?.to_str()?;
    let meant = nearest(name.strip_suffix(".toml").unwrap_or(name), scenes.iter().map(String::as_str))?;
    Some(folder.join(format!("{meant}.toml")))
}

/// The part of the text that the first fault of a scene marks.
fn stated(error: &SceneError) -> Option<&str> {
    error.text.get(error.problems.first()?.span.clone()?)
}
