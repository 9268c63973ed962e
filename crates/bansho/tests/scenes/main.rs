//! Scenes before anything is drawn: their files, edits, defaults, shared tables, the book's reference, and programs with phenomena of their own.

#[allow(dead_code, reason = "the tests of frames use the rest")]
#[path = "../support/mod.rs"]
mod support;

mod defaults;
mod replan;
mod scene_edits;
mod scene_file;
mod scene_reference;
mod shared_tables;
mod traits;
