//! A plume of particles in closed form, drawn without simulation.

use bansho_base::math::{self, DVec3};

use bansho_fire::particles::{GasParticles, Particle};

const LIFETIME_S: f64 = 1.1;
const DENSITY: f64 = 0.2;

/// `count` particles of a plume `height` m high at time `t`: they start on a disk, move inward as they accelerate, and sway as they rise.
pub(crate) fn plume(count: usize, height: f64, t: f64) -> GasParticles {
    let mut particles = GasParticles::new(DVec3::ZERO);
    let rate = count as f64 / LIFETIME_S;
    let last = (t * rate).floor() as i64;
    // The volume of the plume is about a twentieth of its height cubed.
    let volume = 0.05 * height * height * height / count as f64;
    for id in (last - count as i64 + 1).max(0)..=last {
        particles.push(particle(id as u64, t - id as f64 / rate, t, height, volume));
    }
    particles
}

fn particle(id: u64, age: f64, t: f64, height: f64, volume: f64) -> Particle {
    let random =
        bansho_base::math::random::Key::new(1, "plume").uniforms(id, 0, bansho_base::math::random::Purpose::named("p"));
    let [u, v, ..] = random.map(f64::from);
    let age_fraction = (age / LIFETIME_S).clamp(0.0, 1.0);
    let y = height * (0.35 * age_fraction + 0.65 * age_fraction * age_fraction);
    let speed = height * (0.35 + 1.3 * age_fraction) / LIFETIME_S;
    let (sin, cos) = math::sin_cos(std::f64::consts::TAU * u);
    let radius = 0.16 * height * math::sqrt(v) * (1.0 - 0.55 * age_fraction);
    // Particles sway with random phases, the more the older they are.
    let (amplitude, turn) =
        (0.10 * height * age_fraction, std::f64::consts::TAU * (1.4 * (t - age) + 1.3 * y / height));
    let [across, toward] = [2.0 * u, 1.7 + 2.0 * v].map(|phase| amplitude * math::sin(turn + phase));
    let position = [radius * cos + across, y, radius * sin + toward];
    let hot = math::smoothstep(0.0, 0.15, age_fraction) * (1.0 - 0.35 * math::smoothstep(0.4, 1.0, age_fraction));
    let edge = math::sqrt(v) * 0.15;
    let soot = 1.5e-6
        * math::smoothstep(0.05, 0.35, age_fraction)
        * (1.0 - math::smoothstep(0.55 - edge, 1.0 - edge, age_fraction));
    Particle {
        id,
        position: position.map(|value| value as f32),
        velocity: [0.0, speed as f32, 0.0],
        mass: (DENSITY * volume) as f32,
        density: DENSITY as f32,
        temperature: (300.0 + 1650.0 * hot) as f32,
        support_radius: (2.2 * math::cbrt(volume)) as f32,
        age: age as f32,
        max_age: LIFETIME_S as f32,
        fuel: (1.0 - 3.0 * age_fraction).max(0.0) as f32,
        soot: soot as f32,
    }
}
