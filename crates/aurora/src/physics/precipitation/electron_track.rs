//! Electron tracks as sequences of collisions whose mean is the ionization profile of Fang et al. (2010).

use bansho_base::{
    host::parallel::prelude::*,
    math,
    math::random::{Key, Purpose, normal_pair, uniform, uniform_f64},
};

use super::{
    COLLISION_EV,
    deposition::{AltitudeProfile, Deposition},
    energy_grid::{NODES, node_energy_ev},
};
use crate::physics::atmosphere::{LEVELS, level_altitude_km};

const COLLISION: Purpose = Purpose::named("aurora collision");
const TRACK_VARIANT: Purpose = Purpose::named("aurora fall variant");
/// Conjugate of the golden ratio: the fractional parts of its multiples are a low-discrepancy sequence.
const GOLDEN_RATIO_CONJUGATE: f64 = 0.618_033_988_749_895;

/// A collision of an electron with an atom or a molecule.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Collision {
    /// Level of the atmosphere in which it happens.
    pub level: u32,
    /// Altitude, km, within one kilometer of the level.
    pub altitude_km: f32,
    /// Displacement across the magnetic field since the start of the track, km.
    pub transverse_km: [f32; 2],
}

/// Samples electron tracks for every energy of the grid.
#[derive(Clone, Debug)]
pub struct TrackSampler {
    /// For each energy the cumulative fraction of its ionization from the top down to each level.
    cumulative: Vec<AltitudeProfile>,
    /// RMS tangent of the deflection per collision, per transverse direction.
    deflection: f64,
}

/// Collisions until an electron of a node's energy has lost it: 100 eV each, at least one.
#[must_use]
pub fn collision_count(node: usize) -> u32 {
    (node_energy_ev(node) / COLLISION_EV).round().max(1.0) as u32
}

impl TrackSampler {
    /// Tracks with the monoenergetic profiles of `deposition`; each collision deflects the electron by an angle with
    /// RMS tangent `deflection` (the vector omega of (2.21)).
    #[must_use]
    pub fn new(deposition: &Deposition, deflection: f64) -> Self {
        Self {
            cumulative: (0..NODES).map(|node| cumulative_from_top(deposition.monoenergetic_profile(node))).collect(),
            deflection,
        }
    }

    /// The collisions of particle number `particle` with the energy of `node`, from the highest to the lowest.
    ///
    /// Stratified sampling: at the k-th of n collisions, between k/n and (k + 1)/n of the energy has been lost. The
    /// mean over particles is the profile, and each track follows it approximately. Within one kilometer of a level the
    /// altitude has a triangular density, so the mean is linear between levels.
    ///
    /// # Panics
    ///
    /// If the node is not in the grid.
    pub fn sample_track(&self, node: usize, key: Key, particle: u64) -> impl Iterator<Item = Collision> {
        self.track_with(node, key, particle, |_, uniform| uniform)
    }

    /// A track whose k-th collision is at `quantile(k, uniform)` in [0, 1) of its stratum.
    fn track_with(
        &self,
        node: usize,
        key: Key,
        particle: u64,
        quantile: impl Fn(u32, f64) -> f64,
    ) -> impl Iterator<Item = Collision> {
        let cumulative = &self.cumulative[node];
        let count = collision_count(node);
        let mut from_top = 0;
        let mut state = TrackState::default();
        (0..count).map(move |number| {
            // The four words of one counter are all that a collision needs: stratum, altitude within the level, and two for the deflection.
            let words = key.words(particle, number, COLLISION);
            let energy_fraction = (number as f64 + quantile(number, uniform_f64(words[0], 0))) / count as f64;
            from_top = next_level_from_top(cumulative, from_top, energy_fraction);
            let level = LEVELS - 1 - from_top;
            let deflection = normal_pair([words[2], words[3]]).map(|deviation| deviation as f64 * self.deflection);
            state.advance(level_altitude_km(level) + triangular(words[1]), deflection);
            state.collision(level)
        })
    }
}

