//! The blue light of gas that is just beginning to burn.

use bansho_base::color;

/// Colour of the CH (431 nm) and C2 (516 nm) bands of burning gas, ACEScg of luminance 1.
pub(crate) fn colour() -> [f32; 3] {
    let (ch, c2) = (color::line_xyz(431.0), color::line_xyz(516.0));
    let xyz: [f64; 3] = std::array::from_fn(|i| ch[i] + 0.3 * c2[i]);
    color::acescg_from_xyz(xyz.map(|value| value / xyz[1]))
}
