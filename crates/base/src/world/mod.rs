//! The environment shared by all phenomena of a scene: air, gravity, wind, sky and solids.

pub mod air;
pub mod gravity;
pub mod occluder;
pub mod shadow;
pub mod sky;
pub mod wind;