impl TrackSampler {
    /// The altitudes of `count` collisions of a node at equally spaced quantiles, from the highest to the lowest.
    ///
    /// The offset within the strata is the same for all collisions but differs between nodes, so the topmost collisions
    /// of all energies are spread evenly.
    pub(crate) fn quantile_collisions(&self, node: usize, count: usize) -> impl Iterator<Item = Collision> {
        let cumulative = &self.cumulative[node];
        let quantile = (node as f64 * GOLDEN_RATIO_CONJUGATE) % 1.0;
        let mut from_top = 0;
        (0..count).map(move |number| {
            let energy_fraction = (number as f64 + quantile) / count as f64;
            from_top = next_level_from_top(cumulative, from_top, energy_fraction);
            let before = from_top.checked_sub(1).map_or(0.0, |above| cumulative[above]);
            // The place of the quantile within its level, with the triangular density of the random tracks: both have the same mean between levels.
            let fraction = (energy_fraction - before) / (cumulative[from_top] - before).max(f64::MIN_POSITIVE);
            let level = LEVELS - 1 - from_top;
            let altitude_km = (level_altitude_km(level) + inverse_triangular_cdf(fraction)) as f32;
            Collision { level: level as u32, altitude_km, transverse_km: [0.0; 2] }
        })
    }

    /// One of the [`TRACKS_PER_ENERGY`] tracks of a node. Each samples another substratum of every stratum, in a permutation
    /// that differs between collisions.
    fn stratified_track(&self, node: usize, variant: u32, key: Key) -> impl Iterator<Item = Collision> {
        self.track_with(node, key, (node as u64) << 32 | variant as u64, move |number, uniform| {
            let substratum = variant ^ (key.words(node as u64, number, TRACK_VARIANT)[0] % TRACKS_PER_ENERGY);
            (substratum as f64 + uniform) / TRACKS_PER_ENERGY as f64
        })
    }
}

/// Precomputed tracks for a range of energies, [`TRACKS_PER_ENERGY`] of each, whose mean is the profile.
#[derive(Clone, Debug)]
pub struct TrackLibrary {
    first_node: usize,
    /// Start index of the tracks of each node, and the total.
    starts: Vec<usize>,
    collisions: Vec<Collision>,
}

/// Tracks of each energy in a library: a power of two.
pub const TRACKS_PER_ENERGY: u32 = 64;

impl TrackLibrary {
    /// Tracks for a range of energy nodes.
    ///
    /// # Panics
    ///
    /// If nodes are not in the grid.
    #[must_use]
    pub fn new(sampler: &TrackSampler, nodes: std::ops::RangeInclusive<usize>, key: Key) -> Self {
        let first_node = *nodes.start();
        let by_node: Vec<Vec<Collision>> = nodes
            .into_par_iter()
            .map(|node| (0..TRACKS_PER_ENERGY).flat_map(|v| sampler.stratified_track(node, v, key)).collect())
            .collect();
        // All tracks of an energy have the same number of collisions, so that only energies need an index.
        let mut starts = vec![0];
        starts.extend(by_node.iter().scan(0, |end, collisions| {
            *end += collisions.len();
            Some(*end)
        }));
        Self { first_node, starts, collisions: by_node.concat() }
    }

    /// One of the [`TRACKS_PER_ENERGY`] tracks of a node, selected by any `variant`; of the nearest node in the library.
    ///
    /// # Panics
    ///
    /// If the library was created for an empty range.
    #[must_use]
    pub fn track(&self, node: usize, variant: u32) -> &[Collision] {
        let index = node.saturating_sub(self.first_node).min(self.starts.len() - 2);
        let (start, end) = (self.starts[index], self.starts[index + 1]);
        let count = (end - start) / TRACKS_PER_ENERGY as usize;
        let first = start + (variant % TRACKS_PER_ENERGY) as usize * count;
        &self.collisions[first..first + count]
    }
}

