//! The aurora's particles and the field that moves them (thesis, 2.2.3 and 2.3).
//!
//! [`AuroraSimulation`] steps them: a field pulls them toward the in-between shape, they push each other apart, and whenever the
//! shape is renewed some are born where they are missing and die where they are strays.

pub mod afterglow;
mod energy_flux;
pub mod field;
mod forces;
mod particles;
pub(crate) mod point_cloud;
mod relocation;
pub(crate) mod sheets;
mod simulation;
mod snapshot;
#[cfg(test)]
mod tests;

pub use particles::AuroraParticles;
pub use simulation::AuroraSimulation;
