//! Fog: a uniform medium that is everywhere above the ground. It dims what is behind it, and scatters the light of sky, lamps and fires toward the camera.
//!
//! # References
//! - H. Koschmieder, "Theorie der horizontalen Sichtweite" (1924): visibility and airlight.
//! - B. Sun, R. Ramamoorthi, S. G. Narasimhan and S. K. Nayar, "A practical analytic single scattering model for real time rendering" (2005): the light of a point
//!   source along a line of sight, as an integral over the angle at the source.
//! - S. G. Narasimhan and S. K. Nayar, "Shedding light on the weather" (2003): the asymmetry of the phase function of fog.
//! - L. G. Henyey and J. L. Greenstein, "Diffuse radiation in the galaxy" (1941): the phase function.
//!
//! # Equations
//!
//! | equation | function |
//! | --- | --- |
//! | extinction `beta = -ln 0.02 / V = 3.912 / V` | `scattering::extinction` |
//! | transmittance `exp(-beta s)` | `render::PreparedFog::layer` |
//! | airlight `L (1 - exp(-beta s))`, with the radiance L of the sky at the horizon or above | `render::PreparedFog::add_airlight` |
//! | phase function `(1 - g^2) / (4 pi (1 + g^2 - 2 g cos a)^1.5)` | `scattering::phase_function` |
//! | light of a source: integral of `beta p E exp(-beta (s + r)) ds`, by the angle at the source | `light_in_fog::LightInFog::add` |
//!
//! # Data flow
//! The table `[fog]` publishes its extinction, by which solids receive less light from far lamps. [`Fog`] fills all depths. In each slice, a pixel of
//! `render::PreparedFog` has the transmittance and the light of the part of its line of sight that is within the slice and ends at the plate, at a solid or at the
//! ground. `row_cache` keeps them while neither the camera nor the light changes. There is single scattering of lamps and fires without shadows; of the sky,
//! Koschmieder's airlight includes multiple scattering. A plate without depth is infinitely far away.

mod light_in_fog;
mod phenomenon;
mod render;
mod row_cache;
mod scattering;

pub use phenomenon::{Fog, FogParameters};

#[cfg(test)]
mod tests;
