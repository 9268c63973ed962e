//! Animations that need nothing installed: APNG and GIF.

pub(crate) mod apng;
pub(crate) mod gif;
mod palette;
pub(crate) mod timing;
