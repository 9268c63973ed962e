//! The text of a scene, its folder, and the changes to it for one job.

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
    assets::{FileAssets, InputLimits},
    files::input::{self, InputError},
};
use bansho_render::CompiledScene;
use bansho_scene::{
    Scene, SceneError,
    edit::{self, EditError},
};

use super::error::JobError;
use crate::{KINDS, parse_scene};

/// Maximum size of a scene's text, bytes.
pub const MAX_SCENE_BYTES: u64 = 16 << 20;

/// The file of a scene, read and not yet checked.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SceneFile {
    /// Its name in messages.
    pub name: String,
    /// Its name without folder and extension, from which outputs are named.
    pub stem: String,
    /// The folder to which paths in it are relative.
    pub folder: PathBuf,
    /// Its text, TOML.
    pub text: String,
    /// Changes for this job, each in the form `key.path=value`.
    pub changes: Vec<String>,
    /// Limits of the files that it names: their memory and their folder.
    pub input_limits: InputLimits,
}

impl SceneFile {
    /// Reads the scene at `path`.
    ///
    /// # Errors
    /// The file does not exist, is no regular file, is larger than [`MAX_SCENE_BYTES`], cannot be read, or is not UTF-8.
    pub fn read(path: &Path) -> Result<Self, JobError> {
        let bytes = input::read(path, MAX_SCENE_BYTES).map_err(|source| {
            let suggestion = if is_missing(&source) { suggest_file(path) } else { None };
            JobError::Unreadable { path: path.to_path_buf(), source, suggestion }
        })?;
        Ok(Self {
            name: path.display().to_string(),
            stem: path.file_stem().unwrap_or(path.as_os_str()).to_string_lossy().into_owned(),
            folder: path.parent().map(Path::to_path_buf).unwrap_or_default(),
            text: decode(path, bytes)?,
            changes: Vec::new(),
            input_limits: InputLimits::default(),
        })
    }

    /// Reads a scene from a `stream`. Messages and outputs call it `name`; paths in it are relative to the current folder.
    ///
    /// # Errors
    /// It is larger than [`MAX_SCENE_BYTES`], cannot be read, or is not UTF-8.
    pub fn read_stream(name: &str, stream: impl Read) -> Result<Self, JobError> {
        let path = Path::new(name);
        let bytes = input::read_stream(stream, MAX_SCENE_BYTES);
        let bytes =
            bytes.map_err(|source| JobError::Unreadable { path: path.to_path_buf(), source, suggestion: None })?;
        Ok(Self {
            name: name.to_owned(),
            stem: name.to_owned(),
            folder: PathBuf::new(),
            text: decode(path, bytes)?,
            changes: Vec::new(),
            input_limits: InputLimits::default(),
        })
    }

    /// Applies the changes and parses the scene. Files that it names are not read.
    ///
    /// # Errors
    /// The problems of the file if it has any, with their lines; else those of the changes.
    pub fn parse(&self) -> Result<Scene, JobError> {
        let changed = match self.changed() {
            // The text is not TOML: the parser has the better message.
            Err(JobError::Edit { source: EditError::Syntax(_), .. }) => self.text.clone(),
            changed => changed?,
        };
        let error = match parse_scene(&self.name, &changed) {
            Ok(scene) => return Ok(scene),
            Err(error) => Box::new(error),
        };
        match parse_scene(&self.name, &self.text) {
            _ if self.changes.is_empty() => Err(JobError::Scene(error)),
            // If the file itself has the same problems, they are reported at its positions; otherwise at those of the changed text.
            Err(own) if has_problems_of(&own, &error) => Err(JobError::Scene(Box::new(own))),
            _ => Err(self.as_changed(*error)),
        }
    }

