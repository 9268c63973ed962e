//! Drawn strokes and their validation.

pub(crate) mod intersection;
pub(crate) mod validate;
