//! Documents in files: opening, atomic saving, and the list of recent files.

pub mod autosave;
#[cfg(not(target_arch = "wasm32"))]
pub mod watch;

use std::{
    fs, io,
    path::{Path, PathBuf},
    sync::Arc,
};

use bansho::{
    job::{JobError, SceneFile},
    media::{
        MediaError,
        files::{atomic, overwrite_policy::OverwritePolicy},
    },
};

use super::Document;

/// Why a scene file cannot be opened.
#[derive(Debug, thiserror::Error)]
#[error(transparent)]
pub struct OpenError(Box<JobError>);

/// The text in `path`.
///
/// # Errors
/// There is no such file, it cannot be read, or it is not UTF-8.
pub fn read(path: &Path) -> Result<String, OpenError> {
    SceneFile::read(path).map(|file| file.text).map_err(|error| OpenError(Box::new(error)))
}

/// Opens the scene in `path`.
///
/// # Errors
/// As [`read`].
pub fn open(path: &Path) -> Result<Document, OpenError> {
    Ok(Document::new(path.display().to_string(), read(path)?))
}

/// Saves `text` to `path`, atomically. `text` is the text of `document`, or the same scene with paths adjusted to another folder, which
/// then becomes an undo step.
///
/// # Errors
/// The file cannot be written. A previous file and the document are unchanged then.
pub fn save(document: &mut Document, path: &Path, text: Arc<str>) -> Result<(), MediaError> {
    // The user has chosen this file, and was asked where another program had changed it.
    atomic::write_bytes(path, text.as_bytes(), &OverwritePolicy::any())?;
    if text != *document.text() {
        document.end_step();
        document.replace("paths", &text);
        document.end_step();
    }
    document.mark_saved(text);
    document.rename(path.display().to_string());
    Ok(())
}

/// Whether `path` has the extension of scene files, `.toml`.
pub fn has_scene_extension(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml"))
}

/// `path`, with `.toml` appended unless it has that extension.
pub fn with_scene_extension(path: PathBuf) -> PathBuf {
    if has_scene_extension(&path) {
        return path;
    }
    let mut name = path.into_os_string();
    name.push(".toml");
    name.into()
}

/// Writes a copy of `text` beside `path`, after a panic, and returns its path. Earlier copies are not overwritten.
///
/// # Errors
/// The copy cannot be written.
pub fn save_rescue_copy(text: &str, path: &Path) -> Result<PathBuf, MediaError> {
    write_to_free_name(|which| path.with_extension(format!("rescued{which}.toml")), text.as_bytes())
}

/// Maximum number of files whose names differ in a number only.
const MAX_NUMBERED_FILES: usize = 1000;

/// Writes `bytes` to the first of several numbered files that does not exist, or that has just this content. Returns its path. `named`
/// makes a path from a suffix: empty, ` 2`, ` 3` and so on.
///
/// # Errors
/// The file cannot be written, or too many names are taken.
pub fn write_to_free_name(named: impl Fn(&str) -> PathBuf, bytes: &[u8]) -> Result<PathBuf, MediaError> {
    let mut file = named("");
    for number in 2..=MAX_NUMBERED_FILES {
        if fs::symlink_metadata(&file).is_err() {
            atomic::write_new(&file, bytes)?;
            return Ok(file);
        }
        if fs::read(&file).is_ok_and(|content| content == bytes) {
            return Ok(file);
        }
        file = named(&format!(" {number}"));
    }
    Err(MediaError::Io { path: file, source: io::ErrorKind::AlreadyExists.into() })
}

/// How another program changed a file since it was opened or saved here.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ExternalChange {
    /// It has the same text.
    Unchanged,
    /// It has this text.
    Changed(Arc<str>),
    /// It cannot be read as text, for this reason.
    Unreadable(String),
    /// It was deleted.
    Deleted,
}

/// How another program changed the file `path` of `document`.
pub fn external_change(document: &Document, path: &Path) -> ExternalChange {
    match fs::read_to_string(path) {
        Ok(text) if *text != *document.saved => ExternalChange::Changed(text.into()),
        Ok(_) => ExternalChange::Unchanged,
        Err(error) if error.kind() == io::ErrorKind::NotFound => ExternalChange::Deleted,
        Err(error) => ExternalChange::Unreadable(error.to_string()),
    }
}

/// Recently opened files, the newest first. They are stored as one path per line.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RecentFiles {
    file: Option<PathBuf>,
    paths: Vec<PathBuf>,
}

/// Maximum number of recent files.
const MAX_RECENT_FILES: usize = 12;

impl RecentFiles {
    /// Reads the list in `file`; empty where there is none.
    pub fn read(file: PathBuf) -> Self {
        let text = fs::read_to_string(&file).unwrap_or_default();
        let paths = text.lines().filter(|line| !line.is_empty()).map(PathBuf::from).take(MAX_RECENT_FILES).collect();
        Self { file: Some(file), paths }
    }

    /// The files, the newest first.
    pub fn paths(&self) -> &[PathBuf] {
        &self.paths
    }

    /// Puts `path` first and stores the list.
    ///
    /// # Errors
    /// The list cannot be written. It stays valid in memory.
    pub fn add(&mut self, path: &Path) -> Result<(), MediaError> {
        let path = fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf());
        self.paths.retain(|other| *other != path);
        self.paths.insert(0, path);
        self.paths.truncate(MAX_RECENT_FILES);
        let Some(file) = &self.file else { return Ok(()) };
        let lines: Vec<String> = self.paths.iter().map(|path| path.display().to_string()).collect();
        let policy = OverwritePolicy::any().without_links();
        atomic::write_bytes(file, (lines.join("\n") + "\n").as_bytes(), &policy)
    }
}
