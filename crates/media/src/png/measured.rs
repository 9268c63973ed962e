//! Encoding of measured quantities as PNG: linear, without a view transform, with their scale.

use std::path::Path;

use ::png::{BitDepth, ColorType, Encoder, EncodingError, ScaledFloat};

use super::{KEY_FINGERPRINT, KEY_SCALE, KEY_VERSION, PngEffort, encode::set_effort};
use crate::{
    error::{MediaError, SizeRule},
    fingerprint,
};

/// Samples of a measured image: rows from the top, channels interleaved.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Samples {
    /// 8 bits per channel.
    Eight(Vec<u8>),
    /// 16 bits per channel.
    Sixteen(Vec<u16>),
}

/// An image of measured quantities: value = code / largest code * scale.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasuredImage {
    /// Width and height, pixels.
    pub size: [usize; 2],
    /// Channels per pixel: 1 (gray) or 3 (red, green, blue).
    pub channels: usize,
    /// The codes.
    pub samples: Samples,
    /// The value of the largest code.
    pub scale: f32,
}

impl MeasuredImage {
    /// Codes of `values`, which must not be negative, scaled so that the largest gets the largest code: 255, or 65535 with `sixteen_bits`.
    pub fn from_values(size: [usize; 2], channels: usize, values: &[f32], sixteen_bits: bool) -> Self {
        let scale = values.iter().fold(0.0_f32, |largest, &value| largest.max(value));
        let largest_code = if sixteen_bits { u16::MAX } else { u8::MAX.into() };
        let codes_per_unit = if scale > 0.0 { f32::from(largest_code) / scale } else { 0.0 };
        let samples = if sixteen_bits {
            Samples::Sixteen(values.iter().map(|value| (value * codes_per_unit + 0.5) as u16).collect())
        } else {
            Samples::Eight(values.iter().map(|value| (value * codes_per_unit + 0.5) as u8).collect())
        };
        Self { size, channels, samples, scale }
    }
}

/// The bytes of a PNG of measured quantities: marked as linear (gAMA 1), with the scale and a fingerprint as text. The same values give the
/// same bytes.
///
/// # Errors
/// A side of 0 or above the limit of PNG files, or a number of samples other than pixels times channels. `path` is only used in errors.
pub fn encode_measured(
    picture: &MeasuredImage,
    fingerprint: &[u8; 32],
    effort: PngEffort,
    path: &Path,
) -> Result<Vec<u8>, MediaError> {
    let [width, height] = picture.size;
    if picture.size.iter().any(|side| !(1..=super::SIDE_LIMIT).contains(side)) {
        let allowed = SizeRule::UpTo(super::SIDE_LIMIT);
        return Err(MediaError::Size { path: path.to_path_buf(), width, height, allowed });
    }
    let got = match &picture.samples {
        Samples::Eight(samples) => samples.len(),
        Samples::Sixteen(samples) => samples.len(),
    };
    let expected = width * height * picture.channels;
    if got != expected {
        return Err(MediaError::PlaneLength { path: path.to_path_buf(), plane: "samples".to_owned(), got, expected });
    }
    compress(picture, fingerprint, effort)
        .map_err(|error| MediaError::Encode { path: path.to_path_buf(), reason: error.to_string() })
}

fn compress(picture: &MeasuredImage, fingerprint: &[u8; 32], effort: PngEffort) -> Result<Vec<u8>, EncodingError> {
    let [width, height] = picture.size;
    let mut file = Vec::new();
    let mut encoder = Encoder::new(&mut file, width as u32, height as u32);
    encoder.set_color(if picture.channels == 1 { ColorType::Grayscale } else { ColorType::Rgb });
    encoder.set_source_gamma(ScaledFloat::from_scaled(100_000));
    let bytes = match &picture.samples {
        Samples::Eight(samples) => samples.clone(),
        Samples::Sixteen(samples) => samples.iter().flat_map(|sample| sample.to_be_bytes()).collect(),
    };
    encoder.set_depth(match picture.samples {
        Samples::Eight(_) => BitDepth::Eight,
        Samples::Sixteen(_) => BitDepth::Sixteen,
    });
    encoder.add_text_chunk("Software".to_owned(), format!("Bansho {}", fingerprint::VERSION))?;
    encoder.add_text_chunk(KEY_VERSION.to_owned(), fingerprint::VERSION.to_owned())?;
    encoder.add_text_chunk(KEY_FINGERPRINT.to_owned(), fingerprint::to_hex(fingerprint))?;
    encoder.add_text_chunk(KEY_SCALE.to_owned(), picture.scale.to_string())?;
    set_effort(&mut encoder, effort);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&bytes)?;
    writer.finish()?;
    Ok(file)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn encoded(picture: &MeasuredImage) -> Result<Vec<u8>, MediaError> {
        encode_measured(picture, &[3; 32], PngEffort::Fast, Path::new("a.png"))
    }

    #[test]
    fn numbers_come_back_by_their_scale_within_half_a_code() {
        let values: Vec<f32> = (0..24).map(|i| i as f32 * 3.1e-4).collect();
        for (sixteen_bits, largest, channels) in [(false, 255.0, 1), (true, 65_535.0, 3)] {
            let picture = MeasuredImage::from_values([24 / channels / 2, 2], channels, &values, sixteen_bits);
            assert_eq!(picture.scale, 23.0 * 3.1e-4);
            let file = encoded(&picture).unwrap();
            let mut reader = ::png::Decoder::new(std::io::Cursor::new(&file)).read_info().unwrap();
            assert_eq!(reader.info().gamma().map(ScaledFloat::into_scaled), Some(100_000));
            let text = |key| reader.info().uncompressed_latin1_text.iter().find(|chunk| chunk.keyword == key).unwrap();
            let scale: f32 = text(KEY_SCALE).text.parse().unwrap();
            let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
            reader.next_frame(&mut bytes).unwrap();
            let codes: Vec<f32> = if sixteen_bits {
                bytes.chunks_exact(2).map(|pair| f32::from(u16::from_be_bytes([pair[0], pair[1]]))).collect()
            } else {
                bytes.iter().map(|&byte| f32::from(byte)).collect()
            };
            for (code, value) in codes.iter().zip(&values) {
                assert!((code / largest * scale - value).abs() <= 0.501 / largest * scale);
            }
        }
    }

    #[test]
    fn nothing_but_zeros_is_a_picture_too() {
        let picture = MeasuredImage::from_values([3, 1], 1, &[0.0; 3], true);
        assert_eq!((picture.scale, &picture.samples), (0.0, &Samples::Sixteen(vec![0; 3])));
        assert!(encoded(&picture).is_ok());
    }

    #[test]
    fn sizes_that_do_not_fit_are_refused() {
        let picture = MeasuredImage::from_values([3, 2], 1, &[0.0; 3], false);
        assert!(matches!(encoded(&picture), Err(MediaError::PlaneLength { got: 3, expected: 6, .. })));
        let picture = MeasuredImage::from_values([0, 2], 1, &[], false);
        assert!(matches!(encoded(&picture), Err(MediaError::Size { .. })));
    }
}
