//! The light of fires that rain scatters toward the camera, when the fires have changed since the last frame; compared with the naive algorithm: one line of
//! sight, one light and one sample at a time, in double precision, at the same corners of the same grids. And the same behind posts that move: with shadow maps that
//! are made anew, and naively with a ray through the distances of the posts from each sample.

use std::{hint::black_box, sync::Arc};

use bansho_base::{
    camera::CameraParameters,
    host::observer::Unobserved,
    math::{self, DQuat, DVec2, DVec3},
    parameters::animated::Animated,
    phenomenon::{
        Run,
        strip::{Shutter, View},
        surroundings::{Emitter, Light, Occluder, Publication, Surroundings},
    },
    world::{
        shadow,
        wind::{Wind, WindParameters},
    },
};
use bansho_rain::{Rain, RainParameters, RainRun, lighting::drop_phase_function::DropPhaseFunction};
use criterion::{Criterion, criterion_group, criterion_main};

const SIZE: [usize; 2] = [1280, 720];
/// Extinction of the rain, 1/m.
const EXTINCTION: f64 = 3e-3;
/// Angle subtended at a light by one sample, radians.
const SAMPLE_ANGLE: f64 = 0.15;

fn view() -> View {
    let camera = CameraParameters {
        position: Animated::from([0.0, 1.6, 0.0]),
        target: Animated::from([0.0, 1.8, -4.0]),
        vertical_fov_deg: Animated::from(40.0),
        ..CameraParameters::default()
    };
    View::new(camera, Shutter { open: 3.0, close: 3.0 + 1.0 / 60.0 }, 3.03, SIZE, 0)
}

/// Four flames that flicker.
fn lights(frame: u32) -> Vec<Light> {
    let flame = |index: u32| {
        let position = DVec3::new(0.3 * f64::from(index) - 0.45, 1.2 + 0.2 * f64::from(index % 2), -3.6);
        let intensity = 300.0 + ((frame * 7 + index * 3) % 40) as f32;
        Light {
            emitter: Emitter::Point { position, radius: 0.1 },
            intensity: [intensity, 0.5 * intensity, 0.1 * intensity],
        }
    };
    (0..4).map(flame).collect()
}

/// Three posts between the flames and the camera.
fn posts(frame: u32) -> Vec<Occluder> {
    let post = |index: u32| Occluder::Cylinder {
        center: DVec3::new(0.5 * f64::from(index) - 0.5 + 1e-3 * f64::from(frame % 40), 1.0, -2.8),
        radius: 0.06,
        half_height: 1.0,
        rotation: DQuat::IDENTITY,
    };
    (0..3).map(post).collect()
}

/// Pixels at which the light is integrated: corners of a grid of 16 pixels, and of 4 pixels near each light, with the lights that are integrated there.
fn corners(view: &View, lights: &[Light]) -> Vec<(DVec2, Vec<Light>)> {
    let grid = |low: [i32; 2], high: [i32; 2], step: usize, lights: &[Light]| {
        let lights = lights.to_vec();
        let rows = (low[1]..=high[1]).step_by(step);
        let row = move |y: i32| {
            let lights = lights.clone();
            (low[0]..=high[0]).step_by(step).map(move |x| (DVec2::new(x.into(), y.into()), lights.clone()))
        };
        rows.flat_map(row).collect::<Vec<_>>()
    };
    let mut corners = grid([0, 0], SIZE.map(|side| side as i32), 16, lights);
    for light in lights {
        let Some(projection) = light.emitter.position().and_then(|position| view.camera.project(position)) else {
            continue;
        };
        let [x, y] = projection.pixel.to_array().map(|coordinate| coordinate as i32);
        corners.extend(grid([x - 72, y - 72], [x + 72, y + 72], 4, std::slice::from_ref(light)));
    }
    corners
}

/// Light up to each distance along one line of sight.
fn naive(
    eye: DVec3,
    line: DVec3,
    lights: &[Light],
    phase_function: &DropPhaseFunction,
    distances: &[f64],
    casters: &[Occluder],
) -> Vec<[f64; 3]> {
    let mut sums = vec![[0.0; 3]];
    for pair in distances.windows(2) {
        let mut sum = sums[sums.len() - 1];
        for light in lights {
            let Some(position) = light.emitter.position() else { continue };
            let nearest = (position - eye).dot(line);
            let h = (position - eye - line * nearest).length().max(0.02);
            let [first, last] = [pair[0], pair[1]].map(|distance| math::atan((distance - nearest) / h));
            let samples = ((last - first) / SAMPLE_ANGLE).ceil().max(1.0);
            let step = (last - first) / samples;
            for index in 0..samples as i32 {
                let offset = h * math::tan(first + step * (f64::from(index) + 0.5));
                let (distance, length) = (nearest + offset, step * (h * h + offset * offset) / h);
                let incident = light.incident_light(eye + line * distance);
                let phase = phase_function.phase(incident.toward.dot(line) as f32);
                let (point, reach) = (eye + line * distance, incident.distance - 0.1);
                let visible = shadow::visibility(casters, point, incident.toward, reach, 0.1 / incident.distance);
                let weight = visible * EXTINCTION * length * math::exp(-EXTINCTION * (distance + incident.distance));
                for c in 0..3 {
                    let scattered = f64::from(phase[c]) * (0.25 / std::f64::consts::PI);
                    sum[c] += f64::from(incident.illuminance[c]) * scattered * weight;
                }
            }
        }
        sums.push(sum);
    }
    sums
}

fn scattering(criterion: &mut Criterion) {
    let (view, wind) = (view(), Wind::new(WindParameters::default(), 1, None));
    // Hardly any streaks.
    let mut parameters = RainParameters { rate_mm_per_h: 1.0.into(), distance: 1.0, ..RainParameters::default() };
    parameters.splashes.fraction = 0.0;
    let rain = RainRun::new(Arc::new(Rain::new(parameters, "bench", 1, None).expect("the parameters go together")));
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    let mut group = criterion.benchmark_group("light of fires in rain 1280x720, 1 thread");
    group.sample_size(10);
    let mut frame = 0;
    for (name, has_posts) in [("lines of sight in lanes", false), ("the same behind posts, with shadow maps", true)] {
        group.bench_function(name, |bencher| {
            bencher.iter(|| {
                frame += 1;
                let shadow_casters = if has_posts { posts(frame) } else { Vec::new() };
                let others = Publication { lights: lights(frame), shadow_casters, ..Publication::default() };
                let surroundings = Surroundings { others, ..Surroundings::from_wind(&wind) };
                pool.install(|| black_box(rain.prepare(&view, &surroundings, &Unobserved).is_ok()));
            });
        });
    }
    let phase_function = DropPhaseFunction::new();
    let mut distances = vec![0.0, 0.5];
    while distances[distances.len() - 1] < 100.0 {
        distances.push(1.25 * distances[distances.len() - 1]);
    }
    for (name, has_posts) in [("naive: one sample at a time", false), ("naive: the same with a ray to the light", true)]
    {
        group.bench_function(name, |bencher| {
            bencher.iter(|| {
                frame += 1;
                let casters = if has_posts { posts(frame) } else { Vec::new() };
                for (pixel, lights) in corners(&view, &lights(frame)) {
                    let Some(direction) = view.camera.direction(pixel) else { continue };
                    let line = direction.normalize();
                    black_box(naive(view.camera.position, line, &lights, &phase_function, &distances, &casters));
                }
            });
        });
    }
    group.finish();
}

criterion_group!(benches, scattering);
criterion_main!(benches);
