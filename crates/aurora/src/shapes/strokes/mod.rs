//! Strokes as they are drawn, and the faults that they may have.

pub(crate) mod intersection;
pub(crate) mod validate;
