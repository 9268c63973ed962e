//! Encoding of display pictures as PNG.

use std::{borrow::Cow, path::Path};

use ::png::{
    BitDepth, ColorType, DeflateCompression, Encoder, EncodingError, Filter, ScaledFloat, SourceChromaticities,
    SrgbRenderingIntent,
};
use bansho_base::frame::{DisplayEncoding, DisplayImage, DisplayPixels};

use super::{KEY_ALPHA, KEY_ENCODING, KEY_FINGERPRINT, KEY_VERSION};
use crate::{
    decode::color::primaries::AP1,
    error::{MediaError, SizeRule},
    fingerprint,
};

/// Compression effort.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PngEffort {
    /// Fast: for frames of a sequence, so that rendering need not wait for writing.
    #[default]
    Fast,
    /// Small: for single pictures in documents.
    Small,
}

/// The bytes of a PNG of `picture`: with its 8 or 16 bits, without alpha if it is opaque, marked as what its codes stand for, with the fingerprint and the
/// convention of alpha as text. The same picture gives the same bytes.
///
/// # Errors
/// A side of 0 or above [`SIDE_LIMIT`], or a number of pixels other than width times height. `path` is only used in errors.
pub fn encode(
    picture: &DisplayImage,
    fingerprint: &[u8; 32],
    effort: PngEffort,
    path: &Path,
) -> Result<Vec<u8>, MediaError> {
    let size = checked_size(picture, path)?;
    compress(picture, size, Some(fingerprint), effort, ColorMark::of(picture.encoding))
        .map_err(|error| MediaError::Encode { path: path.to_path_buf(), reason: error.to_string() })
}

/// As [`encode`], small and without a fingerprint: a picture for documents that is not a frame of a scene.
///
/// # Errors
/// As [`encode`].
pub fn encode_document(picture: &DisplayImage, path: &Path) -> Result<Vec<u8>, MediaError> {
    document(picture, path, ColorMark::of(picture.encoding))
}

/// As [`encode_document`], of linear values: the file says so.
///
/// # Errors
/// As [`encode`].
pub fn encode_linear_document(picture: &DisplayImage, path: &Path) -> Result<Vec<u8>, MediaError> {
    document(picture, path, ColorMark::Linear)
}

fn document(picture: &DisplayImage, path: &Path, mark: ColorMark) -> Result<Vec<u8>, MediaError> {
    let size = checked_size(picture, path)?;
    compress(picture, size, None, PngEffort::Small, mark)
        .map_err(|error| MediaError::Encode { path: path.to_path_buf(), reason: error.to_string() })
}

/// As [`encode`], without a fingerprint: a frame of a film.
pub(crate) fn encode_frame(picture: &DisplayImage, path: &Path) -> Result<Vec<u8>, MediaError> {
    let size = checked_size(picture, path)?;
    compress(picture, size, None, PngEffort::Fast, ColorMark::of(picture.encoding))
        .map_err(|error| MediaError::Encode { path: path.to_path_buf(), reason: error.to_string() })
}

/// Largest side of a PNG, as most readers allow.
pub const SIDE_LIMIT: usize = 1_000_000;

/// Width and height, checked against the number of pixels.
fn checked_size(picture: &DisplayImage, path: &Path) -> Result<[u32; 2], MediaError> {
    let (width, height) = (picture.width, picture.height);
    if [width, height].iter().any(|side| !(1..=SIDE_LIMIT).contains(side)) {
        let allowed = SizeRule::UpTo(SIDE_LIMIT);
        return Err(MediaError::Size { path: path.to_path_buf(), width, height, allowed });
    }
    let got = match &picture.pixels {
        DisplayPixels::Eight(pixels) => pixels.len(),
        DisplayPixels::Sixteen(pixels) => pixels.len(),
    };
    if got != width * height {
        let plane = "RGBA".to_owned();
        return Err(MediaError::PlaneLength { path: path.to_path_buf(), plane, got, expected: width * height });
    }
    Ok([width as u32, height as u32])
}

/// What the chunks of a file say about its colors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum ColorMark {
    /// sRGB, gAMA and cHRM.
    Srgb,
    /// gAMA 1 alone.
    Linear,
    /// gAMA 1, and cHRM of AP1.
    LinearAcescg,
    /// Nothing: whoever converts by gAMA, as several game engines do on import, must leave the codes as they are.
    Data,
}

