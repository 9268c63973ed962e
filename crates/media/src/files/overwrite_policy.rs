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

/// Which existing files may be overwritten: by default those that Bansho made ([`is_bansho_file`]), and empty ones. Every file that is written is
/// written under a policy.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct OverwritePolicy {
    inputs: Arc<InputFiles>,
    any: bool,
    /// Whether a link is refused rather than followed.
    no_links: bool,
    /// The only file that may be overwritten, if there is one.
    only: Option<FileIdentity>,
}

/// Why a file must not be overwritten.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OverwriteError {
    /// It is an input of the job.
    Input,
    /// Bansho did not make it.
    NotMadeByBansho,
    /// It is a link, and the file has a fixed name that nobody has a reason to link.
    Link,
}

impl OverwritePolicy {
    /// Protects `inputs`. `any` allows overwriting of files that Bansho did not make.
    pub fn new(inputs: InputFiles, any: bool) -> Self {
        Self { inputs: Arc::new(inputs), any, ..Self::default() }
    }

    /// Every file may be overwritten: the user has chosen this one.
    pub fn any() -> Self {
        Self::new(InputFiles::default(), true)
    }

    /// Only the file that is now at `path` may be overwritten: one that is rewritten in its place.
    pub fn only(path: &Path) -> Self {
        Self { only: FileIdentity::of(path).ok(), ..Self::default() }
    }

    /// The same, but of files that are no inputs only those that Bansho made, and empty ones, may be overwritten.
    #[must_use]
    pub fn without_foreign_files(self) -> Self {
        Self { any: false, ..self }
    }

    /// The same, but a link is refused rather than followed: for files whose names the user does not choose.
    #[must_use]
    pub fn without_links(self) -> Self {
        Self { no_links: true, ..self }
    }

    /// Whether the file at `path`, if there is one, may be overwritten.
    ///
    /// # Errors
    /// Why not.
    pub fn check(&self, path: &Path) -> Result<(), OverwriteError> {
        if self.no_links && path.is_symlink() {
            return Err(OverwriteError::Link);
        }
        let Ok(existing) = fs::metadata(path) else { return Ok(()) };
        // Refused also where the name leads to another file by now.
        if let Some(only) = &self.only {
            let is_same = FileIdentity::of(path).is_ok_and(|file| file == *only);
            return if is_same { Ok(()) } else { Err(OverwriteError::NotMadeByBansho) };
        }
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
        assert_eq!(check(&OverwritePolicy::only(&at("theirs.png")), "theirs.png"), Ok(()));
        assert_eq!(check(&OverwritePolicy::only(&at("gone")), "gone"), Ok(()));
        assert_eq!(check(&OverwritePolicy::only(&at("ours.ply")), "theirs.png"), Err(OverwriteError::NotMadeByBansho));
        // Saved to a new inode, as editors do.
        fs::copy(at("plate.ply"), at("saved")).unwrap();
        fs::rename(at("saved"), at("plate.ply")).unwrap();
        assert_eq!(check(&all, "plate.ply"), Err(OverwriteError::Input));
    }

    #[cfg(unix)]
    #[test]
    fn links_are_refused_where_the_user_does_not_choose_the_name() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::write(at("ours.ply"), "ply\ncomment Bansho: \nend_header\n").unwrap();
        for (link, target) in [("link", "ours.ply"), ("dangling", "gone")] {
            std::os::unix::fs::symlink(target, at(link)).unwrap();
            for policy in [OverwritePolicy::default(), OverwritePolicy::any()] {
                assert_eq!(policy.check(&at(link)), Ok(()), "{link}");
                assert_eq!(policy.without_links().check(&at(link)), Err(OverwriteError::Link), "{link}");
            }
        }
        assert_eq!(OverwritePolicy::default().without_links().check(&at("ours.ply")), Ok(()));
    }
}
