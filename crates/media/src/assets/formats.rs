//! Recognizes the formats of pictures, also those that are not read.

use bansho_base::host::assets::AssetProblem;

/// A format of pictures that is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PlateFormat {
    Png,
    Jpeg,
    Exr,
    WebP,
    Tiff,
}

/// A format of depth that is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum DepthFormat {
    Exr,
    Png,
    Pfm,
    Npy,
    Tiff,
}

/// A format that is not read: its names, and what to do.
struct UnsupportedFormat {
    extensions: &'static [&'static str],
    format: &'static str,
    advice: &'static str,
}

const HEIC: UnsupportedFormat = UnsupportedFormat {
    extensions: &["heic", "heif", "hif"],
    format: "a HEIC photograph",
    advice: "convert it to JPEG or PNG, as by `heif-convert photo.heic photo.png`, or let the phone export JPEG",
};
const AVIF: UnsupportedFormat = UnsupportedFormat {
    extensions: &["avif"],
    format: "an AVIF picture",
    advice: "convert it to PNG, as by `avifdec picture.avif picture.png`",
};
const RAW: UnsupportedFormat = UnsupportedFormat {
    extensions: &[
        "dng", "cr2", "cr3", "crw", "nef", "nrw", "arw", "srf", "sr2", "raf", "orf", "rw2", "pef", "srw", "x3f",
    ],
    format: "a camera's raw file",
    advice: "develop it to a TIFF of 16 bits, as with darktable or RawTherapee",
};
const DPX: UnsupportedFormat = UnsupportedFormat {
    extensions: &["dpx", "cin"],
    format: "a DPX or Cineon scan",
    advice: "convert it to EXR, as by `oiiotool scan.dpx -o scan.exr`",
};
const PSD: UnsupportedFormat = UnsupportedFormat {
    extensions: &["psd", "psb"],
    format: "a Photoshop document",
    advice: "export it as PNG or TIFF, as by `magick 'picture.psd[0]' picture.png`",
};
const JXL: UnsupportedFormat = UnsupportedFormat {
    extensions: &["jxl"],
    format: "a JPEG XL picture",
    advice: "convert it to PNG, as by `djxl picture.jxl picture.png`",
};
const JP2: UnsupportedFormat = UnsupportedFormat {
    extensions: &["jp2", "j2k", "jpf", "jpx"],
    format: "a JPEG 2000 picture",
    advice: "convert it to PNG, as by `magick picture.jp2 picture.png`",
};
const HDR: UnsupportedFormat = UnsupportedFormat {
    extensions: &["hdr", "rgbe", "pic"],
    format: "a Radiance picture",
    advice: "convert it to EXR, as by `oiiotool picture.hdr -o picture.exr`",
};
const OTHERS: UnsupportedFormat = UnsupportedFormat {
    extensions: &["gif", "bmp", "tga", "ppm", "pgm", "pnm", "ico", "dds", "qoi"],
    format: "a GIF, BMP, TGA, PNM, ICO, DDS or QOI picture",
    advice: "convert it to PNG, as by `magick picture.bmp picture.png`",
};

const UNSUPPORTED: [&UnsupportedFormat; 9] = [&HEIC, &AVIF, &RAW, &DPX, &PSD, &JXL, &JP2, &HDR, &OTHERS];

/// First bytes of formats that are not read.
const FIRST_BYTES: [(&[u8], &UnsupportedFormat); 16] = [
    (b"8BPS", &PSD),
    (b"SDPX", &DPX),
    (b"XPDS", &DPX),
    // Cineon.
    (&[0x80, 0x2a, 0x5f, 0xd7], &DPX),
    (b"FUJIFILMCCD-RAW", &RAW),
    // Olympus and Panasonic; most other makers' raw files begin as a TIFF.
    (b"IIRO", &RAW),
    (b"IIU\0", &RAW),
    // A bare codestream, and one in a container.
    (&[0xff, 0x0a], &JXL),
    (b"\0\0\0\x0cJXL ", &JXL),
    (b"\0\0\0\x0cjP  ", &JP2),
    (b"#?RADIANCE", &HDR),
    (b"#?RGBE", &HDR),
    (b"GIF8", &OTHERS),
    (b"BM", &OTHERS),
    (b"DDS ", &OTHERS),
    (b"qoif", &OTHERS),
];

