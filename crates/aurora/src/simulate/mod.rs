//! Simulation of the particles and of the field that moves them (thesis, 2.2.3 and 2.3).
//!
//! [`AuroraSimulation`] advances them: the [`field`] attracts them to the in-between shape, `forces` has the repulsion
//! and integration (`neighbor_cells` the neighbor search of the thesis), `relocation` creates and removes particles when the shape is updated, `energy_flux` assigns their
//! power, and [`afterglow`] stores the delayed light of the green and the red line.

pub mod afterglow;
mod energy_flux;
pub mod field;
mod forces;
mod neighbor_cells;
mod particles;
mod relocation;
pub(crate) mod sheets;
mod simulation;
mod state;
#[cfg(test)]
mod tests;

pub(crate) use forces::check_neighbors;
pub use particles::AuroraParticles;
pub use simulation::AuroraSimulation;
