//! Edits of a scene's text that keep its comments: `--set`, and operations of editors.

mod document;
pub mod operation;
mod set;
mod suggest_path;

pub use self::{document::EditError, set::set};
