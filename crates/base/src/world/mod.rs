//! What all phenomena of a scene share: air, gravity, wind, sky and occluders.

pub mod air;
pub mod gravity;
pub mod occluder;
pub mod sky;
pub mod wind;
