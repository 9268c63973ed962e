//! The picture of an aurora: absolute light of particles and afterglow, through any lens.
//!
//! Field lines are seen as meridians about the magnetic zenith (`geometry`), so that an aurora is drawn on a `chart` of
//! the sky in longitude and colatitude about that point. Precipitation is summed up by longitude and distance
//! (`footprint`); then the light of every field line runs along its meridian (`meridians`), its altitudes from tables
//! (`profile`). The chart is dimmed and coloured by the air below (`shading`, `seen`), and what a pixel of any lens shows
//! is looked up on it (`prepared`). The cost grows with pixels and particles, not with shapes.

mod blur;
mod chart;
mod cloud;
mod collisions;
mod descent;
mod exposure;
mod fall_table;
mod footprint;
mod geometry;
mod group;
mod lighting;
mod maps;
mod meridians;
mod parameters;
mod phenomenon;
mod points;
mod prepared;
mod profile;
mod sampler;
mod seen;
mod shading;
mod shown_rows;
mod sources;
#[cfg(test)]
mod tests;
mod trace;
mod wander;

pub use parameters::{Blur, BlurParameters, DrawingParameters, FallModel, Sampling};
pub use phenomenon::Aurora;
