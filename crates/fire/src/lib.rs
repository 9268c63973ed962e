//! Fire: the flame sheet, the particle flame, and the sparks of both.

pub(crate) mod blue_flame;
pub mod particles;
pub mod sheet;
pub mod sparks;
