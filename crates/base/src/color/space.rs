//! Color spaces as matrices, all derived from chromaticities at compile time.
//!
//! XYZ here is always relative to D65, as for sRGB. The working space is ACEScg (AP1 primaries, D60 white). Every matrix into the working
//! space includes the Bradford adaptation D65 -> D60, and every matrix out of it the inverse.

use crate::math::MulAdd;

/// A 3 x 3 matrix, row by row, acting on column vectors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Matrix3(pub [[f64; 3]; 3]);

impl Matrix3 {
    /// The matrix times a vector.
    #[must_use]
    pub const fn apply(&self, v: [f64; 3]) -> [f64; 3] {
        let [a, b, c] = self.0;
        [dot(a, v), dot(b, v), dot(c, v)]
    }

    /// The matrix product `self * right`.
    #[must_use]
    pub const fn times(&self, right: &Self) -> Self {
        let columns = right.transposed().0;
        let [x, y, z] = [self.apply(columns[0]), self.apply(columns[1]), self.apply(columns[2])];
        Self([x, y, z]).transposed()
    }

    /// The transposed matrix.
    #[must_use]
    pub const fn transposed(&self) -> Self {
        let [a, b, c] = self.0;
        Self([[a[0], b[0], c[0]], [a[1], b[1], c[1]], [a[2], b[2], c[2]]])
    }

    /// The inverse, by cofactors; not finite for a singular matrix.
    #[must_use]
    pub const fn inverse(&self) -> Self {
        let [a, b, c] = self.0;
        let (bc, ca, ab) = (cross(b, c), cross(c, a), cross(a, b));
        let d = 1.0 / dot(a, bc);
        Self([scaled(bc, d), scaled(ca, d), scaled(ab, d)]).transposed()
    }

    /// The matrix in single precision.
    #[must_use]
    pub const fn single(&self) -> [[f32; 3]; 3] {
        let [a, b, c] = self.0;
        [narrow(a), narrow(b), narrow(c)]
    }
}

const fn narrow(v: [f64; 3]) -> [f32; 3] {
    [v[0] as f32, v[1] as f32, v[2] as f32]
}

const fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

const fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

const fn scaled(v: [f64; 3], s: f64) -> [f64; 3] {
    [v[0] * s, v[1] * s, v[2] * s]
}

const fn diagonal(v: [f64; 3]) -> Matrix3 {
    Matrix3([[v[0], 0.0, 0.0], [0.0, v[1], 0.0], [0.0, 0.0, v[2]]])
}

/// XYZ of a chromaticity, with Y = 1.
const fn xyz_of_chromaticity([x, y]: [f64; 2]) -> [f64; 3] {
    [x / y, 1.0, (1.0 - x - y) / y]
}

/// XYZ of RGB with these primaries, such that RGB (1, 1, 1) is the white with Y = 1 (SMPTE RP 177).
const fn xyz_from_rgb(primaries: [[f64; 2]; 3], white: [f64; 2]) -> Matrix3 {
    let [r, g, b] = primaries;
    let columns = Matrix3([xyz_of_chromaticity(r), xyz_of_chromaticity(g), xyz_of_chromaticity(b)]).transposed();
    let scale = columns.inverse().apply(xyz_of_chromaticity(white));
    columns.times(&diagonal(scale))
}

/// Bradford cone responses from XYZ (Lam 1985; ICC.1:2022 annex E).
const BRADFORD: Matrix3 = Matrix3([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]]);

pub(super) const fn adaptation(from: [f64; 2], to: [f64; 2]) -> Matrix3 {
    let [f, t] = [BRADFORD.apply(xyz_of_chromaticity(from)), BRADFORD.apply(xyz_of_chromaticity(to))];
    let gains = diagonal([t[0] / f[0], t[1] / f[1], t[2] / f[2]]);
    BRADFORD.inverse().times(&gains.times(&BRADFORD))
}

/// Chromaticity of D65, the white of sRGB (IEC 61966-2-1).
pub const D65: [f64; 2] = [0.3127, 0.3290];
/// Chromaticity of the ACES white, close to D60 (SMPTE ST 2065-1).
pub const D60: [f64; 2] = [0.32168, 0.33767];
/// Red, green and blue of sRGB, the primaries of Rec. 709.
pub const SRGB_PRIMARIES: [[f64; 2]; 3] = [[0.64, 0.33], [0.30, 0.60], [0.15, 0.06]];
/// Red, green and blue of ACEScg (AP1; Academy S-2014-004).
pub const AP1_PRIMARIES: [[f64; 2]; 3] = [[0.713, 0.293], [0.165, 0.830], [0.128, 0.044]];

