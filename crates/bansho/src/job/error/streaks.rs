//! Parameters of streak textures that are out of range.

use bansho_base::host::plural::counted;
use bansho_rain::{billboards::texture::StreakTextureError, drops::terminal_velocity::NoTerminalVelocity};

/// A parameter that is a list of numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum StreakList {
    /// Rain rates.
    #[error("rain rates")]
    RainRates,
    /// Drop diameters.
    #[error("drop diameters")]
    DropDiameters,
}

impl StreakList {
    /// Smallest and largest value allowed.
    pub(crate) fn limits(self) -> [f64; 2] {
        match self {
            Self::RainRates => [0.0, 500.0],
            Self::DropDiameters => [0.05, 8.0],
        }
    }

    fn unit(self) -> &'static str {
        match self {
            Self::RainRates => "mm/h",
            Self::DropDiameters => "mm",
        }
    }
}

/// Maximum mean number of drops in a texture, since the index lists each.
pub(crate) const MAX_DROPS: u32 = 1_000_000;

/// Why streak textures cannot be made with these parameters.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StreaksError {
    /// A list without values.
    #[error("{0}: the list is empty")]
    EmptyList(StreakList),
    /// A rate or diameter that does not occur in rain.
    #[error("{list}: value {number} is {value}; allowed: {} to {} {}", list.limits()[0], list.limits()[1], list.unit())]
    ValueOutOfRange {
        /// The list.
        list: StreakList,
        /// Which value, counted from 1.
        number: usize,
        /// The value.
        value: f64,
    },
    /// A list that does not ascend.
    #[error("{list}: value {number} is {value} after {previous}; the list must ascend")]
    NotAscending {
        /// The list.
        list: StreakList,
        /// Which value, counted from 1.
        number: usize,
        /// The value.
        value: f64,
        /// The value before it.
        previous: f64,
    },
    /// The exposure time is out of range.
    #[error("an exposure of {0} s; allowed: 0.000001 to 10 s")]
    Exposure(f64),
    /// The size of the textures is out of range.
    #[error("textures of {} a side; allowed: 8 to 4096", counted(*.0, "pixel"))]
    TextureSize(usize),
    /// The edge of the cube is out of range.
    #[error("a cube of {0} m; allowed: 0.001 to 100 m")]
    CubeSize(f64),
    /// The number of variants is out of range.
    #[error("{0} variants; allowed: 1 to 1000")]
    Variants(u32),
    /// The vector toward the light is zero.
    #[error("the light direction is the zero vector; allowed: a vector with at least one nonzero component")]
    LightDirection,
    /// The amplitude of the oscillation is out of range.
    #[error("an oscillation of {0}; allowed: 0 to 1")]
    Oscillation(f64),
    /// Oscillating drops without a light.
    #[error("oscillation changes only lit textures, and no light direction is set; allowed: with a light direction")]
    OscillationWithoutLight,
    /// Oscillating drops of the paper's opacity.
    #[error(
        "the paper's streaks are lines of even brightness and do not oscillate; allowed: the opacity exposure_fraction"
    )]
    OscillationOfLines,
    /// More drops than the index can list.
    #[error(
        "a texture at {rate} mm/h and {diameter_mm} mm would hold {drops:.0} drops; allowed: up to {MAX_DROPS}, so choose a smaller cube"
    )]
    TooManyDrops {
        /// Rain rate, mm/h.
        rate: f64,
        /// Diameter, mm.
        diameter_mm: f64,
        /// Mean number of drops.
        drops: f64,
    },
    /// A drop or a bin for which no texture can be drawn.
    #[error(transparent)]
    Texture(#[from] StreakTextureError),
    /// The paper's formula has no velocity for a diameter.
    #[error("{0}; the measured velocities (gunn_kinzer) cover all diameters")]
    Velocity(NoTerminalVelocity),
}
