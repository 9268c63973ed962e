//! How the sheet changes with time: clock, fluctuations, and the warp of its coordinates at one time.

pub(crate) mod clock;
mod edge_waves;
pub(crate) mod fluctuation;
pub(crate) mod warp;
