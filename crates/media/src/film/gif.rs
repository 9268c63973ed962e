//! Animated GIF: one palette for the whole film, made from all frames, and ordered dithering that is constant in time, so that flames do
//! not shimmer.
//!
//! Frames are kept compressed in an unnamed temporary file until the last one is added; then the palette is made and they are written.
//! Memory is that of a few pictures, whatever the number of frames.

use std::{
    fs::File,
    io::{BufWriter, Cursor, Read, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
};

use ::gif::{DisposalMethod, Encoder, Extension, Repeat};
use bansho_base::frame::{DisplayEncoding, DisplayImage, DisplayPixels};

use super::{
    ordered::FilmEncoder,
    palette::{Ditherer, FrameHistogram, Histogram, palette},
};
use crate::{
    error::{MediaError, SizeRule},
    files::{atomic::AtomicFile, overwrite_policy::OverwritePolicy, provenance},
    frame_rate::GifTiming,
    imageops::flatten,
    png,
};
use rayon::prelude::*;

/// Largest side of a GIF, pixels.
const SIDE_LIMIT: usize = 65535;
/// Frames that are dithered and compressed in parallel.
const BATCH: usize = 8;
/// Alpha threshold of a transparent GIF.
const ALPHA_THRESHOLD: u8 = 128;

/// The format of all frames.
#[derive(Clone, Debug)]
pub(crate) struct GifFormat {
    pub(crate) frame_count: usize,
    pub(crate) size: [usize; 2],
    pub(crate) timing: GifTiming,
    /// Transparency by an alpha threshold, instead of compositing over black.
    pub(crate) transparent: bool,
}

/// A compressed frame and its color histogram; `None` for one that is dropped because of the frame rate.
pub(crate) struct GifFrame(Option<(Vec<u8>, FrameHistogram)>);

pub(crate) struct GifFilm {
    file: AtomicFile,
    /// The temporary file: compressed frames one after another.
    spool: File,
    spooled: Vec<SpooledFrame>,
    histogram: Histogram,
    format: GifFormat,
    received: usize,
}

#[derive(Clone, Copy)]
struct SpooledFrame {
    index: usize,
    /// Length in the temporary file, bytes.
    length: usize,
}

impl GifFilm {
    pub(crate) fn create(path: &Path, format: GifFormat, overwrite: &OverwritePolicy) -> Result<Self, MediaError> {
        let [width, height] = format.size;
        if width.max(height) > SIDE_LIMIT {
            let allowed = SizeRule::UpTo(SIDE_LIMIT);
            return Err(MediaError::Size { path: path.to_path_buf(), width, height, allowed });
        }
        let file = AtomicFile::create(path, overwrite)?;
        let folder = file.temporary_path().parent().unwrap_or(Path::new("."));
        let spool = tempfile::tempfile_in(folder).map_err(|source| MediaError::from_io(path, source))?;
        Ok(Self { file, spool, spooled: Vec::new(), histogram: Histogram::new(), format, received: 0 })
    }
}

/// Prepares a frame for the temporary file.
pub(crate) fn prepare(
    picture: &DisplayImage,
    index: usize,
    format: &GifFormat,
    path: &Path,
) -> Result<GifFrame, MediaError> {
    if !format.timing.is_kept(index) {
        return Ok(GifFrame(None));
    }
    let pixels = if format.transparent {
        let mut pixels = flatten::to_eight_bits(&picture.pixels);
        pixels.iter_mut().for_each(|pixel| {
            *pixel = if pixel[3] < ALPHA_THRESHOLD { [0; 4] } else { [pixel[0], pixel[1], pixel[2], 255] }
        });
        pixels
    } else {
        flatten::to_eight_bits(&flatten::over_black(picture).pixels)
    };
    // Transparent pixels need no entry of the palette.
    let mut histogram = FrameHistogram::new();
    pixels.iter().filter(|pixel| pixel[3] == 255).for_each(|&[r, g, b, _]| histogram.count([r, g, b]));
    let picture = DisplayImage {
        width: picture.width,
        height: picture.height,
        opaque: !format.transparent,
        alpha: picture.alpha,
        encoding: DisplayEncoding::Srgb,
        pixels: DisplayPixels::Eight(pixels),
    };
    Ok(GifFrame(Some((png::encode_frame(&picture, path)?, histogram))))
}

impl FilmEncoder for GifFilm {
    type EncodedFrame = GifFrame;

    fn append(&mut self, GifFrame(encoded): GifFrame) -> Result<(), MediaError> {
        if let Some((bytes, histogram)) = encoded {
            self.spool.write_all(&bytes).map_err(|source| MediaError::from_io(self.file.path(), source))?;
            self.spooled.push(SpooledFrame { index: self.received, length: bytes.len() });
            self.histogram.add(&histogram);
        }
        self.received += 1;
        Ok(())
    }

    fn finish(mut self) -> Result<(), MediaError> {
        let path = self.file.path().to_path_buf();
        // One of 256 entries is for transparency.
        let entries = palette(&self.histogram, if self.format.transparent { 255 } else { 256 });
        let transparent = self.format.transparent.then_some(entries.len() as u8);
        let writer = GifWriter {
            ditherer: Ditherer::new(&entries, &self.histogram),
            transparent,
            format: &self.format,
            path: &path,
        };
        let mut colors = entries.into_flattened();
        colors.extend(transparent.iter().flat_map(|_| [0; 3]));
        self.spool.seek(SeekFrom::Start(0)).map_err(|source| MediaError::from_io(&path, source))?;
        writer.write(&mut self.spool, &self.spooled, &colors, BufWriter::new(self.file.file()))?;
        self.file.finish()
    }
}

/// Writes the frames of a film with its palette.
struct GifWriter<'a> {
    ditherer: Ditherer,
    transparent: Option<u8>,
    format: &'a GifFormat,
    path: &'a Path,
}

