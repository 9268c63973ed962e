//! Edits of a scene's text that keep its comments: `--set`, operations of editors, and `bansho upgrade`.

mod document;
pub mod operation;
mod set;
mod suggest_path;
mod upgrade;

pub use self::{document::EditError, set::set, upgrade::upgrade};
