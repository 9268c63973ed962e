//! Polylines, sampling by arc length, and nearest-segment queries.

pub(crate) mod cell_grid;
pub(crate) mod nearest_segment;
pub(crate) mod polyline;