/// Index from the top, at least `above`, of the level at which the fraction `energy_fraction` of the energy is lost.
fn next_level_from_top(cumulative: &AltitudeProfile, above: usize, energy_fraction: f64) -> usize {
    // Fractions only grow along a track, so the search goes on from the level of the collision before: a track passes the levels once.
    let passed = cumulative[above..LEVELS - 1].iter().take_while(|sum| **sum <= energy_fraction);
    above + passed.count()
}

/// A number in (-1, 1) with triangular density from the two halves of a word.
fn triangular(word: u32) -> f64 {
    // The lower half becomes the upper bits of the second number. The halves share eight bits, which are the last of the first number.
    uniform(word) as f64 + uniform(word << 16) as f64 - 1.0
}

/// Quantile function of the triangular density on (-1, 1), from the top.
fn inverse_triangular_cdf(fraction: f64) -> f64 {
    let fraction = fraction.clamp(0.0, 1.0);
    if fraction < 0.5 { 1.0 - math::sqrt(2.0 * fraction) } else { math::sqrt(2.0 * (1.0 - fraction)) - 1.0 }
}

/// Cumulative sums of a profile from the highest level down, normalized.
fn cumulative_from_top(profile: &AltitudeProfile) -> AltitudeProfile {
    let whole: f64 = profile.iter().sum();
    let mut sum = 0.0;
    std::array::from_fn(|from_top| {
        sum += profile[LEVELS - 1 - from_top];
        sum / whole
    })
}

/// State of an electron along its track.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct TrackState {
    altitude_km: Option<f64>,
    transverse_km: [f64; 2],
}

impl TrackState {
    /// Moves down to an altitude along the field, deflected by the tangents `deflection`: (2.24) read as a step along the
    /// unit vector of L + omega.
    pub(super) fn advance(&mut self, altitude_km: f64, deflection: [f64; 2]) {
        let descent = self.altitude_km.map_or(0.0, |before| before - altitude_km).max(0.0);
        self.transverse_km = std::array::from_fn(|i| self.transverse_km[i] + descent * deflection[i]);
        self.altitude_km = Some(altitude_km);
    }

