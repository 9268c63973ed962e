//! Identity of files, to recognize two paths to the same file.

use std::{
    fs, io,
    path::{Component, Path, PathBuf},
};

/// Identity of a file, independent of path and links. On Unix hard links are equal too; elsewhere they differ, because
/// the system's file number is not available in safe code.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct FileIdentity(Identity);

/// Device and inode.
#[cfg(unix)]
type Identity = [u64; 2];
/// The canonical path.
#[cfg(not(unix))]
type Identity = PathBuf;

impl FileIdentity {
    /// The file that `path` leads to, through all links.
    ///
    /// # Errors
    /// It does not exist, or its metadata cannot be read.
    pub fn of(path: &Path) -> io::Result<Self> {
        identity(path).map(Self)
    }
}

#[cfg(unix)]
fn identity(path: &Path) -> io::Result<Identity> {
    use std::os::unix::fs::MetadataExt;
    fs::metadata(path).map(|found| [found.dev(), found.ino()])
}

#[cfg(not(unix))]
fn identity(path: &Path) -> io::Result<Identity> {
    fs::canonicalize(path)
}

/// The path to which `path` will lead once its missing folders are created. Links in the existing part are followed; `..` after a missing folder
/// leads to the parent of that folder.
pub fn resolved(path: &Path) -> PathBuf {
    let mut resolved = if path.is_absolute() { PathBuf::new() } else { canonical_or_same(Path::new(".")) };
    for component in path.components() {
        match component {
            Component::CurDir => {}
            // The path so far has no links any more, so that this is the parent that the system means.
            Component::ParentDir => {
                resolved.pop();
            }
            other => resolved = canonical_or_same(&resolved.join(other)),
        }
    }
    resolved
}

fn canonical_or_same(path: &Path) -> PathBuf {
    fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_itself_by_every_path_and_no_other() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::create_dir(at("sub")).unwrap();
        fs::write(at("a"), "same").unwrap();
        fs::write(at("b"), "same").unwrap();
        let a = FileIdentity::of(&at("a")).unwrap();
        assert_eq!(FileIdentity::of(&at("sub/../a")).unwrap(), a);
        assert_ne!(FileIdentity::of(&at("b")).unwrap(), a);
        assert!(FileIdentity::of(&at("c")).is_err());
        #[cfg(unix)]
        {
            fs::hard_link(at("a"), at("hard")).unwrap();
            std::os::unix::fs::symlink("a", at("soft")).unwrap();
            assert_eq!(["hard", "soft"].map(|name| FileIdentity::of(&at(name)).unwrap()), [a.clone(), a]);
        }
    }

    #[test]
    fn folders_that_are_missing_lead_where_they_will_be() {
        let folder = tempfile::tempdir().unwrap();
        let root = fs::canonicalize(folder.path()).unwrap();
        fs::write(root.join("plate.png"), "").unwrap();
        for path in ["x/../plate.png", "./x/y/../../plate.png", "x/.././plate.png"] {
            assert_eq!(resolved(&root.join(path)), root.join("plate.png"), "{path}");
        }
        assert_eq!(resolved(&root.join("x/./y/a.png")), root.join("x/y/a.png"));
        assert_eq!(resolved(Path::new("x/../no such file")), fs::canonicalize(".").unwrap().join("no such file"));
        #[cfg(unix)]
        {
            // `..` after a link leads to the parent of its target.
            fs::create_dir_all(root.join("far/deep")).unwrap();
            std::os::unix::fs::symlink("far/deep", root.join("link")).unwrap();
            assert_eq!(resolved(&root.join("link/../a.png")), root.join("far/a.png"));
            assert_eq!(resolved(&root.join("x/../link/a.png")), root.join("far/deep/a.png"));
        }
    }
}
