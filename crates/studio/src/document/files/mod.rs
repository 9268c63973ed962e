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
    media::{MediaError, files::atomic},
};

use super::Document;

/// Why a document cannot be opened.
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

/// Saves `document` to `path`, whole or not at all, as `text`: its own, or one that says the same from there, which is then a
/// step of its history.
///
/// # Errors
/// The file cannot be written; the one that was there stays, and so does the document.
pub fn save(document: &mut Document, path: &Path, text: Arc<str>) -> Result<(), MediaError> {
    atomic::write_bytes(path, text.as_bytes())?;
    if text != *document.text() {
        document.end_step();
        document.replace("paths", &text);
        document.end_step();
    }
    document.mark_saved(text);
    document.rename(path.display().to_string());
    Ok(())
}

/// Whether `path` ends as scenes do.
pub fn is_named_as_scene(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml"))
}

/// `path` with the ending of scenes.
pub fn named_as_scene(path: PathBuf) -> PathBuf {
    if is_named_as_scene(&path) {
        return path;
    }
    let mut whole = path.into_os_string();
    whole.push(".toml");
    whole.into()
}

/// Writes a copy beside `path`, where it is found after a failure, and says where. Earlier copies stay.
///
/// # Errors
/// The copy cannot be written.
pub fn rescue(text: &str, path: &Path) -> Result<PathBuf, MediaError> {
    write_beside(|which| path.with_extension(format!("rescued{which}.toml")), text.as_bytes())
}

/// Most files of one name that are told apart by numbers.
const MOST_OF_A_NAME: usize = 1000;

/// Writes `bytes` to the first file that is free, or that holds just them already; which one. `named` makes its path of what tells it
/// from the first: nothing, ` 2`, ` 3` and so on.
///
/// # Errors
/// The file cannot be written, or too many names are taken.
pub fn write_beside(named: impl Fn(&str) -> PathBuf, bytes: &[u8]) -> Result<PathBuf, MediaError> {
    let mut file = named("");
    for number in 2..=MOST_OF_A_NAME {
        if fs::symlink_metadata(&file).is_err() {
            atomic::write_bytes(&file, bytes)?;
            return Ok(file);
        }
        if fs::read(&file).is_ok_and(|there| there == bytes) {
            return Ok(file);
        }
        file = named(&format!(" {number}"));
    }
    Err(MediaError::Io { path: file, source: io::ErrorKind::AlreadyExists.into() })
}

/// How another program changed a file since it was opened or saved here.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ExternalChange {
    /// Nothing.
    Same,
    /// Another text.
    Changed(Arc<str>),
    /// Something that cannot be read as text, and why.
    Unreadable(String),
    /// It deleted the file.
    Gone,
}

/// What another program made of the file of `document` in `path`.
pub fn external_change(document: &Document, path: &Path) -> ExternalChange {
    match fs::read_to_string(path) {
        Ok(there) if *there != *document.saved => ExternalChange::Changed(there.into()),
        Ok(_) => ExternalChange::Same,
        Err(error) if error.kind() == io::ErrorKind::NotFound => ExternalChange::Gone,
        Err(error) => ExternalChange::Unreadable(error.to_string()),
    }
}

/// Files that were open lately, the last first, kept as one path a line.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Recent {
    file: Option<PathBuf>,
    paths: Vec<PathBuf>,
}

/// Most files that are remembered.
const MOST_RECENT: usize = 12;

impl Recent {
    /// The list in `file`; empty where there is none.
    pub fn read(file: PathBuf) -> Self {
        let text = fs::read_to_string(&file).unwrap_or_default();
        let paths = text.lines().filter(|line| !line.is_empty()).map(PathBuf::from).take(MOST_RECENT).collect();
        Self { file: Some(file), paths }
    }

    /// The files, the last first.
    pub fn paths(&self) -> &[PathBuf] {
        &self.paths
    }

    /// Puts `path` first and keeps the list.
    ///
    /// # Errors
    /// The list cannot be written; it is then right until the program ends.
    pub fn note(&mut self, path: &Path) -> Result<(), MediaError> {
        let path = fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf());
        self.paths.retain(|other| *other != path);
        self.paths.insert(0, path);
        self.paths.truncate(MOST_RECENT);
        let Some(file) = &self.file else { return Ok(()) };
        let lines: Vec<String> = self.paths.iter().map(|path| path.display().to_string()).collect();
        atomic::write_bytes(file, (lines.join("\n") + "\n").as_bytes())
    }
}
