//! Bounded reading of untrusted files: regular files only, up to a number of bytes.
//!
//! The file type is checked before opening, because opening a pipe blocks until there is a writer, and a device may be
//! endless.

use std::{
    fs::{self, File, Metadata},
    io::{self, Read},
    path::Path,
};

use bansho_base::host::{assets::AssetProblem, memory};

/// Why a file cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum InputError {
    /// It is not a regular file.
    #[error("is {found}; allowed: a regular file")]
    NotAFile {
        /// Its type, such as `a pipe`.
        found: &'static str,
    },
    /// It has more bytes than the limit.
    #[error("has {}; allowed: up to {}", size(.bytes), memory::format_bytes(*.limit))]
    Size {
        /// Its length; `None` for a stream, which is not read to its end.
        bytes: Option<u64>,
        /// The limit, bytes.
        limit: u64,
    },
    /// An error of the operating system.
    #[error(transparent)]
    Io(#[from] io::Error),
}

fn size(bytes: &Option<u64>) -> String {
    bytes.map_or_else(|| "more bytes than are read".to_owned(), memory::format_bytes)
}

impl From<InputError> for AssetProblem {
    fn from(error: InputError) -> Self {
        match error {
            InputError::NotAFile { found } => Self::NotAFile { found },
            InputError::Size { bytes, limit } => Self::FileSize { bytes: bytes.unwrap_or(limit + 1), limit },
            InputError::Io(error) if error.kind() == io::ErrorKind::NotFound => Self::Missing,
            InputError::Io(error) => Self::Unreadable(error.to_string()),
        }
    }
}

/// Opens a regular file of at most `limit` bytes; returns it with its length.
///
/// # Errors
/// It does not exist, is not a regular file, is longer, or cannot be read.
pub fn open(path: &Path, limit: u64) -> Result<(File, u64), InputError> {
    check(&fs::metadata(path)?, limit)?;
    let file = File::open(path)?;
    // Checked again after opening: the name may refer to another file by now.
    let bytes = check(&file.metadata()?, limit)?;
    Ok((file, bytes))
}

/// Checks that a regular file exists, of any length.
///
/// # Errors
/// As [`open`].
pub fn find(path: &Path) -> Result<(), InputError> {
    check(&fs::metadata(path)?, u64::MAX).map(drop)
}

/// All bytes of a regular file of at most `limit` bytes.
///
/// # Errors
/// As [`open`], or reading fails.
pub fn read(path: &Path, limit: u64) -> Result<Vec<u8>, InputError> {
    let (file, _) = open(path, limit)?;
    read_stream(file, limit)
}

/// All bytes of a stream of at most `limit` bytes. At most one byte more is read.
///
/// # Errors
/// It is longer, or reading fails.
pub fn read_stream(stream: impl Read, limit: u64) -> Result<Vec<u8>, InputError> {
    let mut bytes = Vec::new();
    stream.take(limit.saturating_add(1)).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > limit { Err(InputError::Size { bytes: None, limit }) } else { Ok(bytes) }
}

/// The length that the file system reports.
fn check(found: &Metadata, limit: u64) -> Result<u64, InputError> {
    if !found.is_file() {
        return Err(InputError::NotAFile { found: kind(found) });
    }
    match found.len() {
        bytes if bytes > limit => Err(InputError::Size { bytes: Some(bytes), limit }),
        bytes => Ok(bytes),
    }
}

/// Name of the type of a file that is not regular.
fn kind(found: &Metadata) -> &'static str {
    if found.is_dir() { "a folder" } else { special_kind(found) }
}

#[cfg(unix)]
fn special_kind(found: &Metadata) -> &'static str {
    use std::os::unix::fs::FileTypeExt;
    let kind = found.file_type();
    match () {
        () if kind.is_fifo() => "a pipe",
        () if kind.is_socket() => "a socket",
        () => "a device",
    }
}

#[cfg(not(unix))]
fn special_kind(_: &Metadata) -> &'static str {
    "not a regular file"
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(path: &Path, limit: u64) -> String {
        read(path, limit).unwrap_err().to_string()
    }

    #[test]
    fn a_file_is_read_whole_or_not_at_all() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        fs::write(&path, b"12345").unwrap();
        assert_eq!(read(&path, 5).unwrap(), b"12345");
        assert_eq!(message(&path, 4), "has 5 bytes; allowed: up to 4 bytes");
        assert_eq!(message(folder.path(), 4), "is a folder; allowed: a regular file");
        assert!(matches!(read(&folder.path().join("b"), 5), Err(InputError::Io(_))));
        find(&path).unwrap();
        assert!(find(folder.path()).is_err());
    }

    #[test]
    fn a_sparse_file_is_refused_by_its_length() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("sparse");
        File::create(&path).unwrap().set_len(1 << 42).unwrap();
        assert_eq!(message(&path, 16 << 20), "has 4096.0 GiB; allowed: up to 16.0 MiB");
    }

    #[cfg(unix)]
    #[test]
    fn pipes_sockets_and_devices_are_not_opened() {
        let folder = tempfile::tempdir().unwrap();
        let (socket, link) = (folder.path().join("socket"), folder.path().join("zero"));
        let _listener = std::os::unix::net::UnixListener::bind(&socket).unwrap();
        std::os::unix::fs::symlink("/dev/zero", &link).unwrap();
        assert_eq!(message(&socket, 9), "is a socket; allowed: a regular file");
        assert_eq!(message(&link, 9), "is a device; allowed: a regular file");
        // Opening a pipe that nobody writes to would wait for ever.
        let pipe = folder.path().join("pipe");
        let made = std::process::Command::new("mkfifo").arg(&pipe).status().unwrap();
        assert!(made.success());
        assert_eq!(message(&pipe, 9), "is a pipe; allowed: a regular file");
    }

    #[test]
    fn a_stream_is_read_no_further_than_its_limit() {
        assert_eq!(read_stream(&b"12345"[..], 5).unwrap(), b"12345");
        assert!(matches!(read_stream(&b"12345"[..], 4), Err(InputError::Size { bytes: None, limit: 4 })));
        assert!(matches!(read_stream(io::repeat(0), 1 << 20), Err(InputError::Size { .. })));
    }
}
