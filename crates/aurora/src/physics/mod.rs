//! The physics of auroral light: the atmosphere, the altitudes at which electrons lose their energy, and the light of the atoms and molecules that they excite.

pub mod atmosphere;
pub mod calibration;
pub mod emission;
pub mod extinction;
pub mod precipitation;
