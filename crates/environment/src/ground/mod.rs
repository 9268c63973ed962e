//! A horizontal ground plane: land, a plate's own ground, or a lake; lit by lamps, fires and the sky, dry or wet.
//!
//! Wet ground and lakes mirror the scene. The renderer draws a picture with a camera mirrored at the plane
//! ([`Surroundings::reflection`]); puddles show it sharply, lakes displaced by waves and blurred by those too short to
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
//! | diffuse reflection `albedo E / pi` | `shade::PreparedGround::diffuse` |
//! | albedo of wet ground | `shade::wet_albedo_factor` |
//! | Fresnel reflectance `F = F0 + (1 - F0) (1 - cos)^5`, n = 1.333 | `surface::fresnel` |
//! | microfacet reflection `F D G / (4 cos)` | `wet_reflection::Microfacets::specular_lobe` |
//! | GTR distribution D and Smith masking G | `wet_reflection::gtr3_distribution_with_masking` |
//! | deep-water waves, `omega^2 = g k` | `waves::Waves::new`, `waves::Waves::slope` |
//! | blur by unresolved slopes, `sigma = 2 s f` pixels | `lake_reflection::blurred_reflection` |
//!
//! # Data flow
//! `Surface` is the pattern of the ground, made once from [`GroundParameters`]: octaves of noise for albedo, puddles
//! and films. For a frame, `Ground::lake` makes the waves of the time and the blurred reflection, and `prepare`
//! collects them in a `PreparedGround`. `PreparedGround` intersects each pixel's line of sight with the plane, samples
//! the surface with a filter of the pixel's footprint, and adds the diffuse and the specular radiance. A ground of kind
//! `plate` only darkens the plate and adds reflections, where the plate's depth says that it is ground.

mod lake_reflection;
mod parameters;
mod shade;
mod surface;
mod waves;
mod wet_reflection;

use std::sync::Arc;

use bansho_base::{
    host::observer::{Cancelled, Observer, check},
    image::Image,
    math::{DVec2, random::Key},
    phenomenon::{
        Phenomenon, PhenomenonInfo, Prepared, Run,
        strip::{DepthInterval, Shutter, View},
        surroundings::{Backdrop, Occluder, Publication, Surroundings},
    },
};

use self::{shade::PreparedGround, surface::Surface, waves::Waves};

pub use parameters::{GroundKind, GroundParameters};

/// The ground of a scene.
pub struct Ground {
    parameters: GroundParameters,
    surface: Surface,
    key: Key,
    loop_s: Option<f64>,
}

impl Ground {
    /// The name of its layer.
    pub const NAME: &str = "ground";

    /// A ground with these parameters.
    pub fn new(parameters: GroundParameters, seed: u64, loop_s: Option<f64>) -> Self {
        let key = Key::new(seed, Self::NAME);
        Self { surface: Surface::new(&parameters, key), parameters, key, loop_s }
    }

    /// The lake, if that is what it is.
    fn lake(&self, view: &View, surroundings: &Surroundings) -> Option<LakeFrame> {
        let parameters = &self.parameters;
        let sharp = surroundings.reflection.filter(|_| parameters.kind == GroundKind::Water)?;
        let t = view.shutter.middle();
        let wind = surroundings.wind.mean(t);
        let heading = DVec2::new(wind.x, wind.z).try_normalize().unwrap_or(DVec2::X);
        let waves = Waves::new(self.key, parameters.waves, parameters.wave_length, heading, t, self.loop_s);
        Some(LakeFrame {
            waves,
            blurred_reflection: lake_reflection::blurred_reflection(sharp, 1, view, parameters.waves),
        })
    }
}

/// A lake in one frame.
struct LakeFrame {
    waves: Waves,
    /// The reflection, blurred by waves too short to be resolved.
    blurred_reflection: Image<4>,
}

impl Phenomenon for Ground {
    fn info(&self) -> PhenomenonInfo<'_> {
        let dry = self.parameters.wetness.constant() == Some(0.0) && self.parameters.kind != GroundKind::Water;
        PhenomenonInfo { mirror: (!dry).then(|| self.parameters.level()), ..PhenomenonInfo::new(Self::NAME) }
    }

    /// It only shows the light of others.
    fn luminance(&self) -> f64 {
        0.0
    }

    fn start(self: Arc<Self>) -> Box<dyn Run> {
        Box::new(self)
    }
}

impl Run for Ground {
    fn publish(&self, _shutter: Shutter) -> Publication {
        let point = bansho_base::math::DVec3::new(0.0, self.parameters.height, 0.0);
        let solid = Occluder::HalfSpace { point, normal: bansho_base::math::DVec3::Y };
        Publication { occluders: vec![solid], ..Publication::default() }
    }

    fn depth_intervals(&self, _view: &View, _surroundings: &Surroundings) -> Vec<DepthInterval> {
        vec![DepthInterval { near: 0.0, far: shade::HORIZON }]
    }

    fn prepare<'a>(
        &'a self,
        view: &'a View,
        surroundings: &'a Surroundings<'a>,
        observer: &dyn Observer,
    ) -> Result<Box<dyn Prepared + 'a>, Cancelled> {
        check(observer)?;
        let wetness = match self.parameters.kind {
            GroundKind::Water => 1.0,
            GroundKind::Land | GroundKind::Plate => self.parameters.wetness.at(view.shutter.middle()),
        };
        Ok(Box::new(PreparedGround {
            parameters: &self.parameters,
            surface: &self.surface,
            view,
            surroundings,
            wetness,
            lake: self.lake(view, surroundings),
            backdrop: surroundings.backdrop.map(|sharp| Backdrop {
                image: lake_reflection::blurred_reflection(
                    &sharp.image,
                    sharp.pixel_size,
                    view,
                    self.surface.mean_slope(),
                ),
                pixel_size: sharp.pixel_size,
            }),
        }))
    }
}

#[cfg(test)]
mod tests;
