//! From a scene to frames: compiling, planning, drawing a shot.
//!
//! [`CompiledScene`] builds what the scene contains, once; [`Plan`] fixes everything before the first frame; [`Shot`] steps simulations and
//! draws frames; [`display`](mod@display) applies the view transform for display formats.

pub mod compiled;
mod composite;
mod context;
mod crossfade;
pub mod display;
mod faint;
pub mod fingerprint;
pub mod plan;
mod planning;
pub mod remarks;
pub mod shot;

pub use compiled::{BuildErrors, CompiledScene};
pub use plan::{Plan, PlanError, PlanOptions};
pub use shot::{PhenomenonLight, RenderError, Shot};
