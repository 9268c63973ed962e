//! Whether the files that a job finished are still there when all are: something may remove or change them in the meantime.

use std::{
    collections::HashMap,
    fs,
    path::{Path, PathBuf},
    sync::{Mutex, MutexGuard, PoisonError},
    time::SystemTime,
};

use bansho_media::files::{file_identity::FileIdentity, provenance::is_bansho_file};

/// What tells cheaply that a file was not touched.
#[derive(Clone, Debug, PartialEq, Eq)]
struct FileState {
    identity: FileIdentity,
    length: u64,
    modified: Option<SystemTime>,
}

impl FileState {
    fn of(path: &Path) -> Option<Self> {
        let found = fs::metadata(path).ok()?;
        Some(Self { identity: FileIdentity::of(path).ok()?, length: found.len(), modified: found.modified().ok() })
    }
}

/// How files were when they were finished.
#[derive(Default)]
pub(crate) struct Finished(Mutex<HashMap<PathBuf, Option<FileState>>>);

impl Finished {
    fn lock(&self) -> MutexGuard<'_, HashMap<PathBuf, Option<FileState>>> {
        // Whole entries are inserted, so that a panic elsewhere leaves it usable.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Remembers the file at `path` as it is now.
    pub(crate) fn note(&self, path: PathBuf) {
        let state = FileState::of(&path);
        self.lock().insert(path, state);
    }

    /// Whether the file at `path` was not touched since it was noted.
    pub(crate) fn is_untouched(&self, path: &Path) -> bool {
        let known = self.lock().get(path).cloned().flatten();
        known.is_some() && known == FileState::of(path)
    }

    /// Whether the file at `path` was not touched, or is at least one of the same kind and length, as another program that makes the same
    /// leaves it.
    pub(crate) fn is_there(&self, path: &Path) -> bool {
        let length = self.lock().get(path).and_then(|state| Some(state.as_ref()?.length));
        self.is_untouched(path)
            || length.is_some() && length == fs::metadata(path).ok().map(|found| found.len()) && is_bansho_file(path)
    }

    /// The files that were noted and are no longer there, in order.
    pub(crate) fn lost(&self) -> Vec<PathBuf> {
        let mut noted: Vec<PathBuf> = self.lock().keys().cloned().collect();
        noted.retain(|path| !self.is_there(path));
        noted.sort_unstable();
        noted
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_removed_or_changed_is_lost() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let finished = Finished::default();
        for name in ["kept", "removed", "cut", "spoiled", "again"] {
            fs::write(at(name), "BANSHOSS").unwrap();
            finished.note(at(name));
        }
        finished.note(at("never"));
        assert_eq!(finished.lost(), [at("never")]);
        fs::remove_file(at("removed")).unwrap();
        fs::write(at("cut"), "BANSH").unwrap();
        fs::write(at("spoiled"), "--------").unwrap();
        // Another program that makes the same puts its own file there.
        fs::write(at("new"), "BANSHOSS").unwrap();
        fs::rename(at("new"), at("again")).unwrap();
        assert_eq!(finished.lost(), ["cut", "never", "removed", "spoiled"].map(at));
        assert!(finished.is_untouched(&at("kept")) && !finished.is_untouched(&at("again")));
    }
}
