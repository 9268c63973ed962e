//! TIFF plates, and depth in gray TIFFs.

use std::io::Cursor;

use ::tiff::{
    ColorType,
    decoder::{Decoder, DecodingResult, Limits},
    tags::Tag,
};
use bansho_base::{
    host::assets::{AssetProblem, DepthMap, Encoding, Picture, PictureAlpha, PictureRemark},
    image::Image,
};

use crate::{
    decode::{
        DecodedPicture, PIXEL_BYTES,
        color::{self, SourceColor},
        damaged,
        exif::ExifData,
    },
    limits::{self, MemoryLimit},
};

/// Largest value of a tag, bytes: a profile.
const TAG_BYTES: usize = 16 << 20;
/// Largest compression ratio: DEFLATE and LZW; a JPEG in it is limited by its own markers.
const COMPRESSION_RATIO: u64 = 1 << 13;
/// Value of `ExtraSamples` for alpha that colors are multiplied by.
const ASSOCIATED_ALPHA: u16 = 1;

/// The samples of a file, in single precision; integers are codes.
struct TiffSamples {
    size: [u64; 2],
    /// Values of a pixel.
    channels: usize,
    color_type: ColorType,
    values: Vec<f32>,
    /// The largest code; `None` for floats, which are light.
    max_code: Option<u32>,
    exif: ExifData,
    profile: Option<Vec<u8>>,
    has_associated_alpha: bool,
    has_more: bool,
}

type FileDecoder<'a> = Decoder<Cursor<&'a [u8]>>;

fn channels(color_type: ColorType) -> Result<usize, AssetProblem> {
    Ok(match color_type {
        ColorType::Gray(_) => 1,
        ColorType::GrayA(_) => 2,
        ColorType::RGB(_) => 3,
        ColorType::RGBA(_) | ColorType::CMYK(_) => 4,
        other => {
            let reason = format!("it has {other:?} values; allowed: gray, RGB or CMYK, with or without alpha");
            return Err(damaged(reason));
        }
    })
}

fn open(file: &[u8]) -> Result<FileDecoder<'_>, AssetProblem> {
    let mut limits = Limits::default();
    limits.ifd_value_size = TAG_BYTES;
    // Further limits once the size is known and checked.
    Ok(Decoder::new(Cursor::new(file)).map_err(damaged)?.with_limits(limits))
}

fn read(file: &[u8], limit: MemoryLimit, pixel_bytes: u64) -> Result<TiffSamples, AssetProblem> {
    let mut decoder = open(file)?;
    let (width, height) = decoder.dimensions().map_err(damaged)?;
    let [width, height] = limits::check_size([width.into(), height.into()])?;
    let color_type = decoder.colortype().map_err(damaged)?;
    let (channels, bits) = (channels(color_type)?, u64::from(color_type.bit_depth()));
    if bits < 8 {
        return Err(damaged(format!("it has {bits} bits; allowed: 8, 16, 32 or 64")));
    }
    // At least eight bits, so that no byte has several samples.
    let bytes = width * height * channels as u64 * bits / 8;
    limits::check_expansion([width, height], bytes, file, COMPRESSION_RATIO)?;
    // The bytes, the same values in single precision, and the pixels.
    limit.check(file.len() as u64 + 2 * bytes + width * height * (4 * channels as u64 + pixel_bytes))?;
    let mut exif = ExifData::default();
    exif.set_orientation(decoder.find_tag_unsigned(Tag::Orientation).map_err(damaged)?);
    let profile = decoder.get_tag_u8_vec(Tag::IccProfile).ok();
    let extra: Option<Vec<u16>> = decoder.find_tag_unsigned_vec(Tag::ExtraSamples).map_err(damaged)?;
    let planar: Option<u16> = decoder.find_tag_unsigned(Tag::PlanarConfiguration).map_err(damaged)?;
    let has_more = decoder.more_images();
    let mut limits = Limits::default();
    (limits.ifd_value_size, limits.decoding_buffer_size) = (TAG_BYTES, bytes as usize + 64);
    limits.intermediate_buffer_size = bytes as usize + (1 << 20);
    let mut decoder = decoder.with_limits(limits);
    let mut result = DecodingResult::U8(Vec::new());
    decoder.read_image_to_buffer(&mut result).map_err(damaged)?;
    let (values, max_code) = to_single(result)?;
    if values.len() < (width * height) as usize * channels {
        return Err(damaged("its samples do not fill it"));
    }
    // 2 means planes of single channels, one after another.
    let values = if planar == Some(2) { interleaved(&values, channels) } else { values };
    Ok(TiffSamples {
        size: [width, height],
        channels,
        color_type,
        values,
        max_code,
        exif,
        profile,
        has_associated_alpha: extra.is_some_and(|extra| extra.first() == Some(&ASSOCIATED_ALPHA)),
        has_more,
    })
}

