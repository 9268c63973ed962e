//! Projection of particles to elliptical sprites.

pub(crate) mod perspective;
pub(crate) mod sprite;
