//! From a scene file to frames: the scene, what is compiled of it, the plan of a shot, and the shot itself.

pub mod compiled;
mod composite;
mod context;
mod crossfade;
pub mod display;
mod exposure;
mod faint;
pub mod fingerprint;
mod loop_start;
pub mod plan;
pub mod remarks;
pub mod shot;

pub use compiled::{BuildErrors, CompiledScene};
pub use composite::slices;
pub use plan::{Plan, PlanError, PlanOptions};
pub use shot::{RenderError, Shot};
