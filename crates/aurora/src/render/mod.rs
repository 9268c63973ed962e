//! The picture of an aurora: absolute light of particles and afterglow, through any lens.
//!
//! Field lines are seen as meridians about the magnetic zenith (`geometry`), so that an aurora is drawn on a `chart` of
//! the sky in longitude and colatitude about that point. Precipitation is summed up by longitude and distance
//! (`source_bins`); then the light of every field line runs along its meridian (`meridians`), its altitudes from tables
//! (`profile`). The chart is dimmed and colored by the air below (`emitter_colors`, `seen`), and what a pixel of any lens shows
//! is looked up on it (`prepared`). The cost grows with pixels and particles, not with shapes.

pub(crate) mod bin;
mod emitted_light;
pub(crate) mod integrate;
pub(crate) mod maps;
pub(crate) mod prepared;
pub(crate) mod project;
pub(crate) mod shade;
pub(crate) mod shutter;
#[cfg(test)]
mod tests;

pub use super::{
    parameters::{Blur, BlurParameters, DrawingParameters, Sampling},
    phenomenon::Aurora,
};
pub use crate::physics::precipitation::TrackModel;
