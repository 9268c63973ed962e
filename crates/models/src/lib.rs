//! Bansho's methods, each readable beside its paper: parameters as plain data, then functions that step and draw.

mod fault;

pub mod flame_sheet;
pub mod rain;

pub use fault::{FaultKind, ParameterFault};
