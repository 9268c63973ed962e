//! The text of a scene file: TOML with the position of every value, edits that keep comments, and lines and columns for messages.

pub mod edit;
pub(crate) mod lines;
pub mod operation;
pub(crate) mod path;
pub(crate) mod positions;
pub(crate) mod toml;
mod upgrade;
