//! Bansho's methods, each readable beside its paper: parameters as plain data, then functions that step and draw.

mod blue_flame;
mod directions;
mod fault;
mod lanes;

pub mod aurora;
pub mod field;
pub mod flame_particles;
pub mod flame_sheet;
pub mod ground;
pub mod lamps;
pub mod rain;
pub mod sky;
pub mod sparks;
pub mod sph;

pub use fault::{FaultKind, ParameterFault};
