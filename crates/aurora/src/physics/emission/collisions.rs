//! Photons of single collisions: normalized so that the mean of the electron tracks is the emission table, and the
//! thesis's quenching rules.

use bansho_base::math;

use super::{
    emitter::{EMITTERS, PerEmitter, SpectralEmitter},
    excitation::DIRECT_PHOTONS,
    quenching::natural_lifetime,
};
use crate::physics::atmosphere::AirLevel;

/// k_b, J/K, and the atomic mass unit, kg.
const BOLTZMANN: f64 = 1.380_649e-23;
const ATOMIC_MASS: f64 = 1.660_539e-27;

/// Mean thermal speed of molecules with a mass in atomic units, m/s (2.26).
#[must_use]
pub fn thermal_speed(temperature: f64, mass_u: f64) -> f64 {
    math::sqrt(8.0 * BOLTZMANN * temperature / (std::f64::consts::PI * mass_u * ATOMIC_MASS))
}

/// Probability that a contact with a sphere of `radius` in m de-excites a state within its mean lifetime (2.25).
///
/// With the radius of the electrons' collisions, 3.2e-11 m, a tenth of the green light is left at 110 km and nearly all above 150 km. With that of a
/// molecule, 1.85e-10 m, none is left below 190 km, which is not observed: few contacts with a molecule quench O(1S).
#[must_use]
pub fn hard_sphere_quenching(emitter: SpectralEmitter, air: &AirLevel, radius: f64) -> f64 {
    let mass_u = match emitter {
        SpectralEmitter::OxygenGreen | SpectralEmitter::OxygenRed => 15.999,
        SpectralEmitter::NitrogenIon | SpectralEmitter::Nitrogen => 28.014,
    };
    let cross_section = std::f64::consts::PI * radius * radius;
    let rate = std::f64::consts::SQRT_2 * air.number_density() * cross_section * thermal_speed(air.temperature, mass_u);
    -math::exp_m1(-rate * natural_lifetime(emitter))
}

/// Photons of each emitter per ion pair by the rules of the thesis (2.4.2): the target is chosen by number density and
/// emits one line by production rate, unless it is quenched (2.25) by spheres of `radius` in m. O2 emits nothing. This is the expected value over
/// all random choices.
#[must_use]
pub fn mean_hard_sphere_photons(air: &AirLevel, radius: f64) -> PerEmitter<f64> {
    EMITTERS.map(|emitter| {
        let struck = match emitter {
            SpectralEmitter::OxygenGreen | SpectralEmitter::OxygenRed => air.o,
            SpectralEmitter::NitrogenIon | SpectralEmitter::Nitrogen => air.n2,
        };
        let radiated = 1.0 - hard_sphere_quenching(emitter, air, radius);
        struck / air.number_density() * DIRECT_PHOTONS[emitter.index()] * radiated
    })
}

#[cfg(test)]
mod tests {
    use bansho_base::math::random::{Key, Purpose};

    use super::{
        super::{Emission, PHOTONS_PER_KILORAYLEIGH},
        *,
    };
    use crate::physics::{
        atmosphere::{LEVELS, atmosphere},
        precipitation::{electron_track::TrackSampler, spectrum::ARC},
    };

    /// Light by level and emitter, kR per mW m^-2, of so many tracks of a spectrum.
    fn light(table: &Emission, tracks: &TrackSampler, energy_ev: f64, particles: u64) -> Vec<PerEmitter<f64>> {
        let key = Key::new(11, "aurora");
        let mut sum = vec![[0.0; 4]; LEVELS];
        for particle in 0..particles {
            let uniforms = key.uniforms(particle, 0, Purpose::named("energy")).map(f64::from);
            let node = table.deposition().sample_node(energy_ev, [uniforms[0], uniforms[1]]);
            let pairs = table.ion_pairs_per_collision(node) / particles as f64;
            for collision in tracks.sample_track(node, key, particle) {
                let level = collision.level as usize;
                let photons = table.photons_per_ion_pair()[level];
                sum[level] = std::array::from_fn(|i| sum[level][i] + photons[i] * pairs);
            }
        }
        sum
    }

