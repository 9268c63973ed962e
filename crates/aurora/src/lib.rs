//! The aurora: drawn by an artist, moved by a field, lit by the atoms that precipitating electrons strike.
//!
//! K. Sekiguchi, "A study on artist-controllable aurora simulation". [`shapes`] are the foot of the aurora as it is drawn and as it
//! becomes, [`simulate`] the electrons that follow it, [`physics::atmosphere`] is the air from 80 to 800 km, [`physics::precipitation`] says where
//! electrons of an energy spend it, [`physics::emission`] what the struck atoms give back, for how long and in which color; [`simulate::afterglow`] is
//! where it lingers, [`render`] makes pictures of it.

mod parameters;
pub(crate) mod phenomenon;
pub mod physics;
pub mod render;
pub mod shapes;
pub mod simulate;
pub mod single_collisions;

pub use parameters::{
    AuroraParameters, FieldCharge, FieldParameters, FieldSolver, FoldParameters, ParticleParameters,
    PulsationParameters, RayParameters, RelocationParameters, RepulsionKernel, SpectrumShape,
};
pub use render::{Aurora, Blur, BlurParameters, DrawingParameters, Sampling, TrackModel};
