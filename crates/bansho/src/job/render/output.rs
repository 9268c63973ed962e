//! Writes frames: the view transform of display formats, metadata, and encoding.

use std::{
    path::{Path, PathBuf},
    sync::atomic::{AtomicUsize, Ordering},
};

use bansho_base::{
    color::{AlphaConvention, View},
    frame::{DisplayImage, Frame},
    host::observer::{Observer, Stage, StageGuard},
};
use bansho_media::{
    files::{naming::OutputPattern, overwrite_policy::OverwritePolicy},
    format::{OutputKind, PictureFormat},
    output::sink::{EncodedFrame, FrameSlot, Sink, SinkOptions},
};
use bansho_render::{
    Plan, Target,
    display::{BitDepth, DisplayOptions, display},
    fingerprint,
};

use super::metadata;
use crate::job::{
    checks::finished_files::FinishedFiles,
    error::JobError,
    observer::{FrameDone, JobObserver},
    pipeline::draw_frames::{DrawnFrame, FrameSink},
};

/// How the pictures of a job are written.
#[derive(Clone, Debug)]
pub(crate) struct Format {
    pub(crate) pattern: OutputPattern,
    pub(crate) view: View,
    pub(crate) bits: BitDepth,
    /// Convention of straight alpha.
    pub(crate) alpha: AlphaConvention,
    /// Whether metadata is written beside each picture.
    pub(crate) metadata: bool,
    /// Which existing files may be overwritten.
    pub(crate) overwrite: OverwritePolicy,
}

impl Format {
    /// The fingerprint of a file: that of the frame's pixels and, where the format has options, of how they are stored.
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

    /// The file of a picture, and the file of its metadata.
    pub(crate) fn files(&self, picture: &Path) -> impl Iterator<Item = PathBuf> + use<> {
        let metadata = self.metadata.then(|| metadata::path(picture));
        [Some(picture.to_path_buf()), metadata].into_iter().flatten()
    }

    /// Opens the files for `count` frames of `size` pixels, all of them `opaque` or not. Up to `max_in_flight` of them are written at once.
    pub(crate) fn open(
        &self,
        plan: &Plan,
        opaque: bool,
        count: usize,
        size: [usize; 2],
        max_in_flight: usize,
    ) -> Result<Sink, JobError> {
        let fps = plan.fps();
        let options = SinkOptions {
            opaque,
            alpha: self.alpha,
            sixteen_bits: self.bits == BitDepth::Sixteen,
            window: max_in_flight,
            overwrite: self.overwrite.clone(),
            ..SinkOptions::new(size, [fps.frames, fps.seconds], count)
        };
        Ok(Sink::open(self.pattern.clone(), options)?)
    }

    /// Encodes a frame and its metadata, if they are requested.
    fn encode(
        &self,
        sink: &Sink,
        index: usize,
        frame: &mut impl DrawnFrame,
        observer: &dyn Observer,
    ) -> Result<EncodedPicture, JobError> {
        let header = frame.header_mut();
        header.fingerprint = self.fingerprint(header.fingerprint);
        let number = header.number;
        let metadata = self.metadata.then(|| metadata::text(frame.header(), frame.metadata(), &sink.path(number)));
        let _stage = StageGuard::begin(observer, Stage::Write);
        let picture = sink.encode(FrameSlot { index, number }, frame.picture(), observer)?;
        Ok(EncodedPicture { number, metadata, picture })
    }

    /// Writes the metadata of a frame, and then the picture, so that every existing picture has its metadata.
    fn write(&self, sink: &Sink, encoded: EncodedPicture, observer: &dyn Observer) -> Result<(), JobError> {
        let _stage = StageGuard::begin(observer, Stage::Write);
        if let Some(metadata) = &encoded.metadata {
            metadata::write(metadata, &sink.path(encoded.number), &self.overwrite)?;
        }
        Ok(sink.commit(encoded.picture)?)
    }

    /// How light becomes the display pixels that the sink takes; `None` if it takes light.
    pub(crate) fn display_options(&self, sink: &Sink) -> Option<DisplayOptions> {
        let over_black = match sink.picture_format() {
            PictureFormat::Frame => return None,
            PictureFormat::Display => false,
            PictureFormat::OpaqueDisplay => true,
        };
        Some(DisplayOptions { view: self.view, depth: self.bits, alpha: self.alpha, over_black })
    }

    /// The view transform.
    pub(crate) fn to_display(&self, frame: &Frame, observer: &dyn Observer) -> DisplayImage {
        let _stage = StageGuard::begin(observer, Stage::View);
        display(frame, &self.view, self.bits, self.alpha)
    }
}

/// A frame that is ready to be written.
pub(crate) struct EncodedPicture {
    number: i64,
    /// The text of its metadata, if that is written.
    metadata: Option<String>,
    picture: EncodedFrame,
}

/// Writes every frame to the sink.
pub(crate) struct FileWriter<'a, T> {
    pub(crate) format: &'a Format,
    /// What frames are drawn as: what the sink takes.
    pub(crate) target: T,
    pub(crate) sink: &'a Sink,
    pub(crate) max_in_flight: usize,
    pub(crate) observer: &'a dyn JobObserver,
    pub(crate) drawn: AtomicUsize,
    pub(crate) finished: &'a FinishedFiles,
}

impl<T: Target<Frame: DrawnFrame>> FrameSink for FileWriter<'_, T> {
    type Target = T;
    type Encoded = EncodedPicture;

    fn target(&self) -> &T {
        &self.target
    }

    fn encode(&self, index: usize, frame: &mut T::Frame, observer: &dyn Observer) -> Result<EncodedPicture, JobError> {
        self.format.encode(self.sink, index, frame, observer)
    }

    fn commit(&self, _index: usize, encoded: EncodedPicture, observer: &dyn Observer) -> Result<(), JobError> {
        let number = encoded.number;
        self.format.write(self.sink, encoded, observer)?;
        let drawn = self.drawn.fetch_add(1, Ordering::Relaxed) + 1;
        let path = self.sink.kind().is_sequence().then(|| self.sink.path(number));
        path.iter().flat_map(|path| self.format.files(path)).for_each(|file| self.finished.record(file));
        self.observer.frame_done(&FrameDone { number, path, drawn });
        Ok(())
    }

    fn max_in_flight(&self) -> usize {
        self.max_in_flight
    }

    fn writes_pixels(&self) -> bool {
        true
    }
}