    /// Sum of absolute differences from the profile over its sum, levels taken together by tens for the red line, which few collisions
    /// high up make.
    fn difference(table: &Emission, energy_ev: f64, found: &[PerEmitter<f64>]) -> PerEmitter<f64> {
        let profile = table.profile(energy_ev);
        std::array::from_fn(|i| {
            let together = if i == SpectralEmitter::OxygenRed.index() { 20 } else { 1 };
            let sums = |levels: &[PerEmitter<f64>]| -> Vec<f64> {
                levels.chunks(together).map(|chunk| chunk.iter().map(|photons| photons[i]).sum()).collect()
            };
            let expected: Vec<f64> = sums(&profile).iter().map(|sum| sum * 1e3 / PHOTONS_PER_KILORAYLEIGH).collect();
            let apart: f64 = sums(found).iter().zip(&expected).map(|(found, expected)| (found - expected).abs()).sum();
            apart / expected.iter().sum::<f64>()
        })
    }

    #[test]
    fn the_mean_of_collisions_is_the_profile() {
        let table = Emission::new(atmosphere(), ARC);
        let tracks = TrackSampler::new(table.deposition(), 0.02);
        // 64 sets of 500 particles; a picture of 120,000 has a fifteenth of this noise.
        let all = difference(&table, 4000.0, &light(&table, &tracks, 4000.0, 32_000));
        assert!(all.iter().all(|difference| *difference < 0.03), "{all:?}");
    }

    #[test]
    fn thermal_speed_by_hand() {
        // sqrt(8 x 1.380649e-23 x 300 / (pi x 28.014 x 1.660539e-27)) = 476.2 m/s.
        assert!((thermal_speed(300.0, 28.014) - 476.2).abs() < 0.1);
    }

    #[test]
    fn green_survives_the_radius_of_the_collisions_and_not_that_of_a_molecule() {
        let left = |altitude_km, radius| {
            1.0 - hard_sphere_quenching(SpectralEmitter::OxygenGreen, &atmosphere().at(altitude_km), radius)
        };
        for (altitude_km, of_collisions, of_molecules) in
            [(115.0, 0.16, 0.0), (120.0, 0.35, 0.0), (130.0, 0.64, 0.0), (150.0, 0.87, 0.01)]
        {
            let found = [3.2e-11, 1.85e-10].map(|radius| left(altitude_km, radius));
            assert!((found[0] - of_collisions).abs() < 0.006, "{altitude_km}: {found:?}");
            assert!((found[1] - of_molecules).abs() < 0.006, "{altitude_km}: {found:?}");
        }
        assert!(hard_sphere_quenching(SpectralEmitter::NitrogenIon, &atmosphere().at(110.0), 1.85e-10) < 1e-3);
    }

    /// What shines after a collision, drawn by the rules of the thesis.
    fn drawn(air: &AirLevel, radius: f64, uniforms: [f64; 3]) -> Option<SpectralEmitter> {
        use SpectralEmitter::{Nitrogen, NitrogenIon, OxygenGreen, OxygenRed};
        let species_draw = uniforms[0] * air.number_density();
        let struck = match species_draw {
            species_draw if species_draw < air.o => [OxygenGreen, OxygenRed],
            species_draw if species_draw < air.o + air.n2 => [NitrogenIon, Nitrogen],
            _ => return None,
        };
        let rates = struck.map(|emitter| DIRECT_PHOTONS[emitter.index()]);
        let emitter = struck[usize::from(uniforms[1] * (rates[0] + rates[1]) >= rates[0])];
        (uniforms[2] >= hard_sphere_quenching(emitter, air, radius)).then_some(emitter)
    }

    #[test]
    fn the_mean_of_the_rules_is_what_they_draw() {
        let air = atmosphere().at(220.0);
        let [green, red, violet, deep_red] = DIRECT_PHOTONS;
        // All photons that a species has.
        let photons = [green + red, green + red, violet + deep_red, violet + deep_red];
        let (mut sum, draws) = ([0.0; 4], 100_000_u64);
        for draw in 0..draws {
            let [a, b, c, _] = Key::new(1, "rules").uniforms(draw, 0, Purpose::named("draw")).map(f64::from);
            if let Some(emitter) = drawn(&air, 1.85e-10, [a, b, c]) {
                sum[emitter.index()] += photons[emitter.index()] / draws as f64;
            }
        }
        let mean = mean_hard_sphere_photons(&air, 1.85e-10);
        // Hardly any red is left, and 1,700 photons of the violet: 2.4 %.
        for i in [0, 2, 3] {
            assert!((sum[i] / mean[i] - 1.0).abs() < 0.08, "{i}: {sum:?} {mean:?}");
        }
        assert!(mean[1] < 1e-3 && sum[1] < 1e-3, "{sum:?} {mean:?}");
    }
}
