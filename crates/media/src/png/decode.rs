//! PNG plates, and depth in gray PNGs.

use std::io::Cursor;

use ::png::{BitDepth, ColorType, Decoder, Info, Limits, Reader, Transformations};
use bansho_base::{
    color::AlphaConvention,
    host::assets::{AssetProblem, DepthMap, Picture, PictureRemark},
    image::Image,
};

use super::{KEY_ALPHA, chunk};
use crate::{
    decode::{
        DecodedPicture, PIXEL_BYTES,
        color::{SourceColor, primaries::REC709, transfer::Transfer},
        damaged,
        exif::{self, ExifData},
    },
    limits::{self, MemoryLimit},
};

/// Largest text or profile, bytes.
const METADATA_BYTES: usize = 64 << 20;

type FileReader<'a> = Reader<Cursor<&'a [u8]>>;

/// Opens a PNG and checks its size against `limit`, with `pixel_bytes` for each decoded pixel.
fn open(file: &[u8], limit: MemoryLimit, pixel_bytes: u64) -> Result<FileReader<'_>, AssetProblem> {
    let mut decoder = Decoder::new_with_limits(Cursor::new(file), Limits { bytes: METADATA_BYTES });
    decoder.set_transformations(Transformations::EXPAND);
    let reader = decoder.read_info().map_err(|error| match has_chunk(file, *b"cICP") {
        true => damaged(format!("{error}; perhaps its cICP states YCbCr, which a PNG cannot have (allowed: matrix 0)")),
        false => damaged(error),
    })?;
    let info = reader.info();
    let [width, height] = limits::check_size([info.width.into(), info.height.into()])?;
    let claimed_bytes = width * height * info.bits_per_pixel() as u64 / 8;
    limits::check_expansion([width, height], claimed_bytes, file, limits::DEFLATE_RATIO)?;
    let row_bytes = row_bytes(&reader)? as u64;
    // An interlaced PNG has seven passes, so all rows are kept until the last.
    let kept_rows = if reader.info().interlaced { height } else { 1 };
    limit.check(file.len() as u64 + width * height * pixel_bytes + kept_rows * row_bytes)?;
    Ok(reader)
}

fn row_bytes(reader: &FileReader) -> Result<usize, AssetProblem> {
    reader.output_line_size(reader.info().width).ok_or_else(|| damaged("its rows do not fit in memory"))
}

/// Reads the pixels, and gives `take` whole rows of their bytes.
fn read_rows(reader: &mut FileReader, mut take: impl FnMut(&[u8])) -> Result<(), AssetProblem> {
    if reader.info().interlaced {
        let mut bytes = vec![0; reader.info().height as usize * row_bytes(reader)?];
        reader.next_frame(&mut bytes).map_err(damaged)?;
        take(&bytes);
    } else {
        while let Some(row) = reader.next_row().map_err(damaged)? {
            take(row.data());
        }
    }
    Ok(())
}

/// Decodes a PNG of any color type and bit depth, with its colors, orientation and convention of alpha.
pub(crate) fn decode(file: &[u8], limit: MemoryLimit) -> Result<Picture, AssetProblem> {
    let mut reader = open(file, limit, PIXEL_BYTES)?;
    let (color_type, bit_depth) = reader.output_color_type();
    let [width, height] = [reader.info().width as usize, reader.info().height as usize];
    let mut pixels = Vec::with_capacity(width * height);
    read_rows(&mut reader, |bytes| append_rows(&mut pixels, bytes, color_type, bit_depth))?;
    let info = reader.info();
    let exif = info.exif_metadata.as_deref().map(exif::read).unwrap_or_default();
    // Checked again, since a picture that is to be turned is in memory twice.
    limit.check(file.len() as u64 + PIXEL_BYTES * pixels.len() as u64 + turning(&exif, &pixels))?;
    let animated = info.animation_control.is_some_and(|control| control.num_frames > 1);
    DecodedPicture {
        width,
        height,
        pixels,
        max_code: if bit_depth == BitDepth::Sixteen { 65535 } else { 255 },
        color: colors(info, file),
        exif,
        alpha: stated_alpha(info),
        remarks: animated.then_some(PictureRemark::SeveralPictures).into_iter().collect(),
    }
    .finish()
}

/// Memory for turning the picture, bytes.
fn turning(exif: &ExifData, pixels: &[[f32; 4]]) -> u64 {
    DecodedPicture::turning_bytes(exif, pixels.len() as u64)
}

/// The convention of alpha by Bansho's own mark.
fn stated_alpha(info: &Info) -> Option<AlphaConvention> {
    let mark = info.uncompressed_latin1_text.iter().find(|text| text.keyword == KEY_ALPHA)?;
    [AlphaConvention::Encoded, AlphaConvention::Linear].into_iter().find(|convention| convention.name() == mark.text)
}

