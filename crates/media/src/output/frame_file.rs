//! Reads frames back from the files that Bansho wrote them to, without any loss: to join tiles, and to make films of finished frames.

use std::{io::Cursor, path::Path};

use bansho_base::{
    color::AlphaConvention,
    frame::{Channel, DisplayImage, DisplayPixels, Precision},
    image::Image,
};

use crate::{
    files::input::{self, InputError},
    png::KEY_ALPHA,
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
    #[error("is no frame of Bansho, or damaged: {0}")]
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
    Ok(DisplayImage { width: info.width as usize, height: info.height as usize, opaque, alpha, pixels })
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

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::{exr, png, testing};

    #[test]
    fn a_png_comes_back_with_every_code() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        let eight = DisplayImage { alpha: AlphaConvention::Linear, ..testing::display(9, 4, 3) };
        let DisplayPixels::Eight(codes) = &eight.pixels else { unreachable!() };
        let wide = codes.iter().map(|pixel| pixel.map(|code| u16::from(code) * 251 + 3)).collect();
        let sixteen = DisplayImage { pixels: DisplayPixels::Sixteen(wide), ..eight.clone() };
        for picture in [DisplayImage { opaque: false, ..eight }, DisplayImage { opaque: false, ..sixteen }] {
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
}
