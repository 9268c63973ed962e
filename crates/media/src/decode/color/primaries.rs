//! Conversion from a file's chromaticities to known primaries.

use bansho_base::{color::srgb_from_acescg, host::assets::Encoding};

/// CIE xy of red, green, blue and white.
pub(crate) type Chromaticities = [[f32; 2]; 4];

/// A color matrix, and the encoding of its result; without a matrix, the encoding of the file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Conversion {
    pub(crate) encoding: Encoding,
    pub(crate) matrix: Option<[[f32; 3]; 3]>,
}

/// CIE xy of red, green, blue and white of Rec. 709 and sRGB.
pub(crate) const REC709: Chromaticities = [[0.64, 0.33], [0.30, 0.60], [0.15, 0.06], [0.3127, 0.3290]];

/// CIE xy of the ACEScg (AP1) red, green and blue and of its white, D60 (SMPTE ST 2065-4, S-2014-004).
pub(crate) const AP1: Chromaticities = [[0.713, 0.293], [0.165, 0.830], [0.128, 0.044], [0.32168, 0.33767]];

/// CIE xy of red, green, blue and white of Rec. 2020.
pub(crate) const REC2020: Chromaticities = [[0.708, 0.292], [0.170, 0.797], [0.131, 0.046], [0.3127, 0.3290]];

/// Tolerance for rounded chromaticities.
const TOLERANCE: f32 = 0.001;

type Matrix = [[f64; 3]; 3];

/// Whether two sets of chromaticities are the same, up to rounding.
pub(crate) fn is_near(first: Chromaticities, second: Chromaticities) -> bool {
    first.as_flattened().iter().zip(second.as_flattened()).all(|(a, b)| (a - b).abs() <= TOLERANCE)
}

/// The conversion for these chromaticities; without any, Rec. 709 is assumed. `None` for collinear ones.
pub(crate) fn conversion(chromaticities: Option<Chromaticities>) -> Option<Conversion> {
    let source = chromaticities.unwrap_or(REC709);
    // Files round their chromaticities. Known primaries get the exact matrix of their encoding later, rather than one from rounded numbers.
    if is_near(source, REC709) {
        return Some(Conversion { encoding: Encoding::LinearSrgb, matrix: None });
    }
    if is_near(source, AP1) {
        return Some(Conversion { encoding: Encoding::LinearAcescg, matrix: None });
    }
    let (xyz_from_source, xyz_from_srgb) = (to_xyz(source)?, to_xyz(REC709)?);
    let adapted = multiply(bradford(white(source)?, white(REC709)?)?, xyz_from_source);
    let matrix = multiply(inverse(xyz_from_srgb)?, adapted).map(|row| row.map(|value| value as f32));
    let is_finite = matrix.as_flattened().iter().all(|value| value.is_finite());
    is_finite.then_some(Conversion { encoding: Encoding::LinearSrgb, matrix: Some(matrix) })
}

/// A color in the encoding of `conversion`.
#[inline(always)]
pub(crate) fn apply(conversion: &Conversion, color: [f32; 3]) -> [f32; 3] {
    match &conversion.matrix {
        None => color,
        Some(rows) => rows.map(|row| row[0] * color[0] + (row[1] * color[1] + row[2] * color[2])),
    }
}

/// Linear sRGB of light in `encoding`.
#[inline(always)]
pub(crate) fn srgb_of(encoding: Encoding, color: [f32; 3]) -> [f32; 3] {
    if encoding == Encoding::LinearAcescg { srgb_from_acescg(color) } else { color }
}

/// Weights of the luminance; `None` for collinear chromaticities.
pub(crate) fn luminance_weights(chromaticities: Chromaticities) -> Option<[f32; 3]> {
    to_xyz(chromaticities).map(|rows| rows[1].map(|weight| weight as f32))
}

/// XYZ of chromaticity xy, up to a factor: y may be 0, as of XYZ itself.
fn direction([x, y]: [f32; 2]) -> Option<[f64; 3]> {
    let (x, y) = (f64::from(x), f64::from(y));
    let color = [x, y, 1.0 - x - y];
    color.iter().all(|value| value.is_finite()).then_some(color)
}

/// XYZ of chromaticity xy with Y = 1.
fn xyz(chromaticity: [f32; 2]) -> Option<[f64; 3]> {
    let [x, y, z] = direction(chromaticity)?;
    let color = [x / y, 1.0, z / y];
    color.iter().all(|value| value.is_finite()).then_some(color)
}

fn white(chromaticities: [[f32; 2]; 4]) -> Option<[f64; 3]> {
    xyz(chromaticities[3])
}

