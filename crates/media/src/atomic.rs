//! Whole files or none: written under a temporary name in the same folder, then renamed.
//!
//! The temporary name is `.NAME.RANDOM.part`: hidden, unique, so that two machines that write the same frame never
//! spoil it. After a power cut or SIGKILL such a file may stay; nothing reads it and it may be deleted.

use std::{
    fs::{self, File},
    io::{self, BufWriter, Write},
    path::{Path, PathBuf},
};

use tempfile::NamedTempFile;

use crate::{
    error::MediaError,
    unfinished::{self, Listed},
};

/// A file that bears its name only once it is finished. Dropped before, it vanishes.
#[derive(Debug)]
pub struct AtomicFile {
    temporary: NamedTempFile,
    /// Dropped after the file, which is then gone or finished.
    _listed: Listed,
    path: PathBuf,
    /// What `path` means, where it is a link.
    target: PathBuf,
}

impl AtomicFile {
    /// Makes the folders that lead to `path`, and a temporary file beside it, or beside what it links to.
    ///
    /// # Errors
    /// The folder cannot be made or written, the disk is full, or `path` is a folder, a device or a pipe.
    pub fn create(path: &Path) -> Result<Self, MediaError> {
        let fail = |source| MediaError::from_io(path, source);
        match fs::metadata(path) {
            Ok(there) if there.is_dir() => return Err(MediaError::IsFolder { path: path.to_path_buf() }),
            // A rename would put a file in its place.
            Ok(there) if !there.is_file() => return Err(MediaError::NotAFile { path: path.to_path_buf() }),
            _ => {}
        }
        let target = if path.is_symlink() {
            fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf())
        } else {
            path.to_path_buf()
        };
        let folder = match target.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder,
            _ => Path::new("."),
        };
        fs::create_dir_all(folder).map_err(|source| match source.kind() {
            // `create_dir_all` says so when a file stands where a folder should be made.
            io::ErrorKind::AlreadyExists => MediaError::NotAFolder { path: path.to_path_buf() },
            _ => fail(source),
        })?;
        let (temporary, listed) = unfinished::list(|| temporary_in(folder, &target)).map_err(fail)?;
        Ok(Self { temporary, _listed: listed, path: path.to_path_buf(), target })
    }

    /// The file to write to.
    pub fn file(&mut self) -> &mut File {
        self.temporary.as_file_mut()
    }

    /// Where it lies until it is finished, for a program that writes by name.
    pub fn temporary_path(&self) -> &Path {
        self.temporary.path()
    }

    /// The name it will bear.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Gives it its name, which no file may bear.
    ///
    /// # Errors
    /// A file bears it, or it cannot be renamed; the temporary file is then removed.
    pub fn finish_new(self) -> Result<(), MediaError> {
        let path = self.path;
        self.temporary.persist_noclobber(&self.target).map(drop).map_err(|error| match error.error.kind() {
            io::ErrorKind::AlreadyExists => MediaError::IsThere { path },
            _ => MediaError::from_io(&path, error.error),
        })
    }

    /// Gives it its name, in place of any file that bore it, and who may read and write that one may do so with this.
    ///
    /// # Errors
    /// It cannot be renamed; the temporary file is then removed.
    pub fn finish(self) -> Result<(), MediaError> {
        let path = self.path;
        let fail = |source| MediaError::from_io(&path, source);
        if let Ok(old) = fs::metadata(&self.target) {
            self.temporary.as_file().set_permissions(old.permissions()).map_err(fail)?;
        }
        self.temporary.persist(&self.target).map(drop).map_err(|error| fail(error.error))
    }
}

/// A new, empty, hidden file in `folder`. It is as readable as any other file of the user, since it becomes the picture.
fn temporary_in(folder: &Path, path: &Path) -> io::Result<NamedTempFile> {
    // A name may have 255 bytes, so a long one is cut before the letters that make it unique.
    let name: String = path.file_name().unwrap_or_default().to_string_lossy().chars().take(50).collect();
    let prefix = format!(".{name}.");
    let mut builder = tempfile::Builder::new();
    builder.prefix(&prefix).suffix(".part").rand_bytes(8);
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(folder)
}

/// Writes a whole file by `fill`, or none.
///
/// # Errors
/// As [`AtomicFile::create`], or what `fill` could not write.
pub fn write(path: &Path, fill: impl FnOnce(&mut BufWriter<&mut File>) -> io::Result<()>) -> Result<(), MediaError> {
    let mut atomic = AtomicFile::create(path)?;
    let mut buffer = BufWriter::with_capacity(1 << 16, atomic.file());
    fill(&mut buffer).and_then(|()| buffer.flush()).map_err(|source| MediaError::from_io(path, source))?;
    drop(buffer);
    atomic.finish()
}

