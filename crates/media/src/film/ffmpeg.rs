//! Films by `ffmpeg`: H.264, ProRes 4444 with alpha, VP9 with alpha, AV1.
//!
//! Raw frames go through a pipe; the film has a temporary name until `ffmpeg` has exited successfully. It is tagged with Rec. 709 primaries
//! and matrix, sRGB transfer and limited range. Films of different versions of `ffmpeg` look the same, but their bytes may differ.

use std::{
    ffi::OsString,
    io::{self, Read, Write},
    path::{Path, PathBuf},
    process::{Child, ChildStdin, Command, Stdio},
    thread::JoinHandle,
};

use bansho_base::{
    color::AlphaConvention,
    frame::{DisplayImage, DisplayPixels},
};

use super::ordered::FilmEncoder;
use crate::{
    error::MediaError,
    files::{atomic::AtomicFile, overwrite_policy::OverwritePolicy, provenance},
    imageops::flatten,
    png::KEY_ALPHA,
};

/// Options of films by `ffmpeg`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct VideoOptions {
    /// The program; a name without a folder is searched in `PATH`.
    pub program: PathBuf,
    /// Codec of `.webm`.
    pub webm: WebmCodec,
}

impl Default for VideoOptions {
    fn default() -> Self {
        Self { program: PathBuf::from("ffmpeg"), webm: WebmCodec::default() }
    }
}

/// Codecs of WebM.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum WebmCodec {
    /// VP9, 8 bits, with alpha.
    #[default]
    Vp9,
    /// AV1, 10 bits, without alpha.
    Av1,
}

/// Containers that `ffmpeg` writes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum VideoContainer {
    /// H.264.
    Mp4,
    /// QuickTime, with ProRes 4444.
    Mov,
    /// VP9 or AV1, by [`VideoOptions::webm`].
    Webm,
}

/// The format of all frames of a film.
#[derive(Clone, Debug)]
pub(crate) struct VideoFormat {
    pub(crate) container: VideoContainer,
    pub(crate) size: [usize; 2],
    pub(crate) fps: [u32; 2],
    pub(crate) opaque: bool,
    pub(crate) alpha: AlphaConvention,
    pub(crate) sixteen_bits: bool,
    pub(crate) options: VideoOptions,
}

impl VideoFormat {
    /// Whether the film has no alpha.
    fn is_opaque(&self) -> bool {
        self.opaque || !carries_alpha(self.container, &self.options)
    }

    /// The encoded size. 4:2:0 chroma needs even sides, so the last column or row of an odd side is repeated.
    fn encoded_size(&self) -> [usize; 2] {
        match self.container {
            VideoContainer::Mov => self.size,
            VideoContainer::Mp4 | VideoContainer::Webm => self.size.map(|side| side.next_multiple_of(2)),
        }
    }
}

/// Whether a film in this container has alpha.
pub(crate) fn carries_alpha(container: VideoContainer, options: &VideoOptions) -> bool {
    match (container, options.webm) {
        (VideoContainer::Mov, _) | (VideoContainer::Webm, WebmCodec::Vp9) => true,
        (VideoContainer::Mp4, _) | (VideoContainer::Webm, WebmCodec::Av1) => false,
    }
}

/// A frame as raw video for `ffmpeg`: RGBA rows of 8 bits, or of 16 bits little-endian.
pub(crate) fn prepare(picture: &DisplayImage, format: &VideoFormat) -> Vec<u8> {
    let flattened;
    let picture = if format.is_opaque() && !picture.opaque {
        flattened = flatten::over_black(picture);
        &flattened
    } else {
        picture
    };
    let encoded_size = format.encoded_size();
    if format.sixteen_bits {
        let wide = match &picture.pixels {
            DisplayPixels::Sixteen(pixels) => padded(pixels, format.size, encoded_size),
            DisplayPixels::Eight(pixels) => {
                // 255 becomes 65535.
                let wide: Vec<[u16; 4]> = pixels.iter().map(|pixel| pixel.map(|code| u16::from(code) * 257)).collect();
                padded(&wide, format.size, encoded_size)
            }
        };
        wide.as_flattened().iter().flat_map(|code| code.to_le_bytes()).collect()
    } else {
        padded(&flatten::to_eight_bits(&picture.pixels), format.size, encoded_size).into_flattened()
    }
}

