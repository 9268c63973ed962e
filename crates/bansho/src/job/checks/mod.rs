//! Checks before a job draws anything: files it may not overwrite, memory it would need, plates that are missing.

pub(crate) mod memory;
pub(crate) mod overwrite;
pub(crate) mod plates;
