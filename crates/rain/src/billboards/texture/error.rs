//! Inputs of streak textures that are out of range.

use std::fmt;

/// A quantity that a streak texture is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum StreakQuantity {
    /// Edge of the cube.
    Edge,
    /// Pixels on a side of the texture.
    Size,
    /// Duration of the exposure.
    Exposure,
    /// Mean number of drops of a bin in the cube, which grows with the rain rate and the cube.
    MeanDropCount,
    /// Diameter of a drop or of a bin.
    DiameterMm,
    /// Speed of a drop.
    Speed,
    /// Coordinate of a drop.
    Position,
    /// Amplitude of the oscillation of drops.
    Oscillation,
}

impl StreakQuantity {
    /// The smallest and the largest value that is allowed.
    #[must_use]
    pub const fn limits(self) -> [f64; 2] {
        match self {
            Self::Edge => [1e-3, 100.0],
            Self::Size => [1.0, 4096.0],
            Self::Exposure => [1e-6, 10.0],
            Self::MeanDropCount => [0.0, 1e6],
            Self::DiameterMm => [1e-6, 40.0],
            Self::Speed => [0.0, 1000.0],
            Self::Position => [-1000.0, 1000.0],
            Self::Oscillation => [0.0, 1.0],
        }
    }

    /// Its unit; empty for a number.
    #[must_use]
    pub const fn unit(self) -> &'static str {
        match self {
            Self::Edge | Self::Position => "m",
            Self::Size => "pixels",
            Self::Exposure => "s",
            Self::DiameterMm => "mm",
            Self::Speed => "m/s",
            Self::MeanDropCount | Self::Oscillation => "",
        }
    }

    /// Checks a value; NaN is out of range.
    pub(super) fn check(self, value: f64) -> Result<(), StreakTextureError> {
        let [min, max] = self.limits();
        if (min..=max).contains(&value) {
            return Ok(());
        }
        Err(StreakTextureError::OutOfRange { quantity: self, value })
    }
}

impl fmt::Display for StreakQuantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Edge => "edge of the cube",
            Self::Size => "size of the texture",
            Self::Exposure => "exposure",
            Self::MeanDropCount => "mean number of drops",
            Self::DiameterMm => "diameter",
            Self::Speed => "speed of a drop",
            Self::Position => "position of a drop",
            Self::Oscillation => "amplitude of the oscillation",
        })
    }
}

/// Why a streak texture cannot be drawn.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StreakTextureError {
    /// A quantity is out of range, or not a number.
    #[error("{quantity}: {value} {}; allowed: {} to {}", .quantity.unit(), .quantity.limits()[0], .quantity.limits()[1])]
    OutOfRange {
        /// The quantity.
        quantity: StreakQuantity,
        /// Its value.
        value: f64,
    },
    /// The diameters of a bin do not ascend.
    #[error("a bin of diameters from {} to {} mm; allowed: ascending limits", .range_mm[0], .range_mm[1])]
    BinRange {
        /// Its ends, mm.
        range_mm: [f64; 2],
    },
    /// A texture that is drawn over has another size than the cube.
    #[error("a texture of {width} x {height} pixels; allowed: {size} x {size}, as set for the cube")]
    ImageSize {
        /// Columns of the texture.
        width: usize,
        /// Rows of the texture.
        height: usize,
        /// Size of the cube's textures.
        size: usize,
    },
    /// The vector toward the light has no direction.
    #[error("the light direction is the zero vector; allowed: a vector with at least one nonzero component")]
    LightDirection,
}
