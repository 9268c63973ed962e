//! Rendering of the sheet: projection, shading by tables, drawing into strips, AOVs and emitted light.

pub(crate) mod aovs;
pub(crate) mod color_ramp;
pub(crate) mod curve_tables;
pub(crate) mod draw;
pub(crate) mod emitted_light;
pub(crate) mod flame_instance;
pub(crate) mod prepared;
pub(crate) mod projection;
pub(crate) mod shade;
pub(crate) mod smoke;
