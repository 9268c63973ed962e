//! The `ffmpeg` process.

use std::{
    io::{self, Read, Write},
    path::Path,
    process::{Child, ChildStdin, Command, Stdio},
    thread::JoinHandle,
};

use super::{VideoFormat, arguments};
use crate::{
    error::MediaError,
    files::{atomic::AtomicFile, overwrite_policy::OverwritePolicy},
    film::ordered::FilmEncoder,
};

/// Number of bytes at the end of standard error that are kept.
const TAIL_BYTES: usize = 4096;

/// `CreateProcess` flag for a process that Ctrl-C in the console does not reach.
#[cfg(windows)]
const CREATE_NEW_PROCESS_GROUP: u32 = 0x200;

/// A film in progress. If it is dropped before it is finished, `ffmpeg` is stopped and no file is left.
pub(crate) struct FfmpegFilm {
    // Drop order: the process must have ended before its file is removed.
    process: FfmpegProcess,
    file: AtomicFile,
}

struct FfmpegProcess {
    child: Child,
    frames: Option<ChildStdin>,
    stderr: Option<JoinHandle<Vec<u8>>>,
}

impl FfmpegFilm {
    pub(crate) fn create(path: &Path, format: &VideoFormat, overwrite: &OverwritePolicy) -> Result<Self, MediaError> {
        let [numerator, denominator] = format.fps;
        if numerator == 0 || denominator == 0 {
            return Err(MediaError::FrameRate { path: path.to_path_buf(), numerator, denominator });
        }
        let file = AtomicFile::create_with(path, overwrite)?;
        let mut command = Command::new(&format.options.program);
        command.args(arguments(format, file.temporary_path()));
        command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::piped());
        // SVT-AV1 ignores `-loglevel`; this is its own option to log errors only.
        command.env("SVT_LOG", "1");
        // A separate process group, so that Ctrl-C reaches only Bansho, which then ends the film in order.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        #[cfg(windows)]
        std::os::windows::process::CommandExt::creation_flags(&mut command, CREATE_NEW_PROCESS_GROUP);
        let mut child = command.spawn().map_err(|source| match source.kind() {
            io::ErrorKind::NotFound => {
                MediaError::NoFfmpeg { path: path.to_path_buf(), program: format.options.program.clone() }
            }
            _ => MediaError::from_io(path, source),
        })?;
        let frames = child.stdin.take();
        let stderr = child.stderr.take().map(|stream| std::thread::spawn(move || tail(stream)));
        Ok(Self { process: FfmpegProcess { child, frames, stderr }, file })
    }
}

/// The end of a stream, which is read completely so that the process never blocks on it.
fn tail(mut stream: impl Read) -> Vec<u8> {
    let (mut kept, mut buffer) = (Vec::new(), [0; 1024]);
    while let Ok(length @ 1..) = stream.read(&mut buffer) {
        kept.extend_from_slice(&buffer[..length]);
        kept.drain(..kept.len().saturating_sub(TAIL_BYTES));
    }
    kept
}

impl FfmpegProcess {
    /// Waits for the process and checks its result. The exit status alone is not enough: `ffmpeg` (at least 5.1) exits with 0 if only
    /// writing the trailer or closing the file failed. Since only errors are logged, success means an empty log.
    fn wait(&mut self, path: &Path) -> Result<(), MediaError> {
        drop(self.frames.take());
        let status = self.child.wait().map_err(|source| MediaError::from_io(path, source))?;
        let stderr = self.stderr.take().and_then(|thread| thread.join().ok()).unwrap_or_default();
        let tail = String::from_utf8_lossy(&stderr).trim().to_owned();
        if status.success() && tail.is_empty() {
            return Ok(());
        }
        if tail.contains("No space left on device") {
            return Err(MediaError::DiskFull { path: path.to_path_buf() });
        }
        Err(MediaError::FfmpegFailed { path: path.to_path_buf(), status: status.to_string(), tail })
    }
}

impl Drop for FfmpegProcess {
    fn drop(&mut self) {
        // Both fail only if the process has already been waited for.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl FilmEncoder for FfmpegFilm {
    type EncodedFrame = Vec<u8>;

    fn append(&mut self, encoded: Vec<u8>) -> Result<(), MediaError> {
        let written = self.process.frames.as_mut().map(|pipe| pipe.write_all(&encoded));
        match written {
            Some(Ok(())) => Ok(()),
            // The pipe is closed because the program failed; its log has the reason.
            Some(Err(source)) => {
                self.process.wait(self.file.path())?;
                Err(MediaError::from_io(self.file.path(), source))
            }
            None => Err(MediaError::AlreadyFailed { path: self.file.path().to_path_buf() }),
        }
    }

    fn finish(mut self) -> Result<(), MediaError> {
        self.process.wait(self.file.path())?;
        self.file.finish()
    }
}
