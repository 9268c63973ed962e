//! The table of deposition: ion pairs by energy and altitude for a spectrum.

use bansho_base::math::lerp;

use super::{
    energy_grid::{self, NODES, node_energy_ev},
    fang2010::{AirLayer, Monoenergetic},
    hard_sphere::{DEFAULT_RADIUS, HardSphere},
    spectrum::Spectrum,
};
use crate::physics::atmosphere::{Atmosphere, LEVEL_SPACING, LEVELS, locate_level};
use rayon::prelude::*;

/// A profile over the levels of the atmosphere.
pub type Profile = [f64; LEVELS];

/// Ion pairs in m^-3 s^-1 per mW m^-2 for each energy of the grid and each level, of single electrons and of a spectrum about them.
#[derive(Clone, Debug)]
pub struct Deposition {
    monoenergetic: Vec<Profile>,
    /// Shares of the energy flux by central energy, then by energy; summed up for drawing.
    cumulative_shares: Vec<[f64; NODES]>,
    /// For each of so many equal parts of (0, 1) the first node that a uniform number in it may draw.
    guides: Vec<[u8; GUIDES]>,
    mixed: Vec<Profile>,
}

/// Parts of (0, 1), a power of two: from the node at which one begins, it is one or two to the one that is drawn.
const GUIDES: usize = 64;
const _: () = assert!(NODES <= u8::MAX as usize);

impl Deposition {
    /// The table for a spectrum. A few milliseconds.
    #[must_use]
    pub fn new(air: &Atmosphere, spectrum: Spectrum) -> Self {
        let layers: Vec<AirLayer> = air.levels().iter().map(AirLayer::new).collect();
        let monoenergetic: Vec<Profile> = (0..NODES)
            .into_par_iter()
            .map(|node| {
                let beam = Monoenergetic::new(node_energy_ev(node));
                std::array::from_fn(|level| beam.ionisation(&layers[level]))
            })
            .collect();
        Self::of_profiles(monoenergetic, spectrum)
    }

    /// The table of the thesis's fall through hard spheres, [`DEFAULT_RADIUS`].
    #[must_use]
    pub fn of_hard_spheres(air: &Atmosphere, spectrum: Spectrum) -> Self {
        Self::of_profiles(HardSphere::new(air, DEFAULT_RADIUS, 0.0).profiles(air), spectrum)
    }

    fn of_profiles(monoenergetic: Vec<Profile>, spectrum: Spectrum) -> Self {
        let shares: Vec<_> = (0..NODES).into_par_iter().map(|node| spectrum.shares(node)).collect();
        let mixed = shares.par_iter().map(|shares| mix(&monoenergetic, shares)).collect();
        let cumulative_shares: Vec<_> = shares.iter().map(running_sum).collect();
        let guides = cumulative_shares.iter().map(guides).collect();
        Self { monoenergetic, cumulative_shares, guides, mixed }
    }

    /// The profile of electrons with exactly the energy of a node.
    ///
    /// # Panics
    /// For a node that is not of the grid.
    #[must_use]
    pub fn monoenergetic(&self, node: usize) -> &Profile {
        &self.monoenergetic[node]
    }

    /// The profile of the spectrum about the energy of a node.
    ///
    /// # Panics
    /// For a node that is not of the grid.
    #[must_use]
    pub fn mixed(&self, node: usize) -> &Profile {
        &self.mixed[node]
    }

    /// Ion pairs, m^-3 s^-1 per mW m^-2, for a spectrum about any energy at any altitude: linear between levels and, in the logarithm
    /// of the energy, between nodes. Nothing outside 80-800 km.
    #[must_use]
    pub fn ionisation(&self, energy_ev: f64, altitude_km: f64) -> f64 {
        interpolate(&self.mixed, energy_ev, altitude_km)
    }

    /// The node of one particle of the spectrum about an energy, drawn by energy flux: particles that carry equal flux have
    /// [`ionisation`](Self::ionisation) for the mean of their [`monoenergetic`](Self::monoenergetic) profiles.
    #[must_use]
    pub fn draw_node(&self, energy_ev: f64, uniforms: [f64; 2]) -> usize {
        self.draw_node_about(energy_grid::choose_node(energy_ev, uniforms[0]), uniforms[1])
    }

