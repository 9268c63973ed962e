//! Mixing: what particles carry drifts toward what their neighbours carry, and its total is kept.

use rayon::prelude::*;

use super::sorting::MIN_PARTICLES_PER_TASK;

/// Weights `w = m / sqrt(rho)`: for a pair they make the geometric mean of both densities.
///
/// Adding a share of `1 / sqrt(rho_i)` of `sum_j w_j (f_j - f_i) W` to each `f_i` keeps `sum m f` (XSPH, Monaghan 1989, with the
/// geometric in place of the arithmetic mean).
pub fn mixing_weights(masses: &[f32], densities: &[f32], weights: &mut Vec<f32>) {
    let weight = |(mass, density): (&f32, &f32)| mass / density.sqrt();
    masses.par_iter().zip(densities).with_min_len(MIN_PARTICLES_PER_TASK).map(weight).collect_into_vec(weights);
}