    pub(super) fn collision(&self, level: usize) -> Collision {
        Collision {
            level: level as u32,
            altitude_km: self.altitude_km.unwrap_or_else(|| level_altitude_km(level)) as f32,
            transverse_km: self.transverse_km.map(|offset| offset as f32),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{super::Spectrum, *};
    use crate::physics::{atmosphere::atmosphere, precipitation::energy_grid};

    fn sampler(deflection: f64) -> (Deposition, TrackSampler) {
        let deposition = Deposition::new(atmosphere(), Spectrum::Monoenergetic);
        let sampler = TrackSampler::new(&deposition, deflection);
        (deposition, sampler)
    }

    #[test]
    fn the_mean_of_many_tracks_is_the_profile() {
        let (deposition, sampler) = sampler(0.02);
        let key = Key::new(3, "aurora");
        // Shot noise of 200,000 and 2,000,000 collisions over the 200 and 60 levels that matter: 2.5 and 0.4 %.
        for (energy_ev, tolerance) in [(1e3, 0.04), (1e4, 0.01)] {
            let node = energy_grid::locate(energy_ev * 1.000_001).0;
            let mut histogram = [0.0; LEVELS];
            let particles = 20_000;
            for particle in 0..particles {
                sampler
                    .sample_track(node, key, particle)
                    .for_each(|collision| histogram[collision.level as usize] += 1.0);
            }
            let collisions = particles as f64 * collision_count(node) as f64;
            let profile = deposition.monoenergetic_profile(node);
            let whole: f64 = profile.iter().sum();
            let difference: f64 =
                (0..LEVELS).map(|level| (histogram[level] / collisions - profile[level] / whole).abs()).sum();
            assert!(difference < tolerance, "{energy_ev} eV: {difference}");
        }
    }

    #[test]
    fn a_library_has_the_profile_for_its_mean() {
        let (deposition, sampler) = sampler(0.02);
        let library = TrackLibrary::new(&sampler, 40..=70, Key::new(3, "aurora"));
        for node in [40, 55, 70] {
            let mut histogram = [0.0; LEVELS];
            for variant in 0..TRACKS_PER_ENERGY {
                let track = library.track(node, variant);
                assert_eq!(track.len(), collision_count(node) as usize);
                assert!(track.windows(2).all(|pair| pair[1].level <= pair[0].level));
                track.iter().for_each(|collision| histogram[collision.level as usize] += 1.0);
            }
            // Each part of each fraction has one collision: no running sum is off by more than one of them.
            let all = (TRACKS_PER_ENERGY * collision_count(node)) as f64;
            let mut sum = 0.0;
            for (from_top, expected) in
                cumulative_from_top(deposition.monoenergetic_profile(node)).into_iter().enumerate()
            {
                sum += histogram[LEVELS - 1 - from_top];
                assert!(
                    (sum / all - expected).abs() <= 1.0001 / all,
                    "{node} {from_top}: {sum} of {all}, not {expected}"
                );
            }
        }
        assert_eq!(library.track(0, 5), library.track(40, 5));
        assert_eq!(library.track(96, TRACKS_PER_ENERGY + 1), library.track(70, 1));
    }

    #[test]
    fn altitudes_are_linear_between_levels() {
        let (deposition, sampler) = sampler(0.0);
        // 10 keV: between the levels 104 and 108 km, in quarters of a kilometer.
        let node = energy_grid::locate(10_001.0).0;
        let profile = deposition.monoenergetic_profile(node);
        let whole: f64 = profile.iter().sum();
        let mut counts = [0.0; 16];
        for particle in 0..20_000 {
            for collision in sampler.sample_track(node, Key::new(1, "a"), particle) {
                let quantile = (collision.altitude_km as f64 - 104.0) * 4.0;
                if (0.0..16.0).contains(&quantile) {
                    counts[quantile as usize] += 1.0 / 2e6;
                }
                assert!((collision.altitude_km as f64 - level_altitude_km(collision.level as usize)).abs() <= 1.0);
            }
        }
        for (i, count) in counts.iter().enumerate() {
            let (level, fraction) = (24 + i / 4, (i % 4) as f64 * 0.25 + 0.125);
            let expected = (profile[level] * (1.0 - fraction) + profile[level + 1] * fraction) / whole * 0.25;
            // 30,000 to 50,000 collisions each: 0.5 %.
            assert!((count / expected - 1.0).abs() < 0.03, "{i}: {count} for {expected}");
        }
    }

    #[test]
    fn falls_go_down_and_wander_in_proportion() {
        let (_, sampler) = sampler(0.02);
        let node = energy_grid::locate(10_001.0).0;
        assert_eq!(collision_count(node), 100);
        let (mut squares, particles) = ([0.0; 2], 2000);
        for particle in 0..particles {
            let path: Vec<_> = sampler.sample_track(node, Key::new(1, "a"), particle).collect();
            // But for the triangular reach of a level.
            assert!(path.windows(2).all(|pair| pair[1].level <= pair[0].level));
            assert_eq!(path[0].transverse_km, [0.0; 2]);
            let last = path[path.len() - 1].transverse_km.map(f64::from);
            squares = std::array::from_fn(|i| squares[i] + last[i] * last[i] / particles as f64);
        }
        assert!(squares[0] > 0.01, "{squares:?}");
        let difference = squares[0] / squares[1] - 1.0;
        bansho_base::assert_measured!("equation (2.24): difference of both directions", difference, 0.0, 0.3);
    }
}
