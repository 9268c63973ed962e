//! The text of a scene file: TOML values with spans, edits that keep comments, and lines and columns for messages.

pub mod edit;
pub(crate) mod lines;
pub(crate) mod path;
pub(crate) mod toml;
