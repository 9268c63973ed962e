//! Particles onto the grid of the picture.

pub(crate) mod accumulate;
pub(crate) mod buffers;
pub(crate) mod footprint;
pub(crate) mod grid;
pub(crate) mod kernel;
