//! Flame sheet: a small, near flame (candle, torch, hearth, campfire) as a scrolling texture on an upright rectangle.
//!
//! # Model
//! A monochrome texture scrolls upward on a rectangle. A threshold that increases with height is subtracted from it; the rest is sharpened and colored. The
//! coordinates of the rectangle are warped so that the gas accelerates and its edges flutter. Nothing is simulated: every frame is a closed-form
//! function of time. Lengths are in meters, speeds of the texture in sheet heights per second, luminance in cd/m^2.
//!
//! # References
//! - T. Ohshima and S. Itahashi, "Easy representation of flame by using 2-dimensional texture" (in Japanese). Equation numbers are theirs.
//! - K. Perlin, "An image synthesizer" (1985) and "Improving noise" (2002): the gradient noise of the default texture.
//!
//! # Equations
//! | equation | what it says | function |
//! |---|---|---|
//! | (1) | `(p, q) = (u, w - s (t - t0))`: the texture scrolls upward | `animate::clock::Clock::scroll` |
//! | (2) | `T0 = T(u, w - s (t - t0))`, in [0, 1]: value of the texture | `texture::FlameTexture::sample` |
//! | (4) | `L = 1 - (1 - V(w)) (1 - H(u))`: threshold | [`equations::threshold`] |
//! | (5) | `T1 = max(0, T0 - L)`: excess over the threshold | [`equations::above_threshold`] |
//! | (6) | `T2 = C(T1)`: sharpen | `tables::color_ramp::ColorRamp::new` |
//! | (7) | `(r, g, b) = (R, G, B)(T2)`: color | `tables::color_ramp::unscaled_color` |
//! | (9) | `w_p = (1 - k) sqrt(y) + k y`: rise | [`equations::rise`] |
//! | (10) | `x' = 2 abs(x - 1/2)`: distance from the axis | [`equations::axis_distance`] |
//! | (11) | `K = h + (1 - h) F((x' - A) / D)`: speed profile | [`equations::fringe_position`], [`equations::speed_profile`] |
//! | (12) | `w = w_p / K`: slowed rise | [`equations::slowed_rise`] |
//! | (13) | `x' = 2 x - 1`: (10), right of the axis | [`equations::axis_distance`] |
//! | (14) | `u = (1 + u') / 2`: right of the axis | [`equations::texture_u`] |
//! | (15) | `E = A(w) + D(w) P(w - s (t - t0))`: fluttering edge | [`equations::fluttering_edge`] |
//! | (16) | `u' = x' / E` for `x' < E`: across the flame | [`equations::across`] |
//! | (17) | `x' = 1 - 2 x`: (10), left of the axis | [`equations::axis_distance`] |
//! | (18) | `u = (1 - u') / 2`: left of the axis | [`equations::texture_u`] |
//! | (20) | sum of products of cosines: the texture of the paper | [`paper_texture`], [`PaperTexture`] |
//!
//! (3) states bounds that follow from (1). The paper has no (8) and no (19).
//!
//! # Data flow
//! 1. `parameters` holds the scene's values; [`FlameSheet::new`] checks them and makes one `FlameInstance` per entry of `instances`.
//! 2. `tables::shape_tables::ShapeTables` tabulates the user's curves, and `tables::color_ramp::ColorRamp` sharpening and color, on first use.
//! 3. For each time sample of the exposure, `animate::clock` gives time and scroll, `animate::fluctuation` the sums of sines, and
//!    `animate::warp` the warp of the coordinates, including wind.
//!    `eddies` displaces coordinates to where the gas has come from.
//! 4. `texture` gives T0 at that scroll: layers of noise (`fractal`), or the paper's sum (`paper`), filtered for the sheet's size in pixels.
//! 5. `render::time_samples` gives the sheet's quad and state at each of them. `render::projection` maps pixels to sheet coordinates for any
//!    lens; `tables::shape_tables` maps those to flame coordinates.
//! 6. `render::shade` turns them into light and opacity; `render::smoke` prepares the second sheet, the smoke above the flame.
//! 7. `render::draw` evaluates bands of rows and composites them into strips; `render::aovs` writes AOVs. Sheets that are small in the picture are shaded in
//!    cells, whose light is averaged over pixels (`render::cells`).
//! 8. Where the scene selects it, `soot_field` replaces 4 to 7: flame and smoke as one plume of soot that a fractal field displaces.
//! 9. `render::prepared` sorts flames, smoke and [sparks](crate::sparks) by depth; `render::emitted_light` gives point lights for other objects.

pub(crate) mod animate;
pub(crate) mod eddies;
pub mod equations;
mod model;
mod paper_settings;
mod parameters;
mod phenomenon;
pub(crate) mod render;
mod soot_field;
mod tables;
mod texture;
pub use model::FlameSheet;
pub use parameters::{
    ColorParameters, Coloring, Facing, FlameLightParameters, FlameSheetParameters, InstanceParameters, SheetMethod,
    SheetShapeParameters, SheetStage, SmokeParameters, SootFieldParameters, TextureKind, TextureParameters,
};
pub use texture::{PaperTexture, paper_texture};

pub use crate::sparks::SparkParameters;

#[cfg(test)]
mod tests;
