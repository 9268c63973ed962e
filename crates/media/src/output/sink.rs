//! The sink of finished frames: a sequence of files, or a film.

use std::path::{Path, PathBuf};

use bansho_base::{
    color::AlphaConvention,
    frame::{DisplayEncoding, DisplayImage, DisplayPixels, Frame},
    host::observer::{Observer, Unobserved},
};

use crate::{
    error::{MediaError, SizeRule},
    exr,
    files::{
        atomic::{self, AtomicFile},
        naming::OutputPattern,
        overwrite_policy::OverwritePolicy,
    },
    film::{
        apng::{self, ApngFilm, ApngFormat},
        ffmpeg::{self, FfmpegFilm, VideoContainer, VideoFormat, VideoOptions},
        gif::{self, GifFilm, GifFormat},
        ordered::{FilmEncoder, ReorderBuffer},
    },
    format::{OutputKind, PictureFormat},
    frame_rate::GifTiming,
    png::{self, PngEffort},
};

/// How frames are written. Begin with [`SinkOptions::new`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SinkOptions {
    /// Width and height of every frame, pixels; unused for sequences.
    pub size: [usize; 2],
    /// Frames per second, as a fraction.
    pub fps: [u32; 2],
    /// Number of frames.
    pub frame_count: usize,
    /// Whether a plate fills the picture, so that films need no alpha.
    pub opaque: bool,
    /// The convention of straight alpha, which films with alpha declare.
    pub alpha: AlphaConvention,
    /// Whether display pixels have 16 bits, for films that keep more than 8.
    pub sixteen_bits: bool,
    /// Compression effort of PNG files.
    pub png_effort: PngEffort,
    /// GIF: transparency by an alpha threshold, instead of compositing over black.
    pub gif_transparent: bool,
    /// Options of films by `ffmpeg`.
    pub video: VideoOptions,
    /// Number of frames of a film that may wait for an earlier one; at least 1.
    pub window: usize,
    /// Which existing files may be overwritten.
    pub overwrite: OverwritePolicy,
}

impl SinkOptions {
    /// Default options for `frame_count` frames of `size` pixels at `fps` frames per second.
    pub fn new(size: [usize; 2], fps: [u32; 2], frame_count: usize) -> Self {
        Self {
            size,
            fps,
            frame_count,
            opaque: false,
            alpha: AlphaConvention::default(),
            sixteen_bits: false,
            png_effort: PngEffort::default(),
            gif_transparent: false,
            video: VideoOptions::default(),
            window: 16,
            overwrite: OverwritePolicy::default(),
        }
    }

    /// The pixel data that a sink of `kind` with these options takes.
    pub fn picture_format(&self, kind: OutputKind) -> PictureFormat {
        let has_alpha = match kind {
            OutputKind::Exr => return PictureFormat::Frame,
            OutputKind::Png | OutputKind::Apng => true,
            OutputKind::Gif => self.gif_transparent,
            OutputKind::Mp4 => ffmpeg::carries_alpha(VideoContainer::Mp4, &self.video),
            OutputKind::Mov => ffmpeg::carries_alpha(VideoContainer::Mov, &self.video),
            OutputKind::Webm => ffmpeg::carries_alpha(VideoContainer::Webm, &self.video),
        };
        if has_alpha { PictureFormat::Display } else { PictureFormat::OpaqueDisplay }
    }
}

/// Position and number of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameSlot {
    /// Position among the frames of the job, from 0. Determines the order in a film.
    pub index: usize,
    /// Frame number. Determines the file name in a sequence.
    pub number: i64,
}

/// A finished picture.
#[derive(Clone, Copy, Debug)]
pub enum FinishedPicture<'a> {
    /// Scene-linear, for EXR; carries its fingerprint in its header.
    Linear(&'a Frame),
    /// Display pixels, with the fingerprint of everything they depend on.
    Display(&'a DisplayImage, &'a [u8; 32]),
}

/// A frame as its file or film takes it, and where it goes: [`Sink::commit`] writes it.
pub struct EncodedFrame {
    slot: FrameSlot,
    bytes: EncodedBytes,
}

enum EncodedBytes {
    File(Vec<u8>),
    Apng(<ApngFilm as FilmEncoder>::EncodedFrame),
    Gif(<GifFilm as FilmEncoder>::EncodedFrame),
    Video(<FfmpegFilm as FilmEncoder>::EncodedFrame),
}

/// Writes finished frames. May be used from several threads at once.
///
/// Frames of a sequence may be written in any order; each file is complete or does not exist. Frames of a film may be written in any order
/// within [`SinkOptions::window`] positions of the next one. A film gets its name in [`Sink::finish`]; a sink that is dropped before leaves
/// no film behind.
pub struct Sink {
    pattern: OutputPattern,
    options: SinkOptions,
    target: SinkTarget,
}

