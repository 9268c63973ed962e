//! Autosave: unsaved work is stored in the user's data folder, and offered for recovery after a crash.
//!
//! Each running studio holds a file lock, so that the work of running studios is not offered.

use std::{
    fs::{self, File, TryLockError},
    io,
    path::{Path, PathBuf},
};

use bansho::media::{MediaError, files::atomic};

use crate::document::Document;

/// The autosave of a running studio.
#[derive(Debug)]
pub struct Autosave {
    kept: PathBuf,
    lock: PathBuf,
    _held: File,
}

/// Unsaved work of a studio that crashed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RecoveredWork {
    /// The file it belongs to; empty for work that was never saved.
    pub origin: String,
    /// The text.
    pub text: String,
    /// The file that it is kept in, or the browser's name for it.
    pub(crate) kept_in: PathBuf,
}

/// Most names that studios take in one folder.
const MOST_NAMES: usize = 100;

/// Begins the first line of kept work; the origin follows.
const HEADING: &str = "# unsaved work of the studio on: ";

impl Autosave {
    /// Keeps work in `folder`, under a name that begins with `session` and that no other running studio has.
    ///
    /// # Errors
    /// The folder cannot be made or written, it knows no locks, or too many studios hold some.
    pub fn begin(folder: &Path, session: &str) -> io::Result<Self> {
        Self::begin_with(folder, session, File::try_lock)
    }

    /// The same with another way to lock a file.
    fn begin_with(
        folder: &Path,
        session: &str,
        try_lock: impl Fn(&File) -> Result<(), TryLockError>,
    ) -> io::Result<Self> {
        fs::create_dir_all(folder)?;
        for number in 0..MOST_NAMES {
            let lock = folder.join(format!("{session}-{number}.lock"));
            let was_there = lock.exists();
            let held = File::create(&lock)?;
            match try_lock(&held) {
                Ok(()) if !lock.with_extension("toml").exists() => {
                    return Ok(Self { kept: lock.with_extension("toml"), lock, _held: held });
                }
                // Another studio's, or work that waits to be recovered.
                Ok(()) | Err(TryLockError::WouldBlock) => {}
                Err(TryLockError::Error(error)) => {
                    if !was_there {
                        // One that stays does no harm.
                        let _ = fs::remove_file(&lock);
                    }
                    return Err(error);
                }
            }
        }
        Err(io::Error::other(format!("{MOST_NAMES} studios run, or left work that was never recovered")))
    }

    /// Keeps what is unsaved, or nothing where nothing is.
    ///
    /// # Errors
    /// The work cannot be written.
    pub fn keep(&self, document: &Document, origin: Option<&Path>) -> Result<(), MediaError> {
        if !document.is_dirty() {
            // Nothing kept is nothing to remove.
            let _ = fs::remove_file(&self.kept);
            return Ok(());
        }
        let origin = origin.map(|path| path.display().to_string()).unwrap_or_default();
        atomic::write_bytes(&self.kept, kept(&origin, document.text()).as_bytes())
    }

    /// Ends well: nothing is left to recover.
    pub fn end(self) {
        // What cannot be removed is offered at the next start, which does no harm.
        let _ = fs::remove_file(&self.kept);
        let _ = fs::remove_file(&self.lock);
    }
}

/// Work of `origin` as it is kept.
pub fn kept(origin: &str, text: &str) -> String {
    format!("{HEADING}{origin}\n{text}")
}

/// The work in `folder` that no running studio holds.
pub fn recoverable(folder: &Path) -> Vec<RecoveredWork> {
    let entries = fs::read_dir(folder).into_iter().flatten().filter_map(Result::ok);
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.path()).collect();
    files.retain(|path| path.extension().is_some_and(|extension| extension == "toml") && !is_held(path));
    files.sort();
    files.into_iter().filter_map(read).collect()
}

/// Where a folder knows no locks, no studio keeps work in it.
fn is_held(kept: &Path) -> bool {
    let lock = File::open(kept.with_extension("lock"));
    lock.is_ok_and(|lock| matches!(lock.try_lock(), Err(TryLockError::WouldBlock)))
}

fn read(file: PathBuf) -> Option<RecoveredWork> {
    let recovered = RecoveredWork::of(&fs::read_to_string(&file).ok()?)?;
    Some(RecoveredWork { kept_in: file, ..recovered })
}

impl RecoveredWork {
    /// Work as it was [`kept`], in no file.
    pub fn of(kept: &str) -> Option<Self> {
        let (heading, text) = kept.split_once('\n')?;
        let origin = heading.strip_prefix(HEADING)?;
        Some(Self { origin: origin.to_owned(), text: text.to_owned(), kept_in: PathBuf::new() })
    }

    /// Forgets it, once it is open again or not wanted.
    pub fn forget(&self) {
        // What cannot be removed is offered again, which does no harm.
        let _ = fs::remove_file(&self.kept_in);
        let _ = fs::remove_file(self.kept_in.with_extension("lock"));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn files_in(folder: &Path) -> usize {
        fs::read_dir(folder).unwrap().count()
    }

    #[test]
    fn a_folder_without_locks_is_told_of_at_once() {
        let folder = tempfile::tempdir().unwrap();
        let without = |_: &File| Err(TryLockError::Error(io::ErrorKind::Unsupported.into()));
        let error = Autosave::begin_with(folder.path(), "studio", without).unwrap_err();
        assert_eq!((error.kind(), files_in(folder.path())), (io::ErrorKind::Unsupported, 0));
    }

    #[test]
    fn names_that_others_hold_are_passed_over_and_there_is_an_end_to_it() {
        let folder = tempfile::tempdir().unwrap();
        let first = Autosave::begin(folder.path(), "studio").unwrap();
        let second = Autosave::begin(folder.path(), "studio").unwrap();
        assert_ne!(first.kept, second.kept);
        let held = |_: &File| Err(TryLockError::WouldBlock);
        Autosave::begin_with(folder.path(), "studio", held).unwrap_err();
        assert_eq!(files_in(folder.path()), MOST_NAMES);
    }
}
