//! The electric field: grid, Poisson solvers and charge of the sheets.

mod grid;
mod poisson;
pub(crate) mod sheet_charge;
pub(crate) mod sheet_field;

pub use grid::{Gradient2, Grid2};
pub use poisson::{PoissonSolver, gauss_seidel_sweep, relative_residual};
