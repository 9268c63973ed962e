//! Protection of existing files from being overwritten.

use std::{
    collections::HashSet,
    fs,
    path::{Path, PathBuf},
    sync::Arc,
};

use super::{file_identity::FileIdentity, provenance::is_bansho_file};

/// The input files of a job.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct InputFiles {
    identities: HashSet<FileIdentity>,
    /// Canonical paths too, since a file that an editor saves again has another inode.
    paths: HashSet<PathBuf>,
}

impl InputFiles {
    /// Adds the file at `path`, if it exists.
    pub fn insert(&mut self, path: &Path) {
        self.identities.extend(FileIdentity::of(path));
        self.paths.extend(fs::canonicalize(path));
    }

    /// Whether `path` refers to one of them, by name or by any link.
    pub fn contains(&self, path: &Path) -> bool {
        FileIdentity::of(path).is_ok_and(|file| self.identities.contains(&file))
            || !self.paths.is_empty() && fs::canonicalize(path).is_ok_and(|file| self.paths.contains(&file))
    }
}

/// Which existing files may be overwritten: by default those that Bansho made ([`is_bansho_file`]), and empty ones.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct OverwritePolicy {
    inputs: Arc<InputFiles>,
    any: bool,
}

/// Why a file must not be overwritten.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OverwriteError {
    /// It is an input of the job.
    Input,
    /// Bansho did not make it.
    NotMadeByBansho,
}

impl OverwritePolicy {
    /// Protects `inputs`. `any` allows overwriting of files that Bansho did not make.
    pub fn new(inputs: InputFiles, any: bool) -> Self {
        Self { inputs: Arc::new(inputs), any }
    }

    /// Every file may be overwritten.
    pub fn any() -> Self {
        Self::new(InputFiles::default(), true)
    }

    /// Whether the file at `path`, if there is one, may be overwritten.
    ///
    /// # Errors
    /// Why not.
    pub fn check(&self, path: &Path) -> Result<(), OverwriteError> {
        let Ok(existing) = fs::metadata(path) else { return Ok(()) };
        if self.inputs.contains(path) {
            return Err(OverwriteError::Input);
        }
        // What is not a regular file is refused by the writer, with its own reason.
        if self.any || !existing.is_file() || existing.len() == 0 || is_bansho_file(path) {
            Ok(())
        } else {
            Err(OverwriteError::NotMadeByBansho)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inputs_are_kept_and_so_is_what_bears_no_mark() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::write(at("plate.ply"), "ply\ncomment Bansho: \nend_header\n").unwrap();
        fs::copy(at("plate.ply"), at("ours.ply")).unwrap();
        fs::write(at("theirs.png"), "a photograph").unwrap();
        fs::write(at("empty.png"), "").unwrap();
        let mut inputs = InputFiles::default();
        inputs.insert(&at("plate.ply"));
        inputs.insert(&at("gone"));
        let (default, all) = (OverwritePolicy::new(inputs.clone(), false), OverwritePolicy::new(inputs, true));
        let check = |policy: &OverwritePolicy, name: &str| policy.check(&at(name));
        for name in ["ours.ply", "empty.png", "new.png", "gone", ""] {
            assert_eq!((check(&default, name), check(&all, name)), (Ok(()), Ok(())), "{name}");
        }
        assert_eq!(
            (check(&default, "theirs.png"), check(&all, "theirs.png")),
            (Err(OverwriteError::NotMadeByBansho), Ok(()))
        );
        assert_eq!([&default, &all].map(|policy| check(policy, "plate.ply")), [Err(OverwriteError::Input); 2]);
        // Saved to a new inode, as editors do.
        fs::copy(at("plate.ply"), at("saved")).unwrap();
        fs::rename(at("saved"), at("plate.ply")).unwrap();
        assert_eq!(check(&all, "plate.ply"), Err(OverwriteError::Input));
    }
}
