//! The studio: everything a scene file says, seen and changed live. What is done here is a scene file that
//! `bansho render` renders identically.
//!
//! Three storeys, each knowing only those below: [`document`] is the scene as text with its history and its faults;
//! [`player`] draws frames off the window's thread and keeps the time; [`app`] is the window. Where there is no GPU, `software` paints it.

pub mod app;
pub mod beginnings;
#[cfg(not(target_arch = "wasm32"))]
pub mod bench;
pub mod document;
pub mod examples;
pub mod player;
#[cfg(not(target_arch = "wasm32"))]
pub mod program;
#[cfg(not(target_arch = "wasm32"))]
pub mod software;
