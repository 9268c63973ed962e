//! The lamps of a scene.

use bansho_base::phenomenon::surroundings::Light;

/// The visible lights of a scene at any time.
pub struct Lamps {
    pub(super) at: Box<dyn Fn(f64) -> Vec<Lamp> + Send + Sync>,
}

/// A light and the ball that it is seen as.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lamp {
    /// The light.
    pub light: Light,
    /// Radius of the ball, m.
    pub radius: f64,
}

impl Lamps {
    /// The name of their layer.
    pub const NAME: &str = "lamps";

    /// Lamps that `at` gives for a time in seconds.
    pub fn new(at: impl Fn(f64) -> Vec<Lamp> + Send + Sync + 'static) -> Self {
        Self { at: Box::new(at) }
    }
}
