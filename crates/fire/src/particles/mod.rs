//! The particle flame: burning gas as particles, moved by smoothed particle hydrodynamics, lit as black bodies.
//!
//! S. Inagaki, M. Imura, S. Ikeda, Y. Manabe and K. Chihara, "Real-time rendering of flame using particle-based fluid simulation".

mod fault;
pub(crate) mod paper_squares;
mod parameters;
mod phenomenon;
pub mod render;
pub mod simulate;
#[cfg(test)]
mod tests;

pub use fault::{ParticleFault, ParticleFaultKind};
pub use parameters::{
    BurnerParameters, BurnerShape, FlameParticlesParameters, FluidParameters, LifeParameters, MotionParameters,
    TemperatureLaw, Tension, WindForce,
};
pub use phenomenon::FlameParticles;
pub use simulate::{
    burner::heskestad,
    derived::check_particle_count,
    particles::{Particle, Particles},
};
