//! Bansho media.
pub mod atomic;
pub mod error;
pub mod exr;
pub mod naming;
pub mod png;
pub mod resume;
pub mod sequence;
mod stamp;
#[cfg(test)]
mod testing;
mod animation;
pub mod flatten;
mod ordered;
pub mod video;
pub mod plates;
