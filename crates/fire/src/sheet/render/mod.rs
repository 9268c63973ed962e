//! Rendering of the sheet: time samples, projection, shading, drawing into strips, AOVs and emitted light.

pub(crate) mod aovs;
pub(crate) mod cells;
pub(crate) mod draw;
pub(crate) mod draw_cells;
pub(crate) mod emitted_light;
pub(crate) mod prepared;
pub(crate) mod projection;
pub(crate) mod shade;
pub(crate) mod smoke;
pub(crate) mod soot_field;
pub(crate) mod time_samples;
