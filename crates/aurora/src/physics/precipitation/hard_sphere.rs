//! Electron tracks of the thesis (section 2.4.1): collisions with hard spheres of one radius for all energies;
//! and a few of them adjusted so that their mean is that of all.

use bansho_base::{
    math,
    math::random::{Key, Purpose, normal_pair, uniform_f64},
    parameters::{Auto, Range},
};

use super::{
    COLLISION_EV, EV_PER_S_PER_MW, ION_PAIR_EV,
    deposition::{AltitudeProfile, Deposition},
    electron_track::{Collision, TRACKS_PER_ENERGY, TrackSampler, TrackState, collision_count},
    energy_grid::{NODES, Spectrum, node_energy_ev},
};
use crate::physics::atmosphere::{Atmosphere, LEVEL_SPACING, LEVELS, level_altitude_km};

const COLLISION: Purpose = Purpose::named("aurora hard-sphere collision");

/// Radius of the spheres, m, that stops 10 keV electrons near 105 km; the thesis gives none. No radius fits all
/// energies: with this one 1 keV electrons stop at 129 km instead of 158 km.
pub(crate) const DEFAULT_RADIUS_M: f64 = 3.2e-11;

/// Radii from a hundredth of the default to ten times that of a molecule, pm.
const RADII_PM: Range = Range::new(0.3, 2000.0);
/// m.
const PICOMETER: f64 = 1e-12;

bansho_base::parameters! {
    /// The hard spheres of the thesis (2.4), for `energy_deposition = "hard_sphere"`. The thesis has one radius r and does not state it.
    pub struct HardSphereParameters {
        /// Radius r of (2.22). At 32 pm electrons of 10 keV stop near 105 km, at 100 pm near 130 km.
        collision_radius_pm: f64 = DEFAULT_RADIUS_M / PICOMETER, limits(RADII_PM), unit("pm");
        /// Radius r of (2.25), by which excited atoms are quenched; `"auto"` is the radius of the collisions, as in the thesis. With collisions at 32 pm
        /// and the radius of a molecule here, 185 pm, 12 % of the green light are left at 170 km and 33 % at 190 km.
        quenching_radius_pm: Auto<f64> = Auto::Auto, limits(RADII_PM), unit("pm");
    }
}

impl HardSphereParameters {
    /// Radius of the spheres that electrons collide with, m.
    #[must_use]
    pub fn collision_radius(&self) -> f64 {
        self.collision_radius_pm * PICOMETER
    }

    /// Radius of the spheres that quench, m.
    #[must_use]
    pub fn quenching_radius(&self) -> f64 {
        match self.quenching_radius_pm {
            Auto::Auto => self.collision_radius(),
            Auto::Set(radius) => radius * PICOMETER,
        }
    }
}

/// An atmosphere of hard spheres.
#[derive(Clone, Debug)]
pub struct HardSphereAtmosphere {
    /// Column density of spheres above each level, from the top down, m^-2.
    columns: Vec<f64>,
    /// pi r^2, m^2.
    cross_section: f64,
    deflection: f64,
}

impl HardSphereAtmosphere {
    /// Spheres of `radius` in m with the number density of N2, O2 and O; `deflection` as for
    /// [`TrackSampler`](super::electron_track::TrackSampler::new).
    #[must_use]
    pub fn new(air: &Atmosphere, radius: f64, deflection: f64) -> Self {
        let mut above = None;
        let mut column = 0.0;
        let columns = air.levels().iter().rev().map(|air| {
            let density = air.number_density();
            // Above the topmost level the density decreases with its scale height.
            column += above.map_or(density * air.scale_height, |above| LEVEL_SPACING * 0.5 * (above + density));
            above = Some(density);
            column
        });
        Self { columns: columns.collect(), cross_section: std::f64::consts::PI * radius * radius, deflection }
    }

