//! Rendering of the gas by marching rays through the grid.

pub(crate) mod blocks;
pub(crate) mod field;
pub(crate) mod haze;
pub(crate) mod lights;
mod march;
mod nodes;
mod optics;
pub(crate) mod prepared;
mod rays;
pub(crate) mod reference;
mod sheet;
pub(crate) mod smoke;
#[cfg(test)]
mod tests;
