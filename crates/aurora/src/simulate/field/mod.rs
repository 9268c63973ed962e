//! Fields on a rectangle of square cells: sampling, gradient, Poisson's equation.

mod grid;
mod poisson;
pub(crate) mod sheet_charge;
pub(crate) mod sheet_field;
mod sine_transform;

pub use grid::{Gradient2, Grid2};
pub use poisson::PoissonSolver;
pub use poisson::{gauss_seidel_sweep, relative_residual};