/// Values in single precision, and the largest code of integers.
fn to_single(result: DecodingResult) -> Result<(Vec<f32>, Option<u32>), AssetProblem> {
    Ok(match result {
        DecodingResult::U8(codes) => (codes.into_iter().map(f32::from).collect(), Some(255)),
        DecodingResult::U16(codes) => (codes.into_iter().map(f32::from).collect(), Some(65535)),
        DecodingResult::U32(codes) => (codes.into_iter().map(|code| code as f32).collect(), Some(u32::MAX)),
        DecodingResult::F16(values) => (values.into_iter().map(|value| value.to_f32()).collect(), None),
        DecodingResult::F32(values) => (values, None),
        DecodingResult::F64(values) => (values.into_iter().map(|value| value as f32).collect(), None),
        _ => {
            return Err(damaged(
                "it has signed values or such of 64 bits; allowed: unsigned ones of 8, 16 or 32 bits, and floats",
            ));
        }
    })
}

/// Planes of single channels, pixel by pixel.
fn interleaved(planes: &[f32], channels: usize) -> Vec<f32> {
    let pixels = planes.len() / channels;
    (0..planes.len()).map(|index| planes[index % channels * pixels + index / channels]).collect()
}

/// Decodes the first picture of a TIFF. Integers are sRGB or as its profile says, floats are linear light.
pub(crate) fn decode(file: &[u8], limit: MemoryLimit) -> Result<Picture, AssetProblem> {
    let samples = read(file, limit, 2 * PIXEL_BYTES)?;
    let mut remarks: Vec<PictureRemark> =
        samples.has_more.then_some(PictureRemark::SeveralPictures).into_iter().collect();
    let mut pixels = pixels(&samples);
    if samples.has_associated_alpha {
        pixels.iter_mut().for_each(|pixel| *pixel = straight(*pixel));
    }
    let [width, height] = samples.size.map(|side| side as usize);
    let mut color = samples.profile.map_or(SourceColor::Srgb, SourceColor::Profile);
    if matches!(samples.color_type, ColorType::CMYK(_)) {
        convert_cmyk(&mut pixels, &color, &mut remarks);
        color = SourceColor::Srgb;
    }
    let (exif, max_code) = (samples.exif, samples.max_code);
    let is_light = max_code.is_none();
    if is_light && color != SourceColor::Srgb {
        remarks.push(PictureRemark::Profile("its values are floats, which count as linear light".to_owned()));
        color = SourceColor::Srgb;
    }
    let max_code = max_code.unwrap_or(1).min(65535);
    let picture = DecodedPicture { width, height, pixels, max_code, color, exif, alpha: None, remarks }.finish()?;
    Ok(if is_light { light(picture) } else { picture })
}

/// A picture whose values are light.
fn light(picture: Picture) -> Picture {
    let alpha = match picture.alpha {
        PictureAlpha::Straight(_) => PictureAlpha::Straight(bansho_base::color::AlphaConvention::Linear),
        other => other,
    };
    Picture { encoding: Encoding::LinearSrgb, alpha, ..picture }
}

/// Red, green, blue and alpha (or four inks); codes divided by the largest.
fn pixels(samples: &TiffSamples) -> Vec<[f32; 4]> {
    let scale = samples.max_code.map_or(1.0, |max_code| max_code as f32);
    let count = (samples.size[0] * samples.size[1]) as usize;
    let mut pixels = Vec::with_capacity(count);
    for values in samples.values.chunks_exact(samples.channels).take(count) {
        // Without alpha, the largest code.
        let pixel = match *values {
            [gray] => [gray, gray, gray, scale],
            [gray, alpha] => [gray, gray, gray, alpha],
            [r, g, b] => [r, g, b, scale],
            [r, g, b, alpha] => [r, g, b, alpha],
            _ => [0.0; 4],
        };
        pixels.push(pixel.map(|value| if value.is_finite() { value / scale } else { 0.0 }));
    }
    pixels
}

/// A pixel whose colors were multiplied by alpha, without that; as codes, at most 1.
fn straight([r, g, b, alpha]: [f32; 4]) -> [f32; 4] {
    let scale = if alpha > 0.0 { 1.0 / alpha } else { 0.0 };
    [(r * scale).min(1.0), (g * scale).min(1.0), (b * scale).min(1.0), alpha]
}

