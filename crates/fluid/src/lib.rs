//! Gas of variable density at low Mach number on a staggered grid.
//!
//! # Model
//! Velocities are on the faces of cubic cells; densities, and the quantities of a kilogram of gas, are at their centers. Pressures are relative to the air at
//! rest. The bottom of the grid is a floor or open; its sides and its top are open to air in a uniform wind, so that a plume entrains air through the sides and
//! leaves through the top. Solids are cells through whose faces nothing flows. SI units throughout.
//!
//! # Equations
//! | equation | what it says | function |
//! |---|---|---|
//! | `d rho/dt + div(rho u) = 0` | mass | [`Carrier::advance`] |
//! | `d(rho Z)/dt + div(rho u Z) = div(rho D grad Z)` | what the gas carries | [`Carrier::advance`] |
//! | `du/dt + u . grad u = -(1/rho) grad p + g (rho_air - rho)/rho + div(nu grad u)` | momentum | [`Flow::accelerate`] |
//! | `div u = S` | expansion, which the owner of a flow states | [`Flow::divergence`] |
//! | `laplacian p = rho_0 (div u* - S) / t` | pressure of the least density rho_0 | `projection::Projection::project` |
//! | `p = -rho (u^2 - U^2) / 2` | pressure where air enters from far away | `sides::side_pressure` |
//! | `nu = (c h)^2 abs(S)` | eddy viscosity | `momentum::eddy_viscosity` |
//!
//! # Step
//! 1. [`Flow::transport`] carries density and quantities, in two stages ([`Carrier::advance`]), with the values at faces of `reconstruction`.
//! 2. The owner of the flow burns the gas and sets [`Flow::divergence`].
//! 3. [`Flow::accelerate`] carries momentum (`momentum`), adds forces, and projects the velocity (`projection`: sine transforms along x and z, elimination
//!    along y; with solids the capacitance matrix method).
//!
//! The equation of the pressure has one density for all cells; the rest of the acceleration, `(1/rho - 1/rho_0) grad p`, is computed from the pressure of the
//! last step. Mass is conserved exactly. A mixture reaches the density that belongs to its temperature by expansion. Mixing ideal gases does not change their
//! volume, so only burning and cooling expand and contract the gas, even where numerical diffusion mixes it.
//!
//! # References
//! - F. Harlow and J. Welch, "Numerical calculation of time-dependent viscous incompressible flow of fluid with free surface" (1965): the grid.
//! - B. Koren, "A robust upwind discretization method for advection, diffusion and source terms" (1993): the limiter.
//! - C.-W. Shu and S. Osher, "Efficient implementation of essentially non-oscillatory shock-capturing schemes" (1988): two stages.
//! - M. Dodd and A. Ferrante, "A fast pressure-correction method for incompressible two-fluid flows" (2014): pressure with variable density.
//! - K. McGrattan et al., "Fire Dynamics Simulator, technical reference guide", NIST SP 1018: open sides.
//! - J. Smagorinsky, "General circulation experiments with the primitive equations" (1963): eddy viscosity.
//! - J. Makhoul, "A fast cosine transform in one and two dimensions" (1980): the transforms.
//! - B. Buzbee, F. Dorr, J. George and G. Golub, "The direct solution of the discrete Poisson equation on irregular regions" (1971): pressure around solids.
//! - M. Hestenes and E. Stiefel, "Methods of conjugate gradients for solving linear systems" (1952).

mod flow;
mod grid;
mod momentum;
mod projection;
mod reconstruction;
mod refine;
mod sides;
mod solids;
mod transport;

pub use flow::{Flow, FlowSettings};
pub use grid::{GHOST_LAYERS, Grid};
pub use momentum::Velocity;
pub use sides::Ambient;
pub use solids::Solids;
pub use transport::{ActiveRows, Carrier, Contents, QUANTITIES};

#[cfg(test)]
mod tests;