impl ColorMark {
    fn of(encoding: DisplayEncoding) -> Self {
        match encoding {
            DisplayEncoding::Srgb => Self::Srgb,
            DisplayEncoding::LinearAcescg => Self::LinearAcescg,
            DisplayEncoding::Data => Self::Data,
        }
    }
}

/// The file, of a picture whose size is checked.
fn compress(
    picture: &DisplayImage,
    [width, height]: [u32; 2],
    fingerprint: Option<&[u8; 32]>,
    effort: PngEffort,
    mark: ColorMark,
) -> Result<Vec<u8>, EncodingError> {
    let mut file = Vec::with_capacity(picture.width * picture.height / 2 + 1024);
    let mut encoder = Encoder::new(&mut file, width, height);
    encoder.set_color(if picture.opaque { ColorType::Rgb } else { ColorType::Rgba });
    encoder.set_depth(match picture.pixels {
        DisplayPixels::Eight(_) => BitDepth::Eight,
        DisplayPixels::Sixteen(_) => BitDepth::Sixteen,
    });
    match mark {
        ColorMark::Srgb => mark_srgb(&mut encoder),
        ColorMark::Linear => encoder.set_source_gamma(ScaledFloat::from_scaled(LINEAR_GAMMA)),
        ColorMark::LinearAcescg => mark_linear_acescg(&mut encoder),
        ColorMark::Data => {}
    }
    encoder.add_text_chunk("Software".to_owned(), format!("Bansho {}", fingerprint::VERSION))?;
    encoder.add_text_chunk(KEY_VERSION.to_owned(), fingerprint::VERSION.to_owned())?;
    if let Some(fingerprint) = fingerprint {
        encoder.add_text_chunk(KEY_FINGERPRINT.to_owned(), fingerprint::to_hex(fingerprint))?;
    }
    if let Some(name) = encoding_name(picture.encoding) {
        encoder.add_text_chunk(KEY_ENCODING.to_owned(), name.to_owned())?;
    }
    if !picture.opaque {
        encoder.add_text_chunk(KEY_ALPHA.to_owned(), picture.alpha.name().to_owned())?;
    }
    set_effort(&mut encoder, effort);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&samples(picture))?;
    writer.finish()?;
    Ok(file)
}

/// Declares sRGB, and gAMA and cHRM as in section 11.3.2.5 of the standard, for programs that support only those.
fn mark_srgb<W: std::io::Write>(encoder: &mut Encoder<'_, W>) {
    encoder.set_source_srgb(SrgbRenderingIntent::Perceptual);
    encoder.set_source_gamma(ScaledFloat::from_scaled(45_455));
    let (white, red, green, blue) = ((0.3127, 0.3290), (0.64, 0.33), (0.30, 0.60), (0.15, 0.06));
    encoder.set_source_chromaticities(SourceChromaticities::new(white, red, green, blue));
}

/// gAMA of linear values, in hundred-thousandths.
const LINEAR_GAMMA: u32 = 100_000;

/// Declares linear light with the primaries and the white of ACEScg. There is no sRGB chunk, before which gAMA and cHRM would not count, and cICP has no
/// number for AP1.
fn mark_linear_acescg<W: std::io::Write>(encoder: &mut Encoder<'_, W>) {
    encoder.set_source_gamma(ScaledFloat::from_scaled(LINEAR_GAMMA));
    let [red, green, blue, white] = AP1.map(|[x, y]| (x, y));
    encoder.set_source_chromaticities(SourceChromaticities::new(white, red, green, blue));
}

/// The name of an encoding in the text of a file; sRGB needs none.
fn encoding_name(encoding: DisplayEncoding) -> Option<&'static str> {
    match encoding {
        DisplayEncoding::Srgb => None,
        DisplayEncoding::LinearAcescg => Some("lin_ap1_scene"),
        DisplayEncoding::Data => Some("data"),
    }
}

/// The encoding of this name in the text of a file; sRGB without one.
pub(crate) fn encoding_of_name(name: Option<&str>) -> DisplayEncoding {
    let named = [DisplayEncoding::LinearAcescg, DisplayEncoding::Data];
    named.into_iter().find(|encoding| name.is_some() && encoding_name(*encoding) == name).unwrap_or_default()
}

