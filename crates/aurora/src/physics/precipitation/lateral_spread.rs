//! Lateral spread of an electron's collisions about its field line.

use std::sync::OnceLock;

use bansho_base::{host::once::get_or_compute, math, math::random::Key};
use rayon::prelude::*;

use super::{
    Deposition, TrackModel,
    electron_track::{Collision, TrackSampler, collision_count},
    energy_grid::{self, NODES, node_energy_ev},
    hard_sphere::{DEFAULT_RADIUS_M, HardSphereAtmosphere},
    spectrum::ARC,
};
use crate::physics::atmosphere::atmosphere;

/// Approximate number of sampled collisions per energy and the minimum number of tracks: a few long tracks dominate the
/// variance.
const COLLISIONS_PER_ENERGY: u32 = 2000;
const MIN_TRACKS: u32 = 96;
/// Tracks are sampled at every fourth energy node; the spread varies slowly between them.
const STRIDE: usize = 4;
const _: () = assert!((NODES - 1).is_multiple_of(STRIDE));

/// Spread of Fang and of hard-sphere tracks, for straight tracks: deflections change their altitudes only to second
/// order.
static FANG: OnceLock<SpreadByEnergy> = OnceLock::new();
static HARD_SPHERE: OnceLock<SpreadByEnergy> = OnceLock::new();

fn by_energy(model: TrackModel) -> &'static SpreadByEnergy {
    match model {
        TrackModel::Fang2010 => get_or_compute(&FANG, || {
            // Tracks are monoenergetic, so the spectrum does not matter.
            let tracks = TrackSampler::new(&Deposition::new(atmosphere(), ARC), 0.0);
            SpreadByEnergy::new(|node, key, particle| altitudes_km(tracks.sample_track(node, key, particle)))
        }),
        TrackModel::HardSphereAtmosphere => get_or_compute(&HARD_SPHERE, || {
            let spheres = HardSphereAtmosphere::new(atmosphere(), DEFAULT_RADIUS_M, 0.0);
            SpreadByEnergy::new(|node, key, particle| altitudes_km(spheres.track(node_energy_ev(node), key, particle)))
        }),
    }
}

/// RMS distance of the collisions of electrons of an energy from their field line, per direction, km, where each
/// collision deflects by an RMS tangent of `deflection`.
pub(crate) fn lateral_spread_km(model: TrackModel, deflection: f64, energy_ev: f64) -> f64 {
    if deflection <= 0.0 { 0.0 } else { deflection * by_energy(model).at(energy_ev) }
}

/// RMS distance for a deflection of 1, km, at every [`STRIDE`]th node; it is proportional to the deflection.
struct SpreadByEnergy(Vec<f64>);

impl SpreadByEnergy {
    /// From the altitudes, in km, of the collisions of a track of a node, sampled with a key and a particle number.
    fn new(track_altitudes_km: impl Fn(usize, Key, u64) -> Vec<f64> + Sync) -> Self {
        let key = Key::new(0, "aurora wander");
        let of_node = |node: usize| {
            let tracks = u64::from(COLLISIONS_PER_ENERGY.div_ceil(collision_count(node)).max(MIN_TRACKS));
            let sum = (0..tracks).map(|particle| variance_km2(&track_altitudes_km(node, key, particle))).sum::<f64>();
            math::sqrt(sum / tracks as f64)
        };
        Self((0..NODES).into_par_iter().step_by(STRIDE).map(of_node).collect())
    }

    fn at(&self, energy_ev: f64) -> f64 {
        let (node, fraction) = energy_grid::locate(energy_ev);
        let coordinate = (node as f64 + fraction) / STRIDE as f64;
        let below = (coordinate as usize).min(self.0.len() - 2);
        math::lerp(self.0[below], self.0[below + 1], coordinate - below as f64)
    }
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
    use crate::physics::precipitation::energy_grid::locate;

    #[test]
    fn steps_of_equal_length_wander_as_a_random_walk() {
        // n steps of 1 km with a tangent of 1: the k-th collision has variance k, their mean is (n - 1) / 2.
        let altitudes: Vec<f64> = (0..11).map(|step| 200.0 - f64::from(step)).collect();
        assert!((variance_km2(&altitudes) - 5.0).abs() < 1e-12);
        assert_eq!(variance_km2(&[]), 0.0);
    }

    #[test]
    fn it_is_that_of_the_falls_that_are_drawn_at_every_energy() {
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
                let ratio = lateral_spread_km(model, 0.05, node_energy_ev(node)) / math::sqrt(sum / count);
                assert!((0.75..1.35).contains(&ratio), "{model:?} {energy_ev}: {ratio}");
            }
        }
    }
}
