//! The light that drops send on: the phase function of a drop, lamps and sky, extinction and single scattering.

pub(crate) mod drop_lighting;
pub mod drop_phase_function;
pub mod extinction;
pub(crate) mod single_scattering;
pub(crate) mod sky;
pub(crate) mod tiles;
