//! Reading and writing of pictures, films and other assets.
//!
//! - [`output`]: the sink that takes frames from any thread, and resuming.
//! - [`film`]: animations that are encoded in this process (APNG, GIF), and films by `ffmpeg`.
//! - [`format`](mod@format): the list of output formats, and the pixels that each takes.
//! - [`png`], [`exr`], [`gltf`]: formats that are written and read, each a folder with its writer beside its reader.
//! - [`ply`], [`zip`]: formats that are only written. `jpeg`, `tiff`, `webp`, `pfm`, `numpy`, [`svg`]: those that are only read.
//! - [`limits`], `decode`: what the readers share: limits that no hostile file can exceed, colors, Exif.
//! - [`imageops`]: flattening, labels and sprite sheets.
//! - [`files`]: names, reading of regular files only, atomic writing, protection of other files, provenance.
//! - [`assets`]: a scene's plates, meshes and drawings from files.
//!
//! PNG, EXR, APNG and GIF output is deterministic: the same frames give the same bytes on every machine and with any
//! number of threads. Nothing here reads the clock, the environment or the host. Work runs in the caller's rayon pool.

pub mod assets;
mod decode;
mod error;
pub mod exr;
pub mod files;
pub mod film;
mod fingerprint;
pub mod format;
mod frame_rate;
pub mod gltf;
pub mod imageops;
mod jpeg;
pub mod limits;
mod numpy;
pub mod output;
mod pfm;
pub mod ply;
pub mod png;
pub mod svg;
#[cfg(test)]
mod testing;
mod tiff;
mod webp;
pub mod zip;

pub use error::{MediaError, SizeRule};
