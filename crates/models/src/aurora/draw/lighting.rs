//! The aurora as a light: what it shines on ground and rain.

use bansho_base::{
    math::DVec3,
    surroundings::{Emitter, Light},
};

use fearless_simd::{Level, dispatch};

use super::{Aurora, shading::Shading};

/// Particles that are asked for their light, about.
const ASKED: usize = 2048;
/// Altitude from which the light of all heights seems to come, km.
const ALTITUDE_KM: f64 = 125.0;
/// Power of one mW/m^2 on one km^2, W.
const W_PER_UNIT: f64 = 1e3;

impl Aurora {
    /// One light from where most of it comes, as bright as all of it on a plane that faces it; none where nothing
    /// shines.
    pub(super) fn lamp(&self, t: f64) -> Option<Light> {
        let (simulation, particles) = (&self.simulation, self.simulation.particles());
        let energy_ev = simulation.parameters().energy_ev.at(t);
        let column = simulation.emission().column(energy_ev).kilorayleigh.map(|value| value as f32);
        let level = Level::new();
        let stride = particles.len().div_ceil(ASKED).max(1);
        let (mut way, mut sum) = (DVec3::ZERO, DVec3::ZERO);
        for index in (0..particles.len()).step_by(stride) {
            let place = particles.place(index);
            let toward = DVec3::new(place.x, ALTITUDE_KM, place.y);
            let squared = toward.length_squared();
            let direction = toward / squared.sqrt();
            // A patch of 1 mW/m^2 over 1 km^2 at 1 km has 1 sr and the column's brightness.
            let share = f64::from(particles.powers_w[index]) / W_PER_UNIT * stride as f64 / squared;
            let elevation = direction.y as f32;
            let colour: [f32; 4] =
                dispatch!(level, simd => self.shading.arriving(simd, &column, Shading::place(elevation)).into());
            let [red, green, blue, _] = colour.map(f64::from);
            sum += DVec3::new(red, green, blue) * share;
            way += direction * (share * green.max(0.0));
        }
        let toward = way.try_normalize()?;
        Some(Light { emitter: Emitter::Directional { toward }, intensity: sum.to_array().map(|value| value as f32) })
    }
}
