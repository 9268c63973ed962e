//! Reading and writing of pictures, films and other assets.
//!
//! - [`output`]: the sink that takes frames from any thread, and resuming.
//! - [`film`]: animations that are encoded in this process (APNG, GIF), and films by `ffmpeg`.
//! - [`format`](mod@format): the list of output formats, and the pixels that each takes.
//! - [`png`], [`exr`], [`ply`], [`gltf`], [`zip`]: encoders of single files.
//! - [`imageops`]: flattening, labels and sprite sheets.
//! - [`files`]: names, reading of regular files only, atomic writing, protection of other files, provenance.
//! - [`assets`]: a scene's plates, meshes and drawings from files, with limits that no hostile file can exceed.
//!
//! PNG, EXR, APNG and GIF output is deterministic: the same frames give the same bytes on every machine and with any
//! number of threads. Nothing here reads the clock, the environment or the host. Work runs in the caller's rayon pool.

pub mod assets;
mod error;
pub mod exr;
pub mod files;
pub mod film;
mod fingerprint;
pub mod format;
mod frame_rate;
pub mod gltf;
pub mod imageops;
pub mod output;
pub mod ply;
pub mod png;
#[cfg(test)]
mod testing;
pub mod zip;

pub use error::{MediaError, SizeRule};
