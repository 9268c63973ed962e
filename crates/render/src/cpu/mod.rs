//! The CPU backend: the pictures that all others are compared with.

mod accumulate;
mod behind;
mod calm;
mod clock;
mod compose;
mod faint;
mod haze;
mod mirror;
mod plate;
mod plate_light;
mod shot;
mod snapshot;

use std::sync::Arc;

use crate::{
    backend::{Backend, RenderError, Shot},
    plan::Plan,
};

pub(crate) use calm::calmest_start;
pub(crate) use clock::remarks;
pub(crate) use plate_light::plate_light;

/// Draws on the processor, in the rayon pool of the caller. Same plan, same bytes, whatever the threads.
#[derive(Clone, Copy, Debug, Default)]
pub struct CpuBackend;

impl Backend for CpuBackend {
    fn name(&self) -> &'static str {
        "cpu"
    }

    fn open(&self, plan: Arc<Plan>) -> Result<Box<dyn Shot>, RenderError> {
        Ok(Box::new(shot::CpuShot::open(plan)?))
    }
}
