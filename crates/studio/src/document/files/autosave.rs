//! Autosave: unsaved work is stored in the user's data folder, and offered for recovery after a crash.
//!
//! Each running studio holds a file lock, so that the work of running studios is not offered.

use std::{
    fs::{self, File, OpenOptions, TryLockError},
    io,
    path::{Path, PathBuf},
};

use bansho::media::{
    MediaError,
    files::{atomic, overwrite_policy::OverwritePolicy},
};

use crate::document::Document;

/// The autosave of a running studio.
#[derive(Debug)]
pub struct Autosave {
    /// The file with the unsaved work.
    file: PathBuf,
    /// The path of the lock file.
    lock: PathBuf,
    /// The locked file; the lock ends with the process.
    _lock: File,
}

/// Unsaved work of a studio that crashed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RecoveredWork {
    /// The file it belongs to; empty for work that was never saved.
    pub origin: String,
    /// The text.
    pub text: String,
    /// The file that it is stored in, or its name in the browser's local storage.
    pub(crate) stored_as: PathBuf,
}

/// Maximum number of autosaves in one folder.
const MAX_SESSIONS: usize = 100;

/// Start of the first line of a stored work; the origin follows.
const HEADING: &str = "# unsaved work of the studio on: ";

impl Autosave {
    /// Starts autosaving in `folder`, under a name that begins with `session` and that no other running studio has.
    ///
    /// # Errors
    /// The folder cannot be created or written, its file system has no locks, or too many autosaves are in it.
    pub fn begin(folder: &Path, session: &str) -> io::Result<Self> {
        Self::begin_with(folder, session, File::try_lock)
    }

    /// As [`begin`](Self::begin), with another function that locks a file.
    fn begin_with(
        folder: &Path,
        session: &str,
        try_lock: impl Fn(&File) -> Result<(), TryLockError>,
    ) -> io::Result<Self> {
        fs::create_dir_all(folder)?;
        for number in 0..MAX_SESSIONS {
            let lock = folder.join(format!("{session}-{number}.lock"));
            let existed = lock.exists();
            // What has this name, perhaps by a link, keeps its contents.
            let lock_file = OpenOptions::new().write(true).create(true).truncate(false).open(&lock)?;
            match try_lock(&lock_file) {
                Ok(()) if !lock.with_extension("toml").exists() => {
                    return Ok(Self { file: lock.with_extension("toml"), lock, _lock: lock_file });
                }
                // Held by another studio, or unsaved work that was not recovered yet.
                Ok(()) | Err(TryLockError::WouldBlock) => {}
                Err(TryLockError::Error(error)) => {
                    if !existed {
                        // A file that remains is harmless.
                        let _ = fs::remove_file(&lock);
                    }
                    return Err(error);
                }
            }
        }
        Err(io::Error::other(format!("{MAX_SESSIONS} studios run, or left work that was never recovered")))
    }

    /// Stores the unsaved work of `document`, or removes the stored work if `document` is saved.
    ///
    /// # Errors
    /// The work cannot be written.
    pub fn save(&self, document: &Document, origin: Option<&Path>) -> Result<(), MediaError> {
        if !document.is_dirty() {
            // Fails where nothing is stored.
            let _ = fs::remove_file(&self.file);
            return Ok(());
        }
        let origin = origin.map(|path| path.display().to_string()).unwrap_or_default();
        let policy = OverwritePolicy::any().without_links();
        atomic::write_bytes(&self.file, encode(&origin, document.text()).as_bytes(), &policy)
    }

    /// Removes the stored work and the lock when the studio closes.
    pub fn end(self) {
        // A file that cannot be removed is offered for recovery at the next start, which is harmless.
        let _ = fs::remove_file(&self.file);
        let _ = fs::remove_file(&self.lock);
    }
}

/// The text that is stored for unsaved work of the file `origin`. [`RecoveredWork::decode`] reads it.
pub fn encode(origin: &str, text: &str) -> String {
    format!("{HEADING}{origin}\n{text}")
}

/// The unsaved work in `folder` of studios that no longer run.
pub fn recoverable(folder: &Path) -> Vec<RecoveredWork> {
    let entries = fs::read_dir(folder).into_iter().flatten().filter_map(Result::ok);
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.path()).collect();
    files.retain(|path| path.extension().is_some_and(|extension| extension == "toml") && !is_locked(path));
    files.sort();
    files.into_iter().filter_map(read).collect()
}

/// Whether a running studio holds the lock of the work in `file`. On file systems without locks no studio stores work.
fn is_locked(file: &Path) -> bool {
    let lock = File::open(file.with_extension("lock"));
    lock.is_ok_and(|lock| matches!(lock.try_lock(), Err(TryLockError::WouldBlock)))
}

fn read(file: PathBuf) -> Option<RecoveredWork> {
    let recovered = RecoveredWork::decode(&fs::read_to_string(&file).ok()?)?;
    Some(RecoveredWork { stored_as: file, ..recovered })
}

impl RecoveredWork {
    /// Reads what [`encode`] wrote; `stored_as` is empty.
    pub fn decode(stored: &str) -> Option<Self> {
        let (heading, text) = stored.split_once('\n')?;
        let origin = heading.strip_prefix(HEADING)?;
        Some(Self { origin: origin.to_owned(), text: text.to_owned(), stored_as: PathBuf::new() })
    }

    /// Removes its file.
    pub fn discard(&self) {
        // A file that cannot be removed is offered again, which is harmless.
        let _ = fs::remove_file(&self.stored_as);
        let _ = fs::remove_file(self.stored_as.with_extension("lock"));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn files_in(folder: &Path) -> usize {
        fs::read_dir(folder).unwrap().count()
    }

    #[test]
    fn a_folder_without_locks_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        let without = |_: &File| Err(TryLockError::Error(io::ErrorKind::Unsupported.into()));
        let error = Autosave::begin_with(folder.path(), "studio", without).unwrap_err();
        assert_eq!((error.kind(), files_in(folder.path())), (io::ErrorKind::Unsupported, 0));
    }

    #[test]
    fn locked_names_are_skipped_up_to_a_maximum() {
        let folder = tempfile::tempdir().unwrap();
        let first = Autosave::begin(folder.path(), "studio").unwrap();
        let second = Autosave::begin(folder.path(), "studio").unwrap();
        assert_ne!(first.file, second.file);
        let held = |_: &File| Err(TryLockError::WouldBlock);
        Autosave::begin_with(folder.path(), "studio", held).unwrap_err();
        assert_eq!(files_in(folder.path()), MAX_SESSIONS);
    }
}
