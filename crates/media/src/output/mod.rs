//! Output files: names, a sink for frames, atomic writing, protection of other files, fingerprints and provenance.

pub mod atomic;
pub mod file_identity;
pub(crate) mod fingerprint;
pub mod flatten;
pub mod label;
pub mod naming;
pub mod overwrite_policy;
pub mod provenance;
pub mod resume;
pub mod sink;
pub mod sprite_sheet;
pub mod temporary_files;
