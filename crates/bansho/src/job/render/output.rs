//! Frames into files: view transform where the format is made to be looked at, encoding, whole files in order.

use std::{
    fs,
    path::{Path, PathBuf},
    sync::atomic::{AtomicUsize, Ordering},
};

use bansho_base::{
    color::{AlphaConvention, View},
    frame::{DisplayImage, Frame},
    host::observer::{Observer, Stage, StageGuard},
};
use bansho_media::{
    MediaError,
    files::{naming::OutputPattern, overwrite_policy::OverwritePolicy},
    format::{OutputKind, PictureFormat},
    output::sink::{FrameSlot, Picture, Sink, SinkOptions},
};
use bansho_render::{
    Plan,
    display::{BitDepth, display},
    fingerprint,
};

use super::{draw_frames::FrameSink, figures, finished_files::Finished};
use crate::job::{
    error::JobError,
    observer::{FrameDone, JobObserver},
};

/// How the pictures of a job are written.
#[derive(Clone, Debug)]
pub(crate) struct Format {
    pub(crate) pattern: OutputPattern,
    pub(crate) view: View,
    pub(crate) bits: BitDepth,
    /// What straight alpha is made for.
    pub(crate) alpha: AlphaConvention,
    /// Whether figures are written beside each picture.
    pub(crate) figures: bool,
    /// Which files that are there may be written over.
    pub(crate) overwrite: OverwritePolicy,
}

impl Format {
    /// What a file's fingerprint must be: that of the frame's pixels, and of how they are stored where that may differ.
    pub(crate) fn fingerprint(&self, frame: [u8; 32]) -> [u8; 32] {
        match self.pattern.kind() {
            OutputKind::Png => fingerprint::of_png(frame, self.bits, self.alpha),
            OutputKind::Exr
            | OutputKind::Apng
            | OutputKind::Gif
            | OutputKind::Mp4
            | OutputKind::Mov
            | OutputKind::Webm => frame,
        }
    }

    /// A picture, and the figures beside it.
    pub(crate) fn files(&self, picture: &Path) -> impl Iterator<Item = PathBuf> + use<> {
        let figures = self.figures.then(|| figures::path(picture));
        [Some(picture.to_path_buf()), figures].into_iter().flatten()
    }

    /// Opens the files for `count` frames of `size` pixels; `window` of them may be under way at once.
    pub(crate) fn open(&self, plan: &Plan, count: usize, size: [usize; 2], window: usize) -> Result<Sink, JobError> {
        let fps = plan.fps();
        let options = SinkOptions {
            opaque: plan.scene().has_plate(),
            alpha: self.alpha,
            sixteen_bits: self.bits == BitDepth::Sixteen,
            window,
            overwrite: self.overwrite.clone(),
            ..SinkOptions::new(size, [fps.frames, fps.seconds], count)
        };
        Ok(Sink::open(self.pattern.clone(), options)?)
    }

    /// Gives a frame to its sink, shown or as it is, as the sink wants it.
    pub(crate) fn write(
        &self,
        sink: &Sink,
        index: usize,
        frame: &mut Frame,
        observer: &dyn Observer,
    ) -> Result<(), JobError> {
        frame.header.fingerprint = self.fingerprint(frame.header.fingerprint);
        if self.figures {
            // Before the picture, so that a picture that is there has its figures.
            figures::write(frame, &sink.path(frame.header.number), &self.overwrite)?;
        }
        let slot = FrameSlot { index, number: frame.header.number };
        let shown = match sink.picture_format() {
            PictureFormat::Frame => None,
            PictureFormat::Display => Some(self.show(frame, observer)),
            PictureFormat::OpaqueDisplay => {
                // Premultiplied light over black is the light itself.
                frame.opaque = true;
                Some(self.show(frame, observer))
            }
        };
        let _stage = StageGuard::begin(observer, Stage::Write);
        let picture = match &shown {
            Some(picture) => Picture::Display(picture, &frame.header.fingerprint),
            None => Picture::Linear(frame),
        };
        Ok(sink.write(slot, picture)?)
    }

    /// The view transform.
    pub(crate) fn show(&self, frame: &Frame, observer: &dyn Observer) -> DisplayImage {
        let _stage = StageGuard::begin(observer, Stage::View);
        display(frame, &self.view, self.bits, self.alpha)
    }
}

/// Writes every frame where the sink puts it.
pub(crate) struct ToFiles<'a> {
    pub(crate) format: &'a Format,
    pub(crate) sink: Sink,
    pub(crate) window: usize,
    pub(crate) observer: &'a dyn JobObserver,
    pub(crate) drawn: AtomicUsize,
    pub(crate) finished: &'a Finished,
}

impl FrameSink for ToFiles<'_> {
    fn finish(&self, index: usize, frame: &mut Frame, observer: &dyn Observer) -> Result<(), JobError> {
        let number = frame.header.number;
        self.format.write(&self.sink, index, frame, observer)?;
        let drawn = self.drawn.fetch_add(1, Ordering::Relaxed) + 1;
        let path = self.sink.kind().is_sequence().then(|| self.sink.path(number));
        path.iter().flat_map(|path| self.format.files(path)).for_each(|file| self.finished.note(file));
        self.observer.frame_done(&FrameDone { number, path, drawn });
        Ok(())
    }

    fn window(&self) -> usize {
        self.window
    }
}

/// Whether `path` could be written, found out without leaving a trace: its folder, or the nearest that there is, takes
/// a nameless file.
///
/// # Errors
/// A folder stands at `path`, a file stands where a folder should be, or it is not allowed.
pub(crate) fn check_writable(path: &Path) -> Result<(), MediaError> {
    if path.is_dir() {
        return Err(MediaError::IsFolder { path: path.to_path_buf() });
    }
    let folders = path.ancestors().skip(1);
    let mut folders = folders.map(|folder| if folder.as_os_str().is_empty() { Path::new(".") } else { folder });
    let Some(folder) = folders.find(|folder| fs::symlink_metadata(folder).is_ok()) else {
        return Ok(());
    };
    if !folder.is_dir() {
        return Err(MediaError::NotAFolder { path: path.to_path_buf() });
    }
    tempfile::tempfile_in(folder).map(drop).map_err(|source| MediaError::from_io(path, source))
}
