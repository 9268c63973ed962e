//! One frame of rain: what is prepared once, and its strips.

pub(crate) mod prepared;
