//! Single collisions of falling electrons, drawn such that the deposition of Fang et al. (2010) is their mean.

use bansho_base::random::{Key, Purpose, normal_pair, uniform, uniform_f64};

use super::{
    COLLISION_EV,
    deposition::{Deposition, Profile},
    energy::{NODES, node_energy_ev},
};
use crate::aurora::atmosphere::{LEVELS, level_altitude_km};

const COLLISION: Purpose = Purpose::named("aurora collision");

/// A collision of an electron with an atom or a molecule.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Collision {
    /// Level of the atmosphere whose air is struck.
    pub level: usize,
    /// Altitude, km: within a kilometre of the level.
    pub altitude_km: f64,
    /// Displacement across the magnetic field since the fall began, km.
    pub offset_km: [f64; 2],
}

/// Falls of electrons of every energy of the grid.
#[derive(Clone, Debug)]
pub struct Falls {
    /// For each energy the share of its deposition above and at each level, from the top down.
    cumulative: Vec<Profile>,
    /// Tangent of the angle by which a collision turns an electron from the field, rms along each direction across.
    wobble: f64,
}

/// Collisions until an electron of a node's energy has spent it: 100 eV each, at least one.
#[must_use]
pub fn collision_count(node: usize) -> u32 {
    (node_energy_ev(node) / COLLISION_EV).round().max(1.0) as u32
}

impl Falls {
    /// Falls whose heights have the monoenergetic profiles of `deposition`; each collision turns the electron from the field by an angle
    /// with a tangent of rms `wobble` (the vector omega of (2.21)).
    #[must_use]
    pub fn new(deposition: &Deposition, wobble: f64) -> Self {
        Self { cumulative: (0..NODES).map(|node| from_the_top(deposition.monoenergetic(node))).collect(), wobble }
    }

    /// The collisions of particle number `particle`, from the first and highest to the last, if its energy is that of `node`.
    ///
    /// The k-th of n happens where between k/n and (k + 1)/n of the energy has been spent: the mean over particles is the profile, and
    /// one fall already follows it. Within a level's reach the altitude is triangular, so that the mean is linear between levels.
    ///
    /// # Panics
    /// For a node that is not of the grid.
    pub fn fall(&self, node: usize, key: Key, particle: u64) -> impl Iterator<Item = Collision> {
        let cumulative = &self.cumulative[node];
        let count = collision_count(node);
        let mut from_top = 0;
        let mut path = Path::default();
        (0..count).map(move |number| {
            let words = key.words(particle, number, COLLISION);
            let spent = (number as f64 + uniform_f64(words[0], 0)) / count as f64;
            while from_top < LEVELS - 1 && cumulative[from_top] <= spent {
                from_top += 1;
            }
            let level = LEVELS - 1 - from_top;
            let turn = normal_pair([words[2], words[3]]).map(|deviation| deviation as f64 * self.wobble);
            path.descend(level_altitude_km(level) + triangular(words[1]), turn);
            path.collision(level)
        })
    }
}

/// A number in (-1, 1) with triangular density from the two halves of a word.
fn triangular(word: u32) -> f64 {
    uniform(word) as f64 + uniform(word << 16) as f64 - 1.0
}

/// Running sums of a profile from the highest level down, as shares of the whole.
fn from_the_top(profile: &Profile) -> Profile {
    let whole: f64 = profile.iter().sum();
    let mut sum = 0.0;
    std::array::from_fn(|from_top| {
        sum += profile[LEVELS - 1 - from_top];
        sum / whole
    })
}

/// Where an electron is on its way down.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Path {
    altitude_km: Option<f64>,
    offset_km: [f64; 2],
}

impl Path {
    /// Down to an altitude along the field turned by `turn` (tangents): (2.24) read as a step along the unit vector of L + omega.
    pub(super) fn descend(&mut self, altitude_km: f64, turn: [f64; 2]) {
        let descent = self.altitude_km.map_or(0.0, |before| before - altitude_km).max(0.0);
        self.offset_km = std::array::from_fn(|i| self.offset_km[i] + descent * turn[i]);
        self.altitude_km = Some(altitude_km);
    }

