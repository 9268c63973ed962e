//! Reads back the files of frames that Bansho wrote: their pixels without any loss, to join tiles and to make films of finished frames, and their fingerprints,
//! so that a job can skip what is complete.

use std::{io::Cursor, path::Path};

use bansho_base::{
    color::AlphaConvention,
    frame::{Channel, DisplayImage, DisplayPixels, Precision},
    image::Image,
};

use crate::{
    exr,
    files::input::{self, InputError},
    fingerprint,
    format::OutputKind,
    png::{self, KEY_ALPHA, KEY_ENCODING},
};

/// Largest frame file that is read, bytes. Bansho writes no larger ones.
const FRAME_BYTES: u64 = 8 << 30;

/// Why a frame cannot be read back.
#[derive(Debug, thiserror::Error)]
pub enum FrameFileError {
    /// The file cannot be read.
    #[error(transparent)]
    Input(#[from] InputError),
    /// The file is not as Bansho writes it.
    #[error("was not written by Bansho, or is damaged: {0}")]
    Damaged(String),
}

fn damaged(reason: impl ToString) -> FrameFileError {
    FrameFileError::Damaged(reason.to_string())
}

/// The pixels of an EXR frame.
#[derive(Clone, Debug, PartialEq)]
pub struct LinearPixels {
    /// Premultiplied red, green, blue and alpha.
    pub beauty: Image<4>,
    /// Depth, m.
    pub depth: Option<Vec<f32>>,
    /// Layers and AOVs, with their names in the file.
    pub channels: Vec<Channel>,
}

/// Reads a PNG frame.
///
/// # Errors
/// The file cannot be read, or is no PNG with the samples that Bansho writes.
pub fn read_png(path: &Path) -> Result<DisplayImage, FrameFileError> {
    let bytes = input::read(path, FRAME_BYTES)?;
    let mut reader = ::png::Decoder::new(Cursor::new(&bytes)).read_info().map_err(damaged)?;
    let length = reader.output_buffer_size().ok_or_else(|| damaged("it is too large"))?;
    let mut samples = vec![0; length];
    let info = reader.next_frame(&mut samples).map_err(damaged)?;
    let texts = &reader.info().uncompressed_latin1_text;
    let alpha = texts.iter().find(|text| text.keyword == KEY_ALPHA);
    let alpha = alpha.and_then(|text| AlphaConvention::from_name(&text.text)).unwrap_or_default();
    let encoding = texts.iter().find(|text| text.keyword == KEY_ENCODING);
    let encoding = png::encoding_of_name(encoding.map(|text| text.text.as_str()));
    let (opaque, channels) = match info.color_type {
        ::png::ColorType::Rgb => (true, 3),
        ::png::ColorType::Rgba => (false, 4),
        other => return Err(damaged(format!("its color type is {other:?}"))),
    };
    let pixels = match info.bit_depth {
        ::png::BitDepth::Eight => {
            DisplayPixels::Eight(samples.chunks_exact(channels).map(|pixel| with_alpha(pixel, u8::MAX)).collect())
        }
        ::png::BitDepth::Sixteen => {
            let codes: Vec<u16> = samples.as_chunks().0.iter().map(|&bytes| u16::from_be_bytes(bytes)).collect();
            DisplayPixels::Sixteen(codes.chunks_exact(channels).map(|pixel| with_alpha(pixel, u16::MAX)).collect())
        }
        other => return Err(damaged(format!("its depth is {other:?}"))),
    };
    Ok(DisplayImage { width: info.width as usize, height: info.height as usize, opaque, alpha, encoding, pixels })
}

fn with_alpha<T: Copy>(samples: &[T], opaque: T) -> [T; 4] {
    [samples[0], samples[1], samples[2], samples.get(3).copied().unwrap_or(opaque)]
}

/// Reads an EXR frame.
///
/// # Errors
/// The file cannot be read, or is no EXR with the channels that Bansho writes.
pub fn read_exr(path: &Path) -> Result<LinearPixels, FrameFileError> {
    use ::exr::prelude::{FlatSamples, ReadChannels, ReadLayers, read};
    let bytes = input::read(path, FRAME_BYTES)?;
    let reader = read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer().all_attributes();
    let layer = reader.from_buffered(Cursor::new(&bytes[..])).map_err(damaged)?.layer_data;
    let (width, height) = (layer.size.0, layer.size.1);
    let (mut beauty, mut depth, mut channels) = (Image::<4>::filled(width, height, [0.0; 4]), None, Vec::new());
    for channel in layer.channel_data.list {
        let name = channel.name.to_string();
        let (values, precision): (Vec<f32>, _) = match channel.sample_data {
            FlatSamples::F16(values) => (values.iter().map(|value| value.to_f32()).collect(), Precision::Half),
            FlatSamples::F32(values) => (values, Precision::Single),
            FlatSamples::U32(_) => return Err(damaged(format!("channel `{name}` has whole numbers"))),
        };
        match ["R", "G", "B", "A"].iter().position(|component| *component == name) {
            Some(component) => {
                beauty.pixels_mut().iter_mut().zip(values).for_each(|(pixel, value)| pixel[component] = value);
            }
            None if name == "Z" => depth = Some(values),
            None => channels.push(Channel { name, precision, values }),
        }
    }
    Ok(LinearPixels { beauty, depth, channels })
}

/// The fingerprint of the frame at `path`, a file of format `kind`, if Bansho wrote it and it is complete: every checksum of a PNG is right
/// up to its end; the digest in the header of an OpenEXR file is that of its bytes. `None` for a file that is missing, truncated, damaged or
/// made by another program, for what is not a regular file, and for films.
pub fn existing_fingerprint(path: &Path, kind: OutputKind) -> Option<[u8; 32]> {
    fingerprint(&input::read(path, FRAME_BYTES).ok()?, kind)
}

/// As [`existing_fingerprint`], of the bytes of a file.
pub fn fingerprint(file: &[u8], kind: OutputKind) -> Option<[u8; 32]> {
    match kind {
        OutputKind::Png => of_png(file),
        OutputKind::Exr => of_exr(file),
        // A film contains many frames, and is always written from the start.
        OutputKind::Apng | OutputKind::Gif | OutputKind::Mp4 | OutputKind::Mov | OutputKind::Webm => None,
    }
}

fn of_png(file: &[u8]) -> Option<[u8; 32]> {
    let (mut fingerprint, mut has_pixels, mut ended) = (None, false, false);
    for chunk in png::chunk::chunks(file)? {
        // Nothing may follow the last chunk: a file that was written over a longer one would still have its end.
        let chunk = chunk.ok().filter(|_| !ended)?;
        match &chunk.kind {
            b"tEXt" => {
                let prefix = [png::KEY_FINGERPRINT.as_bytes(), b"\0"].concat();
                let digits = chunk.contents.strip_prefix(&prefix[..]);
                fingerprint = fingerprint.or(digits.and_then(fingerprint::from_hex));
            }
            b"IDAT" => has_pixels = true,
            b"IEND" => ended = true,
            _ => {}
        }
    }
    fingerprint.filter(|_| has_pixels && ended)
}

fn of_exr(file: &[u8]) -> Option<[u8; 32]> {
    let header = exr::header::parse_header(file).ok()?;
    let [part] = &header.parts[..] else { return None };
    let digest_at = part.string(exr::KEY_DIGEST).filter(|range| range.len() == 64)?;
    let digest = fingerprint::from_hex(file.get(digest_at.clone())?)?;
    // As it was written: of the file with zeros in place of the digits.
    let mut hasher = blake3::Hasher::new();
    hasher.update(file.get(..digest_at.start)?).update(&[b'0'; 64]).update(file.get(digest_at.end..)?);
    if *hasher.finalize().as_bytes() != digest {
        return None;
    }
    fingerprint::from_hex(file.get(part.string(exr::KEY_FINGERPRINT)?)?)
}

#[cfg(test)]
mod tests {
    use std::fs;

