//! Widgets of the panels: value editors, curve editors, icons and pictures.

pub(crate) mod curve_editor;
pub(crate) mod icon;
pub(crate) mod picture_texture;
pub(crate) mod value;

/// The label of a parameter: its key in words.
pub(crate) fn key_label(key: &str) -> String {
    key.replace('_', " ")
}
