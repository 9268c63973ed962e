//! The sheets of the simulation: the drawn ones, refined and folded, with a ray pattern along their length.

pub(crate) mod arc_length;
pub(crate) mod filaments;
pub(crate) mod nodes;
pub(crate) mod rays;
pub(crate) mod refined_shape;
mod swirls;
