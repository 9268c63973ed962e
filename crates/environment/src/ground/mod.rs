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
//! | deep-water waves, `omega^2 = g k` | `lake::Waves::new`, `lake::Waves::slopes` |
//! | blur by unresolved slopes, `sigma = 2 s f` pixels | `lake::blurred_reflection` |
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
mod lake;
mod lighting;
mod parameters;
mod phenomenon;
mod row_cache;
mod sample;
mod shade;
mod surface;
mod wet_reflection;

#[cfg(test)]
mod tests;

use bansho_base::{
    image::Image,
    math::{DVec2, random::Key},
    phenomenon::{
        strip::View,
        surroundings::{Reflection, Surroundings},
    },
};
use lake::{WaveParameters, Waves};
pub use parameters::{GroundKind, GroundParameters};
pub(crate) use phenomenon::height_of_level_ground;
use row_cache::GroundRowCache;
use sample::SampledImage;
use surface::Surface;

/// The ground of a scene.
pub struct Ground {
    parameters: GroundParameters,
    surface: Surface,
    key: Key,
    loop_s: Option<f64>,
    row_cache: GroundRowCache,
}

impl Ground {
    /// The name of its layer.
    pub const NAME: &str = "ground";

    /// A ground with these parameters.
    pub fn new(parameters: GroundParameters, seed: u64, loop_s: Option<f64>) -> Self {
        let key = Key::new(seed, Self::NAME);
        let surface = Surface::new(&parameters, key);
        Self { surface, parameters, key, loop_s, row_cache: GroundRowCache::default() }
    }

    /// The lake in a frame; `None` for other kinds of ground.
    fn lake<'a>(&self, view: &View, surroundings: &Surroundings<'a>) -> Option<LakeFrame<'a>> {
        let parameters = &self.parameters;
        let reflection = surroundings.reflection.filter(|_| parameters.kind == GroundKind::Water)?;
        let t = view.shutter.middle();
        // Waves that turned with a wind that changes during the shot would jump.
        let wind = surroundings.wind.planned_mean(t);
        let waves = WaveParameters {
            key: self.key,
            slope: parameters.waves,
            longest: parameters.wave_length,
            heading: DVec2::new(wind.x, wind.z).try_normalize().unwrap_or(DVec2::X),
            loop_s: self.loop_s,
        };
        let origin = DVec2::new(view.camera.position.x, view.camera.position.z);
        let blurred_reflection = lake::blurred_reflection(sampled(reflection), view, parameters.waves);
        Some(LakeFrame { waves: Waves::new(&waves, t, origin), reflection, blurred_reflection })
    }
}

/// A lake in one frame.
struct LakeFrame<'a> {
    /// The waves around the point below the camera.
    waves: Waves,
    reflection: &'a Reflection,
    /// The reflection, blurred by waves too short to be resolved, with the same pixels and rows.
    blurred_reflection: Image<4>,
}

/// The picture of a mirror for positions in pixels of the view.
fn sampled(reflection: &Reflection) -> SampledImage<'_> {
    let Reflection { image, pixel_size, first_row } = reflection;
    SampledImage { image, pixel_size: *pixel_size, first_row: *first_row }
}
