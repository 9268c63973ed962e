//! The logarithmic grid of electron energies, 32 nodes per decade from 100 eV to 100 keV, and the energy spectra on it as fractions of the energy flux.

use bansho_base::{math, math::approximations};

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

/// Energy spectrum about a nominal energy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Spectrum {
    /// One energy.
    Monoenergetic,
    /// Number flux `exp(-((E - E_0) / (width E_0))^2 / 2)`: acceleration by a parallel potential drop, as in arcs.
    Gaussian {
        /// Standard deviation as a fraction of the central energy.
        width: f64,
    },
    /// Number flux `E exp(-E / E_0)` with characteristic energy E_0 and mean energy 2 E_0: a hot plasma, as in diffuse
    /// auroras.
    Maxwellian,
}

/// Spectrum of arcs: a width of about a third is typical of inverted-V precipitation.
pub const ARC: Spectrum = Spectrum::Gaussian { width: 0.35 };

impl Spectrum {
    /// Fractions of the energy flux at each node, with sum 1, if the central or characteristic energy is that of
    /// `node`.
    ///
    /// The spectrum is truncated at the ends of the grid and normalized.
    #[must_use]
    pub fn flux_fractions(self, node: usize) -> [f64; NODES] {
        let energy_ev = node_energy_ev(node);
        let mut fractions: [f64; NODES] = std::array::from_fn(|other| {
            let ratio = node_energy_ev(other) / energy_ev;
            // Energy flux per logarithmic interval is the number flux times E^2.
            ratio * ratio * self.number_flux(ratio, other == node)
        });
        let sum: f64 = fractions.iter().sum();
        fractions.iter_mut().for_each(|fraction| *fraction /= sum);
        fractions
    }

    /// Number flux by E / E_0, in any unit.
    fn number_flux(self, ratio: f64, central: bool) -> f64 {
        match self {
            Self::Monoenergetic => central as u8 as f64,
            // The center is exact, also for widths below the grid spacing.
            Self::Gaussian { .. } if central => 1.0,
            Self::Gaussian { width } => {
                let deviation = (ratio - 1.0) / width;
                math::exp(-0.5 * deviation * deviation)
            }
            Self::Maxwellian => ratio * math::exp(-ratio),
        }
    }
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

    /// Mean of E over the number flux: the energy flux fractions divided by E weigh the particles.
    fn mean_energy_ev(fractions: &[f64; NODES]) -> f64 {
        let particles: f64 = (0..NODES).map(|node| fractions[node] / node_energy_ev(node)).sum();
        fractions.iter().sum::<f64>() / particles
    }

    #[test]
    fn spectra_have_their_mean_energies() {
        let node = 64;
        let mean = |spectrum: Spectrum| mean_energy_ev(&spectrum.flux_fractions(node)) / node_energy_ev(node);
        assert_eq!(mean(Spectrum::Monoenergetic), 1.0);
        // 0.35 reaches nothing negative to speak of: 2.9 standard deviations.
        assert!((mean(ARC) - 1.0).abs() < 0.01, "{}", mean(ARC));
        assert!((mean(Spectrum::Maxwellian) - 2.0).abs() < 0.02, "{}", mean(Spectrum::Maxwellian));
    }

    #[test]
    fn shares_add_up_for_every_width_and_node() {
        for width in [0.0, 1e-9, 0.01, 0.35, 5.0] {
            for node in [0, 1, 50, NODES - 1] {
                let fractions = Spectrum::Gaussian { width }.flux_fractions(node);
                assert!((fractions.iter().sum::<f64>() - 1.0).abs() < 1e-12, "{width} {node}");
                assert!(fractions.iter().all(|fraction| *fraction >= 0.0));
            }
        }
    }
}
