//! Bansho's vocabulary: what every phenomenon, the renderer and the program share.
//!
//! SI units inside; a unit stands in the name where it is not SI. Right-handed, y up. Time is `f64` seconds.

pub mod camera;
pub mod color;
pub mod geometry;
pub mod host;
pub mod image;
pub mod math;
pub mod noise;
pub mod parameters;
pub mod phenomenon;
pub mod world;
