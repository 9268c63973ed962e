//! The logarithmic grid of electron energies: 32 nodes per decade, 100 eV to 100 keV.

use bansho_base::math::{self, approximations};

/// Lowest energy, eV: the lower limit of the parameterization of Fang et al. (2010).
pub const LOWEST_EV: f64 = 100.0;
/// Highest energy, eV: above it electrons reach below 80 km.
pub const HIGHEST_EV: f64 = 100_000.0;
const PER_DECADE: f64 = 32.0;
/// Energies of the grid, both ends included.
pub const NODES: usize = 97;

/// Energy of a node, eV.
#[must_use]
pub fn node_energy_ev(node: usize) -> f64 {
    LOWEST_EV * math::exp2(node as f64 / PER_DECADE * std::f64::consts::LOG2_10)
}

/// The node below an energy and the interpolation fraction toward the next, in log energy; clamped to 100 eV-100 keV.
#[must_use]
pub fn locate(energy_ev: f64) -> (usize, f64) {
    let coordinate = (PER_DECADE * math::log10(energy_ev.max(LOWEST_EV) / LOWEST_EV)).min((NODES - 1) as f64);
    let node = (coordinate as usize).min(NODES - 2);
    (node, coordinate - node as f64)
}

/// Fractional node index of an energy, for vectorized loops.
#[inline(always)]
pub(crate) fn node_coordinate(energy_ev: f32) -> f32 {
    const PER_OCTAVE: f32 = PER_DECADE as f32 * std::f32::consts::LOG10_2;
    (PER_OCTAVE * approximations::log2(energy_ev * (1.0 / LOWEST_EV) as f32)).clamp(0.0, (NODES - 1) as f32)
}

/// One of the two bracketing nodes: the mean over `uniform` in [0, 1) is the linear interpolation.
#[must_use]
pub fn sample_bracketing_node(energy_ev: f64, uniform: f64) -> usize {
    let (node, fraction) = locate(energy_ev);
    node + (uniform < fraction) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_are_geometric_and_found_again() {
        for (node, energy_ev) in [(0, 100.0), (32, 1000.0), (64, 10_000.0), (96, 100_000.0)] {
            assert!((node_energy_ev(node) / energy_ev - 1.0).abs() < 1e-12);
        }
        for node in 0..NODES {
            let (found, fraction) = locate(node_energy_ev(node));
            assert!((found as f64 + fraction - node as f64).abs() < 1e-9);
            assert!((f64::from(node_coordinate(node_energy_ev(node) as f32)) - node as f64).abs() < 1e-3);
        }
        assert_eq!((locate(0.0), locate(f64::NAN), locate(1e9)), ((0, 0.0), (0, 0.0), (NODES - 2, 1.0)));
    }

    #[test]
    fn chosen_nodes_have_the_energy_for_their_mean() {
        let between = math::sqrt(node_energy_ev(40) * node_energy_ev(41));
        let upper = (0..1000).filter(|i| sample_bracketing_node(between, *i as f64 / 1000.0) == 41).count();
        assert_eq!(upper, 500);
        assert_eq!(sample_bracketing_node(1e9, 0.999), NODES - 1);
    }
}
