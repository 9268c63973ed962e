//! The state of the flame and its steps.

pub(crate) mod burner;
pub(crate) mod collision;
pub(crate) mod combustion;
pub(crate) mod derived;
pub(crate) mod emission;
pub(crate) mod fluid;
pub(crate) mod forces;
pub(crate) mod integrate;
pub(crate) mod neighbor_sums;
pub(crate) mod particle_lanes;
pub mod particles;
pub(crate) mod simulation;
pub(crate) mod snapshot;
pub(crate) mod vector_lanes;
