//! Rain: calibrated streaks from the physics of its drops.
//!
//! Y. Yoshida, Y. Dobashi and T. Yamamoto, "A fast rendering method of raindrop streaks for rainy scenes". How many drops of which
//! size a rain rate has ([`drops::size_distribution`]), how fast they fall ([`drops::terminal_velocity`]), what a streak hides while the shutter is open
//! ([`streaks::coverage`]), all drops of a size in one picture ([`billboards::texture`]), what all drops together take from a distant light
//! ([`lighting::extinction`]), and how a drop sends light on ([`lighting::drop_phase_function`]).

pub mod billboards;
pub mod drops;
pub(crate) mod lanes;
pub mod lighting;
mod parameters;
mod phenomenon;
pub(crate) mod render;
pub(crate) mod shutter_cameras;
pub mod streaks;

pub use parameters::{Method, RainParameters, SplashParameters};
pub use phenomenon::Rain;

#[cfg(test)]
mod tests;
