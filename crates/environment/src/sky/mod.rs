//! The sky as a background, where there is no plate or one with alpha: by day, at twilight or at night, with a skyline of hills and
//! trees.
//!
//! The radiance model itself is [`Sky`](bansho_base::world::sky::Sky), since it also lights other things; this module draws it. By night it adds
//! stars and the Milky Way.
//!
//! # References
//! - Allen's Astrophysical Quantities, 4th edition (2000): numbers of stars by magnitude.
//! - A. F. J. Moffat, Astron. Astrophys. 3 (1969): point spread function of a star's image.
//!
//! # Equations
//!
//! | equation | function |
//! | --- | --- |
//! | radiance by day, by elevation | [`Sky::radiance_at_elevations`](bansho_base::world::sky::Sky::radiance_at_elevations) |
//! | radiance by night: the azimuth-independent radiance of an almucantar, twilight glow and Milky Way | `night::NightSky::radiance` |
//! | number of stars brighter than a magnitude | `stars::log_count`, `stars::magnitude_of_rank` |
//! | illuminance of a star, `2.54e-6 lux * 10^(-0.4 m)` | `stars::star` |
//! | Moffat's point spread function, `(1 + (r / core)^2)^-5/2` | `stars::StarImage::psf_row` |
//!
//! # Data flow
//! [`SkyBackdrop`] generates stars and skyline once. For a frame, `night::NightSky` tabulates the night by elevation, and
//! `stars` projects the visible stars into images; both are kept in a `row_cache::SkyCache` for following frames with
//! the same camera and sky. `PreparedSky` draws rows of sixteen pixels at a time, averaged over the cameras of the
//! exposure: first the hills of `skyline` at their distance, then the sky behind everything else, with the stars added
//! where nothing hides it.

mod model;
pub(crate) mod night;
mod parameters;
mod phenomenon;
mod render;
mod row_cache;
mod skyline;
mod stars;
mod table;

pub use model::SkyBackdrop;
pub use parameters::{NightParameters, SkyParameters};

#[cfg(test)]
mod tests;
