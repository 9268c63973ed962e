//! Rendering of one frame.

pub(crate) mod prepared;
mod streak_parts;
