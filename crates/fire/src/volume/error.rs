//! Errors in combinations of a volume flame's parameters that are each within their bounds.

use bansho_base::host::assets::AssetError;

use crate::particles::ParticleErrorKind;

/// A parameter, or a combination of parameters, that no volume flame can be built from.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{key}: {kind}")]
pub struct VolumeError {
    /// Key of the parameter, with list indices and sub-tables separated by dots, as in `burners.0.file`.
    pub key: String,
    /// What is wrong.
    pub kind: VolumeErrorKind,
}

/// What is wrong with parameters that are each within their bounds.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum VolumeErrorKind {
    /// A burner is outside the domain.
    #[error("the burner is at {position:.3?} m, beyond `{corner}` {limit:.3?} m")]
    OutsideDomain {
        /// Corner of its bounding box.
        position: [f64; 3],
        /// Key of the corner of the domain that it is beyond.
        corner: &'static str,
        /// Coordinates of that corner.
        limit: [f64; 3],
    },
    /// A coordinate of the domain's minimum corner is not below that of the maximum corner.
    #[error("the domain from {min:.3?} to {max:.3?} m is empty; each coordinate of `domain_max` must be greater")]
    EmptyDomain {
        /// Minimum corner.
        min: [f64; 3],
        /// Maximum corner.
        max: [f64; 3],
    },
    /// The grid has more cells than are allowed, or than fit in memory.
    #[error(
        "{resolution:.1} cells in a meter are {cells:.1} million cells, which would take {gib:.1} GiB; allowed: up to {limit:.1} cells in a meter"
    )]
    TooManyCells {
        /// Cells in a meter.
        resolution: f64,
        /// Cells of the grid, in millions.
        cells: f64,
        /// Memory for them, GiB.
        gib: f64,
        /// Largest resolution that is allowed, cells in a meter.
        limit: f64,
    },
    /// A keyframed value differs at the start and the end of the loop.
    #[error("must have the same value at the start and at the end of the loop of {seconds} s")]
    LoopJumps {
        /// Length of the loop, s.
        seconds: f64,
    },
    /// A mesh of a burner.
    #[error(transparent)]
    Burner(ParticleErrorKind),
    /// A file could not be loaded.
    #[error(transparent)]
    Asset(AssetError),
}
