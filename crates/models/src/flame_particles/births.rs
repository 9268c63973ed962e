//! New particles, section 4.3 (1): each a pure function of its birth number.

use bansho_base::{
    math::DVec3,
    random::{Key, Purpose, uniform},
};

use super::{design::Design, particles::Particles};

/// Bits of a birth number that count the births of one burner; those above are the burner's own number.
const ORDINAL_BITS: u32 = 40;
/// How much the speed of gas at birth differs, as a share.
const SPEED_SPREAD: f32 = 0.3;

/// Adds the particles that are born from `start` to `start + seconds`, as far along as they are at its end.
///
/// Births are counted since the preroll began, so that steps of any length give the same ones.
pub(crate) fn add(particles: &mut Particles, design: &Design, afterlife_s: f64, key: Key, start: f64, seconds: f64) {
    for (number, (burner, rate)) in design.burners.iter().zip(&design.rates).enumerate() {
        let born = |t: f64| rate * burner.parameters.flow.integral(-design.preroll, t);
        let [before, after] = [born(start), born(start + seconds)];
        let life = design.longest_life(number, afterlife_s) as f32;
        for ordinal in before.ceil().max(0.0) as u64..after.ceil().max(0.0) as u64 {
            if particles.len() >= design.most {
                return;
            }
            let birth = (number as u64) << ORDINAL_BITS | ordinal;
            let place = burner.birthplace(key, birth);
            let chance = uniform(key.words(birth, 0, Purpose::named("birth speed"))[0]);
            let speed = burner.speed as f32 * (1.0 + SPEED_SPREAD * (chance - 0.5));
            let velocity = place.direction.as_vec3() * speed;
            let age = seconds * ((after - ordinal as f64) / (after - before)).clamp(0.0, 1.0);
            push(
                particles,
                design,
                number,
                birth,
                place.position + (velocity.as_dvec3() * age),
                velocity.to_array(),
                life,
                age as f32,
            );
        }
    }
}

#[expect(clippy::too_many_arguments, reason = "a particle's numbers at birth")]
fn push(
    particles: &mut Particles,
    design: &Design,
    number: usize,
    birth: u64,
    position: DVec3,
    velocity: [f32; 3],
    life: f32,
    age: f32,
) {
    particles.push(super::Particle {
        birth,
        position: position.as_vec3().to_array(),
        velocity,
        mass: design.mass,
        density: design.rest_density.max(1e-6),
        temperature: design.burners[number].parameters.temperature_k as f32,
        support_radius: design.support_radius,
        age,
        life,
        fuel: 1.0,
        soot: 0.0,
    });
    if let Some(burner) = particles.burner.last_mut() {
        *burner = number as u32;
    }
}