    use bansho_base::frame::DisplayEncoding;

    use super::*;
    use crate::testing;

    #[test]
    fn a_png_comes_back_with_every_code() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        let eight = DisplayImage { alpha: AlphaConvention::Linear, ..testing::display(9, 4, 3) };
        let DisplayPixels::Eight(codes) = &eight.pixels else { unreachable!() };
        let wide = codes.iter().map(|pixel| pixel.map(|code| u16::from(code) * 251 + 3)).collect();
        let sixteen = DisplayImage { pixels: DisplayPixels::Sixteen(wide), ..eight.clone() };
        let raw = DisplayImage { encoding: DisplayEncoding::LinearAcescg, ..eight.clone() };
        let data = DisplayImage { encoding: DisplayEncoding::Data, opaque: false, ..sixteen.clone() };
        for picture in [DisplayImage { opaque: false, ..eight }, DisplayImage { opaque: false, ..sixteen }, raw, data] {
            let bytes = png::encode(&picture, &[1; 32], png::PngEffort::Fast, &path).unwrap();
            fs::write(&path, &bytes).unwrap();
            let read = read_png(&path).unwrap();
            assert_eq!(read, picture);
            assert_eq!(png::encode(&read, &[1; 32], png::PngEffort::Fast, &path).unwrap(), bytes);
            fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
            assert!(matches!(read_png(&path), Err(FrameFileError::Damaged(_))));
        }
        assert!(matches!(read_png(&folder.path().join("none")), Err(FrameFileError::Input(_))));
    }