enum SinkTarget {
    Png,
    Exr,
    Apng(ReorderBuffer<ApngFilm>),
    Gif(ReorderBuffer<GifFilm>, GifFormat),
    Video(ReorderBuffer<FfmpegFilm>, VideoFormat),
}

impl Sink {
    /// Creates the folder, checks that files can be written there, and starts a film.
    ///
    /// # Errors
    /// The folder cannot be written, the disk is full, a film would replace a file that must stay, the format does not allow the size or
    /// frame rate, or `ffmpeg` is not installed.
    pub fn open(pattern: OutputPattern, options: SinkOptions) -> Result<Self, MediaError> {
        let path = pattern.path(0);
        let kind = pattern.kind();
        if !kind.is_sequence() {
            check_film(&path, &options)?;
        }
        let target = match kind {
            OutputKind::Png => SinkTarget::Png,
            OutputKind::Exr => SinkTarget::Exr,
            OutputKind::Apng => {
                let film = ApngFilm::create(&path, apng_format(&options), &options.overwrite)?;
                SinkTarget::Apng(in_order(film, &path, &options))
            }
            OutputKind::Gif => {
                let format = gif_format(&path, &options)?;
                let film = GifFilm::create(&path, format.clone(), &options.overwrite)?;
                SinkTarget::Gif(in_order(film, &path, &options), format)
            }
            OutputKind::Mp4 => open_video(VideoContainer::Mp4, &path, &options)?,
            OutputKind::Mov => open_video(VideoContainer::Mov, &path, &options)?,
            OutputKind::Webm => open_video(VideoContainer::Webm, &path, &options)?,
        };
        if kind.is_sequence() {
            // Better to fail now than after the first frame has been rendered.
            drop(AtomicFile::create(&path, &options.overwrite)?);
        }
        Ok(Self { pattern, options, target })
    }

    /// The format of its files.
    pub fn kind(&self) -> OutputKind {
        self.pattern.kind()
    }

    /// The pixel data that it takes.
    pub fn picture_format(&self) -> PictureFormat {
        self.options.picture_format(self.kind())
    }

    /// The file of frame `number`.
    pub fn path(&self, number: i64) -> PathBuf {
        self.pattern.path(number)
    }

    /// Writes a frame. A picture with alpha is composited over black if the format has none.
    ///
    /// # Errors
    /// The frame cannot be written or would replace a file that must stay, has the wrong pixel format or size, or is out of order.
    pub fn write(&self, slot: FrameSlot, picture: FinishedPicture<'_>) -> Result<(), MediaError> {
        self.commit(self.encode(slot, picture, &Unobserved)?)
    }

    /// Encodes a frame and writes nothing: most of the work of [`write`](Self::write), in any order.
    ///
    /// # Errors
    /// The frame has the wrong pixel format or size, or its format cannot hold it; [`MediaError::Cancelled`] if the observer stops the compression of an EXR
    /// file, which takes long.
    pub fn encode(
        &self,
        slot: FrameSlot,
        picture: FinishedPicture<'_>,
        observer: &dyn Observer,
    ) -> Result<EncodedFrame, MediaError> {
        let path = self.path(slot.number);
        let bytes = match (&self.target, picture) {
            (SinkTarget::Exr, FinishedPicture::Linear(frame)) => {
                EncodedBytes::File(exr::encode_observed(frame, &path, observer)?)
            }
            (SinkTarget::Png, FinishedPicture::Display(image, fingerprint)) => {
                EncodedBytes::File(png::encode(image, fingerprint, self.options.png_effort, &path)?)
            }
            (SinkTarget::Apng(_), FinishedPicture::Display(image, _)) => {
                self.check_frame(image, &path)?;
                EncodedBytes::Apng(apng::prepare(image, self.options.opaque, &path)?)
            }
            (SinkTarget::Gif(_, format), FinishedPicture::Display(image, _)) => {
                self.check_frame(image, &path)?;
                EncodedBytes::Gif(gif::prepare(image, slot.index, format, &path)?)
            }
            (SinkTarget::Video(_, format), FinishedPicture::Display(image, _)) => {
                self.check_frame(image, &path)?;
                EncodedBytes::Video(ffmpeg::prepare(image, format))
            }
            (SinkTarget::Exr, FinishedPicture::Display(..))
            | (
                SinkTarget::Png | SinkTarget::Apng(_) | SinkTarget::Gif(..) | SinkTarget::Video(..),
                FinishedPicture::Linear(_),
            ) => return Err(MediaError::WrongPicture { path, expected: self.picture_format() }),
        };
        Ok(EncodedFrame { slot, bytes })
    }

