//! The ionization table: ion pairs by energy and altitude for a spectrum.

use bansho_base::{host::parallel::prelude::*, math::lerp};

use super::{
    energy_grid::{self, NODES, Spectrum, node_energy_ev},
    fang2010::{AirLayer, MonoenergeticBeam},
};
use crate::physics::atmosphere::{Atmosphere, LEVEL_SPACING, LEVELS, locate_level};

/// A profile over the levels of the atmosphere.
pub type AltitudeProfile = [f64; LEVELS];

/// Ionization rate in m^-3 s^-1 per mW m^-2 for each energy node and level, of monoenergetic electrons and of the
/// spectrum about each node.
#[derive(Clone, Debug)]
pub struct Deposition {
    monoenergetic_profiles: Vec<AltitudeProfile>,
    /// Cumulative fractions of the energy flux, by central energy, then by energy: for inverse transform sampling.
    cumulative_fractions: Vec<[f64; NODES]>,
    /// Guide tables (Chen and Asau): for each of [`GUIDE_ENTRIES`] intervals of (0, 1) the first node that a uniform
    /// number in it can select.
    guide_tables: Vec<[u8; GUIDE_ENTRIES]>,
    spectrum_profiles: Vec<AltitudeProfile>,
}

/// Entries of a guide table, a power of two: one or two steps lead from the guide to the sampled node.
const GUIDE_ENTRIES: usize = 64;
const _: () = assert!(NODES <= u8::MAX as usize);

impl Deposition {
    /// The table for a spectrum; takes a few milliseconds.
    #[must_use]
    pub fn new(air: &Atmosphere, spectrum: Spectrum) -> Self {
        let layers: Vec<AirLayer> = air.levels().iter().map(AirLayer::new).collect();
        let monoenergetic_profiles: Vec<AltitudeProfile> = (0..NODES)
            .into_par_iter()
            .map(|node| {
                let beam = MonoenergeticBeam::new(node_energy_ev(node));
                std::array::from_fn(|level| beam.ionization(&layers[level]))
            })
            .collect();
        Self::from_profiles(monoenergetic_profiles, spectrum)
    }

    /// The table for a spectrum, from the profiles of monoenergetic electrons of every node.
    pub(super) fn from_profiles(monoenergetic_profiles: Vec<AltitudeProfile>, spectrum: Spectrum) -> Self {
        let weights: Vec<_> = (0..NODES).into_par_iter().map(|node| spectrum.flux_fractions(node)).collect();
        let spectrum_profiles =
            weights.par_iter().map(|weights| weighted_sum(&monoenergetic_profiles, weights)).collect();
        let cumulative_fractions: Vec<_> = weights.iter().map(running_sum).collect();
        let guide_tables = cumulative_fractions.iter().map(guide_table).collect();
        Self { monoenergetic_profiles, cumulative_fractions, guide_tables, spectrum_profiles }
    }

    /// Profile of monoenergetic electrons of a node.
    ///
    /// # Panics
    ///
    /// If the node is not in the grid.
    #[must_use]
    pub fn monoenergetic_profile(&self, node: usize) -> &AltitudeProfile {
        &self.monoenergetic_profiles[node]
    }

    /// Profile of the spectrum about the energy of a node.
    ///
    /// # Panics
    ///
    /// If the node is not in the grid.
    #[must_use]
    pub fn spectrum_profile(&self, node: usize) -> &AltitudeProfile {
        &self.spectrum_profiles[node]
    }

    /// Ionization rate, m^-3 s^-1 per mW m^-2, for a spectrum about any energy at any altitude: linear between levels
    /// and, in log energy, between nodes; 0 outside 80-800 km.
    #[must_use]
    pub fn ionization(&self, energy_ev: f64, altitude_km: f64) -> f64 {
        interpolate(&self.spectrum_profiles, energy_ev, altitude_km)
    }

    /// Samples the energy node of one particle by energy flux: the mean of the
    /// [`monoenergetic_profile`](Self::monoenergetic_profile)s of particles with equal flux is
    /// [`ionization`](Self::ionization).
    #[must_use]
    pub fn sample_node(&self, energy_ev: f64, uniforms: [f64; 2]) -> usize {
        self.sample_node_around(energy_grid::sample_bracketing_node(energy_ev, uniforms[0]), uniforms[1])
    }

    /// The same for the spectrum about the energy of a node.
    ///
    /// # Panics
    ///
    /// If the node is not in the grid.
    #[must_use]
    pub fn sample_node_around(&self, node: usize, uniform: f64) -> usize {
        let (sums, guide) = (&self.cumulative_fractions[node], &self.guide_tables[node]);
        let mut node_drawn = guide[(uniform * GUIDE_ENTRIES as f64) as usize & (GUIDE_ENTRIES - 1)] as usize;
        // Two branch-free steps are nearly always enough; a data-dependent branch would be mispredicted.
        for _ in 0..2 {
            node_drawn = (node_drawn + usize::from(sums[node_drawn] <= uniform)).min(NODES - 1);
        }
        while node_drawn < NODES - 1 && sums[node_drawn] <= uniform {
            node_drawn += 1;
        }
        node_drawn
    }
}

