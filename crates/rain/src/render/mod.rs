//! Rendering of one frame.

pub(crate) mod prepared;
