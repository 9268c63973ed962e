//! Output of rendered frames: the sink that writes them, and reading back.

pub mod frame_file;
pub mod sink;
