//! The flame sheet's stages and curves.

pub(crate) mod curves_ui;
pub(crate) mod stages_ui;
