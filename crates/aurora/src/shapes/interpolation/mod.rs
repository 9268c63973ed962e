//! In-between shapes: splines in time through the key shapes.

pub(crate) mod gap;
pub(crate) mod spline_track;
