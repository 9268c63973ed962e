//! Drops in the air: size distribution, terminal velocity, positions and motion in the wind.

pub(crate) mod cell_drops;
pub(crate) mod cell_motion;
pub(crate) mod classes;
pub(crate) mod gust;
mod gust_cells;
pub(crate) mod lattice;
pub(crate) mod shutter_state;
pub mod size_distribution;
pub mod terminal_velocity;
