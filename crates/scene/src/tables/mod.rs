//! The shared tables of a scene file, and the defaults of those that a text omits.

pub(crate) mod defaults;
pub(crate) mod depth;
pub(crate) mod ground_fit;
pub mod kinds;
pub mod picture;
pub(crate) mod plate;
pub(crate) mod plate_checks;
pub(crate) mod plate_surfaces;