/// Red, green and blue of ACES2065-1 (AP0; SMPTE ST 2065-1).
pub const AP0_PRIMARIES: [[f64; 2]; 3] = [[0.7347, 0.2653], [0.0, 1.0], [0.0001, -0.0770]];
/// Red, green and blue of Rec. 2020 (ITU-R BT.2020).
pub const REC2020_PRIMARIES: [[f64; 2]; 3] = [[0.708, 0.292], [0.170, 0.797], [0.131, 0.046]];

/// Bradford adaptation of XYZ from D65 to D60.
pub const BRADFORD_D65_TO_D60: Matrix3 = adaptation(D65, D60);
/// Bradford adaptation of XYZ from D60 to D65.
pub const BRADFORD_D60_TO_D65: Matrix3 = BRADFORD_D65_TO_D60.inverse();
/// XYZ (D65) of linear sRGB.
pub const XYZ_FROM_SRGB: Matrix3 = xyz_from_rgb(SRGB_PRIMARIES, D65);
/// Linear sRGB of XYZ (D65).
pub const SRGB_FROM_XYZ: Matrix3 = XYZ_FROM_SRGB.inverse();
/// ACEScg of XYZ (D65), adapted.
pub const ACESCG_FROM_XYZ: Matrix3 = XYZ_FROM_ACESCG.inverse();
/// XYZ (D65) of ACEScg, adapted.
pub const XYZ_FROM_ACESCG: Matrix3 = BRADFORD_D60_TO_D65.times(&xyz_from_rgb(AP1_PRIMARIES, D60));
/// ACEScg of linear sRGB, adapted: white stays (1, 1, 1).
pub const ACESCG_FROM_SRGB: Matrix3 = ACESCG_FROM_XYZ.times(&XYZ_FROM_SRGB);
/// Linear sRGB of ACEScg, adapted: white stays (1, 1, 1).
pub const SRGB_FROM_ACESCG: Matrix3 = ACESCG_FROM_SRGB.inverse();

/// ACES2065-1 of ACEScg. Both have the D60 white, so nothing is adapted.
pub const ACES2065_1_FROM_ACESCG: Matrix3 =
    xyz_from_rgb(AP0_PRIMARIES, D60).inverse().times(&xyz_from_rgb(AP1_PRIMARIES, D60));
/// Linear Rec. 2020 of ACEScg, adapted: white stays (1, 1, 1).
pub const REC2020_FROM_ACESCG: Matrix3 = xyz_from_rgb(REC2020_PRIMARIES, D65).inverse().times(&XYZ_FROM_ACESCG);

/// Weights of the luminance of ACEScg: the Y, relative to D65, of the light before adaptation. They are the Y weights of AP1 (0.2722, 0.6741,
/// 0.0537) combined with the adaptation back to D65, since emitted light is adapted on conversion to ACEScg; they sum to 1.
pub const LUMINANCE_WEIGHTS: [f32; 3] = narrow(XYZ_FROM_ACESCG.0[1]);

/// Luminance of an ACEScg color: in cd/m^2 for scene light, relative to display white for exposed light.
#[inline(always)]
#[must_use]
pub fn luminance(acescg: [f32; 3]) -> f32 {
    dot_single(LUMINANCE_WEIGHTS, acescg)
}

#[inline(always)]
fn dot_single([a, b, c]: [f32; 3], [x, y, z]: [f32; 3]) -> f32 {
    x.fma(a, y.fma(b, z * c))
}

#[inline(always)]
pub(super) fn apply_single(m: &[[f32; 3]; 3], v: [f32; 3]) -> [f32; 3] {
    [dot_single(m[0], v), dot_single(m[1], v), dot_single(m[2], v)]
}

/// ACEScg of linear sRGB.
#[inline(always)]
#[must_use]
pub fn acescg_from_srgb(srgb: [f32; 3]) -> [f32; 3] {
    apply_single(&const { ACESCG_FROM_SRGB.single() }, srgb)
}

/// Linear sRGB of ACEScg; negative components where the color lies outside sRGB.
#[inline(always)]
#[must_use]
pub fn srgb_from_acescg(acescg: [f32; 3]) -> [f32; 3] {
    apply_single(&const { SRGB_FROM_ACESCG.single() }, acescg)
}

