//! A long exposure is the mean of short ones.

use super::*;

/// Strips of light and transmittance, and their mean.
#[derive(Clone)]
struct Mean {
    planes: Vec<f64>,
    count: f64,
}

impl Mean {
    fn of(strips: &[Strip]) -> Self {
        let mut mean = Self { planes: vec![0.0; 4 * strips[0].len()], count: strips.len() as f64 };
        for strip in strips {
            for index in 0..strip.len() {
                for c in 0..3 {
                    mean.planes[4 * index + c] += f64::from(strip.radiance[c][index]) / mean.count;
                }
                // Opacity on a scale with the light.
                mean.planes[4 * index + 3] += 1e4 * (1.0 - f64::from(strip.transmittance(index)[0])) / mean.count;
            }
        }
        mean
    }

    /// R.m.s. difference over r.m.s.
    fn relative_difference(&self, other: &Self) -> f64 {
        let squares = |value: &mut dyn Iterator<Item = f64>| value.map(|value| value * value).sum::<f64>();
        let difference = squares(&mut self.planes.iter().zip(&other.planes).map(|(a, b)| a - b));
        (difference / squares(&mut other.planes.iter().copied())).sqrt()
    }
}

/// A state of a cloud that turns about the vertical axis, cools, and of which one part is spawned and another removed meanwhile.
fn turning_cloud(time: f64) -> GasParticles {
    let (sin, cos) = math::sin_cos(4.0 * time);
    let particles = (0..300).filter(|id| (time - 0.001 * *id as f64).abs() < 0.2).map(|id| {
        let [x, y, z, w] = Key::new(3, "cloud").uniforms(id, 0, Purpose::named("place")).map(|u| u - 0.5);
        let [x, z] = [f64::from(x) + 0.6, 0.6 * f64::from(z)];
        let [x, z, u, v] =
            [x * cos - z * sin, x * sin + z * cos, -4.0 * (x * sin + z * cos), 4.0 * (x * cos - z * sin)]
                .map(|value| value as f32);
        let cooled = 1850.0 + 200.0 * w - 500.0 * time as f32;
        Particle { velocity: [u, 0.0, v], support_radius: 0.15, ..ball(id, [x, y, z], cooled, 4e-6) }
    });
    cloud(particles)
}

/// The exposure of the states at `times`, each of which stands for the same part of the shutter.
fn exposed(times: &[f64], shutter: Shutter, rendering: &GasRenderingParameters, camera: &CameraParameters) -> Strip {
    let (wind, air, buffers) = (Wind::new(WindParameters::default(), 1, None), Air::default(), BufferPool::default());
    let surroundings = Surroundings { air: &air, ..Surroundings::from_wind(&wind) };
    let view = View::new(camera.clone(), shutter, shutter.middle() + 0.04, SIZE, 0);
    let particles: Vec<GasParticles> = times.iter().map(|time| turning_cloud(*time)).collect();
    let edge = |index: usize| shutter.open + shutter.duration() * index as f64 / times.len() as f64;
    let states: Vec<GasState> = particles
        .iter()
        .enumerate()
        .map(|(index, particles)| GasState {
            gas: Gas { time: times[index], ..gas(particles, &buffers) },
            shutter: Shutter { open: edge(index), close: edge(index + 1) },
        })
        .collect();
    let exposure = GasExposure { middle: states[states.len() / 2].gas, is_short: states.len() == 1, states };
    let prepared = PreparedGas::of_exposure(&exposure, rendering, &view, &surroundings, &Unobserved).unwrap();
    let mut strip = Strip::default();
    strip.reset(Rect::from_size(SIZE[0], SIZE[1]), None, 0);
    prepared.draw(&DepthInterval::ALL, &mut strip);
    strip
}

/// R.m.s. difference of one exposure to the mean of short ones from the same states.
fn difference(duration_s: f64, rendering: &GasRenderingParameters, camera: &CameraParameters) -> f64 {
    let count = 20;
    let shutter = Shutter { open: 0.1, close: 0.1 + duration_s };
    let times: Vec<f64> = (0..count).map(|index| shutter.instant(index, count)).collect();
    let long = exposed(&times, shutter, rendering, camera);
    let half = 0.5 * duration_s / count as f64;
    let short = |time: &f64| exposed(&[*time], Shutter { open: time - half, close: time + half }, rendering, camera);
    let short: Vec<Strip> = times.iter().map(short).collect();
    Mean::of(&[long]).relative_difference(&Mean::of(&short))
}

#[test]
fn a_long_exposure_is_the_mean_of_short_ones_from_the_states_it_passes_through() {
    let still = camera();
    let panning = CameraParameters {
        target: Animated::keyed(
            vec![(0.0, [-0.6, 0.0, 0.0]), (0.6, [3.0, 0.0, 0.0])],
            math::curve::Interpolation::Linear,
        )
        .unwrap(),
        ..camera()
    };
    for duration_s in [0.05, 0.2, 0.4] {
        for camera in [&still, &panning] {
            let found = difference(duration_s, &smooth(), camera);
            assert!(found < 0.05, "{duration_s} s: {found}");
            // The detail of a frame is that of its depth layers, which are those of the middle of its exposure.
            let found = difference(duration_s, &GasRenderingParameters::default(), camera);
            assert!(found < 0.1, "{duration_s} s with detail: {found}");
        }
    }
}

#[test]
fn a_fast_pan_is_the_mean_of_short_exposures_of_one_state() {
    // 90 degrees a second for 1/48 s: 1.9 degrees, on the 160 x 120 pixels of 32 degrees in height 7 pixels.
    let camera = CameraParameters {
        target: Animated::keyed(
            vec![(0.0, [-7.0, 0.0, 0.0]), (2.0, [7.0, 0.0, 0.0])],
            math::curve::Interpolation::Linear,
        )
        .unwrap(),
        vertical_fov_deg: Animated::from(20.0),
        ..camera()
    };
    let particles = turning_cloud(0.1);
    let shutter = Shutter { open: 1.0 - 1.0 / 96.0, close: 1.0 + 1.0 / 96.0 };
    let seen = |shutter| {
        let view = View::new(camera.clone(), shutter, 1.04, SIZE, 0);
        drawn(&particles, &GasRenderingParameters::default(), &view, 0, None)
    };
    let edge = |index: usize| shutter.open + shutter.duration() * index as f64 / 20.0;
    let short: Vec<Strip> = (0..20).map(|index| seen(Shutter { open: edge(index), close: edge(index + 1) })).collect();
    let found = Mean::of(&[seen(shutter)]).relative_difference(&Mean::of(&short));
    assert!(found < 0.05, "{found}");
}
