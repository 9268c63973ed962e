//! From a scene file to frames: the scene, the plan of a shot, slices of depth, compositing, and the CPU backend.

pub mod backend;
mod cpu;
pub mod display;
mod dissolving;
mod exposure;
pub mod fingerprint;
pub mod frames;
pub mod phenomena;
pub mod plan;
pub mod scene;
pub mod slices;

pub use backend::{Backend, RenderError, Shot};
pub use cpu::CpuBackend;
pub use plan::{Plan, PlanError, PlanOptions};
pub use scene::{Scene, SceneError};
