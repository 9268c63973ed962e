//! Lateral spread of an electron's collisions about its field line.

use std::sync::{Arc, LazyLock, OnceLock};

use bansho_base::{
    host::{once::get_or_compute, parallel::prelude::*},
    math,
    math::random::Key,
};

use super::{
    Deposition,
    electron_track::{Collision, TrackSampler, collision_count},
    energy_grid::{self, ARC, NODES, node_energy_ev},
    hard_sphere::HardSphereAtmosphere,
};
use crate::physics::atmosphere::atmosphere;

/// Approximate number of sampled collisions per energy and the minimum number of tracks: a few long tracks dominate the
/// variance.
const COLLISIONS_PER_ENERGY: u32 = 2000;
const MIN_TRACKS: u32 = 96;
/// Tracks are sampled at every fourth energy node; the spread varies slowly between them.
const STRIDE: usize = 4;
const _: () = assert!((NODES - 1).is_multiple_of(STRIDE));

/// RMS distance of the collisions of an electron from its field line, for straight tracks: deflections change their altitudes only to
/// second order. Computed on first use.
#[derive(Clone, Debug)]
pub(crate) struct SpreadByEnergy {
    tracks: Tracks,
    /// For a deflection of 1, km, at every [`STRIDE`]th node; it is proportional to the deflection. Shared by copies.
    by_node: Arc<OnceLock<Vec<f64>>>,
}

/// Which tracks are sampled.
#[derive(Clone, Copy, Debug)]
enum Tracks {
    Fang2010,
    /// Radius, m.
    HardSpheres(f64),
}

impl SpreadByEnergy {
    pub(crate) fn of_fang_2010() -> Self {
        // Tracks are monoenergetic, so the spectrum does not matter.
        static BY_NODE: LazyLock<Arc<OnceLock<Vec<f64>>>> = LazyLock::new(Arc::default);
        Self { tracks: Tracks::Fang2010, by_node: BY_NODE.clone() }
    }

    /// For spheres of `radius` in m.
    pub(crate) fn of_hard_spheres(radius: f64) -> Self {
        Self { tracks: Tracks::HardSpheres(radius), by_node: Arc::default() }
    }

    /// For a deflection of 1, km.
    pub(crate) fn at(&self, energy_ev: f64) -> f64 {
        let by_node = get_or_compute(&self.by_node, || self.tracks.spread_by_node());
        let (node, fraction) = energy_grid::locate(energy_ev);
        let coordinate = (node as f64 + fraction) / STRIDE as f64;
        let below = (coordinate as usize).min(by_node.len() - 2);
        math::lerp(by_node[below], by_node[below + 1], coordinate - below as f64)
    }
}

impl Tracks {
    fn spread_by_node(self) -> Vec<f64> {
        match self {
            Self::Fang2010 => {
                let tracks = TrackSampler::new(&Deposition::new(atmosphere(), ARC), 0.0);
                spread_by_node(|node, key, particle| altitudes_km(tracks.sample_track(node, key, particle)))
            }
            Self::HardSpheres(radius) => {
                let spheres = HardSphereAtmosphere::new(atmosphere(), radius, 0.0);
                spread_by_node(|node, key, particle| altitudes_km(spheres.track(node_energy_ev(node), key, particle)))
            }
        }
    }
}

/// From the altitudes, in km, of the collisions of a track of a node, sampled with a key and a particle number.
fn spread_by_node(track_altitudes_km: impl Fn(usize, Key, u64) -> Vec<f64> + Sync) -> Vec<f64> {
    let key = Key::new(0, "aurora wander");
    let nodes = (0..NODES).into_par_iter().step_by(STRIDE);
    nodes
        .map(|node| {
            let tracks = u64::from(COLLISIONS_PER_ENERGY.div_ceil(collision_count(node)).max(MIN_TRACKS));
            let sum = (0..tracks).map(|particle| variance_km2(&track_altitudes_km(node, key, particle))).sum::<f64>();
            math::sqrt(sum / tracks as f64)
        })
        .collect()
}

fn altitudes_km(track: impl Iterator<Item = Collision>) -> Vec<f64> {
    track.map(|collision| f64::from(collision.altitude_km)).collect()
}

/// Mean square distance from the field line, per direction, of collisions at these altitudes in km (highest first),
/// each with an RMS deflection tangent of 1.
fn variance_km2(altitudes_km: &[f64]) -> f64 {
    let (mut variance, mut sum) = (0.0, 0.0);
    for pair in altitudes_km.windows(2) {
        let step = (pair[0] - pair[1]).max(0.0);
        variance += step * step;
        sum += variance;
    }
    sum / altitudes_km.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::precipitation::{TrackModel, energy_grid::locate, hard_sphere::DEFAULT_RADIUS_M};

    #[test]
    fn steps_of_equal_length_wander_as_a_random_walk() {
        // n steps of 1 km with a tangent of 1: the k-th collision has variance k, their mean is (n - 1) / 2.
        let altitudes: Vec<f64> = (0..11).map(|step| 200.0 - f64::from(step)).collect();
        assert!((variance_km2(&altitudes) - 5.0).abs() < 1e-12);
        assert_eq!(variance_km2(&[]), 0.0);
    }

    #[test]
    fn it_is_that_of_the_tracks_that_are_drawn_at_every_energy() {
        let key = Key::new(4, "aurora");
        for model in [TrackModel::Fang2010, TrackModel::HardSphereAtmosphere] {
            let emission = model.emission(ARC);
            for energy_ev in [600.0, 5000.0, 40_000.0] {
                let node = locate(energy_ev).0;
                let (mut sum, mut count) = (0.0, 0.0);
                let mut add = |collision: Collision| {
                    let offset_km = f64::from(collision.transverse_km[0]);
                    sum += offset_km * offset_km;
                    count += 1.0;
                };
                for particle in 100..800 {
                    match model {
                        TrackModel::Fang2010 => {
                            TrackSampler::new(emission.deposition(), 0.05)
                                .sample_track(node, key, particle)
                                .for_each(&mut add);
                        }
                        TrackModel::HardSphereAtmosphere => {
                            HardSphereAtmosphere::new(atmosphere(), DEFAULT_RADIUS_M, 0.05)
                                .track(node_energy_ev(node), key, particle)
                                .for_each(&mut add);
                        }
                    }
                }
                let ratio = emission.lateral_spread_km(0.05, node_energy_ev(node)) / math::sqrt(sum / count);
                assert!((0.75..1.35).contains(&ratio), "{model:?} {energy_ev}: {ratio}");
            }
        }
    }
}
