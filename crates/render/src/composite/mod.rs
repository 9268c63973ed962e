//! Compositing on the processor: slices of depth, strips of rows, the plate behind all, refraction and the mirror.

mod accumulate;
pub(crate) mod background;
pub(crate) mod mirror;
pub(crate) mod plate;
mod plate_light;
pub(crate) mod refraction;
pub mod slices;
pub(crate) mod strips;

pub(crate) use plate_light::plate_light;
