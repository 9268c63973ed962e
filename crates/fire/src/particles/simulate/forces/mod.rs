//! External forces: buoyancy and wind, entrainment, turbulence and vortex rings.

pub(crate) mod entrainment_axis;
pub(crate) mod external_forces;
pub(crate) mod turbulence;
pub(crate) mod vortex_rings;
pub(crate) mod wind_field;