/// Four inks to RGB, by the profile if it can be used.
fn convert_cmyk(pixels: &mut [[f32; 4]], color: &SourceColor, remarks: &mut Vec<PictureRemark>) {
    if let SourceColor::Profile(profile) = color {
        match color::convert_cmyk(pixels, profile) {
            Ok(()) => return,
            Err(reason) => remarks.push(PictureRemark::Profile(reason.to_string())),
        }
    }
    for pixel in pixels {
        let [c, m, y, k] = *pixel;
        let [r, g, b] = [c, m, y].map(|ink| (1.0 - ink) * (1.0 - k));
        *pixel = [r, g, b, 1.0];
    }
}

/// Decodes the first channel of a TIFF as depth; integers are codes.
pub(crate) fn depth(file: &[u8], limit: MemoryLimit) -> Result<DepthMap, AssetProblem> {
    let samples = read(file, limit, size_of::<f32>() as u64)?;
    if samples.channels != 1 {
        let reason = format!("it has {} channels; allowed for depth: a single one", samples.channels);
        return Err(damaged(reason));
    }
    let [width, height] = samples.size.map(|side| side as usize);
    let values = samples.values.iter().take(width * height).map(|value| [*value]).collect();
    let values = Image::from_pixels(width, height, values).ok_or_else(|| damaged("its samples do not fill it"))?;
    Ok(DepthMap { values: samples.exif.orientation.apply(values), remarks: samples.exif.remarks })
}

#[cfg(test)]
mod tests {
    use ::tiff::encoder::{TiffEncoder, colortype};

    use super::*;

    fn encoded<C: colortype::ColorType>(width: u32, height: u32, values: &[C::Inner], tags: &[(Tag, u16)]) -> Vec<u8>
    where
        [C::Inner]: ::tiff::encoder::TiffValue,
    {
        let mut file = Cursor::new(Vec::new());
        let mut encoder = TiffEncoder::new(&mut file).unwrap();
        let mut image = encoder.new_image::<C>(width, height).unwrap();
        for (tag, value) in tags {
            image.encoder().write_tag(*tag, *value).unwrap();
        }
        image.write_data(values).unwrap();
        file.into_inner()
    }

    fn plate(file: &[u8]) -> Picture {
        decode(file, MemoryLimit::default()).unwrap()
    }

    #[test]
    fn integers_are_display_values_and_floats_are_light() {
        let eight = plate(&encoded::<colortype::RGB8>(2, 1, &[0, 51, 255, 255, 0, 102], &[(Tag::Orientation, 2)]));
        assert_eq!((eight.color.at(0, 0), eight.encoding), ([1.0, 0.0, 0.4, 1.0], Encoding::DisplaySrgb));
        let gray = plate(&encoded::<colortype::Gray16>(1, 2, &[65535, 13107], &[(Tag::Orientation, 6)]));
        assert_eq!((gray.color.width(), gray.color.at(0, 0)), (2, [0.2, 0.2, 0.2, 1.0]));
        let light = plate(&encoded::<colortype::RGB32Float>(1, 1, &[4.0, 0.5, -1.0], &[]));
        assert_eq!((light.color.at(0, 0), light.encoding), ([4.0, 0.5, -1.0, 1.0], Encoding::LinearSrgb));
        let cmyk = plate(&encoded::<colortype::CMYK8>(1, 1, &[255, 0, 0, 0], &[]));
        assert_eq!(cmyk.color.at(0, 0), [0.0, 1.0, 1.0, 1.0]);
        let rgba = encoded::<colortype::RGBA8>(1, 1, &[51, 0, 0, 51], &[]);
        assert_eq!(plate(&rgba).color.at(0, 0)[3], 0.2);
    }

    #[test]
    fn depth_keeps_its_codes_and_its_floats() {
        let codes = encoded::<colortype::Gray16>(2, 1, &[300, 65535], &[]);
        let read = |file: &[u8]| depth(file, MemoryLimit::default()).map(|map| map.values.pixels().to_vec());
        assert_eq!(read(&codes).unwrap(), [[300.0], [65535.0]]);
        let floats = encoded::<colortype::Gray32Float>(2, 1, &[0.125, f32::INFINITY], &[]);
        assert_eq!(read(&floats).unwrap(), [[0.125], [f32::INFINITY]]);
        assert!(
            read(&encoded::<colortype::RGB8>(1, 1, &[1, 2, 3], &[])).unwrap_err().to_string().contains("3 channels")
        );
        for end in 0..codes.len() {
            // Any result will do, as long as it returns.
            let _ = read(&codes[..end]);
            let mut bad = codes.clone();
            bad[end] ^= 0xff;
            let _ = read(&bad);
        }
    }
}
