//! Atomic writing of files: a temporary file in the same folder, then a rename.
//!
//! The temporary name is `.NAME.RANDOM.part`: hidden, and unique so that two machines that write the same frame do not interfere. After a power
//! failure or SIGKILL such a file may remain. Nothing reads it, and it may be deleted.

use std::{
    collections::BTreeSet,
    fs::{self, File},
    io::{self, Write},
    mem,
    path::{Path, PathBuf},
    sync::{Mutex, MutexGuard, PoisonError},
};

use tempfile::NamedTempFile;

use super::overwrite_policy::{OverwriteError, OverwritePolicy};
use crate::error::MediaError;

/// A file that gets its name only when it is finished. If dropped before, it is deleted.
#[derive(Debug)]
pub struct AtomicFile {
    temporary: NamedTempFile,
    /// Dropped after the file.
    _guard: TemporaryFileGuard,
    path: PathBuf,
    /// The target of `path`, if it is a symbolic link.
    target: PathBuf,
    policy: OverwritePolicy,
}

impl AtomicFile {
    /// Creates the parent folders of `path`, and a temporary file in the same folder (that of the target, if `path` is a link). It replaces an existing file
    /// only if `policy` allows it. This is checked now and again when it is finished.
    ///
    /// # Errors
    /// The folder cannot be created or written, the disk is full, `path` is a folder, a device or a pipe, or it leads to a file that must not be replaced.
    pub fn create(path: &Path, policy: &OverwritePolicy) -> Result<Self, MediaError> {
        // First, because a path such as `missing/../a.png` can only be resolved when its folders exist.
        fs::create_dir_all(folder_of(path)).map_err(|source| match source.kind() {
            // The error of `create_dir_all` if a parent folder is a file.
            io::ErrorKind::AlreadyExists => MediaError::NotAFolder { path: path.to_path_buf() },
            _ => MediaError::from_io(path, source),
        })?;
        match fs::metadata(path) {
            Ok(existing) if existing.is_dir() => return Err(MediaError::IsFolder { path: path.to_path_buf() }),
            // A rename would replace it.
            Ok(existing) if !existing.is_file() => return Err(MediaError::NotAFile { path: path.to_path_buf() }),
            _ => {}
        }
        // Before the link is followed.
        check_policy(policy, path, path)?;
        let target = match fs::canonicalize(path) {
            Ok(target) if path.is_symlink() => target,
            // A dangling link is replaced; a link to itself is an error.
            Err(source) if path.is_symlink() && source.kind() != io::ErrorKind::NotFound => {
                return Err(MediaError::from_io(path, source));
            }
            _ => path.to_path_buf(),
        };
        check_policy(policy, &target, path)?;
        let (temporary, guard) = create_registered(|| temporary_in(folder_of(&target), &target))
            .map_err(|source| MediaError::from_io(path, source))?;
        Ok(Self { temporary, _guard: guard, path: path.to_path_buf(), target, policy: policy.clone() })
    }

    /// The file to write to.
    pub fn file(&mut self) -> &mut File {
        self.temporary.as_file_mut()
    }

    /// The path of the temporary file, for programs that write by name.
    pub fn temporary_path(&self) -> &Path {
        self.temporary.path()
    }

    /// The final path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Renames it to its final name, which no file may have.
    ///
    /// # Errors
    /// A file has that name, or it cannot be renamed. The temporary file is then removed.
    pub fn finish_new(self) -> Result<(), MediaError> {
        let path = self.path;
        self.temporary.persist_noclobber(&self.target).map(drop).map_err(|error| match error.error.kind() {
            io::ErrorKind::AlreadyExists => MediaError::AlreadyExists { path },
            _ => MediaError::from_io(&path, error.error),
        })
    }

    /// Renames it to its final name. It replaces an existing file, whose permissions it takes.
    ///
    /// # Errors
    /// It cannot be renamed, or a file that must not be replaced has got the name. The temporary file is then removed.
    pub fn finish(self) -> Result<(), MediaError> {
        let path = self.path;
        check_policy(&self.policy, &self.target, &path)?;
        if let Ok(old) = fs::metadata(&self.target) {
            let kept = self.temporary.as_file().set_permissions(old.permissions());
            kept.map_err(|source| MediaError::from_io(&path, source))?;
        }
        self.temporary.persist(&self.target).map(drop).map_err(|error| MediaError::from_io(&path, error.error))
    }
}

fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Checks that `policy` allows writing to `path`, as [`AtomicFile::create`] does.
///
/// # Errors
/// It leads to a file that must not be replaced.
pub fn check(path: &Path, policy: &OverwritePolicy) -> Result<(), MediaError> {
    check_policy(policy, path, path)
}

