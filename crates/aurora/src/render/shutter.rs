//! Motion blur: one extrapolated state of the simulation, or in a long exposure the mean of many states.

use bansho_base::{
    math,
    phenomenon::strip::{Shutter, View},
};

use crate::{
    render::{
        bin::{SampleTimes, Sources},
        inputs::{RenderInputs, emission_inputs},
        project::field_lines::FieldLines,
    },
    simulate::AuroraSimulation,
};

/// Motion per instant in units of the particles' spread, and the maximum number of instants; the rest is added to the
/// spread.
const SPREADS_PER_INSTANT: f64 = 3.0;
const MAX_INSTANTS: f64 = 16.0;
/// Instants of a long exposure, each with its own particles and afterglow.
const LONG_INSTANTS: usize = 16;

/// Whether an exposure is too long for linear extrapolation: more than a step on each side of a state.
pub(crate) fn is_long(shutter: Shutter) -> bool {
    shutter.duration() > 2.0 * AuroraSimulation::STEP_S
}

/// Steps to the last state not after time `t`, s.
pub(crate) fn step_until(simulation: &mut AuroraSimulation, t: f64) {
    // Tolerance for rounding, a millionth of a step.
    while simulation.time() + (1.0 - 1e-6) * AuroraSimulation::STEP_S <= t {
        simulation.step();
    }
}

/// Sources while the shutter of a view is open.
pub(super) fn sources(inputs: RenderInputs, view: &View, field: &FieldLines) -> Sources {
    if is_long(view.shutter) { long_exposure(inputs, view, field) } else { short_exposure(inputs, view, field) }
}

/// Extrapolated particles of the current state, and its afterglow.
fn short_exposure(inputs: RenderInputs, view: &View, field: &FieldLines) -> Sources {
    let simulation = inputs.simulation;
    let inputs = emission_inputs(simulation, &inputs.tables.diffuse, view.shutter.middle());
    let distance_km = rms_speed(simulation) * view.shutter.duration();
    let count =
        (2.0 * distance_km / (SPREADS_PER_INSTANT * inputs.spread_km())).ceil().clamp(1.0, MAX_INSTANTS) as usize;
    let now = simulation.time();
    let offsets_s = (0..count).map(|instant| view.shutter.instant(instant, count) - now).collect();
    Sources::new(
        &inputs,
        field,
        &SampleTimes { offsets_s, first_index: 0, smear_km: smear_km(distance_km / count as f64) },
    )
}

/// Mean of the states during the exposure.
///
/// It starts at the state of [`Stepped::time_for`](bansho_base::phenomenon::Stepped::time_for); in a
/// loop, where two runs are drawn at the shutter's middle, with that one.
fn long_exposure(inputs: RenderInputs, view: &View, field: &FieldLines) -> Sources {
    let mut simulation = inputs.simulation.clone();
    let (shutter, now) = (view.shutter, simulation.time());
    let begin = if now < shutter.middle() - AuroraSimulation::STEP_S { shutter.open } else { shutter.middle() };
    let mut mean = Sources::default();
    for instant in 0..LONG_INSTANTS {
        let t = begin - shutter.open + shutter.instant(instant, LONG_INSTANTS);
        step_until(&mut simulation, t);
        let distance_km = rms_speed(&simulation) * shutter.duration() / LONG_INSTANTS as f64;
        let first = instant as u32;
        let times =
            SampleTimes { offsets_s: vec![t - simulation.time()], first_index: first, smear_km: smear_km(distance_km) };
        let sources = Sources::new(&emission_inputs(&simulation, &inputs.tables.diffuse, t), field, &times);
        mean.add(&sources, 1.0 / LONG_INSTANTS as f32);
    }
    mean
}

/// Root mean square speed of the particles, km/s.
fn rms_speed(simulation: &AuroraSimulation) -> f64 {
    let particles = simulation.particles();
    let squares: f64 = particles.velocities.iter().flatten().map(|speed| f64::from(speed * speed)).sum();
    math::sqrt(squares / particles.len().max(1) as f64)
}

