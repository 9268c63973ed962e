//! Rendering of a soot field: time samples, shading, and drawing into strips with AOVs.

mod draw;
pub(crate) mod shade;
#[cfg(test)]
mod tests;
mod time_samples;

pub(crate) use draw::{SootContext, draw_soot_rows};
pub(crate) use time_samples::SootSample;
