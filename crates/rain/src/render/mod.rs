//! One frame of rain: what is prepared once, and its strips.

pub(crate) mod aovs;
pub(crate) mod prepared;