/// Column-integrated ionization, m^-2 s^-1 per mW m^-2.
#[must_use]
pub fn column_ion_pairs(profile: &AltitudeProfile) -> f64 {
    profile.iter().sum::<f64>() * LEVEL_SPACING
}

/// Bilinear lookup by energy and altitude; 0 outside the levels.
fn interpolate(profiles: &[AltitudeProfile], energy_ev: f64, altitude_km: f64) -> f64 {
    let (level, fraction) = locate_level(altitude_km);
    let (node, mixing) = energy_grid::locate(energy_ev);
    if !crate::physics::atmosphere::covers(altitude_km) {
        return 0.0;
    }
    let [low, high] = [node, node + 1].map(|node| lerp(profiles[node][level], profiles[node][level + 1], fraction));
    lerp(low, high, mixing)
}

/// Weighted sum of profiles.
fn weighted_sum(profiles: &[AltitudeProfile], weights: &[f64; NODES]) -> AltitudeProfile {
    let mut sum = [0.0; LEVELS];
    for (profile, weight) in profiles.iter().zip(weights).filter(|(_, weight)| **weight > 1e-12) {
        for (total, value) in sum.iter_mut().zip(profile) {
            *total += weight * value;
        }
    }
    sum
}

fn running_sum(weights: &[f64; NODES]) -> [f64; NODES] {
    let mut sum = 0.0;
    weights.map(|weight| {
        sum += weight;
        sum
    })
}

/// The guide table of a cumulative distribution.
fn guide_table(sums: &[f64; NODES]) -> [u8; GUIDE_ENTRIES] {
    std::array::from_fn(|entry| {
        let lower_bound = entry as f64 / GUIDE_ENTRIES as f64;
        sums.partition_point(|sum| *sum <= lower_bound).min(NODES - 1) as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::{
        atmosphere::{atmosphere, level_altitude_km},
        precipitation::energy_grid::ARC,
    };

    fn peak_km(profile: &AltitudeProfile) -> f64 {
        level_altitude_km((0..LEVELS).max_by(|a, b| profile[*a].total_cmp(&profile[*b])).unwrap())
    }

    #[test]
    fn deposition_peaks_where_fang_has_it() {
        for (spectrum, tolerance_km) in [(Spectrum::Monoenergetic, 1.0), (ARC, 4.0)] {
            let table = Deposition::new(atmosphere(), spectrum);
            for (energy_ev, reference_km) in [(1e3, 158.35), (3e3, 122.23), (1e4, 104.68), (3e4, 95.194)] {
                let profile = std::array::from_fn(|level| table.ionization(energy_ev, level_altitude_km(level)));
                let found_km = peak_km(&profile);
                assert!((found_km - reference_km).abs() <= tolerance_km, "{spectrum:?} {energy_ev} eV: {found_km}");
            }
        }
    }

    #[test]
    fn energies_between_nodes_differ_little_from_the_formula() {
        let table = Deposition::new(atmosphere(), Spectrum::Monoenergetic);
        for energy_ev in [137.0, 1037.0, 3333.0, 10_370.0, 44_000.0] {
            let beam = MonoenergeticBeam::new(energy_ev);
            let (mut difference, mut sum) = (0.0, 0.0);
            for (level, air) in atmosphere().levels().iter().enumerate() {
                let expected = beam.ionization(&AirLayer::new(air));
                difference += (table.ionization(energy_ev, level_altitude_km(level)) - expected).abs();
                sum += expected;
            }
            assert!(difference < 0.01 * sum, "{energy_ev}: {}", difference / sum);
        }
        assert_eq!((table.ionization(1e4, 79.9), table.ionization(1e4, 800.1)), (0.0, 0.0));
    }

    #[test]
    fn a_spectrum_keeps_the_energy() {
        for spectrum in [ARC, Spectrum::Maxwellian] {
            let table = Deposition::new(atmosphere(), spectrum);
            for node in [32, 64, 80] {
                let pairs = column_ion_pairs(table.spectrum_profile(node));
                assert!((1.6e14..1.784e14).contains(&pairs), "{spectrum:?} {node}: {pairs}");
            }
        }
    }

    #[test]
    fn drawn_particles_follow_the_shares() {
        let table = Deposition::new(atmosphere(), Spectrum::Maxwellian);
        let energy_ev = node_energy_ev(50);
        let mut counts = [0.0; NODES];
        for i in 0..100_000 {
            counts[table.sample_node(energy_ev, [0.5, (i as f64 + 0.5) * 1e-5])] += 1e-5;
        }
        let weights = Spectrum::Maxwellian.flux_fractions(50);
        assert!((0..NODES).all(|node| (counts[node] - weights[node]).abs() < 2e-5));
        assert_eq!(table.sample_node(1e9, [0.999_999, 0.999_999_999]), NODES - 1);
    }
}
