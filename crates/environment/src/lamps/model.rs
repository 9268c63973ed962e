//! The lamps of a scene.

use bansho_base::phenomenon::surroundings::Light;

/// The visible lights of a scene at any time.
pub struct Lamps {
    pub(super) at: Box<dyn Fn(f64) -> Vec<Lamp> + Send + Sync>,
}

/// A light, and the luminous sphere as which it is visible.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lamp {
    /// The light.
    pub light: Light,
    /// Radius of the sphere, m.
    pub radius: f64,
}

impl Lamps {
    /// The name of their layer.
    pub const NAME: &str = "lamps";

    /// The lamps that `at` returns for a time in seconds.
    pub fn new(at: impl Fn(f64) -> Vec<Lamp> + Send + Sync + 'static) -> Self {
        Self { at: Box::new(at) }
    }
}
