//! DropBatch in the air: how many of which size, how fast they fall, where they are.

pub(crate) mod cell;
pub(crate) mod exposure;
pub(crate) mod gust;
pub(crate) mod lattice;
pub mod size_distribution;
pub mod terminal_velocity;
