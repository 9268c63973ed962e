//! Smoothed-particle hydrodynamics in the plane and in space: kernels, cells, density, pressure, step length.
//!
//! One code for both: everything takes the number of dimensions `D`, two or three. A step of a model is
//! ```
//! use self::{Cells, KernelShape, Particles, PressureForce, StateEquation, compute_densities};
//!
//! let mut particles = Particles::<3>::default();
//! particles.push([0.0; 3], [0.0; 3], 1.0, 0);
//! particles.push([0.1, 0.0, 0.0], [0.0; 3], 1.0, 1);
//! let mut cells = Cells::new(0.3);
//! let mut force = PressureForce::new(KernelShape::Spiky);
//! let state = StateEquation { rest_density: 0.0, tension: false };
//! let (mut density, mut acceleration) = (Vec::new(), Default::default());
//!
//! particles.sort(&mut cells); // then `cells.reorder` for arrays of the model's own
//! compute_densities(&cells, KernelShape::Poly6, &particles.masses, &mut density);
//! let pressure: Vec<f32> = density.iter().map(|density| state.pressure(10.0, *density)).collect();
//! force.compute_accelerations(&cells, &particles.masses, &density, &pressure, &mut acceleration);
//! particles.advance(&acceleration, 1e-3);
//! assert!(particles.velocities[0][0] < 0.0 && particles.velocities[0][1] > 0.0);
//! ```
//! Anything else that is a sum over neighbours is a [`PairTerm`] for [`Cells::sum`].

mod batch;
mod cells;
mod density;
mod kernel;
mod mixing;
mod neighbor_groups;
mod neighbor_sums;
mod particles;
mod pressure;
mod sorting;
mod step;
#[cfg(test)]
mod tests;

pub use bansho_base::math::simd::Real;

pub use cells::Cells;
pub use density::{StateEquation, compute_densities};
pub use kernel::{CubicSpline, Kernel, KernelShape, Poly6, SmoothingKernel, Spiky};
pub use mixing::mixing_weights;
pub use neighbor_sums::{Pair, PairTerm};
pub use particles::{Particles, retain};
pub use pressure::PressureForce;
pub use step::{max_stable_step, substep_count};