/// Writes `bytes` as a whole file, or none.
///
/// # Errors
/// As [`AtomicFile::create`], or the bytes cannot be written.
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<(), MediaError> {
    let mut atomic = AtomicFile::create(path)?;
    atomic.file().write_all(bytes).map_err(|source| MediaError::from_io(path, source))?;
    atomic.finish()
}

/// Writes `bytes` as a whole new file, or none; one that is there already stays.
///
/// # Errors
/// As [`write_bytes`], or a file is there.
pub fn write_new(path: &Path, bytes: &[u8]) -> Result<(), MediaError> {
    if path.exists() {
        return Err(MediaError::IsThere { path: path.to_path_buf() });
    }
    let mut atomic = AtomicFile::create(path)?;
    atomic.file().write_all(bytes).map_err(|source| MediaError::from_io(path, source))?;
    atomic.finish_new()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_new_file_never_takes_the_place_of_another() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scene.toml");
        write_new(&path, b"first").unwrap();
        assert!(matches!(write_new(&path, b"second"), Err(MediaError::IsThere { .. })));
        // Also where it came in the meantime.
        let late = AtomicFile::create(&path).unwrap();
        assert!(matches!(late.finish_new(), Err(MediaError::IsThere { .. })));
        assert_eq!(fs::read(&path).unwrap(), b"first");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[cfg(unix)]
    #[test]
    fn a_device_stays_a_device() {
        let folder = tempfile::tempdir().unwrap();
        let link = folder.path().join("0001.png");
        std::os::unix::fs::symlink("/dev/null", &link).unwrap();
        assert!(matches!(write_bytes(&link, b"x"), Err(MediaError::NotAFile { .. })));
    }

    fn names(folder: &Path) -> Vec<String> {
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect()
    }

    #[test]
    fn a_finished_file_replaces_the_old_one_and_leaves_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("new/deep/a.png");
        write_bytes(&path, b"first").unwrap();
        write(&path, |file| file.write_all(b"second")).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"second");
        assert_eq!(names(path.parent().unwrap()), ["a.png"]);
    }

    #[test]
    fn a_failed_write_keeps_the_old_file_and_removes_the_temporary_one() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        write_bytes(&path, b"old").unwrap();
        let error = write(&path, |file| {
            file.write_all(b"half")?;
            Err(io::ErrorKind::StorageFull.into())
        });
        assert!(matches!(error, Err(MediaError::DiskFull { .. })));
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(names(folder.path()), ["a.png"]);
    }

    #[test]
    fn while_it_is_written_it_is_hidden_and_two_writers_do_not_meet() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        let (one, two) = (AtomicFile::create(&path).unwrap(), AtomicFile::create(&path).unwrap());
        assert_ne!(one.temporary_path(), two.temporary_path());
        assert!(names(folder.path()).iter().all(|name| name.starts_with(".a.png.") && name.ends_with(".part")));
        drop((one, two));
        assert!(names(folder.path()).is_empty());
    }

    #[test]
    fn a_folder_and_a_file_in_the_way_are_named() {
        let folder = tempfile::tempdir().unwrap();
        assert!(matches!(write_bytes(folder.path(), b""), Err(MediaError::IsFolder { .. })));
        let file = folder.path().join("file");
        write_bytes(&file, b"").unwrap();
        assert!(matches!(write_bytes(&file.join("a.png"), b""), Err(MediaError::NotAFolder { .. })));
        assert!(matches!(write_bytes(&file.join("deep/a.png"), b""), Err(MediaError::NotAFolder { .. })));
    }

    #[test]
    fn a_very_long_name_still_has_a_temporary_name() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(format!("{}.png", "火".repeat(80)));
        write_bytes(&path, b"x").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"x");
    }

    #[cfg(unix)]
    #[test]
    fn links_and_permissions_stay() {
        use std::os::unix::fs::{PermissionsExt, symlink};
        let folder = tempfile::tempdir().unwrap();
        let (file, link) = (folder.path().join("deep/a.toml"), folder.path().join("link.toml"));
        write_bytes(&file, b"old").unwrap();
        fs::set_permissions(&file, fs::Permissions::from_mode(0o600)).unwrap();
        symlink("deep/a.toml", &link).unwrap();
        write_bytes(&link, b"new").unwrap();
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
        write_bytes(&whole, b"").unwrap();
        let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode();
        assert_eq!(mode(&whole), mode(&plain));
    }
}
