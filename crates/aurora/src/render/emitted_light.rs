//! Illumination of ground and rain by the aurora, as one directional light, and of plates, as lights in fixed directions over the sky.

use std::f64::consts::TAU;

use bansho_base::{
    math::{self, DVec2, DVec3},
    phenomenon::surroundings::{Emitter, Light},
};
use fearless_simd::dispatch;

use crate::{
    render::{
        cloud_in_cell::CloudInCellGrid,
        project::field_lines::{EARTH_RADIUS_KM, FOOT_ALTITUDE_KM},
        shade::EmitterColors,
    },
    simulate::AuroraSimulation,
};

/// Cells per side of the drawn square, whose power together stands for the particles: a sample of these would make the light of a plate flicker.
const CELLS: usize = 128;
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

/// The directions of the lights of the sky: the zenith, and two rings at these sines of elevation, with their numbers of directions.
const RINGS: [(f64, usize); 2] = [(0.788, 5), (0.309, 10)];
/// Number of lights of the sky.
pub(crate) const SKY_LIGHTS: usize = 1 + RINGS[0].1 + RINGS[1].1;
/// Cosine of the angle up to which a light of the sky stands for directions about its own: between three and five lights share any direction.
const SHARED_COSINE: f64 = 0.72;

/// Illumination by the aurora, for receivers on the ground below the drawn square's center.
#[derive(Debug, PartialEq)]
pub(crate) struct EmittedLight {
    /// One light from the weighted mean direction, with the irradiance of the whole aurora on a plane that faces it.
    pub(crate) mean: Light,
    /// Lights in fixed directions, with the irradiance of what is about each of them. Together they are the radiance of the aurora over the sphere, which
    /// surfaces see with soft shadows; since only their intensities change, these shadows are computed once.
    pub(crate) sky: Vec<Light>,
}

/// Fixed unit vectors toward the lights of the sky.
fn sky_directions() -> [DVec3; SKY_LIGHTS] {
    let mut directions = [DVec3::Y; SKY_LIGHTS];
    let mut next = 1;
    for (sine, count) in RINGS {
        for index in 0..count {
            let (sin, cos) = math::sin_cos(TAU * (index as f64 + 0.5) / count as f64);
            let level = math::sqrt(1.0 - sine * sine);
            directions[next] = DVec3::new(level * sin, sine, -level * cos);
            next += 1;
        }
    }
    directions
}