    /// Builds a `scene` that was parsed from this file, and reads the files that it names.
    ///
    /// # Errors
    /// Problems that are only found by building, like those of [`parse`](Self::parse).
    pub fn compile(&self, scene: Scene, assets: &Arc<dyn Assets>) -> Result<Arc<CompiledScene>, JobError> {
        let errors = match CompiledScene::build(Arc::new(scene), assets.clone(), None) {
            Ok(compiled) => return Ok(Arc::new(compiled)),
            Err(errors) => errors,
        };
        if self.changes.is_empty() {
            return Err(JobError::Scene(Box::new(errors.located(&self.name, &self.text))));
        }
        // If they are those of the unchanged file, they are reported there.
        let own = parse_scene(&self.name, &self.text).ok();
        match own.map(|own| CompiledScene::build(Arc::new(own), assets.clone(), None)) {
            Some(Err(own)) if own == errors => Err(JobError::Scene(Box::new(own.located(&self.name, &self.text)))),
            _ => Err(self.as_changed(errors.located(&self.name, &self.changed()?))),
        }
    }

    /// Reads the files that the scene names from its folder, within its limits.
    pub fn assets(&self) -> Arc<dyn Assets> {
        Arc::new(FileAssets::with_limits(&self.folder, self.input_limits.clone()))
    }

    fn as_changed(&self, error: SceneError) -> JobError {
        JobError::ChangedScene(Box::new(SceneError { file: format!("{} as changed", self.name), ..error }))
    }

    /// The error for a problem at the dotted `path`, with its line. For problems that only the job finds, such as too little memory.
    pub(crate) fn error_at(&self, path: &str, kind: ProblemKind) -> JobError {
        let own = SceneError::at(&self.name, &self.text, path, kind.clone());
        let changed = self.changed().unwrap_or_else(|_| self.text.clone());
        let as_changed = SceneError::at(&format!("{} as changed", self.name), &changed, path, kind);
        // The file causes the problem if it has the same text there without the changes.
        if marked_text(&own) == marked_text(&as_changed) {
            JobError::Scene(Box::new(own))
        } else {
            JobError::ChangedScene(Box::new(as_changed))
        }
    }

    /// The text with the changes.
    pub(crate) fn changed(&self) -> Result<String, JobError> {
        let mut text = self.text.clone();
        for assignment in &self.changes {
            text = edit::set(&text, assignment, KINDS)
                .map_err(|source| JobError::Edit { assignment: assignment.clone(), source })?;
        }
        Ok(text)
    }
}

/// Whether the problems of an unchanged file are those of the changed one.
fn has_problems_of(own: &SceneError, changed: &SceneError) -> bool {
    own.problems.iter().map(ToString::to_string).eq(changed.problems.iter().map(ToString::to_string))
}

fn is_missing(error: &InputError) -> bool {
    matches!(error, InputError::Io(error) if error.kind() == io::ErrorKind::NotFound)
}

/// The bytes of a scene as text.
fn decode(path: &Path, bytes: Vec<u8>) -> Result<String, JobError> {
    String::from_utf8(bytes).map_err(|error| {
        let valid = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        let line = 1 + valid.iter().filter(|&&byte| byte == b'\n').count();
        JobError::NotUtf8 { path: path.to_path_buf(), line }
    })
}

/// The scene in the folder of the missing file `path` whose name is most similar.
fn suggest_file(path: &Path) -> Option<PathBuf> {
    let folder = path.parent()?;
    let listed = fs::read_dir(if folder.as_os_str().is_empty() { Path::new(".") } else { folder }).ok()?;
    let scenes =
        listed.filter_map(|entry| Some(entry.ok()?.file_name().into_string().ok()?.strip_suffix(".toml")?.to_owned()));
    let mut scenes: Vec<String> = scenes.collect();
    scenes.sort_unstable();
    let name = path.file_name()?.to_str()?;
    let similar = nearest(name.strip_suffix(".toml").unwrap_or(name), scenes.iter().map(String::as_str))?;
    Some(folder.join(format!("{similar}.toml")))
}

/// The text that the first problem of a scene marks.
fn marked_text(error: &SceneError) -> Option<&str> {
    error.text.get(error.problems.first()?.span.clone()?)
}