    #[test]
    fn an_exr_comes_back_and_encodes_to_the_same_bytes() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        let frame = testing::frame(20, 18);
        let bytes = exr::encode(&frame, &path).unwrap();
        fs::write(&path, &bytes).unwrap();
        let LinearPixels { beauty, depth, channels } = read_exr(&path).unwrap();
        assert_eq!((beauty.width(), beauty.height()), (20, 18));
        let again = bansho_base::frame::Frame { beauty, depth, channels, ..frame };
        assert_eq!(exr::encode(&again, &path).unwrap(), bytes);
        fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
        assert!(matches!(read_exr(&path), Err(FrameFileError::Damaged(_))));
    }

    const FINGERPRINT: [u8; 32] = *b"the pixels depend on all of this";

    fn a_png() -> Vec<u8> {
        let pixels = (0..35).map(|i| [i * 7, i, 255 - i, 200]).collect();
        let pixels = DisplayPixels::Eight(pixels);
        let picture = DisplayImage {
            width: 7,
            height: 5,
            opaque: false,
            alpha: AlphaConvention::Encoded,
            encoding: DisplayEncoding::Srgb,
            pixels,
        };
        png::encode(&picture, &FINGERPRINT, png::PngEffort::Fast, Path::new("a.png")).unwrap()
    }

    fn an_exr() -> Vec<u8> {
        let mut frame = testing::frame(20, 18);
        frame.header.fingerprint = FINGERPRINT;
        exr::encode(&frame, Path::new("a.exr")).unwrap()
    }

    #[test]
    fn whole_files_give_their_fingerprint() {
        assert_eq!(fingerprint(&a_png(), OutputKind::Png), Some(FINGERPRINT));
        assert_eq!(fingerprint(&an_exr(), OutputKind::Exr), Some(FINGERPRINT));
        // A file of another format than its name says is not the frame that was to be written.
        assert_eq!([fingerprint(&a_png(), OutputKind::Exr), fingerprint(&an_exr(), OutputKind::Png)], [None; 2]);
        assert_eq!(fingerprint(&a_png(), OutputKind::Apng), None);
    }

    #[test]
    fn cut_off_files_count_as_absent() {
        for (file, kind) in [(a_png(), OutputKind::Png), (an_exr(), OutputKind::Exr)] {
            for length in 0..file.len() {
                assert_eq!(fingerprint(&file[..length], kind), None, "cut to {length} of {}", file.len());
            }
        }
    }

    #[test]
    fn any_changed_byte_makes_a_file_count_as_absent() {
        for (file, kind) in [(a_png(), OutputKind::Png), (an_exr(), OutputKind::Exr)] {
            for index in 0..file.len() {
                let mut damaged = file.clone();
                damaged[index] ^= 0x10;
                assert_eq!(fingerprint(&damaged, kind), None, "byte {index} of {}", file.len());
            }
        }
    }

    #[test]
    fn files_with_more_behind_them_and_missing_files_count_as_absent() {
        for (file, kind) in [(a_png(), OutputKind::Png), (an_exr(), OutputKind::Exr)] {
            assert_eq!(fingerprint(&[&file[..], b"x"].concat(), kind), None);
        }
        assert_eq!(existing_fingerprint(Path::new("no such folder/a.png"), OutputKind::Png), None);
        // An endless device.
        #[cfg(unix)]
        assert_eq!(existing_fingerprint(Path::new("/dev/zero"), OutputKind::Png), None);
    }
}
