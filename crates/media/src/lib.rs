//! Bansho's pictures in and out.
//!
//! - Out: [`naming`] says where frames go and as what, [`output::sink::Sink`] takes them from any thread, [`atomic`] sees to it
//!   that a file is whole or not there, [`overwriting`] that it takes no other's place, [`resume`] finds those that need not be made
//!   again. [`png`], [`exr`] and [`video`] are the formats, [`mark`] is what they all bear, [`flatten`] and [`flipbook`] prepare pictures for them.
//! - In: [`assets::FileAssets`] gives a scene its plates, meshes and drawings, with limits that no hostile file can pass;
//!   [`input`] reads the bytes of ordinary files alone.
//!
//! PNG, EXR, APNG and GIF files are the same bytes for the same frames on every machine and with any number of threads:
//! nothing here reads the clock, the environment or the host. Work runs in the caller's rayon pool.

pub mod assets;
mod error;
pub mod exr;
pub mod film;
pub mod input;
pub mod output;
pub mod ply;
pub mod png;
#[cfg(test)]
mod testing;
pub mod zip;

pub use error::{MediaError, SizeRule};
