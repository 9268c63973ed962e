//! Errors of encoding and writing.

use std::{io, path::PathBuf};

use bansho_base::host::{observer::Cancelled, plural::counted};

use crate::format::{PictureFormat, extensions_without_ffmpeg};

/// Why a picture or a film could not be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MediaError {
    /// The observer asked to stop while the picture was encoded.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// The disk is full.
    #[error(
        "{path}: the disk is full; no incomplete file was left there. Free some space or choose another folder",
        path = .path.display()
    )]
    DiskFull {
        /// The file that was to be written.
        path: PathBuf,
    },
    /// The file would be larger than the system allows.
    #[error(
        "{path}: the file would be larger than this process may write (`ulimit -f`) or the disk can hold; no incomplete file was left there",
        path = .path.display()
    )]
    FileTooLarge {
        /// The file that was to be written.
        path: PathBuf,
    },
    /// No permission to write there.
    #[error("{path}: no permission to write there; choose a folder you may write to", path = .path.display())]
    NotAllowed {
        /// The file that was to be written.
        path: PathBuf,
    },
    /// The path is a folder.
    #[error("{path}: is a folder; give the name of a file in it", path = .path.display())]
    IsFolder {
        /// The folder.
        path: PathBuf,
    },
    /// The path is a device, a pipe or a socket.
    #[error("{path}: is not a regular file; give another name", path = .path.display())]
    NotAFile {
        /// The file that was to be written.
        path: PathBuf,
    },
    /// The file exists, and was to be created.
    #[error("{path}: already exists; choose another name", path = .path.display())]
    AlreadyExists {
        /// The file.
        path: PathBuf,
    },
    /// The path is an input of the job.
    #[error("{path}: is a file that the scene is read from; allowed: any other name", path = .path.display())]
    IsInput {
        /// The file.
        path: PathBuf,
    },
    /// The file exists, and Bansho did not make it.
    #[error("{path}: already exists and was not made by Bansho; allowed: another name", path = .path.display())]
    NotMadeByBansho {
        /// The file.
        path: PathBuf,
    },
    /// The path is a link where a file of a fixed name is to be written.
    #[error("{path}: is a link; allowed: no file, or one that Bansho made", path = .path.display())]
    IsLink {
        /// The link.
        path: PathBuf,
    },
    /// A parent folder is a file.
    #[error("{path}: a part of this path is a file, not a folder", path = .path.display())]
    NotAFolder {
        /// The file that was to be written.
        path: PathBuf,
    },
    /// Another error of the operating system.
    #[error("{path}: cannot be written: {source}", path = .path.display())]
    Io {
        /// The file that was to be written.
        path: PathBuf,
        /// The error.
        source: io::Error,
    },
    /// The format or the film does not allow a picture of this size.
    #[error("{path}: a picture of {width} x {height} pixels; {allowed}", path = .path.display())]
    Size {
        /// The file that was to be written.
        path: PathBuf,
        /// Width of the picture, pixels.
        width: usize,
        /// Height of the picture, pixels.
        height: usize,
        /// The sizes that are allowed.
        allowed: SizeRule,
    },
    /// The number of pixels is not width times height, or a channel is longer or shorter than the picture.
    #[error("{path}: `{plane}` has {} where the picture has {}", counted(*.got, "value"), counted(*.expected, "pixel"), path = .path.display())]
    PlaneLength {
        /// The file that was to be written.
        path: PathBuf,
        /// The plane or channel.
        plane: String,
        /// Its number of values.
        got: usize,
        /// The number of pixels.
        expected: usize,
    },
    /// Two channels with the same name, or a name that EXR does not allow.
    #[error("{path}: channel name `{name}` has an empty component, is longer than 255 bytes or used twice", path = .path.display())]
    ChannelName {
        /// The file that was to be written.
        path: PathBuf,
        /// The name.
        name: String,
    },
    /// A display format was given scene-linear pixels, or a scene-linear format display pixels.
    #[error("{path}: this format requires {expected}", path = .path.display())]
    WrongPicture {
        /// The file that was to be written.
        path: PathBuf,
        /// The pixels that it takes.
        expected: PictureFormat,
    },
    /// Pixels that are not sRGB for a format that cannot say what else they are.
    #[error("{path}: this format requires sRGB pixels", path = .path.display())]
    NotSrgb {
        /// The file that was to be written.
        path: PathBuf,
    },
    /// A frame of a film was added too early, twice, or beyond the end.
    #[error(
        "{path}: the frame at position {index} is out of order: the next to be written is {next}, and up to {window} may wait",
        path = .path.display()
    )]
    OutOfOrder {
        /// The film.
        path: PathBuf,
        /// Position of the frame.
        index: usize,
        /// Position of the next frame to be written.
        next: usize,
        /// How many frames may wait for an earlier one.
        window: usize,
    },
    /// A film was finished before all its frames were added.
    #[error("{path}: {got} of {} were added; the film was not written", counted(*.expected, "frame"), path = .path.display())]
    FramesMissing {
        /// The film.
        path: PathBuf,
        /// Frames that were added without a gap.
        got: usize,
        /// Frames of the film.
        expected: usize,
    },
    /// An earlier frame of the film failed.
    #[error("{path}: not written, because an earlier frame failed", path = .path.display())]
    AlreadyFailed {
        /// The film.
        path: PathBuf,
    },
    /// A frame rate of zero, or one that the format cannot represent.
    #[error("{path}: {numerator}/{denominator} frames per second cannot be written in this format", path = .path.display())]
    FrameRate {
        /// The film.
        path: PathBuf,
        /// Frames.
        numerator: u32,
        /// Seconds.
        denominator: u32,
    },
    /// The encoder failed.
    #[error("{path}: cannot be encoded: {reason}", path = .path.display())]
    Encode {
        /// The file that was to be written.
        path: PathBuf,
        /// Its message.
        reason: String,
    },
    /// `ffmpeg` was not found.
    #[error(
        "{path}: needs the program `{program}`, which is not installed. Get it with `apt install ffmpeg`, `brew install \
         ffmpeg` or `winget install ffmpeg`, or from https://ffmpeg.org; without it choose {}",
        extensions_without_ffmpeg(), path = .path.display(), program = .program.display()
    )]
    NoFfmpeg {
        /// The film.
        path: PathBuf,
        /// The program that was tried.
        program: PathBuf,
    },
    /// `ffmpeg` failed.
    #[error("{path}: ffmpeg failed ({status}): {}", .tail.replace('\n', "; "), path = .path.display())]
    FfmpegFailed {
        /// The film.
        path: PathBuf,
        /// Its exit status.
        status: String,
        /// The last lines of its standard error.
        tail: String,
    },
}

/// The sizes that a format or a film allows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SizeRule {
    /// From 1 to this many pixels on a side.
    #[error("allowed: 1 to {0} on a side")]
    UpTo(usize),
    /// All frames of a film have the same width and height, pixels.
    #[error("allowed: {0} x {1}, the size of this film")]
    Exactly(usize, usize),
}

impl MediaError {
    /// Classifies an error of the operating system on `path`.
    pub fn from_io(path: impl Into<PathBuf>, source: io::Error) -> Self {
        let path = path.into();
        match source.kind() {
            io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => Self::DiskFull { path },
            io::ErrorKind::FileTooLarge => Self::FileTooLarge { path },
            io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem => Self::NotAllowed { path },
            io::ErrorKind::IsADirectory => Self::IsFolder { path },
            io::ErrorKind::NotADirectory => Self::NotAFolder { path },
            _ => Self::Io { path, source },
        }
    }
}
