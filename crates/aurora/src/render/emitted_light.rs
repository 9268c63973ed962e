//! Illumination of ground and rain by the aurora, as one directional light.

use bansho_base::{
    math::{self, DVec2, DVec3},
    phenomenon::surroundings::{Emitter, Light},
};
use fearless_simd::dispatch;

use crate::{
    render::{
        project::field_lines::{EARTH_RADIUS_KM, FOOT_ALTITUDE_KM},
        shade::EmitterColors,
    },
    simulate::AuroraSimulation,
};

/// Approximate number of particles that are sampled.
const MAX_SAMPLED_PARTICLES: usize = 2048;
/// Effective altitude of the emission, km.
const ALTITUDE_KM: f64 = 125.0;
/// Power of one mW/m^2 on one km^2, W.
const W_PER_UNIT: f64 = 1e3;

/// Apparent position of the light above a position of the drawn plane, km: along the shell at 100 km of a spherical
/// Earth.
fn toward_km(position: DVec2) -> DVec3 {
    let (sin, cos) = math::sin_cos(position.length() / (EARTH_RADIUS_KM + FOOT_ALTITUDE_KM));
    let level = position.normalize_or_zero() * sin;
    DVec3::new(level.x, cos, level.y) * (EARTH_RADIUS_KM + ALTITUDE_KM) - DVec3::Y * EARTH_RADIUS_KM
}

/// One directional light from the weighted mean direction, with the irradiance of the whole aurora on a plane that
/// faces it, for receivers on the ground below the drawn square's center; `None` where nothing shines. Each
/// particle has the color of its own electron energy; particles below the horizon are skipped.
pub(crate) fn directional_light(simulation: &AuroraSimulation, emitter_colors: &EmitterColors) -> Option<Light> {
    let (emission, particles) = (simulation.emission(), simulation.particles());
    let level = bansho_base::math::simd::level();
    let stride = particles.len().div_ceil(MAX_SAMPLED_PARTICLES).max(1);
    let (mut direction_sum, mut sum) = (DVec3::ZERO, DVec3::ZERO);
    for index in (0..particles.len()).step_by(stride) {
        let toward = toward_km(particles.position(index));
        let squared = toward.length_squared();
        let direction = toward / math::sqrt(squared);
        let elevation = direction.y as f32;
        if elevation <= 0.0 {
            continue;
        }
        let column = emission.column(f64::from(particles.energies_ev[index])).kilorayleigh.map(|value| value as f32);
        // A patch of 1 mW/m^2 over 1 km^2 at 1 km subtends 1 sr and has the column's brightness.
        let solid_angle = f64::from(particles.powers_w[index]) / W_PER_UNIT * stride as f64 / squared;
        let color: [f32; 4] = dispatch!(level, simd => emitter_colors.attenuated(simd, &column, EmitterColors::table_coordinate(elevation)).into());
        let [red, green, blue, _] = color.map(f64::from);
        sum += DVec3::new(red, green, blue) * solid_angle;
        direction_sum += direction * (solid_angle * green.max(0.0));
    }
    let toward = direction_sum.try_normalize()?;
    Some(Light { emitter: Emitter::Directional { toward }, intensity: sum.to_array().map(|value| value as f32) })
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use bansho_base::{
        host::assets::MemoryAssets,
        math::curve::{Curve, Interpolation},
        parameters::animated::Animated,
    };

    use super::*;
    use crate::{
        Aurora, AuroraParameters, AuroraRun, ParticleParameters,
        shapes::{ShapeParameters, SheetParameters},
    };

    fn lamp(energy_ev: f64, factor: f64, north_km: f64) -> Option<Light> {
        let sheet = SheetParameters {
            points: Some(vec![[-90.0, -north_km], [90.0, -north_km]]),
            energy_factor: Curve::new(vec![[0.0, factor]], Interpolation::Linear).unwrap(),
            end_taper: 0.0,
            ..SheetParameters::default()
        };
        let parameters = AuroraParameters {
            extent_km: 4000.0,
            energy_ev: Animated::from(energy_ev),
            particles: ParticleParameters { count: 500, ..ParticleParameters::default() },
            shapes: vec![ShapeParameters { sheets: vec![sheet], ..ShapeParameters::default() }],
            ..AuroraParameters::default()
        };
        let aurora = Aurora::new(parameters, "aurora", 1, None, &MemoryAssets::default()).unwrap();
        let run = AuroraRun::new(Arc::new(aurora));
        directional_light(run.simulation(), &run.render_inputs().tables.emitter_colors)
    }

    #[test]
    fn sheets_with_their_own_energy_shine_in_their_own_color() {
        let color = |energy_ev, factor| {
            let [red, green, blue] = lamp(energy_ev, factor, 50.0).unwrap().intensity;
            [red / green, blue / green]
        };
        let (soft, same) = (color(500.0, 1.0), color(5000.0, 0.1));
        assert!((0..2).all(|i| (soft[i] / same[i] - 1.0).abs() < 0.02), "{soft:?} {same:?}");
        assert!(color(5000.0, 1.0)[0] < 0.8 * same[0], "soft electrons give more red");
    }

    #[test]
    fn the_earth_is_round_under_it() {
        let elevation = |light: Light| match light.emitter {
            Emitter::Directional { toward } => math::asin(toward.y).to_degrees(),
            _ => f64::NAN,
        };
        // 125 km high and 800 km away along the shell: by the triangle with the Earth's middle.
        let (sin, cos) = math::sin_cos(800.0 / 6471.0);
        let expected = math::atan((6496.0 * cos - 6371.0) / (6496.0 * sin)).to_degrees();
        let found = elevation(lamp(5000.0, 1.0, 800.0).unwrap());
        assert!((found - expected).abs() < 0.3, "{found} {expected}");
        assert_eq!(lamp(5000.0, 1.0, 1600.0), None, "below the horizon");
    }
}
