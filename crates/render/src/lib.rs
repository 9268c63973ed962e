//! From a scene to frames: compiling, planning, drawing a shot.
//!
//! [`CompiledScene`] builds what the scene contains, once; [`Plan`] fixes everything before the first frame; [`Shot`] steps simulations and
//! draws frames as scene-linear light or as display codes, by its [`Target`]; [`display`](mod@display) has the view transform, and [`pixels`] writes frames into buffers
//! of the caller.

pub mod compiled;
mod composite;
mod context;
mod crossfade;
pub mod display;
mod exposure_parts;
mod faint;
pub mod fingerprint;
pub mod pixels;
pub mod plan;
mod planning;
mod plate_boxes;
pub mod remarks;
pub mod shot;
pub mod target;

pub use compiled::{BuildErrors, CompiledScene};
pub use composite::{
    composition::scratch_bytes_per_thread, glare::source_window, moments::moment_bytes_per_thread,
    plate_lighting::lit_plate_bytes,
};
pub use pixels::{
    BufferLengthError, ChannelError, f16, nonzero_rect, write_channel32f, write_depth32f, write_rgba8, write_rgba16f,
    write_rgba32f,
};
pub use plan::{DEFAULT_GLARE, GlareUse, Plan, PlanError, PlanOptions};
pub use shot::{PhenomenonLight, RenderError, Shot, snapshot};
pub use target::{SceneLinear, Target};
