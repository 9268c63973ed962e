//! Drawing many frames: from the nearest snapshot, in order, while earlier ones are finished by other threads of the pool.

pub(crate) mod draw_frames;
pub(crate) mod frame_source;
pub(crate) mod in_flight;
pub(crate) mod snapshots;
