//! The panels around the viewport: scene, inspector, timeline, problems and text.

pub(crate) mod inspector;
pub(crate) mod problems;
pub(crate) mod scene;
pub(crate) mod text;
pub(crate) mod timeline;
