//! The pull of the Earth.

/// Standard acceleration of free fall, m/s^2 (General Conference on Weights and Measures 1901). Whatever falls or rises uses this one.
pub const STANDARD_GRAVITY: f64 = 9.806_65;
