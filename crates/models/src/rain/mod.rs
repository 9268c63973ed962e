//! Rain: calibrated streaks from the physics of its drops.
//!
//! Y. Yoshida, Y. Dobashi and T. Yamamoto, "A fast rendering method of raindrop streaks for rainy scenes". How many drops of which
//! size a rain rate has ([`distribution`]), how fast they fall ([`velocity`]), what a streak hides while the shutter is open
//! ([`streak`]), all drops of a size in one picture ([`texture`]), what all drops together take from a distant light
//! ([`extinction`]), and how a drop sends light on ([`lens`]).

pub mod distribution;
pub mod extinction;
pub mod lens;
pub mod streak;
pub mod texture;
pub mod velocity;

mod aovs;
mod bands;
mod billboards;
mod cell;
mod drops;
mod flights;
mod gust;
mod lattice;
mod light;
mod moment;
mod parameters;
mod part;
mod patch;
mod phenomenon;
mod prepared;
mod sight;
mod singles;
mod sky;
mod splashes;
mod stroke;
mod tiles;
mod veil;

pub use parameters::{Method, RainParameters, SplashParameters};
pub use phenomenon::Rain;

#[cfg(test)]
mod reference;

#[cfg(test)]
mod tests;
