//! Bansho's methods, each readable beside its paper: parameters as plain data, then functions that step and draw.

mod fault;
mod lanes;

pub mod field;
pub mod flame_sheet;
pub mod sph;

pub use fault::{FaultKind, ParameterFault};