    /// Writes a frame that this sink has encoded.
    ///
    /// # Errors
    /// The frame cannot be written, would replace a file that must stay, is out of order, or was encoded by a sink of another format.
    pub fn commit(&self, EncodedFrame { slot, bytes }: EncodedFrame) -> Result<(), MediaError> {
        match (&self.target, bytes) {
            (SinkTarget::Exr | SinkTarget::Png, EncodedBytes::File(bytes)) => {
                atomic::write_bytes(&self.path(slot.number), &bytes, &self.options.overwrite)
            }
            (SinkTarget::Apng(film), EncodedBytes::Apng(encoded)) => film.push(slot.index, encoded),
            (SinkTarget::Gif(film, _), EncodedBytes::Gif(encoded)) => film.push(slot.index, encoded),
            (SinkTarget::Video(film, _), EncodedBytes::Video(encoded)) => film.push(slot.index, encoded),
            _ => Err(MediaError::WrongPicture { path: self.path(slot.number), expected: self.picture_format() }),
        }
    }

    /// Completes a film and renames it to its final name. A sequence needs no completion.
    ///
    /// # Errors
    /// Frames are missing, an earlier frame failed, or the film cannot be written.
    pub fn finish(self) -> Result<(), MediaError> {
        match self.target {
            SinkTarget::Png | SinkTarget::Exr => Ok(()),
            SinkTarget::Apng(film) => film.finish(),
            SinkTarget::Gif(film, _) => film.finish(),
            SinkTarget::Video(film, _) => film.finish(),
        }
    }

    /// Checks that a frame of a film has the size of the film, and colors that the film can name.
    fn check_frame(&self, image: &DisplayImage, path: &Path) -> Result<(), MediaError> {
        if image.encoding != DisplayEncoding::Srgb && !self.kind().takes_linear_acescg() {
            return Err(MediaError::NotSrgb { path: path.to_path_buf() });
        }
        let [width, height] = self.options.size;
        if [image.width, image.height] != [width, height] {
            let (path, allowed) = (path.to_path_buf(), SizeRule::Exactly(width, height));
            return Err(MediaError::Size { path, width: image.width, height: image.height, allowed });
        }
        let got = match &image.pixels {
            DisplayPixels::Eight(pixels) => pixels.len(),
            DisplayPixels::Sixteen(pixels) => pixels.len(),
        };
        if got == width * height {
            return Ok(());
        }
        Err(MediaError::PlaneLength {
            path: path.to_path_buf(),
            plane: "RGBA".to_owned(),
            got,
            expected: width * height,
        })
    }
}

fn in_order<F: FilmEncoder>(film: F, path: &Path, options: &SinkOptions) -> ReorderBuffer<F> {
    ReorderBuffer::new(film, path.to_path_buf(), options.frame_count, options.window)
}

fn open_video(container: VideoContainer, path: &Path, options: &SinkOptions) -> Result<SinkTarget, MediaError> {
    let format = video_format(container, options);
    let film = FfmpegFilm::create(path, &format, &options.overwrite)?;
    Ok(SinkTarget::Video(in_order(film, path, options), format))
}

/// Largest side of a film, pixels.
const FILM_SIDE_LIMIT: usize = 65535;

fn check_film(path: &Path, options: &SinkOptions) -> Result<(), MediaError> {
    let [width, height] = options.size;
    if [width, height].iter().all(|side| (1..=FILM_SIDE_LIMIT).contains(side)) {
        return Ok(());
    }
    Err(MediaError::Size { path: path.to_path_buf(), width, height, allowed: SizeRule::UpTo(FILM_SIDE_LIMIT) })
}

fn apng_format(options: &SinkOptions) -> ApngFormat {
    let SinkOptions { frame_count, size, fps, .. } = *options;
    ApngFormat { frame_count, size, fps }
}

fn gif_format(path: &Path, options: &SinkOptions) -> Result<GifFormat, MediaError> {
    let [numerator, denominator] = options.fps;
    let timing = GifTiming::new(options.fps).ok_or_else(|| MediaError::FrameRate {
        path: path.to_path_buf(),
        numerator,
        denominator,
    })?;
    let transparent = options.gif_transparent && !options.opaque;
    Ok(GifFormat { frame_count: options.frame_count, size: options.size, timing, transparent })
}

fn video_format(container: VideoContainer, options: &SinkOptions) -> VideoFormat {
    let SinkOptions { size, fps, opaque, alpha, sixteen_bits, .. } = *options;
    VideoFormat { container, size, fps, opaque, alpha, sixteen_bits, options: options.video.clone() }
}
