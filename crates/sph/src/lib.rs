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
//! 1. [`Particles::sort`] hands positions and ids to [`Cells::assign`] (`cells`), which sorts by cell key (`cell_keys`) and id (`sorting`: a
//!    sample sort by ranges of keys, a counting sort or a radix sort within each) and notes where each cell begins.
//! 2. Rows of cells (`cell_rows`) are divided into groups of up to eight consecutive particles, each with its list of candidate neighbors
//!    (`neighbor_groups`).
//! 3. [`Cells::reorder`] permutes the caller's other arrays into the sorted order.
//! 4. [`Cells::sum`] (`neighbor_sums`) evaluates a [`PairTerm`] for eight particles at a time over their common candidates.
//! 5. Density, pressure force and mixing (`forces`) are such terms, with the kernels of `kernel`.
//! 6. [`Particles::advance`] integrates (`particles`).
//!
//! Results are the same for any number of threads and any order in which particles were given, bit for bit.
//!
//! # Units
//! The crate has no units of its own: any consistent set will do. With m, kg and s, densities are in kg/m^3 in 3-D and in kg/m^2 in 2-D, pressures `p = k (rho -
//! rho_0)` in Pa (N/m in 2-D), the stiffness k in m^2/s^2 (the square of the speed of sound), accelerations in m/s^2. The support radius d is a length; 2 to 3 times
//! the distance between particles gives each about 20 neighbors in 2-D and 50 in 3-D.
//!
//! # Bad input
//! [`Cells::try_new`] and [`Particles::check`] return a [`SphError`] that names what is wrong. Sums do not look at values again: a particle at NaN, or farther than
//! 1e12 from the origin, has no neighbors, and a mass or field of NaN makes its neighbors NaN. An array with more or fewer values than there are particles is an
//! error of the program and panics, as each function documents.
//!
//! # Example
//! A block of water in 2-D, 2 m wide and 1 m high, falls from 5 cm onto a floor:
//!
//! ```
//! use bansho_sph::{
//!     Cells, KernelShape, Particles, PressureForce, StateEquation, compute_densities, max_stable_step, substep_count,
//! };
//!
//! const SPACING: f32 = 0.05; // m
//! const REST_DENSITY: f32 = 1000.0; // kg/m^2
//! const STIFFNESS: f32 = 400.0; // m^2/s^2: sound at 20 m/s, faster than anything moves
//! const FRAME: f32 = 1.0 / 60.0; // s
//!
//! // 40 x 20 particles at rest. Each has an id that it keeps when particles are sorted.
//! let mut particles = Particles::<2>::default();
//! for id in 0..800 {
//!     let position = [id % 40, id / 40 + 1].map(|count| count as f32 * SPACING);
//!     particles.push(position, [0.0, 0.0], REST_DENSITY * SPACING * SPACING, id);
//! }
//! particles.check()?;
//!
//! let mut cells = Cells::try_new(2.5 * SPACING)?;
//! let mut pressure_force = PressureForce::new(KernelShape::Spiky);
//! // Water does not pull: where it is thinner than at rest its pressure is 0.
//! let water = StateEquation { rest_density: REST_DENSITY, negative_pressure: false };
//! let (mut densities, mut accelerations) = (Vec::new(), <[Vec<f32>; 2]>::default());
//!
//! for _frame in 0..12 {
//!     // The time step must be so short that sound crosses no particle within it.
//!     let fastest = particles.velocities[1].iter().fold(0.0_f32, |fastest, v| fastest.max(v.abs()));
//!     let longest_step = max_stable_step(cells.support_radius(), STIFFNESS, fastest);
//!     let steps = substep_count(FRAME, longest_step, 100);
//!     for _step in 0..steps {
//!         // 1. Find neighbors. This sorts the particles; arrays of your own follow by `cells.reorder`.
//!         particles.sort(&mut cells);
//!         // 2. Densities, then pressures.
//!         compute_densities(&cells, KernelShape::Poly6, &particles.masses, &mut densities);
//!         let pressures: Vec<f32> = densities.iter().map(|density| water.pressure(STIFFNESS, *density)).collect();
//!         // 3. Accelerations by pressure, and gravity.
//!         pressure_force.compute_accelerations(&cells, &particles.masses, &densities, &pressures, &mut accelerations);
//!         accelerations[1].iter_mut().for_each(|acceleration| *acceleration -= 9.81);
//!         // 4. Velocities, then positions; the floor stops what falls through it.
//!         particles.advance(&accelerations, FRAME / steps as f32);
//!         for (y, v) in particles.positions[1].iter_mut().zip(&mut particles.velocities[1]) {
//!             (*y, *v) = if *y < 0.0 { (0.0, v.max(0.0)) } else { (*y, *v) };
//!         }
//!     }
//! }
//!
//! // After 0.2 s it lies on the floor and has spread a little, nowhere much denser than at rest.
//! let mean = |values: &[f32]| values.iter().sum::<f32>() / values.len() as f32;
//! assert!(particles.positions[1].iter().all(|y| (0.0..1.2).contains(y)));
//! assert!(mean(&particles.positions[1]) < 0.52, "it fell");
//! assert!(particles.positions[0].iter().any(|x| *x < -0.02), "it spread");
//! assert!((mean(&particles.positions[0]) - 0.975).abs() < 0.01, "to both sides alike");
//! assert!(densities.iter().all(|density| *density < 1.2 * REST_DENSITY));
//! # Ok::<(), bansho_sph::SphError>(())
//! ```

mod cell_keys;
mod cell_rows;
mod cells;
mod error;
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
pub use error::{ParticleArray, SphError};
pub use forces::{PressureForce, StateEquation, compute_densities, max_stable_step, mixing_weights, substep_count};
pub use kernel::{CubicSpline, Kernel, KernelShape, Poly6, SmoothingKernel, Spiky};
pub use neighbor_sums::{Pair, PairTerm};
pub use particles::{Particles, retain};
