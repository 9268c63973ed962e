//! Energy spectra of precipitating electrons, as fractions of the energy flux on the energy grid.

use bansho_base::math;

use super::energy_grid::{NODES, node_energy_ev};

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