/// Whether the file has a chunk of this kind before its pixels.
fn has_chunk(file: &[u8], kind: [u8; 4]) -> bool {
    let chunks = chunk::chunks(file).into_iter().flatten().map_while(Result::ok);
    chunks.take_while(|chunk| chunk.kind != *b"IDAT").any(|chunk| chunk.kind == kind)
}

/// The colors, in the order of the third edition of the standard (4.3): cICP, iCCP, sRGB, gAMA and cHRM. An unreadable chunk is reported, and the
/// next that the file has is not used: it would contradict the first.
fn colors(info: &Info, file: &[u8]) -> SourceColor {
    if let Some(points) = info.coding_independent_code_points {
        if points.matrix_coefficients != 0 || !points.is_video_full_range_image {
            return SourceColor::Unknown("its cICP states YCbCr or narrow-range values".to_owned());
        }
        return SourceColor::from_code_points(points.color_primaries, points.transfer_function);
    }
    if has_chunk(file, *b"cICP") {
        return SourceColor::Unknown("its cICP chunk is damaged".to_owned());
    }
    if let Some(profile) = &info.icc_profile {
        return SourceColor::Profile(profile.clone().into_owned());
    }
    if has_chunk(file, *b"iCCP") {
        return SourceColor::Unknown("its ICC profile cannot be unpacked".to_owned());
    }
    if info.srgb.is_some() { SourceColor::Srgb } else { gamma_and_chromaticities(info, file) }
}

/// gAMA of sRGB, which states no more than its approximate power.
const SRGB_GAMMA: u32 = 45_455;

/// The colors by gAMA and cHRM; sRGB for what they do not state.
fn gamma_and_chromaticities(info: &Info, file: &[u8]) -> SourceColor {
    let chromaticities = info.chrm_chunk.map_or(REC709, |chunk| {
        [chunk.red, chunk.green, chunk.blue, chunk.white].map(|(x, y)| [x.into_value(), y.into_value()])
    });
    let transfer = match info.gama_chunk.map(::png::ScaledFloat::into_scaled) {
        None if has_chunk(file, *b"gAMA") => return SourceColor::Unknown("its gAMA is damaged or 0".to_owned()),
        None => Transfer::Srgb,
        // Writers round 1 / 2.2 to 0.454, 0.4545 or 0.455.
        Some(gamma) if gamma.abs_diff(SRGB_GAMMA) <= 60 => Transfer::Srgb,
        Some(100_000) => Transfer::Linear,
        Some(gamma) => Transfer::Gamma(100_000.0 / f64::from(gamma)),
    };
    SourceColor::Described { chromaticities, transfer }
}

/// Appends the pixels of whole rows.
fn append_rows(pixels: &mut Vec<[f32; 4]>, bytes: &[u8], color_type: ColorType, bit_depth: BitDepth) {
    match bit_depth {
        BitDepth::Sixteen => {
            let codes = bytes.as_chunks().0.iter().map(|pair| u16::from_be_bytes(*pair));
            append_values(pixels, codes.map(|code| f32::from(code) / 65535.0), color_type);
        }
        _ => append_values(pixels, bytes.iter().map(|code| f32::from(*code) / 255.0), color_type),
    }
}

fn append_values(pixels: &mut Vec<[f32; 4]>, mut values: impl Iterator<Item = f32>, color_type: ColorType) {
    // Values beyond the last whole pixel are dropped.
    match color_type {
        ColorType::Grayscale => pixels.extend(values.map(|y| [y, y, y, 1.0])),
        ColorType::GrayscaleAlpha => {
            while let (Some(y), Some(a)) = (values.next(), values.next()) {
                pixels.push([y, y, y, a]);
            }
        }
        ColorType::Rgba => {
            while let (Some(r), Some(g), Some(b), Some(a)) =
                (values.next(), values.next(), values.next(), values.next())
            {
                pixels.push([r, g, b, a]);
            }
        }
        // Palettes have been expanded.
        ColorType::Rgb | ColorType::Indexed => {
            while let (Some(r), Some(g), Some(b)) = (values.next(), values.next(), values.next()) {
                pixels.push([r, g, b, 1.0]);
            }
        }
    }
}

