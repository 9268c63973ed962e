//! Which files that are there may be written over.

use std::{
    collections::HashSet,
    fs,
    path::{Path, PathBuf},
    sync::Arc,
};

use super::{file_identity::FileIdentity, provenance::is_bansho_file};

/// Files that work is made from.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct InputFiles {
    identities: HashSet<FileIdentity>,
    /// Without links: a file that is saved anew under its name is another one.
    paths: HashSet<PathBuf>,
}

impl InputFiles {
    /// Adds the file at `path`, if there is one.
    pub fn insert(&mut self, path: &Path) {
        self.identities.extend(FileIdentity::of(path));
        self.paths.extend(fs::canonicalize(path));
    }

    /// Whether `path` leads to one of them, by its name or by a link of any kind.
    pub fn contains(&self, path: &Path) -> bool {
        FileIdentity::of(path).is_ok_and(|file| self.identities.contains(&file))
            || !self.paths.is_empty() && fs::canonicalize(path).is_ok_and(|file| self.paths.contains(&file))
    }
}

/// Which files that are there may be written over. By default those that bear the mark of Bansho ([`is_marked`]) and empty ones, which hold
/// nothing that could be lost.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct OverwritePolicy {
    inputs: Arc<InputFiles>,
    any: bool,
}

/// Why a file must stay as it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OverwriteError {
    /// The work is made from it.
    Input,
    /// Bansho did not make it.
    Unmarked,
}

impl OverwritePolicy {
    /// Nothing may be written over `inputs`. `any` says whether files without the mark of Bansho may be.
    pub fn new(inputs: InputFiles, any: bool) -> Self {
        Self { inputs: Arc::new(inputs), any }
    }

    /// Every file may be written over.
    pub fn any() -> Self {
        Self::new(InputFiles::default(), true)
    }

    /// Whether what `path` leads to, if anything, may be written over.
    ///
    /// # Errors
    /// Why not.
    pub fn check(&self, path: &Path) -> Result<(), OverwriteError> {
        let Ok(there) = fs::metadata(path) else { return Ok(()) };
        if self.inputs.contains(path) {
            return Err(OverwriteError::Input);
        }
        // What is no file is refused by whoever writes, for what it is.
        if self.any || !there.is_file() || there.len() == 0 || is_bansho_file(path) {
            Ok(())
        } else {
            Err(OverwriteError::Unmarked)
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
        let (usual, all) = (OverwritePolicy::new(inputs.clone(), false), OverwritePolicy::new(inputs, true));
        let check = |policy: &OverwritePolicy, name: &str| policy.check(&at(name));
        for name in ["ours.ply", "empty.png", "new.png", "gone", ""] {
            assert_eq!((check(&usual, name), check(&all, name)), (Ok(()), Ok(())), "{name}");
        }
        assert_eq!((check(&usual, "theirs.png"), check(&all, "theirs.png")), (Err(OverwriteError::Unmarked), Ok(())));
        assert_eq!([&usual, &all].map(|policy| check(policy, "plate.ply")), [Err(OverwriteError::Input); 2]);
        // Saved anew, as editors do.
        fs::copy(at("plate.ply"), at("saved")).unwrap();
        fs::rename(at("saved"), at("plate.ply")).unwrap();
        assert_eq!(check(&all, "plate.ply"), Err(OverwriteError::Input));
    }
}
