//! Bansho's methods, each readable beside its paper: parameters as plain data, then functions that step and draw.

mod blue_flame;
mod fault;

pub mod flame_particles;
pub mod flame_sheet;
pub mod sparks;

pub use fault::{FaultKind, ParameterFault};
