//! The physics of auroral light: the atmosphere, where electrons spend their energy, and what the struck atoms emit.

pub mod atmosphere;
pub mod calibration;
pub mod emission;
pub mod extinction;
pub mod precipitation;
