//! Bansho's methods, each readable beside its paper: parameters as plain data, then functions that step and draw.

mod fault;

pub mod aurora;
pub mod flame_sheet;
pub mod ground;
pub mod lamps;
pub mod sky;

pub use fault::{FaultKind, ParameterFault};
