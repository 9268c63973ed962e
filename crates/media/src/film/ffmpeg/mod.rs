//! Films by `ffmpeg`: H.264, ProRes 4444 with alpha, VP9 with alpha, AV1.
//!
//! Raw frames go through a pipe; the film has a temporary name until `ffmpeg` has exited successfully. It is tagged with Rec. 709 primaries
//! and matrix, sRGB transfer and limited range. Films of different versions of `ffmpeg` look the same, but their bytes may differ.

mod arguments;
mod process;

use std::path::{Path, PathBuf};

use bansho_base::{
    color::AlphaConvention,
    frame::{DisplayImage, DisplayPixels},
};

use crate::imageops::flatten;

pub(crate) use self::process::FfmpegFilm;

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
    let pixel = |index: usize| {
        let (x, y) = (index % padded_size[0], index / padded_size[0]);
        pixels[y.min(height - 1) * width + x.min(width - 1)]
    };
    (0..padded_size[0] * padded_size[1]).map(pixel).collect()
}

/// The command line of `ffmpeg` for a film at `output`.
pub(crate) fn arguments(format: &VideoFormat, output: &Path) -> Vec<std::ffi::OsString> {
    arguments::arguments(format, output)
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
}
