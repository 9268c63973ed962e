//! Hard-sphere tracks whose altitudes are quantile-matched, so that a few tracks have the mean of all.

use bansho_base::math::random::Key;

use super::{
    electron_track::{Collision, TRACKS_PER_ENERGY, TrackSampler, collision_count},
    energy_grid::node_energy_ev,
    hard_sphere::HardSphereAtmosphere,
};

/// Tracks of one energy.
///
/// A sample of tracks has a sampling error of tens of percent at high altitudes, where lines such as 630.0 nm are
/// emitted. So the pooled collisions are sorted and moved to the quantiles of the mean profile. Lateral displacements
/// are kept.
#[derive(Clone, Debug)]
pub struct QuantileMatchedTracks {
    /// [`TRACKS_PER_ENERGY`] of them, each from its highest collision down.
    tracks: Vec<Vec<Collision>>,
    /// Energy per collision relative to the energy over [`collision_count`]: more than 1 if some collisions are below the
    /// levels.
    pub energy_weight: f32,
}

impl QuantileMatchedTracks {
    /// Tracks of a node of the energy grid, matched to the mean profile of `sampler`.
    ///
    /// # Panics
    ///
    /// If the node is not in the grid.
    #[must_use]
    pub fn new(spheres: &HardSphereAtmosphere, sampler: &TrackSampler, node: usize, key: Key) -> Self {
        let mut tracks: Vec<Vec<Collision>> = Vec::with_capacity(TRACKS_PER_ENERGY as usize);
        for variant in 0..TRACKS_PER_ENERGY {
            let particle = (node as u64) << 32 | u64::from(variant);
            tracks.push(spheres.track(node_energy_ev(node), key, particle).collect());
        }
        // A stable sort keeps the order within a track where altitudes are equal.
        let mut order: Vec<&mut Collision> = tracks.iter_mut().flatten().collect();
        order.sort_by(|a, b| b.altitude_km.total_cmp(&a.altitude_km));
        let count = order.len();
        for (collision, quantile) in order.into_iter().zip(sampler.quantile_collisions(node, count)) {
            (collision.level, collision.altitude_km) = (quantile.level, quantile.altitude_km);
        }
        let energy_weight = f64::from(TRACKS_PER_ENERGY * collision_count(node)) / count.max(1) as f64;
        Self { tracks, energy_weight: energy_weight as f32 }
    }

    /// One of the tracks, selected by any `variant`.
    #[must_use]
    pub fn track(&self, variant: u32) -> &[Collision] {
        &self.tracks[(variant % TRACKS_PER_ENERGY) as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::{
        atmosphere::{LEVELS, atmosphere},
        precipitation::{Deposition, hard_sphere::DEFAULT_RADIUS_M, spectrum::ARC},
    };

    #[test]
    fn the_mean_is_the_profile_and_tracks_go_down() {
        let deposition = Deposition::from_hard_spheres(atmosphere(), ARC, DEFAULT_RADIUS_M);
        let (spheres, sampler) =
            (HardSphereAtmosphere::new(atmosphere(), DEFAULT_RADIUS_M, 0.0), TrackSampler::new(&deposition, 0.0));
        // The last energy is so great that some of its collisions lie below all levels.
        for node in [10, 32, 64, 96] {
            let tracks = QuantileMatchedTracks::new(&spheres, &sampler, node, Key::new(6, "aurora"));
            let mut counts = [0.0; LEVELS];
            for variant in 0..TRACKS_PER_ENERGY {
                let track = tracks.track(variant);
                assert!(track.windows(2).all(|pair| pair[1].level <= pair[0].level));
                track.iter().for_each(|collision| counts[collision.level as usize] += 1.0);
            }
            let (count, profile) = (counts.iter().sum::<f64>(), deposition.monoenergetic_profile(node));
            let whole: f64 = profile.iter().sum();
            let (mut found, mut expected) = (0.0, 0.0);
            for level in (0..LEVELS).rev() {
                (found, expected) = (found + counts[level] / count, expected + profile[level] / whole);
                assert!((found - expected).abs() <= 1.001 / count, "{node} {level}: {found} for {expected}");
            }
            let energies =
                count * f64::from(tracks.energy_weight) / f64::from(TRACKS_PER_ENERGY * collision_count(node));
            assert!((energies - 1.0).abs() < 1e-6);
        }
    }
}
