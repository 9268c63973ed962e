//! How the gas looks: what it radiates, absorbs and bends, and the particles as the paper shows them.
//!
//! Each particle is a ball of gas whose line integral is known in closed form (`kernel`). `survey` finds how the gas is spread, `sprite`
//! each ball's ellipse in the picture (`perspective` sixteen at a time), `splat` sums all of them (`placed` among its cells) on a grid as
//! coarse as they are smooth, in a few layers of depth; `resolve` turns the sums into light at every pixel, by splines (`spline`, `across`) and
//! with the detail (`detail`) that sums lack. `haze` finds deflections, `light` what others are lit with.

mod across;
mod detail;
mod gas;
mod grid;
mod haze;
mod kernel;
mod layers;
mod light;
mod look;
mod measure;
mod memory;
mod perspective;
mod placed;
mod prepared;
mod resolve;
mod splat;
mod spline;
mod sprite;
mod squares;
mod strain;
mod survey;

pub use gas::{Ending, Gas, soot_absorption};
pub use kernel::{line_gradient, line_integral};
pub use light::luminous;
pub use look::{GasLightParameters, LookParameters, SpriteStyle};
pub use measure::AOVS;
pub use memory::Memory;
pub use prepared::{PreparedGas, depth_intervals};

#[cfg(test)]
mod tests;
