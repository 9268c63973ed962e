//! Poisson's equation by relaxation, as the aurora thesis has it.

use super::grid::Grid2;

/// One Gauss-Seidel sweep toward `laplacian(phi) - phi / l^2 = source`, row by row; phi is 0 in ghost cells around the grid.
///
/// The aurora thesis (2.6) with `source = rho / eps`; `screening` is `1 / l^2`, 0 in the thesis. Returns the greatest change.
///
/// # Panics
/// If potential and source are not of one size.
pub fn gauss_seidel_sweep(potential: &mut Grid2, source: &Grid2, screening: f64) -> f64 {
    assert_eq!(potential.size(), source.size(), "one source a cell");
    let [columns, rows] = potential.size();
    let area = potential.spacing() * potential.spacing();
    let scale = 1.0 / area.mul_add(screening, 4.0);
    let mut change = 0.0_f64;
    for j in 0..rows {
        for i in 0..columns {
            let (x, z) = (i as isize, j as isize);
            let around =
                (potential.at(x - 1, z) + potential.at(x + 1, z)) + (potential.at(x, z - 1) + potential.at(x, z + 1));
            let index = j * columns + i;
            let value = scale * (around - area * source.values()[index]);
            change = change.max((value - potential.values()[index]).abs());
            potential.values_mut()[index] = value;
        }
    }
    change
}

/// What is left of the equation: `laplacian(phi) - phi / l^2 - source`, root mean square over that of the source.
///
/// 0 if the source is 0 everywhere and the equation holds.
///
/// # Panics
/// If potential and source are not of one size.
#[must_use]
pub fn relative_residual(potential: &Grid2, source: &Grid2, screening: f64) -> f64 {
    assert_eq!(potential.size(), source.size(), "one source a cell");
    let columns = potential.size()[0];
    let inverse = 1.0 / (potential.spacing() * potential.spacing());
    let (mut left, mut whole) = (0.0, 0.0);
    for (index, source) in source.values().iter().enumerate() {
        let (i, j) = ((index % columns) as isize, (index / columns) as isize);
        let around =
            (potential.at(i - 1, j) + potential.at(i + 1, j)) + (potential.at(i, j - 1) + potential.at(i, j + 1));
        let error = inverse * (around - 4.0 * potential.at(i, j)) - screening * potential.at(i, j) - source;
        left += error * error;
        whole += source * source;
    }
    if left == 0.0 { 0.0 } else { (left / whole).sqrt() }
}
