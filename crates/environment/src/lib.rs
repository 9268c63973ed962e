//! What surrounds the phenomena: sky, ground and lamps.

pub mod ground;
pub mod lamps;
pub mod sky;
