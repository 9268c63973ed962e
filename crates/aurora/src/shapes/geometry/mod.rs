//! Polylines, their segments, and finding what is near.

pub(crate) mod cell_grid;
pub(crate) mod nearest_segment;
pub(crate) mod polyline;
pub(crate) mod segments;
