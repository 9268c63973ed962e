//! Bansho's vocabulary: what every phenomenon, the renderer and the program share.
//!
//! SI units inside; a unit stands in the name where it is not SI. Right-handed, y up. Time is `f64` seconds.

pub mod animation;
pub mod assets;
pub mod camera;
pub mod canvas;
pub mod color;
pub mod curve;
pub mod drawing;
pub mod image;
pub mod math;
pub mod noise;
pub mod observer;
pub mod parameters;
pub mod phenomenon;
pub mod random;
pub mod sky;
pub mod surroundings;
pub mod wind;
