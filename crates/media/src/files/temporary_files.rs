//! Register of temporary files, so that a program that must end at once can remove them first.

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
    let mut unfinished = temporary_files();
    let file = make()?;
    let path: &Path = file.path();
    unfinished.insert(path.to_path_buf());
    let guard = TemporaryFileGuard(path.to_path_buf());
    Ok((file, guard))
}

/// Removes every file that is being written but does not bear its final name yet, and lets no other be begun: whoever tries waits for ever.
///
/// For a program that ends right after, without waiting for what its other threads do. Files that bear their names stay, whole.
#[expect(clippy::mem_forget, reason = "the lock is kept until the program ends, so that no other file is begun")]
pub fn abandon_all() {
    let unfinished = temporary_files();
    // One that just got its name is not there any more, which is as well.
    unfinished.iter().for_each(|path| drop(fs::remove_file(path)));
    mem::forget(unfinished);
}
