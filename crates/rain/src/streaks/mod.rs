//! Streaks: the paths of drops during the exposure. Projection into the picture, binning into tiles, rasterization.

pub(crate) mod bin;
pub mod coverage;
pub(crate) mod exposure_parts;
pub mod oscillation;
pub(crate) mod project;
pub(crate) mod project_curvilinear;
pub(crate) mod project_lanes;
pub(crate) mod rasterize;
pub(crate) mod splashes;
