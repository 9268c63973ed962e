//! Fire: the flame sheet, the particle flame, and the sparks of both.

pub mod particles;
pub mod sheet;
pub mod sparks;

use bansho_base::color;

/// Color of the chemiluminescence of burning hydrocarbons, the CH (431 nm) and C2 (516 nm) bands: ACEScg of luminance 1.
pub(crate) fn chemiluminescence_color() -> [f32; 3] {
    let (ch, c2) = (color::line_xyz(431.0), color::line_xyz(516.0));
    let xyz: [f64; 3] = std::array::from_fn(|i| ch[i] + 0.3 * c2[i]);
    color::acescg_from_xyz(xyz.map(|value| value / xyz[1]))
}
