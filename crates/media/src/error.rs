//! What can go wrong while pictures are written.

use std::{io, path::PathBuf};

use bansho_base::host::plural::counted;

use crate::format::{PictureFormat, extensions_without_ffmpeg};

/// Why a picture or a film could not be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MediaError {
    /// No room is left where the file should go.
    #[error(
        "{path}: the disk is full; nothing half-written was left there. Free some space or choose another folder",
        path = .path.display()
    )]
    DiskFull {
        /// The file that was to be written.
        path: PathBuf,
    },
    /// The user may not write there.
    #[error("{path}: not allowed to write there; choose a folder you may write to", path = .path.display())]
    NotAllowed {
        /// The file that was to be written.
        path: PathBuf,
    },
    /// A folder stands where the file should go.
    #[error("{path}: is a folder; give the name of a file in it", path = .path.display())]
    IsFolder {
        /// The folder.
        path: PathBuf,
    },
    /// What bears the name is a device or a pipe.
    #[error("{path}: is no ordinary file; give another name", path = .path.display())]
    NotAFile {
        /// What was to be written.
        path: PathBuf,
    },
    /// A file that may hold somebody's work.
    #[error("{path}: is there already; choose another name", path = .path.display())]
    IsThere {
        /// The file.
        path: PathBuf,
    },
    /// The work is made from the file that bears the name.
    #[error("{path}: is a file that the scene is read from; allowed: any other name", path = .path.display())]
    OverInput {
        /// The file.
        path: PathBuf,
    },
    /// A file that Bansho did not make bears the name.
    #[error("{path}: is there and bears no mark of Bansho; allowed: another name", path = .path.display())]
    Unmarked {
        /// The file.
        path: PathBuf,
    },
    /// A file stands where a folder should be made.
    #[error("{path}: a part of this path is a file, not a folder", path = .path.display())]
    NotAFolder {
        /// The file that was to be written.
        path: PathBuf,
    },
    /// Any other refusal by the system.
    #[error("{path}: cannot be written: {source}", path = .path.display())]
    Io {
        /// The file that was to be written.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The picture's size is not what the format or the film allows.
    #[error("{path}: a picture of {width} x {height} pixels; {allowed}", path = .path.display())]
    Size {
        /// The file that was to be written.
        path: PathBuf,
        /// Width of the picture, pixels.
        width: usize,
        /// Height of the picture, pixels.
        height: usize,
        /// Which sizes are possible.
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
    /// Two channels of one name, or a name that EXR cannot hold.
    #[error("{path}: channel name `{name}` has an empty part, is longer than 255 bytes or used twice", path = .path.display())]
    ChannelName {
        /// The file that was to be written.
        path: PathBuf,
        /// The name.
        name: String,
    },
    /// A format for looking at was given scene-linear pixels, or the other way about.
    #[error("{path}: this format takes {wanted}", path = .path.display())]
    WrongPicture {
        /// The file that was to be written.
        path: PathBuf,
        /// What it takes.
        wanted: PictureFormat,
    },
    /// A frame of a film came too early, twice, or beyond the end.
    #[error(
        "{path}: frame at position {index} does not fit: the next to be written is {next} and at most {window} may wait",
        path = .path.display()
    )]
    OutOfOrder {
        /// The film.
        path: PathBuf,
        /// Position of the frame that was given.
        index: usize,
        /// Position of the frame that is due.
        next: usize,
        /// How many may wait for an earlier one.
        window: usize,
    },
    /// A film was closed before all its frames had come.
    #[error("{path}: {got} of {} came; the film was not written", counted(*.expected, "frame"), path = .path.display())]
    FramesMissing {
        /// The film.
        path: PathBuf,
        /// Frames that came without a gap.
        got: usize,
        /// Frames that were announced.
        expected: usize,
    },
    /// A film that an earlier error has already spoiled.
    #[error("{path}: not written, because an earlier frame failed", path = .path.display())]
    AlreadyFailed {
        /// The film.
        path: PathBuf,
    },
    /// Frame rate of zero, or one that the format cannot say.
    #[error("{path}: {numerator}/{denominator} frames a second cannot be written in this format", path = .path.display())]
    FrameRate {
        /// The film.
        path: PathBuf,
        /// Frames.
        numerator: u32,
        /// Seconds.
        denominator: u32,
    },
    /// The PNG or GIF encoder refused.
    #[error("{path}: cannot be encoded: {reason}", path = .path.display())]
    Encode {
        /// The file that was to be written.
        path: PathBuf,
        /// What the encoder said.
        reason: String,
    },
    /// There is no `ffmpeg` to make the film.
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
    /// `ffmpeg` gave up.
    #[error("{path}: ffmpeg failed ({status}): {}", .tail.replace('\n', "; "), path = .path.display())]
    FfmpegFailed {
        /// The film.
        path: PathBuf,
        /// How it ended.
        status: String,
        /// The last lines it said.
        tail: String,
    },
}

/// Which sizes a format can hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SizeRule {
    /// From 1 to this many pixels on a side.
    #[error("1 to {0} on a side are possible")]
    UpTo(usize),
    /// Every frame of a film is as large as the first was said to be.
    #[error("this film is {0} x {1}")]
    Exactly(usize, usize),
}

impl MediaError {
    /// Sorts a system error on `path` into what a user can act on.
    pub fn from_io(path: impl Into<PathBuf>, source: io::Error) -> Self {
        let path = path.into();
        match source.kind() {
            io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded | io::ErrorKind::FileTooLarge => {
                Self::DiskFull { path }
            }
            io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem => Self::NotAllowed { path },
            io::ErrorKind::IsADirectory => Self::IsFolder { path },
            io::ErrorKind::NotADirectory => Self::NotAFolder { path },
            _ => Self::Io { path, source },
        }
    }
}
