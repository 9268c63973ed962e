//! Particles and radii with which nothing can be computed.

use std::fmt;

/// An array of [`Particles`](crate::Particles).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ParticleArray {
    /// Positions along an axis, counted from 0.
    Position(usize),
    /// Velocities along an axis, counted from 0.
    Velocity(usize),
    /// Masses.
    Mass,
}

impl fmt::Display for ParticleArray {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Position(axis) => write!(f, "positions[{axis}]"),
            Self::Velocity(axis) => write!(f, "velocities[{axis}]"),
            Self::Mass => f.write_str("masses"),
        }
    }
}

/// Why sums over neighbors cannot be computed.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SphError {
    /// The support radius is not finite, or not above 0.
    #[error("a support radius of {value}; allowed: a finite number above 0")]
    SupportRadius {
        /// The radius.
        value: f32,
    },
    /// An array has not one value per id.
    #[error("`{array}` has {found} values for {expected} ids; allowed: one for each")]
    Length {
        /// The array.
        array: ParticleArray,
        /// Number of ids.
        expected: usize,
        /// Number of values.
        found: usize,
    },
    /// A value is not finite, or a mass is not above 0.
    #[error("`{array}` has the value {value} at index {index}; allowed: {}", if *array == ParticleArray::Mass { "finite numbers above 0" } else { "finite numbers" })]
    Value {
        /// The array.
        array: ParticleArray,
        /// Index of the value.
        index: usize,
        /// The value.
        value: f32,
    },
}
