//! Compositing on the CPU: slices of depth, strips of rows, plate, refraction, mirror.

mod accumulate;
pub(crate) mod background;
mod channels;
pub(crate) mod composition;
pub(crate) mod glare;
pub(crate) mod hiding;
pub(crate) mod light_frame;
pub(crate) mod mirror;
pub(crate) mod moments;
pub(crate) mod moving_members;
pub(crate) mod plate;
pub(crate) mod plate_cache;
mod plate_depth;
mod plate_light;
pub(crate) mod plate_lighting;
mod plate_mapping;
mod plate_shadows;
pub(crate) mod plate_surface;
pub(crate) mod plate_transport;
pub(crate) mod refraction;
pub(crate) mod slices;
mod standing_lights;
pub(crate) mod strips;

pub(crate) use plate_light::{plate_light, plate_light_remark};
