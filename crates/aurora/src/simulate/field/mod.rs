//! Fields on a rectangle of square cells: sampling, gradient, Poisson's equation.

pub mod gauss_seidel;
mod grid;
mod poisson;
pub(crate) mod scatter;
pub(crate) mod sheet_charge;
pub(crate) mod sheet_field;
mod sine_transform;

pub use gauss_seidel::{gauss_seidel_sweep, relative_residual};
pub use grid::{Gradient2, Grid2};
pub use poisson::PoissonSolver;
