//! Reading and writing of pictures, films and other assets.
//!
//! - [`output`]: file names, the sink that takes frames from any thread, atomic writing, protection of other files,
//!   fingerprints and resuming, and the preparation of display pictures (flattening, labels, sprite sheets).
//! - [`film`]: animations that encode in this process (APNG, GIF), and films by `ffmpeg`.
//! - [`png`], [`exr`], [`ply`], [`zip`]: formats.
//! - [`assets`]: a scene's plates, meshes and drawings from files, with limits that no hostile file can exceed.
//! - [`input`]: bytes of regular files only.
//!
//! PNG, EXR, APNG and GIF output is deterministic: the same frames give the same bytes on every machine and with any
//! number of threads. Nothing here reads the clock, the environment or the host. Work runs in the caller's rayon pool.

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
