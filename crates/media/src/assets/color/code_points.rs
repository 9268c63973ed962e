//! The numbers by which ITU-T H.273 names primaries and transfer functions.

use super::{
    SourceColor,
    primaries::{Chromaticities, REC709, REC2020},
    transfer::Transfer,
};

const D65: [f32; 2] = [0.3127, 0.3290];
/// White of illuminant C.
const ILLUMINANT_C: [f32; 2] = [0.310, 0.316];
/// White of digital cinema.
const DCI: [f32; 2] = [0.314, 0.351];

/// Chromaticities of red, green, blue and white of a number of table 2.
fn chromaticities(number: u8) -> Option<Chromaticities> {
    let p3 = |white| [[0.680, 0.320], [0.265, 0.690], [0.150, 0.060], white];
    Some(match number {
        1 => REC709,
        4 => [[0.67, 0.33], [0.21, 0.71], [0.14, 0.08], ILLUMINANT_C],
        5 => [[0.64, 0.33], [0.29, 0.60], [0.15, 0.06], D65],
        6 | 7 => [[0.630, 0.340], [0.310, 0.595], [0.155, 0.070], D65],
        8 => [[0.681, 0.319], [0.243, 0.692], [0.145, 0.049], ILLUMINANT_C],
        9 => REC2020,
        // XYZ.
        10 => [[1.0, 0.0], [0.0, 1.0], [0.0, 0.0], [1.0 / 3.0, 1.0 / 3.0]],
        11 => p3(DCI),
        12 => p3(D65),
        22 => [[0.630, 0.340], [0.295, 0.605], [0.155, 0.077], D65],
        _ => return None,
    })
}

/// The transfer function of a number of table 3.
fn transfer(number: u8) -> Option<Transfer> {
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

/// The colors of RGB values in the full range with these numbers.
pub(crate) fn colors(primaries_number: u8, transfer_number: u8) -> SourceColor {
    match (chromaticities(primaries_number), transfer(transfer_number)) {
        (Some(chromaticities), Some(transfer)) => SourceColor::Described { chromaticities, transfer },
        (None, _) => SourceColor::Unknown(format!("its cICP has primaries {primaries_number}, which are not known")),
        (_, None) => {
            SourceColor::Unknown(format!("its cICP has the transfer function {transfer_number}, which is not known"))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reserved_numbers_are_not_guessed() {
        for (primaries, transfer, word) in
            [(3, 13, "primaries 3"), (2, 13, "primaries 2"), (1, 3, "function 3"), (1, 255, "255")]
        {
            let SourceColor::Unknown(reason) = colors(primaries, transfer) else { panic!("{primaries} {transfer}") };
            assert!(reason.contains(word), "{reason}");
        }
        assert_eq!(colors(1, 13), SourceColor::Described { chromaticities: REC709, transfer: Transfer::Srgb });
    }
}