/// `pixels` with the last column and row repeated up to the size `padded_size`.
fn padded<T: Copy>(pixels: &[T], [width, height]: [usize; 2], padded_size: [usize; 2]) -> Vec<T> {
    if padded_size == [width, height] {
        return pixels.to_vec();
    }
    let [padded_width, padded_height] = padded_size;
    let mut padded = Vec::with_capacity(padded_width * padded_height);
    for y in 0..padded_height {
        let row = &pixels[y.min(height - 1) * width..][..width];
        padded.extend((0..padded_width).map(|x| row[x.min(width - 1)]));
    }
    padded
}

/// All arguments for a film at `output`, which exists and is empty.
fn arguments(format: &VideoFormat, output: &Path) -> Vec<OsString> {
    let [width, height] = format.encoded_size();
    let [frames, seconds] = format.fps;
    let (size, rate) = (format!("{width}x{height}"), format!("{frames}/{seconds}"));
    let input = if format.sixteen_bits { "rgba64le" } else { "rgba" };
    let pixels = pixel_format(format);
    // The scaler needs the matrix, which it otherwise guesses. The frames need the tags (`setparams`), because ProRes takes them from
    // there. The options in `tags` are for the container.
    let filter = format!(
        "scale=out_color_matrix=bt709:out_range=tv:flags=accurate_rnd+full_chroma_int+full_chroma_inp+bitexact,\
         format={pixels},setparams=range=tv:color_primaries=bt709:color_trc=iec61966-2-1:colorspace=bt709"
    );
    let input = ["-f", "rawvideo", "-pixel_format", input, "-video_size", &size, "-framerate", &rate, "-i", "pipe:0"];
    let tags = [
        ["-color_primaries", "bt709"],
        ["-color_trc", "iec61966-2-1"],
        ["-colorspace", "bt709"],
        ["-color_range", "tv"],
        ["-fflags", "+bitexact"],
        ["-flags:v", "+bitexact"],
        ["-map_metadata", "-1"],
    ];
    let (convention, tag) = (format!("{KEY_ALPHA}={}", format.alpha.name()), provenance_tag(format.container));
    let alpha = ["-metadata", &convention].into_iter().filter(|_| !format.is_opaque());
    let start = ["-y", "-nostdin", "-hide_banner", "-nostats", "-loglevel", "error", "-xerror"];
    let words = start.into_iter().chain(input).chain(["-an", "-vf", &filter]).chain(codec(format).iter().copied());
    let words = words.chain(tags.into_iter().flatten()).chain(alpha).chain(["-metadata", &tag]);
    // Without the rate of the output, some containers are given the nearest whole number.
    let words = words.chain(["-r", &rate, "-f", muxer(format.container)]);
    words.map(OsString::from).chain([output.as_os_str().to_owned()]).collect()
}

/// The provenance tag. MP4 has no custom tags, so it is the comment there.
fn provenance_tag(container: VideoContainer) -> String {
    match container {
        VideoContainer::Mp4 => format!("comment={}", provenance::COMMENT_TAG),
        VideoContainer::Mov | VideoContainer::Webm => provenance::COMMENT_TAG.to_owned(),
    }
}

fn pixel_format(format: &VideoFormat) -> &'static str {
    match (format.container, format.options.webm, format.is_opaque()) {
        (VideoContainer::Mov, _, false) => "yuva444p10le",
        (VideoContainer::Mov, _, true) => "yuv444p10le",
        (VideoContainer::Webm, WebmCodec::Av1, _) => "yuv420p10le",
        (VideoContainer::Webm, WebmCodec::Vp9, false) => "yuva420p",
        (VideoContainer::Webm, WebmCodec::Vp9, true) | (VideoContainer::Mp4, ..) => "yuv420p",
    }
}

