//! How far collisions wander from the field line of their electron.

use bansho_base::{math, random::Key};

use rayon::prelude::*;

use super::{DrawingParameters, FallModel};
use crate::aurora::{
    atmosphere::atmosphere,
    light::Emission,
    precipitation::{
        energy::{self, NODES, node_energy_ev},
        fall::{Collision, Falls, collision_count},
        hard_sphere::{DEFAULT_RADIUS, HardSphere},
    },
};

/// Collisions of each energy that are looked at, about, and the fewest falls: a few long ones have much of the wandering.
const COLLISIONS: u32 = 2000;
const FEWEST_FALLS: u32 = 24;

/// The wandering by the energy of the electrons, in the falls that an aurora is drawn with.
#[derive(Clone, Debug)]
pub(super) struct Wander {
    /// Root mean square distance along one direction, km, by node of the grid of energies.
    nodes_km: Vec<f64>,
}

impl Wander {
    /// That of the falls of a drawing.
    pub(super) fn new(emission: &Emission, drawing: &DrawingParameters, key: Key) -> Self {
        let nodes_km = match drawing.fall {
            FallModel::Fang => {
                let falls = Falls::new(emission.deposition(), 0.0);
                by_node(drawing.wobble, |node, particle| altitudes_km(falls.fall(node, key, particle)))
            }
            FallModel::HardSphere => {
                let spheres = HardSphere::new(atmosphere(), DEFAULT_RADIUS, 0.0);
                by_node(drawing.wobble, |node, particle| {
                    altitudes_km(spheres.fall(node_energy_ev(node), key, particle))
                })
            }
        };
        Self { nodes_km }
    }

    /// Root mean square distance of the collisions of electrons of an energy from their field line, along one direction, km.
    pub(super) fn at(&self, energy_ev: f64) -> f64 {
        let (node, part) = energy::locate(energy_ev);
        math::lerp(self.nodes_km[node], self.nodes_km[node + 1], part)
    }
}

fn by_node(wobble: f64, fall: impl Fn(usize, u64) -> Vec<f64> + Sync) -> Vec<f64> {
    let of_node = |node: usize| {
        let falls = u64::from(COLLISIONS.div_ceil(collision_count(node)).max(FEWEST_FALLS));
        let sum = (0..falls).map(|particle| variance_km2(&fall(node, particle), wobble)).sum::<f64>();
        math::sqrt(sum / falls as f64)
    };
    (0..NODES).into_par_iter().map(of_node).collect()
}

fn altitudes_km(fall: impl Iterator<Item = Collision>) -> Vec<f64> {
    fall.map(|collision| f64::from(collision.altitude_km)).collect()
}

/// Mean square distance from the field line, along one direction, of collisions at those altitudes in km (from the first on), each of
/// which turns the electron by a tangent of rms `wobble`.
fn variance_km2(altitudes_km: &[f64], wobble: f64) -> f64 {
    let (mut variance, mut sum) = (0.0, 0.0);
    for pair in altitudes_km.windows(2) {
        let step = wobble * (pair[0] - pair[1]).max(0.0);
        variance += step * step;
        sum += variance;
    }
    sum / altitudes_km.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::aurora::precipitation::{energy::locate, spectrum::ARC};

    #[test]
    fn steps_of_equal_length_wander_as_a_random_walk() {
        // n steps of 1 km with a tangent of 0.1: the k-th collision has variance 0.01 k, their mean is 0.01 (n - 1) / 2.
        let altitudes: Vec<f64> = (0..11).map(|step| 200.0 - f64::from(step)).collect();
        assert!((variance_km2(&altitudes, 0.1) - 0.05).abs() < 1e-12);
        assert_eq!(variance_km2(&[], 0.1), 0.0);
    }

    #[test]
    fn it_is_that_of_the_falls_that_are_drawn_at_every_energy() {
        let key = Key::new(4, "aurora");
        for fall in [FallModel::Fang, FallModel::HardSphere] {
            let emission = fall.emission(ARC);
            let drawing = DrawingParameters { fall, wobble: 0.05, ..DrawingParameters::default() };
            let wander = Wander::new(&emission, &drawing, key);
            for energy_ev in [600.0, 5000.0, 40_000.0] {
                let node = locate(energy_ev).0;
                let (mut sum, mut count) = (0.0, 0.0);
                let mut add = |collision: Collision| {
                    let offset_km = f64::from(collision.offset_km[0]);
                    sum += offset_km * offset_km;
                    count += 1.0;
                };
                for particle in 100..800 {
                    match fall {
                        FallModel::Fang => {
                            Falls::new(emission.deposition(), 0.05).fall(node, key, particle).for_each(&mut add);
                        }
                        FallModel::HardSphere => HardSphere::new(atmosphere(), DEFAULT_RADIUS, 0.05)
                            .fall(node_energy_ev(node), key, particle)
                            .for_each(&mut add),
                    }
                }
                let ratio = wander.at(node_energy_ev(node)) / math::sqrt(sum / count);
                assert!((0.75..1.35).contains(&ratio), "{fall:?} {energy_ev}: {ratio}");
            }
        }
    }
}
