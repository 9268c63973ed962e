//! Spawning of particles, section 4.3, step 1: each particle is a pure function of its id.

use bansho_base::math::{
    self, DVec3,
    random::{Key, Purpose, uniform},
};

use crate::particles::simulate::{
    burner::{Burner, SpawnPoint},
    derived::DerivedConstants,
    forces::turbulence::TurbulenceTile,
    particles::{GasParticles, Particle},
};

/// Number of low bits of an id that count the particles of one burner; the high bits are the index of the burner.
pub(super) const ORDINAL_BITS: u32 = 40;
/// Relative spread of the exit velocity.
const SPEED_SPREAD: f32 = 0.3;
/// Exit velocity relative to the mean at the center of the burner, and its decrease toward the rim.
const SPEED_PROFILE: [f64; 2] = [1.25, 0.5];
/// Burning rate relative to the mean at the center of the burner, and its increase toward the rim, which is exposed to air.
const BURN_RATE_PROFILE: [f64; 2] = [0.62, 0.9];
/// Amplitude of the noise of the burning rate, which causes tongues.
const BURN_RATE_NOISE: f64 = 0.3;
/// Wavelength of that noise, in diameters.
const BURN_RATE_NOISE_WAVELENGTH: f64 = 0.35;

/// Spawns the particles of all burners.
pub(crate) struct Spawner<'a> {
    pub(crate) constants: &'a DerivedConstants,
    pub(crate) turbulence: &'a TurbulenceTile,
    pub(crate) key: Key,
    pub(crate) burnt_gas_lifetime_s: f64,
}

impl Spawner<'_> {
    /// Spawns the particles of the interval from `start` to `start + seconds`, advanced to its end.
    ///
    /// They are counted from the beginning of the preroll, so that each particle is the same for any length of step.
    pub(crate) fn spawn(&self, particles: &mut GasParticles, start: f64, seconds: f64) {
        let constants = self.constants;
        for (burner_index, burner) in constants.burners.iter().enumerate() {
            let [before, after] = [start, start + seconds].map(|t| self.spawned_count(burner_index, burner, t));
            for ordinal in before.ceil().max(0.0) as u64..after.ceil().max(0.0) as u64 {
                if particles.len() >= constants.max_particles {
                    return;
                }
                let age = seconds * ((after - ordinal as f64) / (after - before)).clamp(0.0, 1.0);
                let id = (burner_index as u64) << ORDINAL_BITS | ordinal;
                self.spawn_one(particles, burner_index, id, start + seconds - age, age);
            }
        }
    }

    /// Number of particles spawned until `t`, including a fraction.
    fn spawned_count(&self, burner_index: usize, burner: &Burner, t: f64) -> f64 {
        let constants = self.constants;
        let start = self.pulsating_time(burner_index, -constants.preroll);
        let end = self.pulsating_time(burner_index, t);
        constants.rates[burner_index] * burner.parameters.flow.integral(start, end)
    }

    /// Time that passes faster and slower as a burner puffs, s: `t + pulse sin(omega t) / omega`. A flow over this time pulsates, with an unchanged mean.
    fn pulsating_time(&self, burner_index: usize, t: f64) -> f64 {
        let angular_frequency = std::f64::consts::TAU * self.constants.puffing_hz[burner_index];
        t + self.constants.pulse / angular_frequency * math::sin(angular_frequency * t)
    }

    /// Spawns particle `id` at `t`; it has reached `age` at the end of the step.
    fn spawn_one(&self, particles: &mut GasParticles, burner_index: usize, id: u64, t: f64, age: f64) {
        let (constants, burner) = (self.constants, &self.constants.burners[burner_index]);
        let spawn_point = burner.spawn_point(self.key, id, t);
        let random = uniform(self.key.words(id, 0, Purpose::named("birth speed"))[0]);
        let radial_squared = spawn_point.radial_fraction * spawn_point.radial_fraction;
        let profile = (SPEED_PROFILE[0] - SPEED_PROFILE[1] * radial_squared) as f32;
        let speed = burner.speed as f32 * profile * (1.0 + SPEED_SPREAD * (random - 0.5));
        let velocity = spawn_point.direction.as_vec3() * speed;
        let particle = Particle {
            id,
            position: (spawn_point.position + velocity.as_dvec3() * age).as_vec3().to_array(),
            velocity: velocity.to_array(),
            mass: constants.mass,
            density: constants.density,
            temperature: burner.parameters.temperature_k as f32,
            support_radius: constants.support_radius,
            age: age as f32,
            max_age: constants.max_age(burner_index, self.burnt_gas_lifetime_s) as f32,
            fuel: 1.0,
            soot: 0.0,
        };
        let burn_rate = self.burn_rate(burner, constants.puffing_hz[burner_index], &spawn_point, t) as f32;
        particles.push_from(burner_index as u32, burn_rate, particle);
    }

    /// Burning rate relative to the mean: higher at the rim, and with noise that varies in space and time.
    fn burn_rate(&self, burner: &Burner, hz: f64, spawn_point: &SpawnPoint, t: f64) -> f64 {
        let profile =
            BURN_RATE_PROFILE[0] + BURN_RATE_PROFILE[1] * spawn_point.radial_fraction * spawn_point.radial_fraction;
        let noise_position =
            spawn_point.position / (BURN_RATE_NOISE_WAVELENGTH * burner.diameter) + DVec3::Y * (2.5 * hz * t);
        profile * (1.0 + BURN_RATE_NOISE * f64::from(self.turbulence.noise(noise_position))).clamp(0.4, 2.0)
    }
}
