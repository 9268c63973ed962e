//! Animations that need nothing installed: APNG and GIF.

pub(crate) mod apng;
pub mod ffmpeg;
pub(crate) mod gif;
pub(crate) mod ordered;
mod palette;
pub(crate) mod timing;
