//! Parameters of the ground.

use bansho_base::{
    parameters::{Range, animated::Animated},
    phenomenon::{LevelMirror, MirrorRoughness},
};

bansho_base::choice! {
    /// Kind of the ground.
    pub enum GroundKind {
        /// Soil, stone or asphalt.
        Land = "land",
        /// A lake.
        Water = "water",
        /// The ground of the plate: only its changes by light and wetness are drawn.
        Plate = "plate",
    }
}

bansho_base::parameters! {
    /// A horizontal ground plane that extends to the horizon, lit by lamps, fires and the sky. When wet, it is darker and mirrors them. A scene with
    /// rain only that states neither sky, ground nor light has a wet ground.
    pub struct GroundParameters {
        /// Kind of the ground.
        kind: GroundKind = GroundKind::Land;
        /// Height of the plane.
        height: f64 = 0.0, unit("m");
        /// Albedo when dry, linear sRGB.
        color: [f64; 3] = [0.13, 0.125, 0.12], limits(Range::new(0.0, 1.0));
        /// Variation of the albedo over the ground.
        texture: f64 = 0.5, limits(Range::new(0.0, 1.0));
        /// Size of the largest patches of the texture.
        texture_size: f64 = 1.6, limits(Range::new(0.01, 1000.0)), unit("m");
        /// Wetness: 0 is dry, 1 is covered by a film of water.
        wetness: Animated<f64> = Animated::from(0.0), limits(Range::new(0.0, 1.0));
        /// Fraction of wet ground that is covered by puddles.
        puddles: f64 = 0.25, limits(Range::new(0.0, 1.0));
        /// RMS slope of the film of water between puddles; it elongates the reflections of lamps.
        roughness: f64 = 0.06, limits(Range::new(0.0, 0.5));
        /// With `kind = "plate"`: maximum distance of a pixel of the plate from the ground plane, by its depth, at which it counts as ground. Larger
        /// for a plate whose depth is estimated.
        plate_tolerance: f64 = 0.02, limits(Range::new(0.0, 10.0)), unit("m");
        /// RMS slope of the waves of a lake.
        waves: f64 = 0.02, limits(Range::new(0.0, 0.3));
        /// Wavelength of the longest waves of a lake.
        wave_length: f64 = 4.0, limits(Range::new(0.05, 200.0)), unit("m");
    }
}

impl GroundParameters {
    /// The ground plane as a mirror.
    pub(super) fn mirror(&self) -> LevelMirror {
        let roughness = match self.kind {
            GroundKind::Water => MirrorRoughness::Waves(self.waves),
            // Only puddles show the scene.
            GroundKind::Land | GroundKind::Plate if self.puddles > 0.0 => MirrorRoughness::Puddles,
            GroundKind::Land | GroundKind::Plate => MirrorRoughness::Rough,
        };
        LevelMirror { height: self.height, plate_tolerance: self.plate_tolerance, roughness }
    }
}
