//! From what particles left on the grid to light and transmittance for each pixel.

pub(crate) mod detail;
pub(crate) mod resolve_gas;
pub(crate) mod spline;
pub(crate) mod strain;
pub(crate) mod upsample;
