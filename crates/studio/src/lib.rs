//! The studio: an editor of scene files with a live preview. The file that it saves is rendered identically by `bansho render`.
//!
//! Layers, each of which uses only those above it in this list:
//! - [`document`]: the scene as text, with its undo history and its problems.
//! - [`player`]: renders frames off the window's thread, and keeps the time.
//! - [`session`]: an open document with its player, without widgets.
//! - [`editors`]: editors of single kinds of phenomena. [`app`]: the window.
//!
//! Without a GPU, the crate `bansho-egui-software` paints the window.

pub mod app;
pub mod document;
pub mod editors;
pub mod player;
#[cfg(not(target_arch = "wasm32"))]
pub mod renderer_choice;
pub mod scenes;
pub mod session;
