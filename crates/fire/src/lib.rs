//! Fire: a flame sheet, a particle flame, a volume flame, and sparks for all of them.
//!
//! | module | model | after |
//! |---|---|---|
//! | [`sheet`] | a small, near flame as a warped, scrolling texture in closed form; with smoke | Ohshima and Itahashi |
//! | [`particles`] | burning gas by smoothed-particle hydrodynamics, black-body light, heat haze | Inagaki et al. |
//! | [`volume`] | burning gas on a grid: thin layers of soot that neck, roll up and puff, seen from any side | Burke and Schumann; Nguyen, Fedkiw and Jensen; and others |
//! | [`sparks`] | glowing particles in closed form, drawn as streaks | |
//!
//! The sheet is a closed form, which can be evaluated at any time; the other two are simulated in steps. The volume flame takes the surfaces of its burners from
//! the particle flame; nothing else is shared. The documentation of each module lists
//! its references and its equations with the functions that implement them.

pub mod particles;
mod picture_bounds;
pub mod sheet;
pub mod sparks;
pub mod volume;

use bansho_base::color;

/// The gas flow of a flame as a fraction of full flow, a quantity of
/// [`PhenomenonTable::with_quantity`](bansho_base::tables::PhenomenonTable::with_quantity): 0 puts it out.
pub const GAS_FLOW: &str = "gas flow";
/// The position of a flame, m, a quantity of [`PhenomenonTable::with_quantity`](bansho_base::tables::PhenomenonTable::with_quantity). Gas that burns already
/// stays where it is.
pub const POSITION: &str = "position";

/// What the bright parts of flames are at automatic exposure, relative to display white: a camera that is set for the flame clips 1 to 10 % of it.
pub(crate) const EXPOSED_LUMINANCE: f64 = 2.6;

/// Color of the chemiluminescence of burning hydrocarbons, the CH (431 nm) and C2 (516 nm) bands: ACEScg of luminance 1.
pub(crate) fn chemiluminescence_color() -> [f32; 3] {
    let (ch, c2) = (color::line_xyz(431.0), color::line_xyz(516.0));
    let xyz: [f64; 3] = std::array::from_fn(|i| ch[i] + 0.3 * c2[i]);
    color::acescg_from_xyz(xyz.map(|value| value / xyz[1]))
}
