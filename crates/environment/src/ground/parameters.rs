//! What a scene may say of its ground.

use bansho_base::{
    parameters::{Range, animated::Animated},
    phenomenon::LevelMirror,
};

bansho_base::choice! {
    /// What the ground is.
    pub enum GroundKind {
        /// Soil, stone or asphalt.
        Land = "land",
        /// A lake.
        Water = "water",
        /// The ground of the plate: only what light and wetness change of it is drawn.
        Plate = "plate",
    }
}

bansho_base::parameters! {
    /// A level ground to the horizon, lit by lamps, fires and sky; wet, it darkens and mirrors them. A scene of rain alone that states neither sky,
    /// ground nor light has a wet one.
    pub struct GroundParameters {
        /// What the ground is.
        kind: GroundKind = GroundKind::Land;
        /// How high it lies.
        height: f64 = 0.0, unit("m");
        /// Share of light that it throws back when dry, linear sRGB.
        color: [f64; 3] = [0.13, 0.125, 0.12], limits(Range::new(0.0, 1.0));
        /// How much it varies from place to place.
        texture: f64 = 0.5, limits(Range::new(0.0, 1.0));
        /// Size of its largest patches.
        texture_size: f64 = 1.6, limits(Range::new(0.01, 1000.0)), unit("m");
        /// How wet it is: 0 dry, 1 covered by a film of water.
        wetness: Animated<f64> = Animated::from(0.0), limits(Range::new(0.0, 1.0));
        /// Share of wet ground that is covered by puddles.
        puddles: f64 = 0.25, limits(Range::new(0.0, 1.0));
        /// R.m.s. slope of the film of water between puddles: it draws lamps out into streaks.
        roughness: f64 = 0.06, limits(Range::new(0.0, 0.5));
        /// How far above or below the ground, by its depth, what a plate shows still is ground; for `kind = "plate"`. More for a plate whose
        /// depth is only a guess.
        plate_tolerance: f64 = 0.02, limits(Range::new(0.0, 10.0)), unit("m");
        /// R.m.s. slope of the waves of a lake.
        waves: f64 = 0.02, limits(Range::new(0.0, 0.3));
        /// Longest waves of a lake.
        wave_length: f64 = 4.0, limits(Range::new(0.05, 200.0)), unit("m");
    }
}

impl GroundParameters {
    /// The ground plane as a mirror.
    pub(super) fn mirror(&self) -> LevelMirror {
        LevelMirror { height: self.height, plate_tolerance: self.plate_tolerance }
    }
}
