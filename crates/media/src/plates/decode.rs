//! PNG and JPEG plates.

use std::io::Cursor;

use ::png::{BitDepth, ColorType, Decoder, Limits, Transformations};
use bansho_base::{
    assets::{AssetProblem, Encoding, Picture},
    image::Image,
};
use zune_jpeg::{
    JpegDecoder,
    zune_core::{bytestream::ZCursor, colorspace::ColorSpace, options::DecoderOptions},
};

use super::{exposure::exif_ev100, limits};

fn damaged(reason: impl ToString) -> AssetProblem {
    AssetProblem::Damaged(reason.to_string())
}

/// Reads a PNG of any kind: 1 to 16 bits, grey, palette, with alpha or without. Taken as sRGB, unless it says that its
/// values are linear (a gAMA of 1 and no sRGB chunk); colour profiles are not looked at.
pub(crate) fn png(file: &[u8]) -> Result<Picture, AssetProblem> {
    // For everything but pixels: text and profiles.
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
    let length = reader.output_buffer_size().ok_or_else(|| damaged("its pixels do not fit in memory"))?;
    let mut bytes = vec![0; length];
    let output = reader.next_frame(&mut bytes).map_err(damaged)?;
    let pixels = match output.bit_depth {
        BitDepth::Sixteen => {
            let values = bytes.as_chunks().0.iter().map(|pair| f32::from(u16::from_be_bytes(*pair)) / 65535.0);
            to_rgba(values.collect(), output.color_type)
        }
        _ => to_rgba(bytes.iter().map(|code| f32::from(*code) / 255.0).collect(), output.color_type),
    };
    Ok(Picture { exposure_ev100, ..picture(width, height, pixels, encoding)? })
}

fn to_rgba(values: Vec<f32>, kind: ColorType) -> Vec<[f32; 4]> {
    match kind {
        ColorType::Grayscale => values.iter().map(|&y| [y, y, y, 1.0]).collect(),
        ColorType::GrayscaleAlpha => values.as_chunks().0.iter().map(|&[y, a]| [y, y, y, a]).collect(),
        ColorType::Rgba => values.as_chunks().0.to_vec(),
        // Palettes have been expanded.
        ColorType::Rgb | ColorType::Indexed => values.as_chunks().0.iter().map(|&[r, g, b]| [r, g, b, 1.0]).collect(),
    }
}

/// Reads a JPEG, grey or coloured, taken as sRGB.
pub(crate) fn jpeg(file: &[u8]) -> Result<Picture, AssetProblem> {
    let options = DecoderOptions::default()
        .set_max_width(usize::from(u16::MAX))
        .set_max_height(usize::from(u16::MAX))
        .set_strict_mode(true)
        .jpeg_set_out_colorspace(ColorSpace::RGB);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(file), options);
    decoder.decode_headers().map_err(damaged)?;
    let (width, height) = decoder.dimensions().ok_or_else(|| damaged("it has no size"))?;
    let [width, height] = limits::check_size([width as u64, height as u64])?;
    // A block of 8 x 8 pixels takes at least 2 bits, but in a progressive file one code may stand for 2^15 empty ones.
    limits::check_expansion([width, height], width * height, file, 1 << 20)?;
    let exposure_ev100 = decoder.exif().and_then(|block| exif_ev100(block));
    let bytes = decoder.decode().map_err(damaged)?;
    let pixels = match decoder.output_colorspace() {
        Some(ColorSpace::Luma) => bytes.iter().map(|&code| grey(code)).collect(),
        _ => bytes.as_chunks::<3>().0.iter().map(|&rgb| coloured(rgb)).collect(),
    };
    Ok(Picture { exposure_ev100, ..picture(width, height, pixels, Encoding::DisplaySrgb)? })
}

fn grey(code: u8) -> [f32; 4] {
    coloured([code; 3])
}

fn coloured(codes: [u8; 3]) -> [f32; 4] {
    let [r, g, b] = codes.map(|code| f32::from(code) / 255.0);
    [r, g, b, 1.0]
}

fn picture(width: u64, height: u64, pixels: Vec<[f32; 4]>, encoding: Encoding) -> Result<Picture, AssetProblem> {
    let colour = Image::from_pixels(width as usize, height as usize, pixels);
    let colour = colour.ok_or_else(|| damaged("its pixels do not fill it"))?;
    Ok(Picture { colour, depth: None, encoding, exposure_ev100: None })
}
