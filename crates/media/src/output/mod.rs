//! Output of rendered frames: the sink that writes them, and resuming.

pub mod resume;
pub mod sink;
