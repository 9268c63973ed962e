//! Particles as a lens sees them.

pub(crate) mod perspective;
pub(crate) mod sprite;
