//! The window of a flame sheet's stages, and the curves beside it.

pub(crate) mod curves_ui;
pub(crate) mod stages_ui;
