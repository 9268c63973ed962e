//! Checks before anything is drawn: memory, missing plates, files that must not be overwritten. And at the end: whether all files still exist.

pub(crate) mod finished_files;
pub(crate) mod memory;
pub(crate) mod outputs;
pub(crate) mod plates;
