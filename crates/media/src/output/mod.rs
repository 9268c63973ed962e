//! Output of rendered frames: the sink that writes them, resuming, and reading back.

pub mod frame_file;
pub mod resume;
pub mod sink;
