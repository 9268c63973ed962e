//! Which files a job may write over, found out before anything is drawn.

use std::path::{Path, PathBuf};

use bansho_media::output::{
    file_identity::resolved,
    overwrite_policy::{OverwriteError, OverwritePolicy},
};

use super::error::{Conflict, JobError};

/// Whether every file to be written is new or may be written over, as far as can be known before it is.
///
/// # Errors
/// The first that work is made from; else the first that Bansho did not make, and how many more there are.
pub(super) fn check(policy: &OverwritePolicy, outputs: impl IntoIterator<Item = PathBuf>) -> Result<(), JobError> {
    let mut folder = Folder::default();
    let (mut unmarked, mut others) = (None, 0);
    for path in outputs {
        match policy.check(&folder.resolved(&path)) {
            Ok(()) => {}
            Err(OverwriteError::Input) => return Err(Conflict::OverInput { path }.into()),
            Err(OverwriteError::Unmarked) if unmarked.is_none() => unmarked = Some(path),
            Err(OverwriteError::Unmarked) => others += 1,
        }
    }
    unmarked.map_or(Ok(()), |path| Err(Conflict::Unmarked { path, others }.into()))
}

/// The folder of the last path, and where it is: many files lie in one.
#[derive(Default)]
struct Folder {
    named: PathBuf,
    resolved: Option<PathBuf>,
}

impl Folder {
    fn resolved(&mut self, path: &Path) -> PathBuf {
        let (Some(named), Some(name)) = (path.parent(), path.file_name()) else { return resolved(path) };
        if self.named != named {
            *self = Self { named: named.to_path_buf(), resolved: None };
        }
        self.resolved.get_or_insert_with(|| resolved(named)).join(name)
    }
}
