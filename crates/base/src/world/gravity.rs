//! Gravity.

/// Standard acceleration of free fall, m/s^2 (General Conference on Weights and Measures 1901), used for everything that falls or rises.
pub const STANDARD_GRAVITY: f64 = 9.806_65;
