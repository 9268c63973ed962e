//! Fields on a rectangle of square cells: sampling, gradient, Poisson's equation.

mod grid;
mod poisson;
mod relax;
mod sine;

pub use grid::{Gradient2, Grid2};
pub use poisson::PoissonSolver;
pub use relax::{relax, residual};
