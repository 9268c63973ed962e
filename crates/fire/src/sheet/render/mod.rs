//! From the sheet's parameters at a moment to pixels.

pub(crate) mod aovs;
pub(crate) mod curve_tables;
pub(crate) mod draw;
pub(crate) mod emitted_light;
pub(crate) mod flame;
pub(crate) mod prepared;
pub(crate) mod projection;
pub(crate) mod ramp;
pub(crate) mod shade;
pub(crate) mod shape_tables;
pub(crate) mod smoke;