/// Whether `target` may be overwritten; `path` is its name in errors.
fn check_policy(policy: &OverwritePolicy, target: &Path, path: &Path) -> Result<(), MediaError> {
    let path = path.to_path_buf();
    policy.check(target).map_err(|error| match error {
        OverwriteError::Input => MediaError::IsInput { path },
        OverwriteError::NotMadeByBansho => MediaError::NotMadeByBansho { path },
        OverwriteError::Link => MediaError::IsLink { path },
    })
}

/// A new, empty, hidden file in `folder`, with default permissions (umask), since it becomes the final file.
fn temporary_in(folder: &Path, path: &Path) -> io::Result<NamedTempFile> {
    // Names are limited to 255 bytes: a long one is cut in front of the unique letters.
    let name: String = path.file_name().unwrap_or_default().to_string_lossy().chars().take(50).collect();
    let prefix = format!(".{name}.");
    let mut builder = tempfile::Builder::new();
    builder.prefix(&prefix).suffix(".part").rand_bytes(8);
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(folder)
}

/// Writes `bytes` to a file, completely or not at all. It replaces an existing file only if `policy` allows it.
///
/// # Errors
/// As [`AtomicFile::create`], or the bytes cannot be written.
pub fn write_bytes(path: &Path, bytes: &[u8], policy: &OverwritePolicy) -> Result<(), MediaError> {
    let mut atomic = AtomicFile::create(path, policy)?;
    atomic.file().write_all(bytes).map_err(|source| MediaError::from_io(path, source))?;
    atomic.finish()
}

/// Writes `bytes` to a new file, completely or not at all. An existing file is never replaced.
///
/// # Errors
/// As [`write_bytes`], or the file exists.
pub fn write_new(path: &Path, bytes: &[u8]) -> Result<(), MediaError> {
    if fs::symlink_metadata(path).is_ok() {
        return Err(MediaError::AlreadyExists { path: path.to_path_buf() });
    }
    // A link is not followed: even one that leads nowhere has the name.
    let mut atomic = AtomicFile::create(path, &OverwritePolicy::default().without_links())?;
    atomic.file().write_all(bytes).map_err(|source| MediaError::from_io(path, source))?;
    atomic.finish_new()
}

/// Temporary files that have not been renamed yet.
static TEMPORARY_FILES: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

fn temporary_files() -> MutexGuard<'static, BTreeSet<PathBuf>> {
    // The set is always consistent, so a poisoned lock is usable.
    TEMPORARY_FILES.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Registration of a temporary file, removed when dropped.
#[derive(Debug)]
struct TemporaryFileGuard(PathBuf);

impl Drop for TemporaryFileGuard {
    fn drop(&mut self) {
        temporary_files().remove(&self.0);
    }
}

