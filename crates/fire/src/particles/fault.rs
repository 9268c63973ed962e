//! Faults of a particle flame that no single parameter can see by itself.

use bansho_base::host::assets::AssetError;

/// A parameter from which, with the others, no particle flame can be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{key}: {kind}")]
pub struct ParticleFault {
    /// The parameter, list indices and sub-tables separated by dots, as in `burners.0.file`.
    pub key: String,
    /// What is wrong.
    pub kind: ParticleFaultKind,
}

/// What can be wrong with parameters that are each within their own bounds.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ParticleFaultKind {
    /// A burner whose middle, or a mesh of which any part, lies outside the domain.
    #[error("the burner stands at {position:?} m, beyond `{corner}` {limit:?} m")]
    OutsideDomain {
        /// Where the middle of its area is; of a mesh the corner of the box around it.
        position: [f64; 3],
        /// Which corner of the domain it lies beyond.
        corner: &'static str,
        /// That corner.
        limit: [f64; 3],
    },
    /// A domain that is inside out.
    #[error("the domain from {min:.3?} to {max:.3?} m is empty; each coordinate of `domain_max` must be greater")]
    EmptyDomain {
        /// Least corner.
        min: [f64; 3],
        /// Greatest corner.
        max: [f64; 3],
    },
    /// Particles that see farther than the domain is wide.
    #[error(
        "the support radius d would be {radius:.4} m, more than the domain's {side:.4} m; use more particles or a larger domain"
    )]
    SupportBeyondDomain {
        /// Support radius d, m.
        radius: f64,
        /// Shortest side of the domain, m.
        side: f64,
    },
    /// More particles than are taken, or than the machine has memory for.
    #[error("{count} particles{} would take {gib:.0} GiB; allowed: up to {most}", beside(*.others))]
    TooManyParticles {
        /// How many are asked for.
        count: i64,
        /// How many other flames of the scene have.
        others: i64,
        /// What all would take when all live; bursts of up to twice as many are let live for a while.
        gib: f64,
        /// How many are allowed.
        most: i64,
    },
    /// A burner of shape mesh without a file.
    #[error("a burner of shape \"mesh\" needs a `file`")]
    NoFile,
    /// A mesh that cannot be had.
    #[error("{0}")]
    Asset(#[from] AssetError),
    /// A keyed value that does not end as it begins.
    #[error(
        "the loop of {seconds} s jumps: its first and its last moment differ; allowed: the same value at 0 s and at {seconds} s"
    )]
    LoopJumps {
        /// Length of the loop.
        seconds: f64,
    },
}

/// What a fault says of the particles of other flames.
fn beside(others: i64) -> String {
    if others == 0 { String::new() } else { format!(" beside {others} of other flames") }
}
