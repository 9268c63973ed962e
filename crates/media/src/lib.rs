//! Bansho's pictures in and out.
//!
//! - Out: [`naming`] says where frames go and as what, [`sequence::Sink`] takes them from any thread, [`atomic`] sees to it
//!   that a file is whole or not there, [`overwriting`] that it takes no other's place, [`resume`] finds those that need not be made
//!   again. [`png`], [`exr`] and [`video`] are the formats, [`mark`] is what they all bear, [`flatten`] and [`flipbook`] prepare pictures for them.
//! - In: [`plates::FileAssets`] gives a scene its plates, meshes and drawings, with limits that no hostile file can pass;
//!   [`input`] reads the bytes of ordinary files alone.
//!
//! PNG, EXR, APNG and GIF files are the same bytes for the same frames on every machine and with any number of threads:
//! nothing here reads the clock, the environment or the host. Work runs in the caller's rayon pool.

mod animation;
pub mod atomic;
pub mod drawings;
mod error;
pub mod exr;
pub mod flatten;
pub mod flipbook;
pub mod identity;
pub mod input;
pub mod label;
pub mod mark;
pub mod meshes;
pub mod naming;
mod ordered;
pub mod overwriting;
pub mod plates;
pub mod ply;
pub mod png;
pub mod resume;
pub mod sequence;
mod stamp;
#[cfg(test)]
mod testing;
pub mod unfinished;
pub mod video;
pub mod zip;

pub use error::{MediaError, SizeRule};