/// The light of an aurora and of its diffuse aurora; `None` where nothing shines. A cell has the color of the mean energy of its electrons; cells below the horizon
/// are skipped.
pub(crate) fn emitted_light(simulation: &AuroraSimulation, emitter_colors: &EmitterColors) -> Option<EmittedLight> {
    let (emission, particles) = (simulation.emission(), simulation.particles());
    let diffuse = &simulation.parameters().diffuse;
    let diffuse_column = emission.column(diffuse.energy_ev).kilorayleigh;
    let level = bansho_base::math::simd::level();
    // A cell more to each side: those at the edges share their particles with it.
    let grid = CloudInCellGrid { cell_km: simulation.parameters().extent_km / CELLS as f64, side: CELLS + 2 };
    let powers = grid.deposit(&particles.positions, particles.powers_w.iter().copied());
    let weighted_energies = particles.powers_w.iter().zip(&particles.energies_ev).map(|(power, energy)| power * energy);
    let energies = grid.deposit(&particles.positions, weighted_energies);
    let directions = sky_directions();
    let mut sky = [DVec3::ZERO; SKY_LIGHTS];
    let (mut direction_sum, mut sum) = (DVec3::ZERO, DVec3::ZERO);
    for (index, power) in powers.into_iter().enumerate().filter(|(_, power)| *power > 0.0) {
        let toward = toward_km(grid.middle_km(index).into());
        let squared = toward.length_squared();
        let direction = toward / math::sqrt(squared);
        let elevation = direction.y as f32;
        if elevation <= 0.0 {
            continue;
        }
        // The diffuse aurora is about as far to one side as to the other.
        let mut column = emission.column(f64::from(energies[index] / power)).kilorayleigh;
        for (light, diffuse_light) in column.iter_mut().zip(diffuse_column) {
            *light += diffuse.fraction * diffuse_light;
        }
        let column = column.map(|value| value as f32);
        // A patch of 1 mW/m^2 over 1 km^2 at 1 km subtends 1 sr and has the column's brightness.
        let solid_angle = f64::from(power) / W_PER_UNIT / squared;
        let color: [f32; 4] = dispatch!(level, simd => emitter_colors.attenuated(simd, &column, EmitterColors::table_coordinate(elevation)).into());
        let [red, green, blue, _] = color.map(f64::from);
        let light = DVec3::new(red, green, blue) * solid_angle;
        sum += light;
        direction_sum += direction * (solid_angle * green.max(0.0));
        let shares = directions.map(|other| (direction.dot(other) - SHARED_COSINE).max(0.0));
        let total: f64 = shares.iter().map(|share| share * share).sum();
        for (sum, share) in sky.iter_mut().zip(shares) {
            *sum += light * (share * share / total.max(f64::MIN_POSITIVE));
        }
    }
    let directional = |toward: DVec3, intensity: DVec3| Light {
        emitter: Emitter::Directional { toward },
        intensity: intensity.to_array().map(|value| value as f32),
    };
    let mean = directional(direction_sum.try_normalize()?, sum);
    let sky = directions.into_iter().zip(sky).map(|(toward, intensity)| directional(toward, intensity)).collect();
    Some(EmittedLight { mean, sky })
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
        Aurora, AuroraParameters, AuroraRun, ParticleParameters, SwirlParameters,
        shapes::{ShapeParameters, SheetParameters},
    };

    fn lamp(energy_ev: f64, factor: f64, north_km: f64) -> Option<Light> {
        emitted(energy_ev, factor, north_km).map(|light| light.mean)
    }

    fn emitted(energy_ev: f64, factor: f64, north_km: f64) -> Option<EmittedLight> {
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
            swirls: SwirlParameters { displacement_km: 0.0, ..SwirlParameters::default() },
            ..AuroraParameters::default()
        };
        let aurora = Aurora::new(parameters, "aurora", 1, None, &MemoryAssets::default()).unwrap();
        let run = AuroraRun::new(Arc::new(aurora));
        emitted_light(run.simulation(), &run.render_inputs().tables.emitter_colors)
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

    /// Particles are born, die and move. If every tenth stood for ten, the light would change by 1.7 % in a step.
    #[test]
    fn the_light_does_not_flicker_as_particles_are_born_and_die() {
        let particles = ParticleParameters { count: 20_000, ..ParticleParameters::default() };
        let parameters = AuroraParameters { particles, ..AuroraParameters::default() };
        let aurora = Aurora::new(parameters, "aurora", 1, None, &MemoryAssets::default()).unwrap();
        let mut simulation = aurora.initial_state().clone();
        let light = |simulation: &AuroraSimulation| {
            emitted_light(simulation, &aurora.render_tables().emitter_colors).unwrap().mean.intensity[1]
        };
        (0..40).for_each(|_| simulation.step());
        let (mut before, mut greatest) = (light(&simulation), 0.0_f32);
        for _ in 0..40 {
            simulation.step();
            let now = light(&simulation);
            greatest = greatest.max((now / before - 1.0).abs());
            before = now;
        }
        assert!(greatest < 0.004, "{greatest}");
    }

    #[test]
    fn the_lights_of_the_sky_are_all_of_its_light_from_about_its_directions() {
        for north_km in [0.0, 60.0, 150.0, 400.0, 800.0] {
            let EmittedLight { mean, sky } = emitted(5000.0, 1.0, north_km).unwrap();
            let Emitter::Directional { toward } = mean.emitter else { panic!("directional") };
            let (mut sum, mut direction) = (0.0, DVec3::ZERO);
            for light in &sky {
                let Emitter::Directional { toward } = light.emitter else { panic!("directional") };
                assert!((toward.length() - 1.0).abs() < 1e-9 && toward.y > 0.3);
                sum += light.intensity[1];
                direction += toward * f64::from(light.intensity[1]);
            }
            assert!((sum / mean.intensity[1] - 1.0).abs() < 1e-4, "{sum} {}", mean.intensity[1]);
            let cosine = direction.normalize().dot(toward);
            // Near the horizon the lowest ring, at 18 degrees, has to do.
            assert!(cosine > if toward.y < 0.3 { 0.93 } else { 0.985 }, "{north_km} km: {cosine}");
        }
        let places = |north_km: f64| -> Vec<Emitter> {
            emitted(5000.0, 1.0, north_km).unwrap().sky.iter().map(|light| light.emitter).collect()
        };
        assert_eq!(places(50.0), places(300.0));
    }
}