fn codec(format: &VideoFormat) -> &'static [&'static str] {
    match (format.container, format.options.webm) {
        // 16 bits of straight alpha, and the vendor code that other programs expect.
        (VideoContainer::Mov, _) => &[
            "-c:v",
            "prores_ks",
            "-profile:v",
            "4444",
            "-alpha_bits",
            "16",
            "-vendor",
            "apl0",
            "-movflags",
            "+write_colr+use_metadata_tags",
        ],
        (VideoContainer::Webm, WebmCodec::Av1) => &["-c:v", "libsvtav1", "-preset", "8", "-crf", "24", "-g", "120"],
        // Alternate reference frames do not work with alpha.
        (VideoContainer::Webm, WebmCodec::Vp9) => {
            &["-c:v", "libvpx-vp9", "-crf", "20", "-b:v", "0", "-row-mt", "1", "-cpu-used", "4", "-auto-alt-ref", "0"]
        }
        // Dark gradients of fire and night need a higher quality than the default. The index goes to the front, for
        // streaming.
        (VideoContainer::Mp4, _) => {
            &["-c:v", "libx264", "-preset", "medium", "-crf", "16", "-movflags", "+faststart+write_colr"]
        }
    }
}

/// The name of `ffmpeg`'s muxer for a container.
fn muxer(container: VideoContainer) -> &'static str {
    match container {
        VideoContainer::Mp4 => "mp4",
        VideoContainer::Mov => "mov",
        VideoContainer::Webm => "webm",
    }
}

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
        let file = AtomicFile::create(path, overwrite)?;
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn odd_sides_get_their_last_pixels_twice() {
        assert_eq!(padded(&[1, 2, 3, 4, 5, 6], [3, 2], [4, 2]), [1, 2, 3, 3, 4, 5, 6, 6]);
        assert_eq!(padded(&[1, 2, 3], [1, 3], [2, 4]), [1, 1, 2, 2, 3, 3, 3, 3]);
        assert_eq!(padded(&[1, 2], [2, 1], [2, 1]), [1, 2]);
    }

    fn words(container: VideoContainer, opaque: bool, webm: WebmCodec) -> String {
        let options = VideoOptions { webm, ..VideoOptions::default() };
        let (size, fps, alpha) = ([65, 48], [24000, 1001], AlphaConvention::Encoded);
        let format = VideoFormat { container, size, fps, opaque, alpha, sixteen_bits: false, options };
        let words: Vec<_> =
            arguments(&format, Path::new("t.part")).into_iter().map(|word| word.into_string().unwrap()).collect();
        words.join(" ")
    }

    #[test]
    fn every_film_names_its_matrix_transfer_and_rate() {
        for container in [VideoContainer::Mp4, VideoContainer::Mov, VideoContainer::Webm] {
            let words = words(container, false, WebmCodec::Vp9);
            for part in
                ["out_color_matrix=bt709", "-colorspace bt709", "-color_trc iec61966-2-1", "-framerate 24000/1001"]
            {
                assert!(words.contains(part), "{words}");
            }
            assert!(words.ends_with(&format!("-r 24000/1001 -f {} t.part", muxer(container))), "{words}");
        }
    }

    #[test]
    fn alpha_is_kept_where_the_codec_has_it() {
        assert!(words(VideoContainer::Mov, false, WebmCodec::Vp9).contains("format=yuva444p10le"));
        assert!(words(VideoContainer::Mov, true, WebmCodec::Vp9).contains("format=yuv444p10le"));
        assert!(words(VideoContainer::Webm, false, WebmCodec::Vp9).contains("format=yuva420p,"));
        assert!(words(VideoContainer::Webm, false, WebmCodec::Av1).contains("format=yuv420p10le"));
        assert!(words(VideoContainer::Mp4, false, WebmCodec::Vp9).contains("format=yuv420p,"));
        let names_its_alpha =
            |container, opaque, webm| words(container, opaque, webm).contains("-metadata bansho:alpha=encoded");
        for container in [VideoContainer::Mov, VideoContainer::Webm] {
            assert!(
                names_its_alpha(container, false, WebmCodec::Vp9) && !names_its_alpha(container, true, WebmCodec::Vp9)
            );
        }
        assert!(!names_its_alpha(VideoContainer::Webm, false, WebmCodec::Av1));
        assert!(!names_its_alpha(VideoContainer::Mp4, false, WebmCodec::Vp9));
    }

    #[test]
    fn odd_sides_are_padded_but_for_prores() {
        assert!(words(VideoContainer::Mp4, true, WebmCodec::Vp9).contains("66x48"));
        assert!(words(VideoContainer::Mov, true, WebmCodec::Vp9).contains("65x48"));
    }
}
