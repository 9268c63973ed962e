//! Flames, rain and aurora for pictures, as a library.
//!
//! A scene is three lines of TOML or a [`SceneBuilder`]; a [`Plan`] fixes the shot; a [`Backend`] opens it; the [`Shot`]
//! draws frames to memory. Nothing here prints, reads a clock, or keeps threads of its own: work runs in the caller's
//! rayon pool and reports to the caller's [`Observer`].
//!
//! ```
//! use std::sync::Arc;
//! use bansho::{Backend, CpuBackend, MemoryAssets, Plan, PlanOptions, Unobserved, parse_scene};
//!
//! let scene = parse_scene("fire", "bansho = 1\n[picture]\nsize = [64, 36]\n", &MemoryAssets::default())?;
//! let plan = Plan::new(scene, &PlanOptions::default(), Arc::new(MemoryAssets::default()))?;
//! let mut shot = CpuBackend.open(Arc::new(plan))?;
//! let frame = bansho::draw(shot.as_mut(), 0, &Unobserved)?;
//! assert_eq!((frame.beauty.width(), frame.beauty.height()), (64, 36));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! With the feature `files` (on by default) there is also `job`: from a scene file to pictures on disk, as the program
//! `bansho render` does it.

mod build;
#[cfg(feature = "files")]
pub mod job;

pub use bansho_aurora as aurora;
pub use bansho_base as base;
pub use bansho_environment as environment;
pub use bansho_fire as fire;
#[cfg(feature = "files")]
pub use bansho_media as media;
pub use bansho_rain as rain;
pub use bansho_render as render;
pub use bansho_sph as sph;

pub use bansho_base::{
    color::{AlphaConvention, View},
    host::{
        assets::{Assets, MemoryAssets},
        observer::{Cancelled, Observer, Stage, Unobserved},
    },
    image::{DisplayImage, Frame, Image, Rect},
};
pub use bansho_render::{
    Backend, CpuBackend, Plan, PlanError, PlanOptions, RenderError, Scene, SceneError, Shot,
    display::{BitDepth, display},
    phenomena::KINDS,
};
pub use build::SceneBuilder;

/// Reads and checks a scene of every kind of phenomenon this version knows; `file` is what errors call it.
///
/// # Errors
/// Every fault of the text and of the assets it names, with its place, what is wrong and what is allowed.
pub fn parse_scene(file: &str, text: &str, assets: &dyn Assets) -> Result<Scene, SceneError> {
    Scene::parse(file, text, KINDS, assets)
}

/// Advances `shot` to frame `number` and draws it.
///
/// # Errors
/// The observer asked to stop, or a picture that the scene names cannot be had.
pub fn draw(shot: &mut dyn Shot, number: i64, observer: &dyn Observer) -> Result<Frame, RenderError> {
    shot.advance(number, observer)?;
    shot.draw(observer)?;
    Ok(shot.read().ok_or(Cancelled)?)
}
