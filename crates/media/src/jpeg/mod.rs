//! JPEG plates: decoded by `zune-jpeg`. It decodes some corrupt files without an error; [`scans`] finds what is wrong in them.

mod huffman;
mod scans;

use bansho_base::host::assets::{AssetProblem, Picture, PictureRemark};
use zune_jpeg::{
    JpegDecoder,
    zune_core::{bytestream::ZCursor, colorspace::ColorSpace, options::DecoderOptions},
};

use crate::{
    decode::{
        DecodedPicture, PIXEL_BYTES,
        color::{self, SourceColor},
        damaged, exif,
    },
    limits::{self, MemoryLimit},
};

type FileDecoder<'a> = JpegDecoder<ZCursor<&'a [u8]>>;

/// Opens a file; `strict` refuses what libjpeg reads with a warning.
fn open(file: &[u8], strict: bool) -> Result<FileDecoder<'_>, AssetProblem> {
    let options = DecoderOptions::default()
        .set_max_width(usize::from(u16::MAX))
        .set_max_height(usize::from(u16::MAX))
        .set_strict_mode(strict)
        .jpeg_set_out_colorspace(ColorSpace::RGB);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(file), options);
    decoder.decode_headers().map_err(damaged)?;
    Ok(decoder)
}

/// Decodes a JPEG, gray, colored or of cyan, magenta, yellow and black. It is read as tolerantly as libjpeg reads it; a remark tells what is corrupt.
pub(crate) fn decode(file: &[u8], limit: MemoryLimit) -> Result<Picture, AssetProblem> {
    match decode_once(file, true, limit) {
        Err(AssetProblem::Damaged(reason)) => {
            let mut picture = decode_once(file, false, limit).map_err(|_| AssetProblem::Damaged(reason.clone()))?;
            // Bytes between segments, which cameras and mail programs leave, change nothing.
            if !reason.contains("Extra bytes between headers") {
                picture.remarks.push(PictureRemark::Corrupt(reason));
            }
            Ok(picture)
        }
        result => result,
    }
}

fn decode_once(file: &[u8], strict: bool, limit: MemoryLimit) -> Result<Picture, AssetProblem> {
    let mut decoder = open(file, strict)?;
    let (width, height) = decoder.dimensions().ok_or_else(|| damaged("it has no size"))?;
    let [width, height] = limits::check_size([width as u64, height as u64])?;
    // A block of 8 x 8 pixels takes at least 2 bits, but in a progressive file one code may represent 2^15 empty blocks.
    limits::check_expansion([width, height], width * height, file, 1 << 20)?;
    let exif = decoder.exif().map(|block| exif::read(block)).unwrap_or_default();
    // Four bytes of color, and in a progressive file two bytes for each coefficient, including those beyond the edge of the picture.
    let decoding_bytes = (width + 64) * (height + 64) * (3 + 3 * 2);
    let turning_bytes = DecodedPicture::turning_bytes(&exif, width * height);
    limit.check(file.len() as u64 + decoding_bytes.max(turning_bytes) + width * height * PIXEL_BYTES)?;
    let mut remarks = Vec::new();
    let profile = decoder.icc_profile();
    if profile.is_none() && has_profile(file) {
        remarks.push(PictureRemark::Profile("its segments are incomplete".to_owned()));
    }
    let (pixels, color) = decode_pixels(file, strict, &mut decoder, profile, &mut remarks)?;
    // What the decoder refuses in strict mode is told by its own words.
    if let Some(fault) = strict.then(|| scans::fault(file)).flatten() {
        remarks.push(PictureRemark::Corrupt(fault.to_string()));
    }
    let [width, height] = [width as usize, height as usize];
    DecodedPicture { width, height, pixels, max_code: 255, color, exif, alpha: None, remarks }.finish()
}

/// Whether there is a segment of an ICC profile.
fn has_profile(file: &[u8]) -> bool {
    const NAME: &[u8] = b"ICC_PROFILE\0";
    // Within the first megabyte, which holds what precedes the pixels.
    file[..file.len().min(1 << 20)].windows(NAME.len()).any(|window| window == NAME)
}

/// The pixels, and the colors that they are in.
fn decode_pixels(
    file: &[u8],
    strict: bool,
    decoder: &mut FileDecoder<'_>,
    profile: Option<Vec<u8>>,
    remarks: &mut Vec<PictureRemark>,
) -> Result<(Vec<[f32; 4]>, SourceColor), AssetProblem> {
    let is_cmyk = decoder.input_colorspace() == Some(ColorSpace::CMYK);
    if let (true, Some(profile)) = (is_cmyk, &profile) {
        match decode_cmyk(file, strict, profile)? {
            Ok(pixels) => return Ok((pixels, SourceColor::Srgb)),
            Err(remark) => remarks.push(remark),
        }
    }
    let bytes = decoder.decode().map_err(damaged)?;
    let pixels = match decoder.output_colorspace() {
        Some(ColorSpace::Luma) => bytes.iter().map(|&code| rgb([code; 3])).collect(),
        _ => bytes.as_chunks::<3>().0.iter().map(|&codes| rgb(codes)).collect(),
    };
    let color = profile.filter(|_| !is_cmyk).map_or(SourceColor::Srgb, SourceColor::Profile);
    Ok((pixels, color))
}

/// The pixels of a CMYK file by its profile; the remark if the profile cannot be used.
fn decode_cmyk(
    file: &[u8],
    strict: bool,
    profile: &[u8],
) -> Result<Result<Vec<[f32; 4]>, PictureRemark>, AssetProblem> {
    let mut decoder = open(file, strict)?;
    decoder.set_options(decoder.options().jpeg_set_out_colorspace(ColorSpace::CMYK));
    let bytes = decoder.decode().map_err(damaged)?;
    // Adobe's programs store the amount of light instead of ink, which their marker says.
    let is_inverted = file.windows(5).take(1 << 16).any(|window| window == b"Adobe");
    let mut pixels = Vec::with_capacity(bytes.len() / 4);
    for codes in bytes.as_chunks::<4>().0 {
        pixels.push(codes.map(|code| f32::from(if is_inverted { 255 - code } else { code }) / 255.0));
    }
    Ok(match color::convert_cmyk(&mut pixels, profile) {
        Ok(()) => Ok(pixels),
        Err(reason) => Err(PictureRemark::Profile(reason.to_string())),
    })
}

fn rgb(codes: [u8; 3]) -> [f32; 4] {
    let [r, g, b] = codes.map(|code| f32::from(code) / 255.0);
    [r, g, b, 1.0]
}
