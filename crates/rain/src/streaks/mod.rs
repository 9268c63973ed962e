//! Streaks: drops as an exposure sees them, sorted into tiles and rasterized.

pub(crate) mod bin;
pub mod coverage;
pub(crate) mod project;
pub(crate) mod project_lanes;
pub(crate) mod rasterize;
pub(crate) mod splashes;
