//! Register of temporary files, so that a program that is about to exit can remove them.

use std::{
    collections::BTreeSet,
    fs, io, mem,
    path::{Path, PathBuf},
    sync::{Mutex, MutexGuard, PoisonError},
};

use tempfile::NamedTempFile;

/// Temporary files that have not been renamed yet.
static TEMPORARY_FILES: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

fn temporary_files() -> MutexGuard<'static, BTreeSet<PathBuf>> {
    // The set is always consistent, so a poisoned lock is usable.
    TEMPORARY_FILES.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Registration of a temporary file, removed when dropped.
#[derive(Debug)]
pub(crate) struct TemporaryFileGuard(PathBuf);

impl Drop for TemporaryFileGuard {
    fn drop(&mut self) {
        temporary_files().remove(&self.0);
    }
}

/// Creates a temporary file and registers it.
pub(crate) fn create(
    make: impl FnOnce() -> io::Result<NamedTempFile>,
) -> io::Result<(NamedTempFile, TemporaryFileGuard)> {
    // Locked while the file is created, so that no file is ever missing from the register.
    let mut files = temporary_files();
    let file = make()?;
    let path: &Path = file.path();
    files.insert(path.to_path_buf());
    let guard = TemporaryFileGuard(path.to_path_buf());
    Ok((file, guard))
}

/// Removes all temporary files, and blocks forever every thread that creates another one.
///
/// For a program that exits right after, without waiting for its other threads. Files with their final names are complete and stay.
#[expect(clippy::mem_forget, reason = "the lock is kept until the program exits, so that no other file is created")]
pub fn abandon_all() {
    let files = temporary_files();
    // A file that was renamed in the meantime is not found, which is fine.
    files.iter().for_each(|path| drop(fs::remove_file(path)));
    mem::forget(files);
}
