//! Rendering of the aurora in absolute luminance, through any lens.
//!
//! Field lines of a uniform field appear as meridians about the magnetic zenith (`project`: `field_lines`), so the
//! aurora is drawn on a chart of the sky in longitude and colatitude about that point (`chart`). Precipitation is
//! binned by longitude and distance (`bin`); the emission profile of every field line is integrated along its
//! meridian (`integrate`), or single collisions are rasterized (`single_collisions`). Extinction and color are applied to the chart (`shade`), and the pixels of any lens
//! sample it (`prepared`). `stages` draws maps of the simulation instead. The cost is linear in pixels and particles and independent of the shapes.

pub(crate) mod aovs;
pub(crate) mod bin;
pub(crate) mod cloud_in_cell;
pub(crate) mod diffuse;
pub(crate) mod emitted_light;
pub(crate) mod inputs;
pub(crate) mod integrate;
pub(crate) mod prepared;
pub(crate) mod project;
pub(crate) mod shade;
pub(crate) mod shutter;
pub(crate) mod single_collisions;
pub(crate) mod stages;
#[cfg(test)]
mod tests;

pub use super::parameters::{Blur, BlurParameters, RenderingParameters, Sampling};
pub use crate::physics::precipitation::TrackModel;
