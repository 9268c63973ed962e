//! The colors of a file, converted to sRGB or ACEScg.
//!
//! [`primaries`]: matrices between chromaticities. [`transfer`]: from encoded values to light. [`icc`]: ICC profiles.

mod icc;
pub(crate) mod primaries;
pub(crate) mod transfer;

use bansho_base::{
    color::encode_srgb,
    host::assets::{Encoding, PictureRemark},
};
use rayon::prelude::*;

use self::{
    primaries::{Chromaticities, REC709, REC2020},
    transfer::Transfer,
};

/// What a file says about its colors.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) enum SourceColor {
    /// sRGB, or nothing.
    #[default]
    Srgb,
    /// Chromaticities of red, green, blue and white, and a transfer function.
    Described { chromaticities: Chromaticities, transfer: Transfer },
    /// An ICC profile.
    Profile(Vec<u8>),
    /// Something that is not understood, and why.
    Unknown(String),
}

/// Pixels that are converted at a time by one thread.
const CHUNK: usize = 1 << 14;

/// Converts `pixels`, which are codes up to `max_code` divided by it, and says what they are then. Alpha is unchanged. What cannot be converted is
/// taken as sRGB, and a remark says so.
pub(crate) fn convert(
    pixels: &mut [[f32; 4]],
    source: &SourceColor,
    max_code: u32,
    remarks: &mut Vec<PictureRemark>,
) -> Encoding {
    match source {
        SourceColor::Srgb => Encoding::DisplaySrgb,
        SourceColor::Unknown(reason) => {
            remarks.push(PictureRemark::Colors(reason.clone()));
            Encoding::DisplaySrgb
        }
        SourceColor::Profile(profile) => {
            if let Err(reason) = icc::convert(pixels, profile) {
                remarks.push(PictureRemark::Profile(reason.to_string()));
            }
            Encoding::DisplaySrgb
        }
        SourceColor::Described { chromaticities, transfer } => {
            convert_described(pixels, *chromaticities, *transfer, max_code, remarks)
        }
    }
}

/// Converts 4-component pixels, cyan, magenta, yellow and black, by their profile. Alpha becomes 1.
pub(crate) fn convert_cmyk(pixels: &mut [[f32; 4]], profile: &[u8]) -> Result<(), icc::ProfileError> {
    icc::convert_cmyk(pixels, profile)
}

fn convert_described(
    pixels: &mut [[f32; 4]],
    chromaticities: Chromaticities,
    transfer: Transfer,
    max_code: u32,
    remarks: &mut Vec<PictureRemark>,
) -> Encoding {
    if transfer == Transfer::Srgb && primaries::is_near(chromaticities, REC709) {
        return Encoding::DisplaySrgb;
    }
    let Some(conversion) = primaries::conversion(Some(chromaticities)) else {
        let reason = "its chromaticities describe no colors".to_owned();
        remarks.push(PictureRemark::Colors(reason));
        return Encoding::DisplaySrgb;
    };
    // Values are codes, of which there are at most 65536: a table takes fewer powers and exponentials than pixels have channels.
    let light_of_code: Vec<f32> =
        (0..=max_code).map(|code| transfer.to_light(f64::from(code) / f64::from(max_code))).collect();
    // Light of a scene, or beyond display white, would lose what is above 1 by encoding.
    let stays_linear = transfer.is_linear() || transfer.is_high_dynamic_range();
    pixels.par_chunks_mut(CHUNK).for_each(|chunk| {
        for [r, g, b, _] in chunk {
            let light = [*r, *g, *b].map(|value| {
                // Half a code is added, since a value is its code divided in single precision.
                light_of_code[((value * max_code as f32 + 0.5) as usize).min(max_code as usize)]
            });
            let light = primaries::apply(&conversion, transfer.with_system_gamma(light, chromaticities));
            [*r, *g, *b] =
                if stays_linear { light } else { primaries::srgb_of(conversion.encoding, light).map(encode_srgb) };
        }
    });
    if !stays_linear {
        return Encoding::DisplaySrgb;
    }
    remarks.extend(transfer.high_dynamic_range_remark());
    conversion.encoding
}

/// White of daylight at 6504 K.
const D65: [f32; 2] = [0.3127, 0.3290];
/// White of illuminant C.
const ILLUMINANT_C: [f32; 2] = [0.310, 0.316];
/// White of digital cinema.
const DCI: [f32; 2] = [0.314, 0.351];

/// Chromaticities of red, green, blue and white of a number of ITU-T H.273, table 2.
fn chromaticities_of_number(number: u8) -> Option<Chromaticities> {
    Some(match number {
        1 => REC709,
        4 => [[0.67, 0.33], [0.21, 0.71], [0.14, 0.08], ILLUMINANT_C],
        5 => [[0.64, 0.33], [0.29, 0.60], [0.15, 0.06], D65],
        6 | 7 => [[0.630, 0.340], [0.310, 0.595], [0.155, 0.070], D65],
        8 => [[0.681, 0.319], [0.243, 0.692], [0.145, 0.049], ILLUMINANT_C],
        9 => REC2020,
        // XYZ.
        10 => [[1.0, 0.0], [0.0, 1.0], [0.0, 0.0], [1.0 / 3.0, 1.0 / 3.0]],
        // SMPTE RP 431-2 and EG 432-1: the primaries of P3 with the white of cinemas, and with that of displays.
        11 => [[0.680, 0.320], [0.265, 0.690], [0.150, 0.060], DCI],
        12 => [[0.680, 0.320], [0.265, 0.690], [0.150, 0.060], D65],
        22 => [[0.630, 0.340], [0.295, 0.605], [0.155, 0.077], D65],
        _ => return None,
    })
}

