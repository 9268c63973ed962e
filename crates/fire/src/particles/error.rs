//! Errors of a particle flame's parameters that no single parameter shows by itself.

use bansho_base::host::assets::AssetError;

/// A combination of parameters from which no particle flame can be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{key}: {kind}")]
pub struct ParticleError {
    /// Key of the parameter, with list indices and sub-tables separated by dots, as in `burners.0.file`.
    pub key: String,
    /// What is wrong.
    pub kind: ParticleErrorKind,
}

/// Errors of parameters that are each within their own bounds.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ParticleErrorKind {
    /// A burner whose center, or a mesh of which any vertex, lies outside the domain.
    #[error("the burner stands at {position:?} m, beyond `{corner}` {limit:?} m")]
    OutsideDomain {
        /// Center of its area; of a mesh the corner of its bounding box.
        position: [f64; 3],
        /// The corner of the domain that it lies beyond.
        corner: &'static str,
        /// That corner.
        limit: [f64; 3],
    },
    /// A domain whose least corner exceeds the greatest.
    #[error("the domain from {min:.3?} to {max:.3?} m is empty; each coordinate of `domain_max` must be greater")]
    EmptyDomain {
        /// Least corner.
        min: [f64; 3],
        /// Greatest corner.
        max: [f64; 3],
    },
    /// A support radius larger than the domain.
    #[error(
        "the support radius d would be {radius:.4} m, more than the domain's {side:.4} m; use more particles or a larger domain"
    )]
    SupportBeyondDomain {
        /// Support radius d, m.
        radius: f64,
        /// Shortest side of the domain, m.
        side: f64,
    },
    /// More particles than are allowed, or than there is memory for.
    #[error("{count} particles{} would take {gib:.0} GiB; allowed: up to {most}", beside_others(*.others))]
    TooManyParticles {
        /// Particles requested.
        count: i64,
        /// Particles of other flames of the scene.
        others: i64,
        /// Memory for all of them.
        gib: f64,
        /// Greatest number allowed.
        most: i64,
    },
    /// A burner of shape `mesh` without a file.
    #[error("a burner of shape \"mesh\" needs a `file`")]
    NoFile,
    /// A mesh that cannot be loaded.
    #[error("{0}")]
    Asset(#[from] AssetError),
    /// An animated value that differs between both ends of a loop.
    #[error(
        "the loop of {seconds} s jumps: its first and its last moment differ; allowed: the same value at 0 s and at {seconds} s"
    )]
    LoopJumps {
        /// Length of the loop.
        seconds: f64,
    },
}

/// Text about the particles of other flames.
fn beside_others(others: i64) -> String {
    if others == 0 { String::new() } else { format!(" beside {others} of other flames") }
}