/// Creates a temporary file and registers it.
fn create_registered(
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_new_file_never_takes_the_place_of_another() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scene.toml");
        write_new(&path, b"first").unwrap();
        assert!(matches!(write_new(&path, b"second"), Err(MediaError::AlreadyExists { .. })));
        // Also one that was created in the meantime.
        let late = AtomicFile::create(&path, &OverwritePolicy::any()).unwrap();
        assert!(matches!(late.finish_new(), Err(MediaError::AlreadyExists { .. })));
        assert_eq!(fs::read(&path).unwrap(), b"first");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[cfg(unix)]
    #[test]
    fn no_link_that_is_made_on_the_way_leads_to_an_input() {
        use std::os::unix::fs::symlink;

        use crate::files::overwrite_policy::InputFiles;
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::write(at("plate.png"), "plate").unwrap();
        let mut inputs = InputFiles::default();
        inputs.insert(&at("plate.png"));
        let policy = OverwritePolicy::new(inputs, true);
        // Whether the folder that the path passes through is missing or there.
        for _ in 0..2 {
            let made = write_bytes(&at("x/../plate.png"), b"new", &policy);
            assert!(matches!(made, Err(MediaError::IsInput { .. })));
        }
        symlink("plate.png", at("soft.png")).unwrap();
        fs::hard_link(at("plate.png"), at("hard.png")).unwrap();
        for name in ["soft.png", "hard.png"] {
            let error = AtomicFile::create(&at(name), &policy).unwrap_err();
            assert!(matches!(&error, MediaError::IsInput { path } if *path == at(name)), "{error}");
        }
        // The folder becomes a link while the file is written.
        fs::create_dir(at("out")).unwrap();
        let late = AtomicFile::create(&at("out/plate.png"), &policy).unwrap();
        let temporary = late.temporary_path().to_path_buf();
        fs::rename(&temporary, folder.path().join(temporary.file_name().unwrap())).unwrap();
        fs::remove_dir(at("out")).unwrap();
        symlink(".", at("out")).unwrap();
        assert!(matches!(late.finish(), Err(MediaError::IsInput { .. })));
        assert_eq!(fs::read(at("plate.png")).unwrap(), b"plate");
    }

    #[test]
    fn a_file_without_our_mark_that_comes_on_the_way_stays() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        let late = AtomicFile::create(&path, &OverwritePolicy::default()).unwrap();
        fs::write(&path, "a photograph").unwrap();
        assert!(matches!(late.finish(), Err(MediaError::NotMadeByBansho { .. })));
        assert!(matches!(
            write_bytes(&path, b"", &OverwritePolicy::default()),
            Err(MediaError::NotMadeByBansho { .. })
        ));
        assert_eq!((fs::read(&path).unwrap(), names(folder.path())), (b"a photograph".to_vec(), vec!["a.png".into()]));
    }

    #[cfg(unix)]
    #[test]
    fn a_device_stays_a_device() {
        let folder = tempfile::tempdir().unwrap();
        let link = folder.path().join("0001.png");
        std::os::unix::fs::symlink("/dev/null", &link).unwrap();
        assert!(matches!(write_bytes(&link, b"x", &OverwritePolicy::any()), Err(MediaError::NotAFile { .. })));
    }

    #[cfg(unix)]
    #[test]
    fn a_link_to_itself_is_an_error_and_stays() {
        let folder = tempfile::tempdir().unwrap();
        let link = folder.path().join("a.png");
        std::os::unix::fs::symlink("a.png", &link).unwrap();
        assert!(matches!(write_bytes(&link, b"x", &OverwritePolicy::any()), Err(MediaError::Io { .. })));
        assert!(link.is_symlink());
    }

    fn names(folder: &Path) -> Vec<String> {
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect()
    }

    #[test]
    fn a_finished_file_replaces_the_old_one_and_leaves_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("new/deep/a.png");
        write_bytes(&path, b"first", &OverwritePolicy::any()).unwrap();
        write_bytes(&path, b"second", &OverwritePolicy::any()).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"second");
        assert_eq!(names(path.parent().unwrap()), ["a.png"]);
    }

    #[test]
    fn a_failed_write_keeps_the_old_file_and_removes_the_temporary_one() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        write_bytes(&path, b"old", &OverwritePolicy::any()).unwrap();
        let mut half = AtomicFile::create(&path, &OverwritePolicy::any()).unwrap();
        half.file().write_all(b"half").unwrap();
        drop(half);
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(names(folder.path()), ["a.png"]);
    }

    #[test]
    fn while_it_is_written_it_is_hidden_and_two_writers_do_not_meet() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        let (one, two) = (
            AtomicFile::create(&path, &OverwritePolicy::any()).unwrap(),
            AtomicFile::create(&path, &OverwritePolicy::any()).unwrap(),
        );
        assert_ne!(one.temporary_path(), two.temporary_path());
        assert!(names(folder.path()).iter().all(|name| name.starts_with(".a.png.") && name.ends_with(".part")));
        drop((one, two));
        assert!(names(folder.path()).is_empty());
    }

    #[test]
    fn a_folder_and_a_file_in_the_way_are_named() {
        let folder = tempfile::tempdir().unwrap();
        assert!(matches!(write_bytes(folder.path(), b"", &OverwritePolicy::any()), Err(MediaError::IsFolder { .. })));
        let file = folder.path().join("file");
        write_bytes(&file, b"", &OverwritePolicy::any()).unwrap();
        assert!(matches!(
            write_bytes(&file.join("a.png"), b"", &OverwritePolicy::any()),
            Err(MediaError::NotAFolder { .. })
        ));
        assert!(matches!(
            write_bytes(&file.join("deep/a.png"), b"", &OverwritePolicy::any()),
            Err(MediaError::NotAFolder { .. })
        ));
    }

    #[test]
    fn a_very_long_name_still_has_a_temporary_name() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(format!("{}.png", "火".repeat(80)));
        write_bytes(&path, b"x", &OverwritePolicy::any()).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"x");
    }

    #[cfg(unix)]
    #[test]
    fn links_and_permissions_stay() {
        use std::os::unix::fs::{PermissionsExt, symlink};
        let folder = tempfile::tempdir().unwrap();
        let (file, link) = (folder.path().join("deep/a.toml"), folder.path().join("link.toml"));
        write_bytes(&file, b"old", &OverwritePolicy::any()).unwrap();
        fs::set_permissions(&file, fs::Permissions::from_mode(0o600)).unwrap();
        symlink("deep/a.toml", &link).unwrap();
        write_bytes(&link, b"new", &OverwritePolicy::any()).unwrap();
        assert!(link.is_symlink() && fs::read(&file).unwrap() == b"new");
        assert_eq!(fs::metadata(&file).unwrap().permissions().mode() & 0o777, 0o600);
    }

    #[cfg(unix)]
    #[test]
    fn others_may_read_a_finished_file_as_the_umask_allows() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let (plain, whole) = (folder.path().join("plain"), folder.path().join("whole"));
        fs::write(&plain, b"").unwrap();
        write_bytes(&whole, b"", &OverwritePolicy::any()).unwrap();
        let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode();
        assert_eq!(mode(&whole), mode(&plain));
    }
}