    /// The collisions of particle number `particle`, until its energy is lost or it leaves the levels.
    ///
    /// (2.22) is read as `1 - exp(-n pi r^2 |L|)`, which stays below 1 in dense air. The column density to the next
    /// collision is then exponentially distributed and is sampled directly, without steps.
    pub fn track(&self, energy_ev: f64, key: Key, particle: u64) -> impl Iterator<Item = Collision> {
        let mut state = TrackState::default();
        let (mut column, mut from_top) = (0.0, 0);
        (0..(energy_ev / COLLISION_EV).round().max(1.0) as u32).map_while(move |number| {
            let words = key.words(particle, number, COLLISION);
            let deflection = normal_pair([words[2], words[3]]).map(|deviation| deviation as f64 * self.deflection);
            let slant = math::sqrt(1.0 + deflection[0] * deflection[0] + deflection[1] * deflection[1]);
            // The free path is exponential in the column density, whatever the profile of the air, and is shorter in altitude on a slant path.
            column -= math::ln_1p(-uniform_f64(words[0], words[1])) / (self.cross_section * slant);
            while from_top < LEVELS && self.columns[from_top] < column {
                from_top += 1;
            }
            let altitude_km = self.altitude_km(from_top, column)?;
            state.advance(altitude_km, deflection);
            Some(state.collision((altitude_km - level_altitude_km(0)).round() as usize))
        })
    }

    /// Ionization rate, m^-3 s^-1 per mW m^-2, for each energy node and level: the expected value over all undeflected
    /// tracks.
    ///
    /// The number of collisions above a column density is Poisson distributed; an electron contributes while it has
    /// collisions left.
    #[must_use]
    pub fn profiles(&self, air: &Atmosphere) -> Vec<AltitudeProfile> {
        let counts: [u32; NODES] = std::array::from_fn(collision_count);
        let mut profiles = vec![[0.0; LEVELS]; NODES];
        for (level, air) in air.levels().iter().enumerate() {
            let still_colliding = poisson_below(&counts, self.columns[LEVELS - 1 - level] * self.cross_section);
            let pairs_per_m = air.number_density() * self.cross_section * (COLLISION_EV / ION_PAIR_EV);
            for (node, fraction) in still_colliding.into_iter().enumerate() {
                profiles[node][level] = EV_PER_S_PER_MW / node_energy_ev(node) * pairs_per_m * fraction;
            }
        }
        profiles
    }

    /// Altitude at which the column density is reached, between the level `from_top` and the one above; `None` below
    /// the lowest level.
    fn altitude_km(&self, from_top: usize, column: f64) -> Option<f64> {
        let low = *self.columns.get(from_top)?;
        let low_km = level_altitude_km(LEVELS - 1 - from_top);
        let Some(above) = from_top.checked_sub(1) else { return Some(low_km) };
        let high = self.columns[above];
        Some(low_km + math::ln(low / column) / math::ln(low / high))
    }
}

impl Deposition {
    /// The table of the thesis's hard-sphere tracks, for spheres of `radius` in m.
    #[must_use]
    pub(crate) fn from_hard_spheres(air: &Atmosphere, spectrum: Spectrum, radius: f64) -> Self {
        Self::from_profiles(HardSphereAtmosphere::new(air, radius, 0.0).profiles(air), spectrum)
    }
}

/// Ion pairs of one collision of electrons of an energy, m^-2 s^-1 per mW m^-2: each collision deposits 100 eV.
#[must_use]
pub(crate) fn ion_pairs_of_collision(energy_ev: f64) -> f64 {
    EV_PER_S_PER_MW / energy_ev * (COLLISION_EV / ION_PAIR_EV)
}

