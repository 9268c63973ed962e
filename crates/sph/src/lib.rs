//! Smoothed-particle hydrodynamics (SPH) in two and three dimensions, deterministic and vectorized.
//!
//! # Model
//! A field `A` is represented by particles of mass `m` and density `rho`: `A(x) = sum_j m_j A_j / rho_j W(|x - x_j|)`, with a smoothing
//! kernel `W` that ends at the support radius `d`. This crate sums over neighbors; which gas the particles are is the caller's model
//! (`bansho_fire::particles` in 3-D, `bansho_aurora` in 2-D). All types take the number of dimensions `D`.
//!
//! # References
//! - S. Inagaki, M. Imura, S. Ikeda, Y. Manabe and K. Chihara, "Real-time rendering of flame using particle-based fluid simulation".
//! - M. Mueller, D. Charypar and M. Gross, "Particle-based fluid simulation for interactive applications" (2003): poly6 and spiky kernels.
//! - J. J. Monaghan and J. C. Lattanzio, "A refined particle method for astrophysical problems" (1985): the cubic spline.
//! - J. J. Monaghan, "On the problem of penetration in particle methods" (1989): XSPH.
//! - J. J. Monaghan, "Smoothed particle hydrodynamics" (1992): the time step.
//!
//! # Equations
//! | equation | Inagaki et al. | aurora thesis | code |
//! |---|---|---|---|
//! | poly6 kernel | (2) | (2.12) | [`Poly6`] |
//! | spiky kernel and its gradient | | (2.15), (2.16) | [`Spiky`] |
//! | cubic spline kernel and its gradient | | (2.17), (2.18) | [`CubicSpline`] |
//! | density `rho_i = sum_j m_j W` | (3) | (2.11) | [`compute_densities`] |
//! | pressure `p = k (rho - rho_0)` | (11) | (2.13) | [`StateEquation::pressure`] |
//! | pressure force, and `a = f / rho` | (12), (8) | (2.14) | [`PressureForce::compute_accelerations`] |
//! | interpolated field (6), any other sum | (6) | | [`PairTerm`] for [`Cells::sum`] |
//! | velocity, then position | section 4.3, step 5 | | [`Particles::advance`] |
//! | XSPH weights | | | [`mixing_weights`] |
//! | Courant-Friedrichs-Lewy condition | | | [`max_stable_step`], [`substep_count`] |
//!
//! # Data flow
//! 1. [`Particles::sort`] hands positions and ids to [`Cells::assign`] (`cells`), which sorts by cell key and id (`sorting`: a sample sort
//!    by ranges of keys, a radix sort within each) and lists the occupied cells.
//! 2. Rows of cells (`cell_rows`) are divided into groups of up to eight consecutive particles, each with its list of candidate neighbors
//!    (`neighbor_groups`).
//! 3. [`Cells::reorder`] permutes the caller's other arrays into the sorted order.
//! 4. [`Cells::sum`] (`neighbor_sums`) evaluates a [`PairTerm`] for eight particles at a time over their common candidates.
//! 5. Density, pressure force and mixing (`forces`) are such terms, with the kernels of `kernel`.
//! 6. [`Particles::advance`] integrates (`particles`).
//!
//! Results are the same for any number of threads and any order in which particles were given, bit for bit.
//!
//! # Example
//! ```
//! use bansho_sph::{Cells, KernelShape, Particles, PressureForce, StateEquation, compute_densities};
//!
//! let mut particles = Particles::<3>::default();
//! particles.push([0.0; 3], [0.0; 3], 1.0, 0);
//! particles.push([0.1, 0.0, 0.0], [0.0; 3], 1.0, 1);
//! let mut cells = Cells::new(0.3);
//! let mut force = PressureForce::new(KernelShape::Spiky);
//! let state = StateEquation { rest_density: 0.0, negative_pressure: false };
//! let (mut density, mut acceleration) = (Vec::new(), Default::default());
//!
//! particles.sort(&mut cells); // then `cells.reorder` for arrays of the model's own
//! compute_densities(&cells, KernelShape::Poly6, &particles.masses, &mut density);
//! let pressure: Vec<f32> = density.iter().map(|density| state.pressure(10.0, *density)).collect();
//! force.compute_accelerations(&cells, &particles.masses, &density, &pressure, &mut acceleration);
//! particles.advance(&acceleration, 1e-3);
//! assert!(particles.velocities[0][0] < 0.0 && particles.velocities[0][1] > 0.0);
//! ```

mod cell_rows;
mod cells;
mod forces;
mod kernel;
mod neighbor_groups;
mod neighbor_sums;
mod particles;
mod sorting;
#[cfg(test)]
mod tests;

pub use bansho_base::math::simd::Real;

pub use cells::Cells;
pub use forces::{PressureForce, StateEquation, compute_densities, max_stable_step, mixing_weights, substep_count};
pub use kernel::{CubicSpline, Kernel, KernelShape, Poly6, SmoothingKernel, Spiky};
pub use neighbor_sums::{Pair, PairTerm};
pub use particles::{Particles, retain};