impl GifWriter<'_> {
    fn write(
        &self,
        spool: &mut File,
        spooled: &[SpooledFrame],
        colors: &[u8],
        mut out: BufWriter<&mut File>,
    ) -> Result<(), MediaError> {
        let [width, height] = self.format.size.map(|side| side as u16);
        let mut encoder = Encoder::new(&mut out, width, height, colors).map_err(|error| self.encoding(error))?;
        encoder.set_repeat(Repeat::Infinite).map_err(|error| self.encoding(error))?;
        let comment = encoder.write_raw_extension(Extension::Comment.into(), &[provenance::COMMENT_TAG.as_bytes()]);
        comment.map_err(|error| self.encoding(error))?;
        for batch in spooled.chunks(BATCH) {
            // Read one after another, as they are in the file; dithered and compressed in parallel; written in their order.
            let mut files = Vec::with_capacity(batch.len());
            for frame in batch {
                let mut bytes = vec![0; frame.length];
                spool.read_exact(&mut bytes).map_err(|source| MediaError::from_io(self.path, source))?;
                files.push((frame.index, bytes));
            }
            let frames: Vec<_> =
                files.into_par_iter().map(|(index, bytes)| self.frame(index, &bytes)).collect::<Result<_, _>>()?;
            for frame in &frames {
                encoder.write_lzw_pre_encoded_frame(frame).map_err(|error| self.encoding(error))?;
            }
        }
        drop(encoder);
        out.flush().map_err(|source| MediaError::from_io(self.path, source))
    }

    /// One frame with its delay, dithered and compressed.
    fn frame(&self, index: usize, bytes: &[u8]) -> Result<::gif::Frame<'static>, MediaError> {
        let [width, height] = self.format.size;
        let (pixels, channels) = decode_frame(bytes).ok_or_else(|| MediaError::Encode {
            path: PathBuf::from(self.path),
            reason: "a frame kept in the temporary file was lost".to_owned(),
        })?;
        let mut indices = Vec::with_capacity(width * height);
        for (y, row) in pixels.chunks_exact(width * channels).enumerate() {
            indices.extend(row.chunks_exact(channels).enumerate().map(|(x, pixel)| match (pixel, self.transparent) {
                ([_, _, _, 0], Some(transparent)) => transparent,
                ([r, g, b, ..], _) => self.ditherer.index([*r, *g, *b], x, y),
                _ => 0,
            }));
        }
        let mut frame = ::gif::Frame {
            width: width as u16,
            height: height as u16,
            delay: self.format.timing.delay_cs(index, self.format.frame_count),
            // A transparent frame does not cover the one before, which is therefore cleared.
            dispose: if self.transparent.is_some() { DisposalMethod::Background } else { DisposalMethod::Keep },
            transparent: self.transparent,
            buffer: indices.into(),
            ..Default::default()
        };
        frame.make_lzw_pre_encoded();
        Ok(frame)
    }

    fn encoding(&self, error: ::gif::EncodingError) -> MediaError {
        match error {
            ::gif::EncodingError::Io(source) => MediaError::from_io(self.path, source),
            other => MediaError::Encode { path: PathBuf::from(self.path), reason: other.to_string() },
        }
    }
}