/// Probabilities that a Poisson variable of that mean is below each of the ascending counts.
fn poisson_below(counts: &[u32; NODES], mean: f64) -> [f64; NODES] {
    let (mut number, mut log_probability, mut sum) = (0, -mean, 0.0);
    counts.map(|count| {
        while number < count {
            // As logarithms: exp(-mean) alone is 0 above a mean of 745, and electrons of 100 keV have 1000 collisions.
            sum += math::exp(log_probability);
            number += 1;
            log_probability += math::ln(mean / f64::from(number));
        }
        sum
    })
}

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
        precipitation::{Deposition, energy_grid::ARC},
    };

    /// Mean altitude of the last collision, km.
    fn end_km(energy_ev: f64) -> f64 {
        let spheres = HardSphereAtmosphere::new(atmosphere(), DEFAULT_RADIUS_M, 0.02);
        let key = Key::new(1, "aurora");
        let ends = (0..500).filter_map(|particle| spheres.track(energy_ev, key, particle).last());
        ends.map(|collision| collision.altitude_km as f64).sum::<f64>() / 500.0
    }

    #[test]
    fn ten_kilovolts_end_near_their_peak_and_one_does_not() {
        assert!((end_km(1e4) - 105.0).abs() < 1.5, "{}", end_km(1e4));
        assert!((end_km(1e3) - 129.0).abs() < 2.5, "{}", end_km(1e3));
    }

    /// The radius of the literal scenes.
    #[test]
    fn ten_kilovolts_end_near_130_km_in_larger_spheres() {
        let spheres = HardSphereAtmosphere::new(atmosphere(), 1e-10, 0.0);
        let ends = (0..500).filter_map(|particle| spheres.track(1e4, Key::new(1, "aurora"), particle).last());
        let end_km = ends.map(|collision| collision.altitude_km as f64).sum::<f64>() / 500.0;
        assert!((end_km - 130.0).abs() < 3.0, "{end_km}");
    }

    #[test]
    fn profiles_are_the_mean_of_many_falls() {
        let spheres = HardSphereAtmosphere::new(atmosphere(), DEFAULT_RADIUS_M, 0.0);
        let profiles = spheres.profiles(atmosphere());
        for node in [32, 64] {
            let tracks = 4000;
            let mut histogram = [0.0; LEVELS / 4 + 1];
            for particle in 0..tracks {
                for collision in spheres.track(node_energy_ev(node), Key::new(4, "aurora"), particle) {
                    histogram[collision.level as usize / 4] += 1.0 / (tracks * u64::from(collision_count(node))) as f64;
                }
            }
            let whole: f64 = profiles[node].iter().sum();
            let expected = profiles[node].chunks(4).map(|levels| levels.iter().sum::<f64>() / whole);
            let difference: f64 = expected.zip(histogram).map(|(expected, found)| (expected - found).abs()).sum();
            // Shot noise, and levels taken as a kilometer high.
            assert!(difference < 0.05, "{node}: {difference}");
            // All of the energy that collisions take, but for what electrons of 1 keV leave above 800 km.
            let pairs = whole * LEVEL_SPACING * ION_PAIR_EV / EV_PER_S_PER_MW;
            assert!((pairs - 1.0).abs() < 0.02, "{node}: {pairs}");
        }
    }

    #[test]
    fn collisions_are_poisson_in_the_column() {
        let spheres = HardSphereAtmosphere::new(atmosphere(), DEFAULT_RADIUS_M, 0.0);
        // Columns above 120 km hold on average column * pi r^2 collisions.
        let expected = spheres.columns[LEVELS - 1 - 40] * spheres.cross_section;
        let key = Key::new(2, "aurora");
        let counts = (0..4000).map(|particle| {
            spheres.track(1e5, key, particle).filter(|collision| collision.altitude_km > 120.0).count() as f64
        });
        let (sum, squares) = counts.fold((0.0, 0.0), |(sum, squares), count| (sum + count, squares + count * count));
        let (mean, variance) = (sum / 4000.0, squares / 4000.0 - sum * sum / 16e6);
        bansho_base::assert_measured!(
            "equation (2.22): difference of the mean count",
            mean / expected - 1.0,
            0.0,
            0.05
        );
        bansho_base::assert_measured!(
            "equation (2.21): difference of the variance of counts",
            variance / expected - 1.0,
            0.0,
            0.1
        );
    }

    /// Altitudes of the collisions of an electron, km, from the highest down, by the steps of (2.21) with the probability (2.22) as printed. Steps are short:
    /// that probability is at most 1/500.
    fn stepped_fall(radius: f64, deflection: f64, energy_ev: f64, key: Key, particle: u64) -> Vec<f64> {
        let cross_section = std::f64::consts::PI * radius * radius;
        let levels = atmosphere().levels();
        // How much of a step is downward: B and omega, two tangents, are added and made a unit vector. A new omega is drawn after each collision.
        let descent = |collision: u32| {
            let words = key.words(particle, collision, Purpose(1));
            let [x, z] = normal_pair([words[0], words[1]]).map(|deviation| f64::from(deviation) * deflection);
            1.0 / math::sqrt(1.0 + x * x + z * z)
        };
        let mut collisions = Vec::new();
        let (mut altitude, mut downward) = (1000.0 * level_altitude_km(LEVELS - 1), descent(0));
        for step in 0.. {
            let place = (altitude - 1000.0 * level_altitude_km(0)) / LEVEL_SPACING;
            if collisions.len() as f64 * COLLISION_EV >= energy_ev || place < 0.0 {
                break;
            }
            // Between two levels the density is exponential.
            let level = (place as usize).min(LEVELS - 2);
            let [low, high] = [level, level + 1].map(|level| levels[level].number_density());
            let density = low * math::exp((place - level as f64) * math::ln(high / low));
            let length = (0.002 / (density * cross_section)).min(100.0);
            altitude -= length * downward;
            let words = key.words(particle, step, Purpose(2));
            if uniform_f64(words[0], words[1]) < density * cross_section * length {
                collisions.push(0.001 * altitude);
                downward = descent(collisions.len() as u32);
            }
        }
        collisions
    }

    /// Mean and squared standard error of a number of each of some electrons.
    fn mean_and_error(values: &[f64]) -> [f64; 2] {
        let count = values.len() as f64;
        let mean = values.iter().sum::<f64>() / count;
        let squares = values.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>();
        [mean, squares / (count * (count - 1.0))]
    }

    /// Electrons of the literal scenes: 10 keV and spheres of 100 pm, with 25 times their deflection. The collisions of one electron depend on each other, so
    /// that errors are those between electrons.
    #[test]
    fn falls_by_steps_of_time_have_the_same_altitudes() {
        let (radius, deflection) = (1e-10, 0.05);
        let spheres = HardSphereAtmosphere::new(atmosphere(), radius, deflection);
        let mut stepped: Vec<Vec<f64>> = Vec::new();
        for particle in 0..400 {
            stepped.push(stepped_fall(radius, deflection, 1e4, Key::new(1, "stepped"), particle));
        }
        let mut sampled: Vec<Vec<f64>> = Vec::new();
        for particle in 0..4000 {
            let collisions = spheres.track(1e4, Key::new(2, "sampled"), particle);
            sampled.push(collisions.map(|collision| f64::from(collision.altitude_km)).collect());
        }
        assert!(stepped.iter().chain(&sampled).all(|collisions| collisions.len() == 100));
        let mean = |values: &Vec<f64>| values.iter().sum::<f64>() / values.len() as f64;
        let deviation = |values: &Vec<f64>| {
            let mean = mean(values);
            math::sqrt(values.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>() / values.len() as f64)
        };
        let high = |values: &Vec<f64>| values.iter().filter(|value| **value > 150.0).count() as f64;
        let lowest = |values: &Vec<f64>| values[values.len() - 1];
        type Statistic<'a> = &'a dyn Fn(&Vec<f64>) -> f64;
        let statistics: [(&str, Statistic<'_>); 4] =
            [("mean", &mean), ("deviation", &deviation), ("above 150 km", &high), ("lowest", &lowest)];
        for (name, statistic) in statistics {
            let [by_steps, by_columns] = [&stepped, &sampled].map(|electrons| {
                let values: Vec<f64> = electrons.iter().map(statistic).collect();
                mean_and_error(&values)
            });
            let error = math::sqrt(by_steps[1] + by_columns[1]);
            println!("measured: {name}: {} by steps, {} by columns, error {error}", by_steps[0], by_columns[0]);
            assert!((by_steps[0] - by_columns[0]).abs() < 3.0 * error, "{name}: {by_steps:?} {by_columns:?}");
            // Small enough that a fault would be found.
            assert!(error < 0.03 * by_columns[0], "{name}: {error} of {}", by_columns[0]);
        }
    }

    #[test]
    fn falls_end_above_the_ground_and_go_down() {
        let spheres = HardSphereAtmosphere::new(atmosphere(), 1e-12, 0.1);
        for particle in 0..200 {
            let path: Vec<_> = spheres.track(1e6, Key::new(1, "b"), particle).collect();
            assert!(path.windows(2).all(|pair| pair[1].altitude_km <= pair[0].altitude_km));
            assert!(path.iter().all(|collision| (collision.level as usize) < LEVELS && collision.altitude_km >= 80.0));
        }
    }

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