/// Linear RGB to XYZ so that (1, 1, 1) is the white (SMPTE RP 177).
fn to_xyz(chromaticities: [[f32; 2]; 4]) -> Option<Matrix> {
    let [red, green, blue, _] = chromaticities.map(direction);
    let columns = transposed([red?, green?, blue?]);
    let scale = times(inverse(columns)?, white(chromaticities)?);
    Some(columns.map(|row| [row[0] * scale[0], row[1] * scale[1], row[2] * scale[2]]))
}

/// Bradford chromatic adaptation (ICC.1:2022, annex E).
fn bradford(from: [f64; 3], to: [f64; 3]) -> Option<Matrix> {
    const CONES: Matrix = [[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]];
    let (before, after) = (times(CONES, from), times(CONES, to));
    let scaled = [0, 1, 2].map(|cone| CONES[cone].map(|value| value * after[cone] / before[cone]));
    Some(multiply(inverse(CONES)?, scaled))
}

fn times(matrix: Matrix, vector: [f64; 3]) -> [f64; 3] {
    matrix.map(|row| row[0] * vector[0] + row[1] * vector[1] + row[2] * vector[2])
}

fn transposed(matrix: Matrix) -> Matrix {
    [0, 1, 2].map(|column| [0, 1, 2].map(|row| matrix[row][column]))
}

fn multiply(a: Matrix, b: Matrix) -> Matrix {
    let columns = transposed(b);
    a.map(|row| columns.map(|column| row[0] * column[0] + row[1] * column[1] + row[2] * column[2]))
}

/// The determinant of what is left without a row and a column, with its sign.
fn cofactor(m: Matrix, row: usize, column: usize) -> f64 {
    // The other rows and columns in cyclic order, which gives the sign.
    let (r, s) = ((row + 1) % 3, (row + 2) % 3);
    let (c, d) = ((column + 1) % 3, (column + 2) % 3);
    m[r][c] * m[s][d] - m[r][d] * m[s][c]
}

/// The inverse by Cramer's rule; `None` for a singular matrix.
fn inverse(m: Matrix) -> Option<Matrix> {
    let determinant = m[0][0] * cofactor(m, 0, 0) + m[0][1] * cofactor(m, 0, 1) + m[0][2] * cofactor(m, 0, 2);
    let inverse = [0, 1, 2].map(|row| [0, 1, 2].map(|column| cofactor(m, column, row) / determinant));
    (determinant.abs() > 1e-9).then_some(inverse)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_primaries_pass_unchanged() {
        assert_eq!(conversion(None).unwrap(), Conversion { encoding: Encoding::LinearSrgb, matrix: None });
        assert_eq!(conversion(Some(AP1)).unwrap(), Conversion { encoding: Encoding::LinearAcescg, matrix: None });
    }

    #[test]
    fn rec2020_becomes_the_published_rec709() {
        // ITU-R BT.2087, table 4 inverted: Rec. 2020 to Rec. 709, same white.
        let rec2020 = [[0.708, 0.292], [0.170, 0.797], [0.131, 0.046], [0.3127, 0.3290]];
        let matrix = conversion(Some(rec2020)).unwrap().matrix.unwrap();
        let expected = [[1.6605, -0.5876, -0.0728], [-0.1246, 1.1329, -0.0083], [-0.0182, -0.1006, 1.1187]];
        for (found, wanted) in matrix.as_flattened().iter().zip(expected.as_flattened()) {
            assert!((found - wanted).abs() < 2e-4, "{matrix:?}");
        }
    }

    #[test]
    fn white_stays_white_whatever_the_white_was() {
        let p3_dci = [[0.680, 0.320], [0.265, 0.690], [0.150, 0.060], [0.314, 0.351]];
        let matrix = conversion(Some(p3_dci)).unwrap().matrix.unwrap();
        for row in matrix {
            assert!((row.iter().sum::<f32>() - 1.0).abs() < 1e-5, "{row:?}");
        }
    }

    #[test]
    fn xyz_itself_has_primaries_whose_y_is_zero() {
        let xyz = [[1.0, 0.0], [0.0, 1.0], [0.0, 0.0], [1.0 / 3.0, 1.0 / 3.0]];
        let conversion = conversion(Some(xyz)).unwrap();
        // Equal energy is white, and D65's Y alone is greener than white.
        let white = apply(&conversion, [1.0; 3]);
        assert!(white.iter().all(|value| (value - 1.0).abs() < 1e-5), "{white:?}");
        let green = apply(&conversion, [0.0, 1.0, 0.0]);
        assert!(green[1] > 1.0 && green[0] < 0.0, "{green:?}");
    }

    #[test]
    fn impossible_primaries_are_refused() {
        assert!(conversion(Some([[0.3, 0.3]; 4])).is_none());
        assert!(conversion(Some([[0.0; 2]; 4])).is_none());
        assert!(conversion(Some([[f32::NAN; 2]; 4])).is_none());
    }
}
