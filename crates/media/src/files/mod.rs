//! Files: names, reading of regular files only, atomic writing, protection of other files, and provenance.

pub mod atomic;
pub mod file_identity;
pub mod input;
pub mod naming;
pub mod overwrite_policy;
pub mod provenance;