pub(super) fn set_effort<W: std::io::Write>(encoder: &mut Encoder<'_, W>, effort: PngEffort) {
    match effort {
        // Measured on a dithered flame of 1280 x 720: `Sub` is a fifth smaller than `Up`, and the adaptive choice of filters takes 50 %
        // more time for the same size.
        PngEffort::Fast => {
            encoder.set_deflate_compression(DeflateCompression::FdeflateUltraFast);
            encoder.set_filter(Filter::Sub);
        }
        PngEffort::Small => encoder.set_compression(::png::Compression::High),
    }
}

/// The samples in file order: big-endian, without alpha if the picture is opaque.
fn samples(picture: &DisplayImage) -> Cow<'_, [u8]> {
    match (&picture.pixels, picture.opaque) {
        (DisplayPixels::Eight(pixels), false) => Cow::Borrowed(bytemuck::cast_slice(pixels)),
        (DisplayPixels::Eight(pixels), true) => {
            let rgb: Vec<[u8; 3]> = pixels.iter().map(|&[r, g, b, _]| [r, g, b]).collect();
            Cow::Owned(rgb.into_flattened())
        }
        (DisplayPixels::Sixteen(pixels), false) => {
            let rgba: Vec<[[u8; 2]; 4]> = pixels.iter().map(|pixel| pixel.map(u16::to_be_bytes)).collect();
            Cow::Owned(rgba.into_flattened().into_flattened())
        }
        (DisplayPixels::Sixteen(pixels), true) => {
            let rgb: Vec<[[u8; 2]; 3]> = pixels.iter().map(|&[r, g, b, _]| [r, g, b].map(u16::to_be_bytes)).collect();
            Cow::Owned(rgb.into_flattened().into_flattened())
        }
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::color::AlphaConvention;

    use super::*;
    use crate::testing;

    fn read_back(file: &[u8]) -> (::png::OutputInfo, Vec<u8>) {
        let mut reader = ::png::Decoder::new(std::io::Cursor::new(file)).read_info().unwrap();
        let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut bytes).unwrap();
        (info, bytes)
    }

    #[test]
    fn eight_bits_come_back_and_alpha_is_left_out_of_opaque_pictures() {
        let mut picture = testing::display(9, 4, 0);
        let DisplayPixels::Eight(pixels) = picture.pixels.clone() else { unreachable!() };
        for effort in [PngEffort::Fast, PngEffort::Small] {
            picture.opaque = false;
            let (info, bytes) = read_back(&encode(&picture, &[1; 32], effort, Path::new("a.png")).unwrap());
            assert_eq!((info.color_type, info.bit_depth), (ColorType::Rgba, BitDepth::Eight));
            assert_eq!(bytes, pixels.as_flattened());
            picture.opaque = true;
            let (info, bytes) = read_back(&encode(&picture, &[1; 32], effort, Path::new("a.png")).unwrap());
            assert_eq!(info.color_type, ColorType::Rgb);
            assert!(bytes.as_chunks::<3>().0.iter().zip(&pixels).all(|(rgb, rgba)| rgb == &rgba[..3]));
        }
    }

    #[test]
    fn sixteen_bits_come_back_in_big_endian_order() {
        let pixels: Vec<[u16; 4]> = (0..6).map(|i| [i, 257 * i, 65535 - i, 40000]).collect();
        for opaque in [false, true] {
            let pixels = DisplayPixels::Sixteen(pixels.clone());
            let picture = DisplayImage {
                width: 3,
                height: 2,
                opaque,
                alpha: AlphaConvention::Linear,
                encoding: DisplayEncoding::Srgb,
                pixels,
            };
            let (info, bytes) = read_back(&encode(&picture, &[1; 32], PngEffort::Fast, Path::new("a.png")).unwrap());
            assert_eq!(info.bit_depth, BitDepth::Sixteen);
            let values: Vec<u16> = bytes.as_chunks().0.iter().map(|pair| u16::from_be_bytes(*pair)).collect();
            let channels = if opaque { 3 } else { 4 };
            assert_eq!(values[channels..2 * channels], [1, 257, 65534, 40000][..channels]);
        }
    }

    #[test]
    fn linear_documents_say_so() {
        let picture = testing::display(9, 4, 0);
        let kinds = |file: &[u8]| -> Vec<[u8; 4]> {
            super::super::chunk::chunks(file).unwrap().map(|chunk| chunk.unwrap().kind).collect()
        };
        let [linear, srgb] =
            [encode_linear_document, encode_document].map(|encode| encode(&picture, Path::new("a.png")));
        let (linear, srgb) = (linear.unwrap(), srgb.unwrap());
        let gamma = ::png::Decoder::new(std::io::Cursor::new(&linear[..])).read_info().unwrap().info().gama_chunk;
        assert_eq!(gamma, Some(ScaledFloat::from_scaled(100_000)));
        assert!(!kinds(&linear).contains(b"sRGB") && kinds(&srgb).contains(b"sRGB"));
        assert_eq!(read_back(&linear).1, read_back(&srgb).1);
    }

    #[test]
    fn raw_light_reads_back_as_the_light_it_is_and_data_claim_no_color() {
        use bansho_base::host::assets::{Encoding, PictureLayers};
        let read = |encoding| {
            let pixels = DisplayPixels::Sixteen(vec![[20_690, 100, 65_535, 65_535]; 2]);
            let alpha = AlphaConvention::Linear;
            let picture = DisplayImage { width: 2, height: 1, opaque: true, alpha, encoding, pixels };
            let file = encode(&picture, &[1; 32], PngEffort::Fast, Path::new("a.png")).unwrap();
            let kinds: Vec<_> = super::super::chunk::chunks(&file).unwrap().map(|chunk| chunk.unwrap().kind).collect();
            let limit = crate::limits::MemoryLimit::default();
            (kinds, crate::assets::decode_picture(&file, "png", &PictureLayers::default(), limit).unwrap())
        };
        let (kinds, raw) = read(DisplayEncoding::LinearAcescg);
        assert!(kinds.contains(b"gAMA") && kinds.contains(b"cHRM") && !kinds.contains(b"sRGB"), "{kinds:?}");
        assert_eq!((raw.encoding, raw.remarks.len()), (Encoding::LinearAcescg, 0));
        for (value, code) in raw.color.at(0, 0).into_iter().zip([20_690.0, 100.0, 65_535.0, 65_535.0]) {
            assert!((value - code / 65_535.0).abs() < 1e-7, "{value}");
        }
        let (kinds, _) = read(DisplayEncoding::Data);
        assert!([b"sRGB", b"gAMA", b"cHRM", b"iCCP", b"cICP"].iter().all(|kind| !kinds.contains(kind)), "{kinds:?}");
        let (kinds, display) = read(DisplayEncoding::Srgb);
        assert!(kinds.contains(b"sRGB") && display.encoding == Encoding::DisplaySrgb);
    }

    #[test]
    fn the_file_says_that_it_is_srgb_and_nothing_of_time_or_place() {
        let file = encode(&testing::display(9, 4, 0), &[1; 32], PngEffort::Fast, Path::new("secret/a.png")).unwrap();
        let kinds: Vec<_> = super::super::chunk::chunks(&file).unwrap().map(|chunk| chunk.unwrap().kind).collect();
        let text = [b"tEXt"; 4];
        let expected = [b"IHDR", b"sRGB", b"gAMA", b"cHRM"].into_iter().chain(text).chain([b"IDAT", b"IEND"]);
        assert!(expected.eq(kinds.iter()), "{kinds:?}");
        assert!(!file.windows(6).any(|window| window == b"secret"));
        for alpha in [AlphaConvention::Encoded, AlphaConvention::Linear] {
            for opaque in [false, true] {
                let picture = DisplayImage { alpha, opaque, ..testing::display(9, 4, 0) };
                let file = encode(&picture, &[1; 32], PngEffort::Fast, Path::new("a.png")).unwrap();
                let words = [b"bansho:alpha\0", alpha.name().as_bytes()].concat();
                assert_eq!(file.windows(words.len()).any(|window| window == words), !opaque, "{alpha:?}");
            }
        }
    }

    #[test]
    fn sizes_that_do_not_fit_are_refused() {
        let mut picture = testing::display(9, 4, 0);
        picture.width = 8;
        let wrong = encode(&picture, &[1; 32], PngEffort::Fast, Path::new("a.png"));
        assert!(matches!(wrong, Err(MediaError::PlaneLength { got: 36, expected: 32, .. })));
        picture.width = 0;
        let empty = encode(&picture, &[1; 32], PngEffort::Fast, Path::new("a.png"));
        assert!(matches!(empty, Err(MediaError::Size { .. })));
    }
}
