//! PNG and JPEG plates.

use std::io::Cursor;

use ::png::{BitDepth, ColorType, Decoder, Limits, Transformations};
use bansho_base::{
    host::assets::{AssetProblem, Encoding, Picture},
    image::Image,
};

use super::{
    exif::exif_ev100,
    limits::{self, MemoryLimit},
};

use zune_jpeg::{
    JpegDecoder,
    zune_core::{bytestream::ZCursor, colorspace::ColorSpace, options::DecoderOptions},
};

/// Memory of a decoded pixel, bytes.
const PIXEL_BYTES: u64 = size_of::<[f32; 4]>() as u64;

fn damaged(reason: impl ToString) -> AssetProblem {
    AssetProblem::Damaged(reason.to_string())
}

/// Decodes a PNG of any color type and bit depth. Its values are sRGB, or linear if it has a gAMA of 1 and no sRGB chunk; color profiles
/// are ignored.
pub(crate) fn png(file: &[u8], limit: MemoryLimit) -> Result<Picture, AssetProblem> {
    // The limit for text and profiles.
    let metadata = Limits { bytes: 64 << 20 };
    let mut decoder = Decoder::new_with_limits(Cursor::new(file), metadata);
    decoder.set_transformations(Transformations::EXPAND);
    let mut reader = decoder.read_info().map_err(damaged)?;
    let info = reader.info();
    let [width, height] = limits::check_size([info.width.into(), info.height.into()])?;
    let claimed_bytes = width * height * info.bits_per_pixel() as u64 / 8;
    limits::check_expansion([width, height], claimed_bytes, file, limits::DEFLATE_RATIO)?;
    let is_linear = info.srgb.is_none() && info.gamma().is_some_and(|gamma| gamma.into_scaled() == 100_000);
    let encoding = if is_linear { Encoding::LinearSrgb } else { Encoding::DisplaySrgb };
    let exposure_ev100 = info.exif_metadata.as_deref().and_then(exif_ev100);
    let (color_type, bit_depth) = reader.output_color_type();
    let row_bytes = reader.output_line_size(width as u32).ok_or_else(|| damaged("its rows do not fit in memory"))?;
    let is_interlaced = reader.info().interlaced;
    // An interlaced PNG has seven passes, so all rows are kept until the last.
    let kept_rows = if is_interlaced { height } else { 1 };
    limit.check(file.len() as u64 + width * height * PIXEL_BYTES + kept_rows * row_bytes as u64)?;
    let mut pixels = Vec::with_capacity((width * height) as usize);
    let decode = |row: &[u8], pixels: &mut Vec<[f32; 4]>| append_rows(pixels, row, color_type, bit_depth);
    if is_interlaced {
        let mut bytes = vec![0; height as usize * row_bytes];
        reader.next_frame(&mut bytes).map_err(damaged)?;
        decode(&bytes, &mut pixels);
    } else {
        while let Some(row) = reader.next_row().map_err(damaged)? {
            decode(row.data(), &mut pixels);
        }
    }
    Ok(Picture { exposure_ev100, ..picture(width, height, pixels, encoding)? })
}

/// Appends the pixels of whole rows.
fn append_rows(pixels: &mut Vec<[f32; 4]>, bytes: &[u8], color_type: ColorType, bit_depth: BitDepth) {
    match bit_depth {
        BitDepth::Sixteen => {
            let value = |pair: &[u8; 2]| f32::from(u16::from_be_bytes(*pair)) / 65535.0;
            append_values(pixels, bytes.as_chunks().0.iter().map(value), color_type);
        }
        _ => append_values(pixels, bytes.iter().map(|code| f32::from(*code) / 255.0), color_type),
    }
}

fn append_values(pixels: &mut Vec<[f32; 4]>, mut values: impl Iterator<Item = f32>, color_type: ColorType) {
    let mut next = || values.next();
    match color_type {
        ColorType::Grayscale => pixels.extend(std::iter::from_fn(|| next().map(|y| [y, y, y, 1.0]))),
        ColorType::GrayscaleAlpha => {
            pixels.extend(std::iter::from_fn(|| next().zip(next()).map(|(y, a)| [y, y, y, a])));
        }
        ColorType::Rgba => pixels.extend(std::iter::from_fn(|| Some([next()?, next()?, next()?, next()?]))),
        // Palettes have been expanded.
        ColorType::Rgb | ColorType::Indexed => {
            pixels.extend(std::iter::from_fn(|| Some([next()?, next()?, next()?, 1.0])));
        }
    }
}

/// Decodes a JPEG, gray or colored. Its values are sRGB.
pub(crate) fn jpeg(file: &[u8], limit: MemoryLimit) -> Result<Picture, AssetProblem> {
    let options = DecoderOptions::default()
        .set_max_width(usize::from(u16::MAX))
        .set_max_height(usize::from(u16::MAX))
        .set_strict_mode(true)
        .jpeg_set_out_colorspace(ColorSpace::RGB);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(file), options);
    decoder.decode_headers().map_err(damaged)?;
    let (width, height) = decoder.dimensions().ok_or_else(|| damaged("it has no size"))?;
    let [width, height] = limits::check_size([width as u64, height as u64])?;
    // A block of 8 x 8 pixels takes at least 2 bits, but in a progressive file one code may represent 2^15 empty blocks.
    limits::check_expansion([width, height], width * height, file, 1 << 20)?;
    // Three bytes of color, and in a progressive file two bytes for each coefficient, including those beyond the edge of the picture.
    let decoding_bytes = (width + 64) * (height + 64) * (3 + 3 * 2);
    limit.check(file.len() as u64 + decoding_bytes + width * height * PIXEL_BYTES)?;
    let exposure_ev100 = decoder.exif().and_then(|block| exif_ev100(block));
    let bytes = decoder.decode().map_err(damaged)?;
    let pixels = match decoder.output_colorspace() {
        Some(ColorSpace::Luma) => bytes.iter().map(|&code| gray(code)).collect(),
        _ => bytes.as_chunks::<3>().0.iter().map(|&codes| rgb(codes)).collect(),
    };
    Ok(Picture { exposure_ev100, ..picture(width, height, pixels, Encoding::DisplaySrgb)? })
}

fn gray(code: u8) -> [f32; 4] {
    rgb([code; 3])
}

fn rgb(codes: [u8; 3]) -> [f32; 4] {
    let [r, g, b] = codes.map(|code| f32::from(code) / 255.0);
    [r, g, b, 1.0]
}

fn picture(width: u64, height: u64, pixels: Vec<[f32; 4]>, encoding: Encoding) -> Result<Picture, AssetProblem> {
    let color = Image::from_pixels(width as usize, height as usize, pixels);
    let color = color.ok_or_else(|| damaged("its pixels do not fill it"))?;
    Ok(Picture { color, depth: None, encoding, exposure_ev100: None })
}
