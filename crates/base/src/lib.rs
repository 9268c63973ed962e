//! Bansho's vocabulary: what every phenomenon, the renderer and the program share.
//!
//! SI units inside; a unit stands in the name where it is not SI. Right-handed, y up. Time is `f64` seconds.

pub mod air;
pub mod animation;
pub mod assets;
pub mod camera;
pub mod canvas;
pub mod color;
pub mod curve;
pub mod distance_field;
pub mod drawing;
pub mod gravity;
pub mod image;
pub mod math;
pub mod memory;
pub mod mesh;
pub mod noise;
pub mod observer;
pub mod occluder;
pub mod once;
pub mod parameters;
pub mod phenomenon;
pub mod placement;
pub mod plural;
pub mod point_cloud;
pub mod printable;
pub mod random;
pub mod sky;
pub mod spares;
pub mod surroundings;
pub mod wind;
