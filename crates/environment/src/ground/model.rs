//! The ground: the pattern that is built once from its parameters.

use bansho_base::{
    image::Image,
    math::{DVec2, random::Key},
    phenomenon::{
        strip::View,
        surroundings::{Reflection, Surroundings},
    },
};

use super::{
    GroundKind, GroundParameters, lake_reflection,
    row_cache::GroundRowCache,
    sample::SampledImage,
    surface::Surface,
    waves::{WaveParameters, Waves},
};

/// The ground of a scene.
pub struct Ground {
    pub(super) parameters: GroundParameters,
    pub(super) surface: Surface,
    pub(super) key: Key,
    pub(super) loop_s: Option<f64>,
    pub(super) known_rows: GroundRowCache,
}

impl Ground {
    /// The name of its layer.
    pub const NAME: &str = "ground";

    /// A ground with these parameters.
    pub fn new(parameters: GroundParameters, seed: u64, loop_s: Option<f64>) -> Self {
        let key = Key::new(seed, Self::NAME);
        let surface = Surface::new(&parameters, key);
        Self { surface, parameters, key, loop_s, known_rows: GroundRowCache::default() }
    }

    /// The lake in a frame; `None` for other kinds of ground.
    pub(super) fn lake<'a>(&self, view: &View, surroundings: &Surroundings<'a>) -> Option<LakeFrame<'a>> {
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
        let blurred_reflection = lake_reflection::blurred_reflection(sampled(reflection), view, parameters.waves);
        Some(LakeFrame { waves: Waves::new(&waves, t, origin), reflection, blurred_reflection })
    }
}

/// A lake in one frame.
pub(super) struct LakeFrame<'a> {
    /// The waves around the point below the camera.
    pub(super) waves: Waves,
    pub(super) reflection: &'a Reflection,
    /// The reflection, blurred by waves too short to be resolved, with the same pixels and rows.
    pub(super) blurred_reflection: Image<4>,
}

/// The picture of a mirror for positions in pixels of the view.
pub(super) fn sampled(reflection: &Reflection) -> SampledImage<'_> {
    let Reflection { image, pixel_size, first_row } = reflection;
    SampledImage { image, pixel_size: *pixel_size, first_row: *first_row }
}