    pub(super) fn collision(&self, level: usize) -> Collision {
        Collision {
            level,
            altitude_km: self.altitude_km.unwrap_or_else(|| level_altitude_km(level)),
            offset_km: self.offset_km,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::aurora::{
        atmosphere::atmosphere,
        precipitation::{Spectrum, energy},
    };

    fn falls(wobble: f64) -> (Deposition, Falls) {
        let deposition = Deposition::new(atmosphere(), Spectrum::Monoenergetic);
        let falls = Falls::new(&deposition, wobble);
        (deposition, falls)
    }

    #[test]
    fn the_mean_of_many_falls_is_the_profile() {
        let (deposition, falls) = falls(0.02);
        let key = Key::new(3, "aurora");
        // Shot noise of 200,000 and 2,000,000 collisions over the 200 and 60 levels that matter: 2.5 and 0.4 %.
        for (energy_ev, tolerance) in [(1e3, 0.04), (1e4, 0.01)] {
            let node = energy::locate(energy_ev * 1.000_001).0;
            let mut histogram = [0.0; LEVELS];
            let particles = 20_000;
            for particle in 0..particles {
                falls.fall(node, key, particle).for_each(|collision| histogram[collision.level] += 1.0);
            }
            let collisions = particles as f64 * collision_count(node) as f64;
            let profile = deposition.monoenergetic(node);
            let whole: f64 = profile.iter().sum();
            let difference: f64 =
                (0..LEVELS).map(|level| (histogram[level] / collisions - profile[level] / whole).abs()).sum();
            assert!(difference < tolerance, "{energy_ev} eV: {difference}");
        }
    }

    #[test]
    fn altitudes_are_linear_between_levels() {
        let (deposition, falls) = falls(0.0);
        // 10 keV: between the levels 104 and 108 km, in quarters of a kilometre.
        let node = energy::locate(10_001.0).0;
        let profile = deposition.monoenergetic(node);
        let whole: f64 = profile.iter().sum();
        let mut counts = [0.0; 16];
        for particle in 0..20_000 {
            for collision in falls.fall(node, Key::new(1, "a"), particle) {
                let place = (collision.altitude_km - 104.0) * 4.0;
                if (0.0..16.0).contains(&place) {
                    counts[place as usize] += 1.0 / 2e6;
                }
                assert!((collision.altitude_km - level_altitude_km(collision.level)).abs() <= 1.0);
            }
        }
        for (i, count) in counts.iter().enumerate() {
            let (level, part) = (24 + i / 4, (i % 4) as f64 * 0.25 + 0.125);
            let expected = (profile[level] * (1.0 - part) + profile[level + 1] * part) / whole * 0.25;
            // 30,000 to 50,000 collisions each: 0.5 %.
            assert!((count / expected - 1.0).abs() < 0.03, "{i}: {count} for {expected}");
        }
    }

    #[test]
    fn falls_go_down_and_wander_in_proportion() {
        let (_, falls) = falls(0.02);
        let node = energy::locate(10_001.0).0;
        assert_eq!(collision_count(node), 100);
        let (mut squares, particles) = ([0.0; 2], 2000);
        for particle in 0..particles {
            let path: Vec<_> = falls.fall(node, Key::new(1, "a"), particle).collect();
            // But for the triangular reach of a level.
            assert!(path.windows(2).all(|pair| pair[1].level <= pair[0].level));
            assert_eq!(path[0].offset_km, [0.0; 2]);
            let last = path[path.len() - 1].offset_km;
            squares = std::array::from_fn(|i| squares[i] + last[i] * last[i] / particles as f64);
        }
        assert!(squares[0] > 0.01 && (squares[0] / squares[1] - 1.0).abs() < 0.3, "{squares:?}");
    }
}
