//! Rendering of one frame.

mod exposure_parts;
pub(crate) mod prepared;
