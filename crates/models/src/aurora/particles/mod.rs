//! The aurora's particles and the field that moves them (thesis, 2.2.3 and 2.3).
//!
//! [`AuroraSimulation`] steps them: a field pulls them toward the in-between shape, they push each other apart, and whenever the
//! shape is renewed some are born where they are missing and die where they are strays.

mod along;
mod conductor;
mod course;
mod field;
mod motion;
mod nodes;
mod population;
mod precipitation;
mod rays;
mod relocation;
mod scatter;
mod simulation;
mod snapshot;
mod stretches;
#[cfg(test)]
mod tests;

pub use population::AuroraParticles;
pub use simulation::AuroraSimulation;
