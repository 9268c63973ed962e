//! The ground: the pattern that is built once from its parameters.

use bansho_base::{
    image::Image,
    math::{DVec2, random::Key},
    phenomenon::{strip::View, surroundings::Surroundings},
};

use super::{GroundKind, GroundParameters, lake_reflection, surface::Surface, waves::Waves};

/// The ground of a scene.
pub struct Ground {
    pub(super) parameters: GroundParameters,
    pub(super) surface: Surface,
    pub(super) key: Key,
    pub(super) loop_s: Option<f64>,
}

impl Ground {
    /// The name of its layer.
    pub const NAME: &str = "ground";

    /// A ground with these parameters.
    pub fn new(parameters: GroundParameters, seed: u64, loop_s: Option<f64>) -> Self {
        let key = Key::new(seed, Self::NAME);
        Self { surface: Surface::new(&parameters, key), parameters, key, loop_s }
    }

    /// The lake in a frame; `None` for other kinds of ground.
    pub(super) fn lake(&self, view: &View, surroundings: &Surroundings) -> Option<LakeFrame> {
        let parameters = &self.parameters;
        let reflection = surroundings.reflection.filter(|_| parameters.kind == GroundKind::Water)?;
        let t = view.shutter.middle();
        // Waves that turned with a wind that changes during the shot would jump.
        let wind = surroundings.wind.planned_mean(t);
        let heading = DVec2::new(wind.x, wind.z).try_normalize().unwrap_or(DVec2::X);
        let waves = Waves::new(self.key, parameters.waves, parameters.wave_length, heading, t, self.loop_s);
        Some(LakeFrame {
            waves,
            blurred_reflection: lake_reflection::blurred_reflection(reflection, 1, view, parameters.waves),
        })
    }
}

/// A lake in one frame.
pub(super) struct LakeFrame {
    pub(super) waves: Waves,
    /// The reflection, blurred by waves too short to be resolved.
    pub(super) blurred_reflection: Image<4>,
}
