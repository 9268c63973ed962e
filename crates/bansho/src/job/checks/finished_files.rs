//! Whether the files that a job finished still exist unchanged at its end: another program may remove or change them in the meantime.

use std::{
    collections::HashMap,
    fs,
    path::{Path, PathBuf},
    sync::{Mutex, MutexGuard, PoisonError},
    time::SystemTime,
};

use bansho_media::files::{file_identity::FileIdentity, provenance::is_bansho_file};

/// Cheap evidence that a file was not changed.
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

/// The states of files when they were finished.
#[derive(Default)]
pub(crate) struct FinishedFiles(Mutex<HashMap<PathBuf, Option<FileState>>>);

impl FinishedFiles {
    fn lock(&self) -> MutexGuard<'_, HashMap<PathBuf, Option<FileState>>> {
        // Entries are inserted as a whole, so the map is valid even if a thread panicked.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Records the present state of the file at `path`.
    pub(crate) fn record(&self, path: PathBuf) {
        let state = FileState::of(&path);
        self.lock().insert(path, state);
    }

    /// Whether the file at `path` is unchanged since it was recorded.
    pub(crate) fn is_unchanged(&self, path: &Path) -> bool {
        let recorded = self.lock().get(path).cloned().flatten();
        recorded.is_some() && recorded == FileState::of(path)
    }

    /// Whether the file at `path` is unchanged, or another file of Bansho of the same length, as a second program that runs the same job
    /// writes.
    pub(crate) fn is_present(&self, path: &Path) -> bool {
        let length = self.lock().get(path).and_then(|state| Some(state.as_ref()?.length));
        self.is_unchanged(path)
            || length.is_some() && length == fs::metadata(path).ok().map(|found| found.len()) && is_bansho_file(path)
    }

    /// The recorded files that were removed or changed, in order.
    pub(crate) fn removed_or_changed(&self) -> Vec<PathBuf> {
        let mut lost: Vec<PathBuf> = self.lock().keys().cloned().collect();
        lost.retain(|path| !self.is_present(path));
        lost.sort_unstable();
        lost
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn removed_and_changed_files_are_lost() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let finished = FinishedFiles::default();
        for name in ["kept", "removed", "cut", "spoiled", "again"] {
            fs::write(at(name), "BANSHOSS").unwrap();
            finished.record(at(name));
        }
        finished.record(at("never"));
        assert_eq!(finished.removed_or_changed(), [at("never")]);
        fs::remove_file(at("removed")).unwrap();
        fs::write(at("cut"), "BANSH").unwrap();
        fs::write(at("spoiled"), "--------").unwrap();
        // Another program that runs the same job replaces the file by its own.
        fs::write(at("new"), "BANSHOSS").unwrap();
        fs::rename(at("new"), at("again")).unwrap();
        assert_eq!(finished.removed_or_changed(), ["cut", "never", "removed", "spoiled"].map(at));
        assert!(finished.is_unchanged(&at("kept")) && !finished.is_unchanged(&at("again")));
    }
}
