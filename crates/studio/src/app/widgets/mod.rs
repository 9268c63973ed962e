//! Widgets of the panels: values, keyframes, curves and icons.

pub(crate) mod curve_editor;
pub(crate) mod icon;
pub(crate) mod value;
