//! Films: APNG and GIF, encoded in this process, and other formats by `ffmpeg`. Frames may be added out of order.

pub(crate) mod apng;
pub mod ffmpeg;
pub(crate) mod gif;
pub(crate) mod ordered;
mod palette;
