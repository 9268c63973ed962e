//! Flame sheet: a small, near flame (candle, torch, hearth, campfire) as a scrolling texture on an upright rectangle.
//!
//! # Model
//! A monochrome texture scrolls upward behind a rectangle. A threshold that rises with height cuts it; then it is sharpened and colored. The
//! coordinates of the rectangle are warped so that the gas accelerates and its edges flutter. Nothing is simulated: any frame is a function
//! of time alone. Lengths are in meters, speeds of the texture in sheet heights per second, luminance in cd/m^2.
//!
//! # References
//! - T. Ohshima and S. Itahashi, "Easy representation of flame by using 2-dimensional texture" (in Japanese). Equation numbers are theirs.
//! - K. Perlin, "An image synthesizer" (1985) and "Improving noise" (2002): the gradient noise of the default texture.
//!
//! # Equations
//! | step | equation | function |
//! |---|---|---|
//! | texture and scroll | `T0 = T(u, w - s (t - t0))` (1), (2) | `Clock::scroll`, `Texture::sample` |
//! | threshold | `L = 1 - (1 - V(w)) (1 - H(u))` (4) | [`equations::threshold`] |
//! | cut | `T1 = max(0, T0 - L)` (5) | [`equations::above_threshold`] |
//! | sharpen | `T2 = C(T1)` (6) | `ColorRamp` |
//! | color | `(r, g, b) = (R, G, B)(T2)` (7) | `ColorRamp` |
//! | rise | `w_p = (1 - k) sqrt(y) + k y` (9) | [`equations::rise`] |
//! | distance from the axis | `x' = 2 abs(x - 1/2)` (10), (13), (17) | [`equations::axis_distance`] |
//! | speed profile | `K = h + (1 - h) F((x' - A) / D)` (11) | [`equations::fringe_position`], [`equations::speed_profile`] |
//! | slowed rise | `w = w_p / K` (12) | [`equations::slowed_rise`] |
//! | fluttering edge | `E = A(w) + D(w) P(w - s (t - t0))` (15) | [`equations::fluttering_edge`] |
//! | across | `u' = x' / E` (16) | [`equations::across`] |
//! | texture coordinate | `u = (1 +- u') / 2` (14), (18) | [`equations::texture_u`] |
//! | the paper's texture | sum of products of cosines (20) | [`paper_texture`], [`PaperTexture`] |
//!
//! (8) and (19) do not exist in the paper.
//!
//! # Data flow
//! 1. `parameters` holds the scene's values; [`FlameSheet::new`] checks them and makes one `FlameInstance` per entry of `instances`.
//! 2. `render::curve_tables::ShapeTables` tabulates the user's curves, and `render::color_ramp::ColorRamp` sharpening and color, on first use.
//! 3. For each time sample of the exposure, `animate::clock` gives time and scroll, `animate::fluctuation` the sums of sines, and
//!    `animate::warp` the warp of the coordinates, including wind.
//! 4. `texture` gives T0 at that scroll: layers of noise (`fractal`), or the paper's sum (`paper`), filtered for the sheet's size in pixels.
//! 5. `render::projection` maps pixels to sheet coordinates for any lens; `render::curve_tables` maps those to flame coordinates.
//! 6. `render::shade` turns flame coordinates into light and opacity; `render::smoke` does so for the smoke above the flame.
//! 7. `render::draw` evaluates bands of rows and composites them into strips; `render::aovs` writes AOVs.
//! 8. `render::prepared` sorts flames, smoke and [sparks](crate::sparks) by depth; `render::emitted_light` gives point lights for other objects.

pub(crate) mod animate;
pub mod equations;
mod model;
mod parameters;
mod phenomenon;
pub(crate) mod render;
mod texture;
pub use model::FlameSheet;
pub use parameters::{
    ColorParameters, Coloring, Facing, FlameSheetParameters, Instance, LightParameters, ShapeParameters,
    SmokeParameters, Stage, TextureKind, TextureParameters,
};
pub use texture::{PaperTexture, paper_texture};

pub use crate::sparks::SparkParameters;

#[cfg(test)]
mod tests;
