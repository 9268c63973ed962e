//! What a scene says of how an aurora is drawn.

use std::sync::OnceLock;

use bansho_base::{
    host::once::get_or_make,
    parameters::{Auto, Range},
};

use super::SpectrumShape;
use crate::{
    physics::{atmosphere::atmosphere, emission::Emission, precipitation::Spectrum},
    render::extinction::Extinction,
};

bansho_base::choice! {
    /// How the falls of the electrons become light.
    pub enum Sampling {
        /// By the mean of infinitely many falls: no noise.
        Profile = "profile",
        /// By single collisions, as in the thesis (2.4).
        CollisionRenderer = "collisions",
    }
}

bansho_base::choice! {
    /// What stops the electrons and what shines where they are stopped.
    pub enum TrackModel {
        /// Air as it is measured: heights after Fang et al. (2010), colours and brightness as observed.
        Fang = "fang",
        /// Hard spheres, as in the thesis (2.4): one radius for all energies, and green light only above 190 km.
        HardSphereAtmosphere = "hard_sphere",
    }
}

impl TrackModel {
    /// The light that it gives for a spectrum.
    #[must_use]
    pub fn emission(self, spectrum: Spectrum) -> Emission {
        match self {
            Self::Fang => Emission::new(atmosphere(), spectrum),
            Self::HardSphereAtmosphere => Emission::of_hard_spheres(atmosphere(), spectrum),
        }
    }

    /// The same for a spectrum that a scene may state, made once for all auroras.
    pub(crate) fn shared_emission(self, shape: SpectrumShape) -> &'static Emission {
        static KNOWN: [OnceLock<Emission>; TrackModel::CHOICES.len() * SpectrumShape::CHOICES.len()] =
            [const { OnceLock::new() }; TrackModel::CHOICES.len() * SpectrumShape::CHOICES.len()];
        let index = self as usize * SpectrumShape::CHOICES.len() + shape as usize;
        get_or_make(&KNOWN[index], || self.emission(shape.spectrum()))
    }
}

bansho_base::choice! {
    /// How single collisions are smoothed to light.
    pub enum Blur {
        /// On the sky, across the field, as far as `spread_km` says: a near ray is wider than a far one.
        Kilometres = "km",
        /// In the picture, by `blur_radii`, wherever they are, as in the thesis (2.28).
        Pixels = "pixels",
    }
}

bansho_base::parameters! {
    /// Radii (standard deviations) of the thesis's blur, eq. (2.28), which depend on the line alone; it does not say how large they are.
    pub struct BlurParameters {
        /// Of the green line of oxygen, 557.7 nm.
        green_px: f64 = 1.5, limits(Range::new(0.0, 100.0)), unit("pixels");
        /// Of its red lines, 630.0 and 636.4 nm.
        red_px: f64 = 4.0, limits(Range::new(0.0, 100.0)), unit("pixels");
        /// Of the bands of N2+, 391.4 to 470.9 nm.
        violet_px: f64 = 1.0, limits(Range::new(0.0, 100.0)), unit("pixels");
        /// Of the bands of N2, 670.5 nm among them.
        deep_red_px: f64 = 1.0, limits(Range::new(0.0, 100.0)), unit("pixels");
    }
}

/// Most that a collision may turn an electron. Collisions are spread about their line by a few far steps from high up, the mean light by a patch
/// that is as wide; where either is wider than a few km, pictures of both are no longer alike.
pub(super) const MOST_WOBBLE: f64 = 0.05;

bansho_base::parameters! {
    /// How the light of an aurora is drawn.
    pub struct DrawingParameters {
        /// By the mean fall, or by collisions.
        sampling: Sampling = Sampling::Profile;
        /// What stops the electrons: measured air, or the thesis's hard spheres.
        fall: TrackModel = TrackModel::Fang;
        /// Where light is smoothed: on the sky in km, or in the picture in pixels.
        blur: Blur = Blur::Kilometres;
        /// Radii of the blur in pixels.
        blur_radii: BlurParameters = BlurParameters::default();
        /// How far the light of a particle spreads across the field (standard deviation); `"auto"` is as far as its neighbours are, and rays stay sharp.
        spread_km: Auto<f64> = Auto::Auto, limits(Range::new(0.005, 100.0)), unit("km");
        /// How far a collision turns an electron from the field: rms tangent of the angle, the vector omega of (2.21) and (2.24).
        wobble: f64 = 0.002, limits(Range::new(0.0, MOST_WOBBLE));
        /// The air below, which dims what is low in the sky.
        air: Extinction = Extinction::default();
    }
}
