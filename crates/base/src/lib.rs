//! Types and functions shared by all phenomena, the renderer and the program.
//!
//! Units are SI; a unit that is not SI is part of the name. Coordinates are right-handed with y up. Times are `f64` in seconds.

pub mod camera;
pub mod color;
pub mod frame;
pub mod geometry;
pub mod host;
pub mod image;
pub mod math;
pub mod measured;
pub mod noise;
pub mod parameters;
pub mod phenomenon;
pub mod tables;
pub mod world;
