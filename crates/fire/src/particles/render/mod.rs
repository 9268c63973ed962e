//! Rendering of the gas: emission, absorption and refraction of particles by splatting.
//!
//! 1. `gas`: position, absorption and emission of each particle.
//! 2. `depth_layers`: statistics over all particles, and depth layers of constant thickness.
//! 3. `project`: the elliptical sprite of each particle, for every lens.
//! 4. `splat`: line integrals of the kernel (`kernel`), rasterized (`rasterize`) and summed on grids (`grid`) as coarse as the sprites are
//!    smooth, which cubic B-splines interpolate (`spline`). Memory comes from `buffer_pool`.
//! 5. `resolve`: interpolation along rows (`upsample`), detail below the size of particles (`detail`, `strain`), and light per pixel.
//! 6. `deflection`: heat haze. `emitted_light`: point lights for other objects. `aovs`: AOVs. `paper_squares`: the paper's figure 7.
//! 7. `prepared`: one frame, drawn into strips. Where the gas moves far in the open shutter, or is small in the picture, it is the mean of many
//!    `samples` in time and of parts of pixels: `gas_view` is what one of them sees, `exposed` sums their light.

mod aovs;
pub(crate) mod buffer_pool;
mod deflection;
mod depth_layers;
mod emitted_light;
mod exposed;
pub(crate) mod gas;
mod gas_view;
mod paper_squares;
mod prepared;
pub(crate) mod project;
pub(crate) mod resolve;
mod samples;
pub(crate) mod splat;

pub use aovs::AOVS;
pub use buffer_pool::BufferPool;
pub(crate) use deflection::refractivity;
pub use emitted_light::{point_lights_of_exposure, point_lights_of_gas};
pub(crate) use gas::VISIBLE_SOOT_ABSORPTION;
pub use gas::{FadeOut, Gas, soot_absorption};
pub use prepared::{PreparedGas, depth_intervals};
pub use samples::{GasExposure, GasState};
pub use splat::kernel::{line_gradient, line_integral};

pub use crate::particles::parameters::{GasLightParameters, GasRenderingParameters, HeatHazeModel, SpriteStyle};

#[cfg(test)]
mod tests;
