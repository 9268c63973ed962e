//! How the sheet changes with time: its clock, its fluctuations and the moment that an exposure sees.

pub(crate) mod clock;
pub(crate) mod fluctuation;
pub(crate) mod warp;
