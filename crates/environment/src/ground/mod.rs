//! A horizontal ground plane: land, a plate's own ground, or a lake; lit by lamps, fires and the sky, dry or wet.
//!
//! Wet ground and lakes mirror the scene. The renderer draws a picture with a camera mirrored at the plane
//! ([`Surroundings::reflection`](bansho_base::phenomenon::surroundings::Surroundings::reflection)); puddles show it sharply, lakes displaced by waves and blurred by those too short to
//! be resolved, and rough films of water show lamps and sky through microfacets.
//!
//! # References
//! - J. Lekner and M. C. Dorf, "Why some things are darker when wet", Appl. Opt. 27 (1988).
//! - C. Schlick, "An inexpensive BRDF model for physically-based rendering" (1994): Fresnel approximation.
//! - R. L. Cook and K. E. Torrance, "A reflectance model for computer graphics" (1982).
//! - B. Burley, "Physically-based shading at Disney" (2012): GTR distribution, here with exponent 3.
//! - P. Gwosdek, S. Grewenig, A. Bruhn and J. Weickert, "Theoretical foundations of Gaussian convolution by extended
//!   box filtering" (2011).
//!
//! # Equations
//!
//! | equation | function |
//! | --- | --- |
//! | diffuse reflection `albedo E / pi` | `shade::PreparedGround::light` |
//! | albedo of wet ground | `shade::wet_albedo_factor` |
//! | Fresnel reflectance `F = F0 + (1 - F0) (1 - cos)^5`, n = 1.333 | `wet_reflection::fresnel` |
//! | microfacet reflection `F D G / (4 cos)` | `wet_reflection::Microfacets::specular_lobe` |
//! | GTR distribution D and Smith masking G | `wet_reflection::gtr3_distribution_with_masking` |
//! | deep-water waves, `omega^2 = g k` | `waves::Waves::new`, `waves::Waves::slopes` |
//! | blur by unresolved slopes, `sigma = 2 s f` pixels | `lake_reflection::blurred_reflection` |
//!
//! # Data flow
//! `Surface` is the pattern of the ground, built once from [`GroundParameters`]: octaves of noise for albedo, puddles
//! and films. For a frame, `Ground::lake` computes the waves of the time and the blurred reflection, and `prepare`
//! collects them in a `PreparedGround`. For sixteen pixels at a time, `Hits` intersects the lines of sight with the plane, `Surface::samples` samples
//! the pattern with a filter of the pixel's footprint, `PreparedGround::light` adds the diffuse and the glossy reflection of `lighting`'s lights, and
//! `draw` the picture in the mirror. Positions are relative to the camera, in single precision; its own position is exact.
//! While the camera stands still, `row_cache` keeps the pattern, and while the lights do not change either, the light. A ground of kind
//! `plate` only darkens the plate and adds reflections, where the plate's depth says that it is ground.

mod draw;
mod hits;
mod lake_reflection;
mod lighting;
mod model;
mod motion;
mod parameters;
mod phenomenon;
mod row_cache;
mod sample;
mod shade;
mod surface;
mod table;
mod waves;
mod wet_reflection;
pub use model::Ground;
pub use parameters::{GroundKind, GroundParameters};
pub(crate) use phenomenon::height_of_level_ground;

#[cfg(test)]
mod tests;
