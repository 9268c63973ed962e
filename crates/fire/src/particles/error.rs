//! Errors in combinations of a particle flame's parameters that are each within their bounds.

use bansho_base::host::assets::AssetError;

/// A parameter, or a combination of parameters, that no particle flame can be built from.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{key}: {kind}")]
pub struct ParticleError {
    /// Key of the parameter, with list indices and sub-tables separated by dots, as in `burners.0.file`.
    pub key: String,
    /// What is wrong.
    pub kind: ParticleErrorKind,
}

/// What is wrong with parameters that are each within their bounds.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ParticleErrorKind {
    /// The center of a burner, or any vertex of its mesh, is outside the domain.
    #[error("the burner is at {position:?} m, beyond `{corner}` {limit:?} m")]
    OutsideDomain {
        /// Its center, or the corner of the bounding box of its mesh.
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
    /// The support radius is larger than the domain.
    #[error(
        "the support radius d would be {radius:.4} m, more than the domain's {side:.4} m; use more particles or a larger domain"
    )]
    SupportBeyondDomain {
        /// Support radius d, m.
        radius: f64,
        /// Shortest side of the domain, m.
        side: f64,
    },
    /// There are more particles than allowed, or than fit in memory.
    #[error("{count} particles{} would take {gib:.0} GiB; allowed: up to {limit}", in_addition_to(*.others))]
    TooManyParticles {
        /// Particles requested.
        count: i64,
        /// Particles of other flames of the scene.
        others: i64,
        /// Memory for all of them, GiB.
        gib: f64,
        /// Maximum number allowed.
        limit: i64,
    },
    /// A burner of shape `mesh` has no file.
    #[error("a burner of shape \"mesh\" needs a `file`")]
    NoFile,
    /// A mesh cannot be loaded.
    #[error("{0}")]
    Asset(#[from] AssetError),
    /// A keyframed value differs at the start and the end of a seamless loop.
    #[error(
        "the loop of {seconds} s is not seamless: the value differs between its beginning and its end; allowed: the same value at 0 s and at {seconds} s"
    )]
    LoopJumps {
        /// Length of the loop, s.
        seconds: f64,
    },
}

/// Text about the particles of other flames; empty if there are none.
fn in_addition_to(others: i64) -> String {
    if others == 0 { String::new() } else { format!(" in addition to {others} of other flames") }
}