/// The transfer function of a number of ITU-T H.273, table 3.
fn transfer_of_number(number: u8) -> Option<Transfer> {
    Some(match number {
        1 | 6 | 14 | 15 => Transfer::Bt709,
        4 => Transfer::Gamma(2.2),
        5 => Transfer::Gamma(2.8),
        8 => Transfer::Linear,
        13 => Transfer::Srgb,
        16 => Transfer::Pq,
        17 => Transfer::Gamma(2.6),
        18 => Transfer::Hlg,
        _ => return None,
    })
}

impl SourceColor {
    /// The colors of RGB values in the full range with these numbers of ITU-T H.273.
    pub(crate) fn from_code_points(primaries_number: u8, transfer_number: u8) -> Self {
        match (chromaticities_of_number(primaries_number), transfer_of_number(transfer_number)) {
            (Some(chromaticities), Some(transfer)) => Self::Described { chromaticities, transfer },
            (None, _) => Self::Unknown(format!("its cICP has primaries {primaries_number}, which are not known")),
            (_, None) => {
                Self::Unknown(format!("its cICP has the transfer function {transfer_number}, which is not known"))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn converted(
        codes: [u32; 3],
        max_code: u32,
        chromaticities: Chromaticities,
        transfer: Transfer,
    ) -> ([f32; 3], Encoding) {
        let [r, g, b] = codes.map(|code| code as f32 / max_code as f32);
        let mut pixels = [[r, g, b, 0.5]];
        let encoding =
            convert(&mut pixels, &SourceColor::Described { chromaticities, transfer }, max_code, &mut Vec::new());
        assert_eq!(pixels[0][3], 0.5);
        ([pixels[0][0], pixels[0][1], pixels[0][2]], encoding)
    }

    #[test]
    fn display_p3_and_adobe_rgb_become_the_codes_of_their_published_matrices() {
        // Computed in double precision by NumPy from the chromaticities.
        let p3 = [[0.680, 0.320], [0.265, 0.690], [0.150, 0.060], [0.3127, 0.3290]];
        let ([r, g, b], encoding) = converted([128, 128, 64], 255, p3, Transfer::Srgb);
        assert_eq!(encoding, Encoding::DisplaySrgb);
        let codes = [r, g, b].map(|value| (value * 255.0).round());
        assert_eq!(codes, [128.0, 128.0, 53.0]);
        let adobe = [[0.64, 0.33], [0.21, 0.71], [0.15, 0.06], [0.3127, 0.3290]];
        let ([r, g, b], _) = converted([100, 150, 50], 255, adobe, Transfer::Gamma(563.0 / 256.0));
        let codes = [r, g, b].map(|value| (value * 255.0).round());
        assert_eq!(codes, [66.0, 151.0, 34.0]);
    }

    #[test]
    fn what_a_file_calls_srgb_is_unchanged_to_the_bit() {
        let values = [0.2, 0.4, 0.6].map(|value: f32| (value * 255.0).round() as u32);
        let (color, encoding) = converted(values, 255, REC709, Transfer::Srgb);
        assert_eq!((color, encoding), (values.map(|code| code as f32 / 255.0), Encoding::DisplaySrgb));
    }

    #[test]
    fn display_white_of_high_dynamic_range_is_one() {
        // ITU-R BT.2408: 203 cd/m^2 is 58 % of PQ and 75 % of HLG.
        let rec2020 = [[0.708, 0.292], [0.170, 0.797], [0.131, 0.046], [0.3127, 0.3290]];
        for (transfer, signal) in [(Transfer::Pq, 0.5807), (Transfer::Hlg, 0.75)] {
            let code = (65535.0 * signal) as u32;
            let (color, encoding) = converted([code; 3], 65535, rec2020, transfer);
            assert_eq!(encoding, Encoding::LinearSrgb);
            assert!(color.iter().all(|value| (value - 1.0).abs() < 0.01), "{transfer:?}: {color:?}");
        }
        let (peak, _) = converted([65535; 3], 65535, rec2020, Transfer::Pq);
        assert!((peak[0] / (10_000.0 / 203.0) - 1.0).abs() < 1e-3);
    }

    #[test]
    fn what_is_not_understood_is_told() {
        let mut remarks = Vec::new();
        let mut pixels = [[0.25, 0.5, 0.75, 1.0]; 3];
        let before = pixels;
        for source in [
            SourceColor::Unknown("its cICP says 77".to_owned()),
            SourceColor::Profile(b"no profile".to_vec()),
            SourceColor::Profile(Vec::new()),
            SourceColor::Described { chromaticities: [[0.3, 0.3]; 4], transfer: Transfer::Srgb },
        ] {
            assert_eq!(convert(&mut pixels, &source, 255, &mut remarks), Encoding::DisplaySrgb);
        }
        assert_eq!((pixels, remarks.len()), (before, 4));
    }

    #[test]
    fn reserved_numbers_are_not_guessed() {
        for (primaries, transfer, word) in
            [(3, 13, "primaries 3"), (2, 13, "primaries 2"), (1, 3, "function 3"), (1, 255, "255")]
        {
            let SourceColor::Unknown(reason) = SourceColor::from_code_points(primaries, transfer) else {
                panic!("{primaries} {transfer}")
            };
            assert!(reason.contains(word), "{reason}");
        }
        let srgb = SourceColor::Described { chromaticities: REC709, transfer: Transfer::Srgb };
        assert_eq!(SourceColor::from_code_points(1, 13), srgb);
    }
}