/// Standard deviation, per direction, of a uniform distribution over a distance in a random direction.
fn smear_km(distance_km: f64) -> f64 {
    distance_km * math::sqrt(1.0 / 24.0)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use bansho_base::{
        camera::CameraParameters,
        host::{assets::MemoryAssets, observer::Unobserved},
        image::Rect,
        phenomenon::{
            Run, Stepped,
            strip::{DepthInterval, Strip},
            surroundings::Surroundings,
        },
        world::wind::{Wind, WindParameters},
    };

    use super::*;
    use crate::{Aurora, AuroraParameters, AuroraRun, FoldParameters, ParticleParameters};

    const SIZE: [usize; 2] = [96, 64];

    fn run() -> AuroraRun {
        let parameters = AuroraParameters {
            particles: ParticleParameters { count: 4000, ..ParticleParameters::default() },
            folds: FoldParameters { amplitude_km: 12.0, speed_km_per_s: 12.0, ..FoldParameters::default() },
            preroll_s: 0.5,
            ..AuroraParameters::default()
        };
        AuroraRun::new(Arc::new(Aurora::new(parameters, "aurora", 1, None, &MemoryAssets::default()).unwrap()))
    }

    /// The green light of an exposure, after the steps that a shot takes for it.
    fn exposed(run: &mut AuroraRun, shutter: Shutter) -> Vec<f64> {
        let mut camera = CameraParameters::default();
        camera.look_up();
        let wind = Wind::new(WindParameters::default(), 1, None);
        let surroundings = Surroundings::from_wind(&wind);
        let from = run.time_for(shutter);
        step_until(run.simulation_mut(), from);
        let view = View::new(camera, shutter, 0.0, SIZE, 0);
        let prepared = run.prepare(&view, &surroundings, &Unobserved).unwrap();
        let mut strip = Strip::default();
        strip.reset(Rect::from_size(SIZE[0], SIZE[1]), None, 0);
        prepared.draw(&DepthInterval::ALL, &mut strip);
        strip.radiance[1].iter().map(|value| f64::from(*value)).collect()
    }

    fn apart(a: &[f64], b: &[f64]) -> f64 {
        a.iter().zip(b).map(|(a, b)| (a - b).abs()).sum::<f64>() / b.iter().sum::<f64>()
    }

    #[test]
    fn a_long_exposure_is_the_mean_of_short_ones() {
        let long = Shutter { open: 0.0, close: 2.0 };
        let picture = exposed(&mut run(), long);
        let mut moving = run();
        let mut mean = vec![0.0; picture.len()];
        for instant in 0..LONG_INSTANTS {
            let t = long.instant(instant, LONG_INSTANTS);
            let short = exposed(&mut moving, Shutter { open: t, close: t });
            mean.iter_mut().zip(short).for_each(|(sum, light)| *sum += light / LONG_INSTANTS as f64);
        }
        let instant = exposed(&mut run(), Shutter { open: 1.0, close: 1.0 });
        let (from_mean, from_instant) = (apart(&picture, &mean), apart(&picture, &instant));
        assert!(from_mean < 0.05 && from_instant > 3.0 * from_mean, "{from_mean} {from_instant}");
    }

    #[test]
    fn particles_are_those_of_the_middle_of_an_exposure() {
        let (mut early, mut late) = (run(), run());
        step_until(early.simulation_mut(), 0.0);
        step_until(late.simulation_mut(), 1.0);
        let wind = Wind::new(WindParameters::default(), 1, None);
        let exported = |run: &AuroraRun, middle: f64| {
            let shutter = Shutter { open: middle - 0.5, close: middle + 0.5 };
            let view = View::new(CameraParameters::default(), shutter, 0.0, SIZE, 0);
            run.export_particles(&view, &Surroundings::from_wind(&wind)).unwrap()
        };
        assert_eq!(exported(&early, 1.0), exported(&late, 1.0));
        assert_ne!(exported(&early, 0.0), exported(&late, 1.0));
    }
}