/// The format that is not read whose first bytes `file` has, whatever its name.
fn by_first_bytes(file: &[u8]) -> Option<&'static UnsupportedFormat> {
    // The box that begins files of ISO/IEC 14496-12; what is in them is told by the brand that follows.
    if let Some(brand) = file.get(4..12).and_then(|bytes| bytes.strip_prefix(b"ftyp")) {
        return match brand {
            b"avif" | b"avis" => Some(&AVIF),
            b"crx " => Some(&RAW),
            b"heic" | b"heix" | b"hevc" | b"hevx" | b"heim" | b"heis" | b"mif1" | b"msf1" => Some(&HEIC),
            _ => None,
        };
    }
    FIRST_BYTES.iter().find(|(start, _)| file.starts_with(start)).map(|(_, format)| *format)
}

/// Refuses a file of a format that is known and not read, by its first bytes or its name.
fn refuse_unsupported(file: &[u8], extension: &str) -> Result<(), AssetProblem> {
    let by_name = UNSUPPORTED.into_iter().find(|format| format.extensions.contains(&extension));
    match by_first_bytes(file).or(by_name) {
        Some(UnsupportedFormat { format, advice, .. }) => Err(AssetProblem::UnsupportedFormat { format, advice }),
        None => Ok(()),
    }
}

/// The format of the picture `file`, whose name has this `extension`.
pub(crate) fn picture_format(file: &[u8], extension: &str) -> Result<PlateFormat, AssetProblem> {
    let extension = extension.to_ascii_lowercase();
    refuse_unsupported(file, &extension)?;
    Ok(match extension.as_str() {
        "png" => PlateFormat::Png,
        "jpg" | "jpeg" | "jpe" | "jfif" => PlateFormat::Jpeg,
        "exr" => PlateFormat::Exr,
        "webp" => PlateFormat::WebP,
        "tif" | "tiff" => PlateFormat::Tiff,
        _ => return Err(AssetProblem::UnknownKind),
    })
}

/// The format of the depth `file`, whose name has this `extension`.
pub(crate) fn depth_format(file: &[u8], extension: &str) -> Result<DepthFormat, AssetProblem> {
    let extension = extension.to_ascii_lowercase();
    refuse_unsupported(file, &extension)?;
    Ok(match extension.as_str() {
        "exr" => DepthFormat::Exr,
        "png" => DepthFormat::Png,
        "pfm" => DepthFormat::Pfm,
        "npy" => DepthFormat::Npy,
        "tif" | "tiff" => DepthFormat::Tiff,
        _ => return Err(AssetProblem::UnknownDepthKind),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_read_is_named_by_its_contents_and_by_its_name() {
        let told = |file: &[u8], extension| picture_format(file, extension).unwrap_err().to_string();
        assert!(
            told(b"\0\0\0\x18ftypheic\0\0\0\0", "jpg")
                .starts_with("is a HEIC photograph, which Bansho does not read; convert")
        );
        assert!(told(b"\0\0\0\x1cftypavif", "png").contains("an AVIF picture"));
        assert!(told(b"8BPS\0\x01", "psd").contains("a Photoshop document"));
        assert!(told(b"SDPX", "DPX").contains("oiiotool"));
        assert!(told(b"II*\0", "NEF").contains("raw file"));
        assert!(told(b"anything", "bmp").contains("convert it to PNG"));
        assert_eq!(picture_format(b"", "xyz"), Err(AssetProblem::UnknownKind));
        assert_eq!(depth_format(b"", "jpg"), Err(AssetProblem::UnknownDepthKind));
        assert_eq!(picture_format(b"II*\0", "TIF"), Ok(PlateFormat::Tiff));
    }
}
