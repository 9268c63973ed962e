//! Simulated states as files.

pub(crate) mod point_clouds;
