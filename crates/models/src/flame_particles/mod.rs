//! The particle flame: burning gas as particles, moved by smoothed particle hydrodynamics, lit as black bodies.
//!
//! S. Inagaki, M. Imura, S. Ikeda, Y. Manabe and K. Chihara, "Real-time rendering of flame using particle-based fluid simulation".

pub mod draw;
pub mod particles;

pub use particles::{Particle, Particles};
