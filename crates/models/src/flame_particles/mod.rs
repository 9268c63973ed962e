//! The particle flame: burning gas as particles, moved by smoothed particle hydrodynamics, lit as black bodies.
//!
//! S. Inagaki, M. Imura, S. Ikeda, Y. Manabe and K. Chihara, "Real-time rendering of flame using particle-based fluid simulation".

mod beside;
mod births;
mod breeze;
mod burner;
mod collision;
mod design;
mod draught;
pub mod draw;
mod fault;
mod flame;
mod fluid;
mod life;
mod living;
mod moving;
mod narrowing;
mod parameters;
pub mod particles;
mod puffing;
mod rows;
mod simulation;
mod snapshot;
#[cfg(test)]
mod tests;
mod turbulence;
mod vector;
mod weather;

pub use burner::heskestad;
pub use design::check_count;
pub use fault::{ParticleFault, ParticleFaultKind};
pub use flame::FlameParticles;
pub use parameters::{
    BurnerParameters, BurnerShape, FlameParticlesParameters, FluidParameters, LifeParameters, MotionParameters,
    TemperatureLaw, Tension, WindForce,
};
pub use particles::{Particle, Particles};
