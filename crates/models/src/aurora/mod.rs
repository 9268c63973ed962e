//! The aurora: drawn by an artist, moved by a field, lit by the atoms that precipitating electrons strike.
//!
//! K. Sekiguchi, "A study on artist-controllable aurora simulation". [`shapes`] are the foot of the aurora as it is drawn and as it
//! becomes, [`particles`] the electrons that follow it, [`atmosphere`] is the air from 80 to 800 km, [`precipitation`] says where
//! electrons of an energy spend it, [`light`] what the struck atoms give back, for how long and in which colour; [`afterglow`] is
//! where it lingers, [`draw`] makes pictures of it.

pub mod afterglow;
pub mod atmosphere;
pub mod draw;
mod energies;
pub mod light;
mod parameters;
pub mod particles;
pub mod precipitation;
pub mod shapes;

pub use draw::{Aurora, Blur, BlurParameters, DrawingParameters, FallModel, Sampling};
pub use parameters::{
    AuroraParameters, FieldCharge, FieldParameters, FieldSolver, FoldParameters, ParticleParameters,
    PulsationParameters, RayParameters, RelocationParameters, RepulsionKernel, SpectrumShape,
};
