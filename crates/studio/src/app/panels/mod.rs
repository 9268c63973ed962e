//! The panels around the viewport: scene, inspector, stages, timeline, problems and text.

pub(crate) mod inspector;
pub(crate) mod problems;
pub(crate) mod scene;
pub(crate) mod stages;
pub(crate) mod text;
pub(crate) mod timeline;