    /// The same for the spectrum about the energy of a node.
    ///
    /// # Panics
    /// For a node that is not of the grid.
    #[must_use]
    pub fn draw_node_about(&self, node: usize, uniform: f64) -> usize {
        let (sums, guide) = (&self.cumulative_shares[node], &self.guides[node]);
        let mut drawn = guide[(uniform * GUIDES as f64) as usize & (GUIDES - 1)] as usize;
        // Nearly always as far as it is, and without a branch that nobody could foresee.
        for _ in 0..2 {
            drawn = (drawn + usize::from(sums[drawn] <= uniform)).min(NODES - 1);
        }
        while drawn < NODES - 1 && sums[drawn] <= uniform {
            drawn += 1;
        }
        drawn
    }
}

/// Ion pairs of a profile in the whole column, m^-2 s^-1 per mW m^-2.
#[must_use]
pub fn column(profile: &Profile) -> f64 {
    profile.iter().sum::<f64>() * LEVEL_SPACING
}

/// Bilinear look-up in profiles by energy and altitude; 0 outside the levels.
fn interpolate(profiles: &[Profile], energy_ev: f64, altitude_km: f64) -> f64 {
    let (level, part) = locate_level(altitude_km);
    let (node, mixing) = energy_grid::locate(energy_ev);
    let at = |node: usize| lerp(profiles[node][level], profiles[node][level + 1], part);
    if crate::physics::atmosphere::covers(altitude_km) { lerp(at(node), at(node + 1), mixing) } else { 0.0 }
}

/// The profiles weighted by shares.
fn mix(profiles: &[Profile], shares: &[f64; NODES]) -> Profile {
    let mut sum = [0.0; LEVELS];
    for (profile, share) in profiles.iter().zip(shares).filter(|(_, share)| **share > 1e-12) {
        for (total, value) in sum.iter_mut().zip(profile) {
            *total += share * value;
        }
    }
    sum
}

fn running_sum(shares: &[f64; NODES]) -> [f64; NODES] {
    let mut sum = 0.0;
    shares.map(|share| {
        sum += share;
        sum
    })
}

fn guides(sums: &[f64; NODES]) -> [u8; GUIDES] {
    std::array::from_fn(|part| {
        let least = part as f64 / GUIDES as f64;
        sums.partition_point(|sum| *sum <= least).min(NODES - 1) as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::{
        atmosphere::{atmosphere, level_altitude_km},
        precipitation::spectrum::ARC,
    };

    fn peak_km(profile: &Profile) -> f64 {
        level_altitude_km((0..LEVELS).max_by(|a, b| profile[*a].total_cmp(&profile[*b])).unwrap())
    }

    #[test]
    fn deposition_peaks_where_fang_has_it() {
        for (spectrum, tolerance_km) in [(Spectrum::Monoenergetic, 1.0), (ARC, 4.0)] {
            let table = Deposition::new(atmosphere(), spectrum);
            for (energy_ev, reference_km) in [(1e3, 158.35), (3e3, 122.23), (1e4, 104.68), (3e4, 95.194)] {
                let profile = std::array::from_fn(|level| table.ionisation(energy_ev, level_altitude_km(level)));
                let found_km = peak_km(&profile);
                assert!((found_km - reference_km).abs() <= tolerance_km, "{spectrum:?} {energy_ev} eV: {found_km}");
            }
        }
    }

    #[test]
    fn energies_between_nodes_differ_little_from_the_formula() {
        let table = Deposition::new(atmosphere(), Spectrum::Monoenergetic);
        for energy_ev in [137.0, 1037.0, 3333.0, 10_370.0, 44_000.0] {
            let beam = Monoenergetic::new(energy_ev);
            let (mut difference, mut sum) = (0.0, 0.0);
            for (level, air) in atmosphere().levels().iter().enumerate() {
                let expected = beam.ionisation(&AirLayer::new(air));
                difference += (table.ionisation(energy_ev, level_altitude_km(level)) - expected).abs();
                sum += expected;
            }
            assert!(difference < 0.01 * sum, "{energy_ev}: {}", difference / sum);
        }
        assert_eq!((table.ionisation(1e4, 79.9), table.ionisation(1e4, 800.1)), (0.0, 0.0));
    }

    #[test]
    fn a_spectrum_keeps_the_energy() {
        for spectrum in [ARC, Spectrum::Maxwellian] {
            let table = Deposition::new(atmosphere(), spectrum);
            for node in [32, 64, 80] {
                let pairs = column(table.mixed(node));
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
            counts[table.draw_node(energy_ev, [0.5, (i as f64 + 0.5) * 1e-5])] += 1e-5;
        }
        let shares = Spectrum::Maxwellian.shares(50);
        assert!((0..NODES).all(|node| (counts[node] - shares[node]).abs() < 2e-5));
        assert_eq!(table.draw_node(1e9, [0.999_999, 0.999_999_999]), NODES - 1);
    }
}