/// ACEScg of XYZ (D65). Multiply radiometric XYZ by [`LUMINOUS_EFFICACY_LM_PER_W`](super::LUMINOUS_EFFICACY_LM_PER_W) for cd/m^2.
#[inline(always)]
#[must_use]
pub fn acescg_from_xyz(xyz: [f64; 3]) -> [f32; 3] {
    narrow(ACESCG_FROM_XYZ.apply(xyz))
}

/// XYZ (D65) of ACEScg.
#[inline(always)]
#[must_use]
pub fn xyz_from_acescg([r, g, b]: [f32; 3]) -> [f64; 3] {
    XYZ_FROM_ACESCG.apply([f64::from(r), f64::from(g), f64::from(b)])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_near(a: [f64; 3], b: [f64; 3], tolerance: f64) {
        assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() <= tolerance), "{a:?} is not {b:?}");
    }

    #[test]
    fn white_stays_white() {
        assert_near(ACESCG_FROM_SRGB.apply([1.0; 3]), [1.0; 3], 1e-12);
        assert_near(XYZ_FROM_SRGB.apply([1.0; 3]), xyz_of_chromaticity(D65), 1e-12);
        assert_near(BRADFORD_D65_TO_D60.apply(xyz_of_chromaticity(D65)), xyz_of_chromaticity(D60), 1e-12);
    }

    #[test]
    fn published_matrices() {
        // IEC 61966-2-1 gives the first row to four places; Academy S-2014-004 the second row of AP1 to ten.
        assert_near(SRGB_FROM_XYZ.0[0], [3.2406, -1.5372, -0.4986], 5e-4);
        assert_near(xyz_from_rgb(AP1_PRIMARIES, D60).0[1], [0.2722287168, 0.6740817658, 0.0536895174], 1e-9);
        // The widely used sRGB -> ACEScg matrix with Bradford adaptation.
        assert_near(ACESCG_FROM_SRGB.0[0], [0.613097, 0.339523, 0.047379], 2e-5);
        // Academy S-2014-004 gives AP1 to AP0 to ten places.
        assert_near(ACES2065_1_FROM_ACESCG.0[0], [0.6954522414, 0.1406786965, 0.1638690622], 1e-9);
        assert_near(ACES2065_1_FROM_ACESCG.0[2], [-0.0055258826, 0.0040252103, 1.0015006723], 1e-9);
        // ITU-R BT.2020 gives the luminance weights to four places.
        let y = xyz_from_rgb(REC2020_PRIMARIES, D65).0[1];
        assert_near(y, [0.2627, 0.6780, 0.0593], 5e-5);
        // The widely used ACEScg -> Rec. 2020 matrix with Bradford adaptation.
        assert_near(REC2020_FROM_ACESCG.0[0], [1.025825, -0.020053, -0.005772], 2e-5);
        assert_near(REC2020_FROM_ACESCG.0[2], [-0.005013, -0.025290, 1.030303], 2e-5);
    }

    #[test]
    fn round_trips() {
        for color in [[0.2, 0.5, 0.9], [1.0, 0.0, 0.0], [16.0, -2.0, -3.0], [-0.1, 0.4, 3.0]] {
            assert_near(SRGB_FROM_ACESCG.apply(ACESCG_FROM_SRGB.apply(color)), color, 1e-13);
            assert_near(ACESCG_FROM_XYZ.apply(XYZ_FROM_ACESCG.apply(color)), color, 1e-13);
            let single = narrow(color);
            let back = srgb_from_acescg(acescg_from_srgb(single));
            let worst = single.iter().zip(back).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            assert!(worst <= 1e-6 * single[0].abs().max(1.0), "{single:?} -> {back:?}");
        }
    }

    #[test]
    fn luminance_is_the_y_that_went_in() {
        for xyz in [[0.95, 1.0, 1.09], [2.1, 1.0, 0.002], [0.2, 0.05, 1.2]] {
            let y = f64::from(luminance(acescg_from_xyz(xyz)));
            assert!((y - xyz[1]).abs() < 1e-6, "{y} is not {}", xyz[1]);
        }
        assert!((LUMINANCE_WEIGHTS.iter().sum::<f32>() - 1.0).abs() < 1e-6);
    }
}