/// The samples of a PNG, and the number of samples per pixel.
fn decode_frame(bytes: &[u8]) -> Option<(Vec<u8>, usize)> {
    let mut reader = ::png::Decoder::new(Cursor::new(bytes)).read_info().ok()?;
    let mut pixels = vec![0; reader.output_buffer_size()?];
    let info = reader.next_frame(&mut pixels).ok()?;
    Some((pixels, info.color_type.samples()))
}

#[cfg(test)]
mod tests {
    use bansho_base::color::AlphaConvention;

    use super::*;

    fn ramp(index: usize) -> DisplayImage {
        let pixel = |i: usize| [(i * 4) as u8, (i * 2 + index * 8) as u8, 0, if i % 8 < 3 { 40 } else { 220 }];
        let pixels = DisplayPixels::Eight((0..64).map(pixel).collect());
        DisplayImage {
            width: 16,
            height: 4,
            opaque: false,
            alpha: AlphaConvention::Linear,
            encoding: DisplayEncoding::Srgb,
            pixels,
        }
    }

    fn film(frames: usize, fps: [u32; 2], transparent: bool) -> Vec<u8> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.gif");
        let timing = GifTiming::new(fps).unwrap();
        let format = GifFormat { frame_count: frames, size: [16, 4], timing, transparent };
        let mut film = GifFilm::create(&path, format.clone(), &OverwritePolicy::default()).unwrap();
        for index in 0..frames {
            film.append(prepare(&ramp(index), index, &format, &path).unwrap()).unwrap();
        }
        film.finish().unwrap();
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
        std::fs::read(&path).unwrap()
    }

    fn read_back(file: &[u8]) -> Vec<(u16, Vec<u8>)> {
        let mut options = ::gif::DecodeOptions::new();
        options.set_color_output(::gif::ColorOutput::RGBA);
        let mut decoder = options.read_info(file).unwrap();
        assert_eq!(decoder.repeat(), Repeat::Infinite);
        let mut frames = Vec::new();
        while let Some(frame) = decoder.read_next_frame().unwrap() {
            frames.push((frame.delay, frame.buffer.to_vec()));
        }
        frames
    }

    #[test]
    fn colors_come_back_over_black_with_their_lengths() {
        let frames = read_back(&film(3, [30, 1], false));
        assert_eq!(frames.iter().map(|frame| frame.0).collect::<Vec<_>>(), [3, 4, 3]);
        for (index, (_, pixels)) in frames.iter().enumerate() {
            let expected = flatten::to_eight_bits(&flatten::over_black(&ramp(index)).pixels);
            for (found, wanted) in pixels.as_chunks::<4>().0.iter().zip(&expected) {
                assert!(found.iter().zip(wanted).all(|(a, b)| a.abs_diff(*b) <= 10), "{found:?} {wanted:?}");
            }
        }
    }

    #[test]
    fn a_transparent_film_shows_pixels_by_half_their_alpha() {
        let frames = read_back(&film(2, [25, 1], true));
        for (_, pixels) in frames {
            for (index, pixel) in pixels.as_chunks::<4>().0.iter().enumerate() {
                assert_eq!(pixel[3], if index % 8 < 3 { 0 } else { 255 }, "pixel {index}");
            }
        }
    }

    #[test]
    fn a_fast_film_leaves_frames_out_and_keeps_its_length() {
        let frames = read_back(&film(60, [120, 1], false));
        assert_eq!(frames.len(), 25);
        assert_eq!(frames.iter().map(|frame| u32::from(frame.0)).sum::<u32>(), 50);
    }

    #[test]
    fn the_same_film_is_the_same_bytes_whatever_the_threads() {
        let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let one = pool(1).install(|| film(9, [25, 1], false));
        let four = pool(4).install(|| film(9, [25, 1], false));
        assert!(one == four);
    }
}