/// Decodes the codes of a gray PNG as depth.
pub(crate) fn depth(file: &[u8], limit: MemoryLimit) -> Result<DepthMap, AssetProblem> {
    let mut reader = open(file, limit, size_of::<f32>() as u64)?;
    let (color_type, bit_depth) = reader.output_color_type();
    if color_type != ColorType::Grayscale {
        return Err(damaged("it has colors; allowed for depth: a gray PNG, of 16 bits where it can be"));
    }
    let [width, height] = [reader.info().width as usize, reader.info().height as usize];
    // Below 8 bits codes are expanded to 0 to 255.
    let levels = (1_u32 << (reader.info().bit_depth as u8).min(16)) - 1;
    let scale = if bit_depth == BitDepth::Sixteen { 1.0 } else { levels as f32 / 255.0 };
    let mut values = Vec::with_capacity(width * height);
    read_rows(&mut reader, |bytes| match bit_depth {
        BitDepth::Sixteen => {
            values.extend(bytes.as_chunks().0.iter().map(|pair| [f32::from(u16::from_be_bytes(*pair))]));
        }
        _ => values.extend(bytes.iter().map(|code| [f32::from(*code) * scale])),
    })?;
    let exif = reader.info().exif_metadata.as_deref().map(exif::read).unwrap_or_default();
    let values = Image::from_pixels(width, height, values).ok_or_else(|| damaged("its pixels do not fill it"))?;
    Ok(DepthMap { values: exif.orientation.apply(values), remarks: exif.remarks })
}

#[cfg(test)]
mod tests {
    use std::borrow::Cow;

    use super::*;

    /// A gray PNG of one pixel with these chunks, whose CRC is right.
    fn with_chunks(chunks: &[(&[u8; 4], Cow<'_, [u8]>)]) -> Vec<u8> {
        let mut plain = Vec::new();
        let mut encoder = ::png::Encoder::new(&mut plain, 1, 1);
        encoder.set_color(ColorType::Rgb);
        let mut writer = encoder.write_header().unwrap();
        writer.write_image_data(&[128, 128, 64]).unwrap();
        writer.finish().unwrap();
        let mut file = plain[..33].to_vec();
        for (kind, data) in chunks {
            file.extend((data.len() as u32).to_be_bytes());
            let body = [kind.as_slice(), data].concat();
            file.extend(&body);
            file.extend(crc32fast::hash(&body).to_be_bytes());
        }
        file.extend(&plain[33..]);
        file
    }

    fn gamma(value: u32) -> (&'static [u8; 4], Cow<'static, [u8]>) {
        (b"gAMA", Cow::Owned(value.to_be_bytes().to_vec()))
    }

    fn decoded(chunks: &[(&[u8; 4], Cow<'_, [u8]>)]) -> Picture {
        decode(&with_chunks(chunks), MemoryLimit::default()).unwrap()
    }

    fn codes(picture: &Picture) -> [i32; 3] {
        let [r, g, b, _] = picture.color.at(0, 0);
        [r, g, b].map(|value| (255.0 * value).round() as i32)
    }

    #[test]
    fn chunks_of_colors_take_precedence_in_the_order_of_the_third_edition() {
        let p3 = (b"cICP", Cow::Borrowed(&[12, 13, 0, 1][..]));
        let srgb = (b"sRGB", Cow::Borrowed(&[0][..]));
        let plain = [128, 128, 64];
        assert_eq!(codes(&decoded(&[])), plain);
        assert_eq!(codes(&decoded(std::slice::from_ref(&p3))), [128, 128, 53]);
        assert_eq!(codes(&decoded(&[p3, srgb.clone(), gamma(100_000)])), [128, 128, 53]);
        assert_eq!(codes(&decoded(&[srgb, gamma(55_556)])), plain);
        assert_eq!(codes(&decoded(&[gamma(45_455)])), plain);
        // 255 encode((code / 255)^1.8), by NumPy.
        assert_eq!(codes(&decoded(&[gamma(55_556)])), [146, 146, 81]);
        assert_eq!(decoded(&[gamma(100_000)]).encoding, bansho_base::host::assets::Encoding::LinearSrgb);
    }

    #[test]
    fn what_is_unknown_or_damaged_is_told_and_taken_as_srgb() {
        let chunk = |kind: &'static [u8; 4], data: &'static [u8]| (kind, Cow::Borrowed(data));
        for chunk in [
            chunk(b"cICP", &[1, 77, 0, 1]),
            chunk(b"cICP", &[9, 16, 0, 0]),
            chunk(b"cICP", &[9, 16]),
            chunk(b"iCCP", b"name\0\0not zlib"),
            gamma(0),
        ] {
            let picture = decoded(std::slice::from_ref(&chunk));
            assert_eq!(
                (codes(&picture), picture.remarks.len()),
                ([128, 128, 64], 1),
                "{chunk:?}: {:?}",
                picture.remarks
            );
        }
    }
}
