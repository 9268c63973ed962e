//! Tables of the scene file that are no phenomenon, and what follows for those that a text leaves out.

pub(crate) mod defaults;
pub mod picture;
pub(crate) mod plate;
