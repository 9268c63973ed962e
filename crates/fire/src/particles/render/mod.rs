//! How the gas looks: what it radiates, absorbs and bends, and the particles as the paper shows them.
//!
//! Each particle is a ball of gas whose line integral is known in closed form (`kernel`). `survey` finds how the gas is spread, `sprite`
//! each ball's ellipse in the picture (`perspective` sixteen at a time), `splat` sums all of them (`placed` among its cells) on a grid as
//! coarse as they are smooth, in a few layers of depth; `resolve` turns the sums into light at every pixel, by splines (`spline`, `across`) and
//! with the detail (`detail`) that sums lack. `haze` finds deflections, `light` what others are lit with.

mod aovs;
mod deflection;
mod depth_layers;
mod emitted_light;
pub(crate) mod gas;
mod prepared;
pub(crate) mod project;
pub(crate) mod resolve;
pub(crate) mod splat;

pub use crate::particles::parameters::{GasLightParameters, LookParameters, SpriteStyle};
pub use aovs::AOVS;
pub use emitted_light::point_lights_of_gas;
pub use gas::{FadeOut, Gas, soot_absorption};
pub use prepared::{PreparedGas, depth_intervals};
pub use splat::{
    kernel::{line_gradient, line_integral},
    scratch_pool::ScratchPool,
};

#[cfg(test)]
mod tests;
