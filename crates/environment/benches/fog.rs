//! Fog around four lamps, and the naive way: one line of sight at a time, in double precision, with the tangent of each angle.

use std::hint::black_box;

use bansho_base::{
    host::observer::Unobserved,
    image::Rect,
    math::{self, DVec2, DVec3},
    phenomenon::{
        Run,
        strip::{DepthInterval, Strip, View},
        surroundings::{Light, Surroundings},
    },
    world::wind::{Wind, WindParameters},
};
use bansho_environment::fog::Fog;
use criterion::{Criterion, criterion_group, criterion_main};

#[path = "support/scene.rs"]
#[allow(dead_code, reason = "it also has ground")]
mod scene;

const SIZE: [usize; 2] = [640, 360];
const VISIBILITY_M: f64 = 60.0;
/// Slices as of a picture with something at a few depths.
const SLICES: [f64; 4] = [0.0, 6.0, 20.0, f64::INFINITY];

/// Draws a frame in strips of eight rows, slice by slice.
fn frame(draw: impl Fn(&DepthInterval, &mut Strip)) {
    let mut strip = Strip::default();
    for y in (0..SIZE[1]).step_by(8) {
        strip.reset(Rect { x: 0, y, width: SIZE[0], height: 8 }, None, 0);
        for depths in SLICES.windows(2) {
            draw(&DepthInterval { near: depths[0], far: depths[1] }, &mut strip);
        }
        black_box(&strip.radiance);
    }
}

/// Radiance that a part of a line of sight scatters toward its beginning, by 24 equal steps of the angle at the light.
fn scattered(light: &Light, eye: DVec3, line: DVec3, [begin, end]: [f64; 2], extinction: f64) -> [f64; 3] {
    const STEPS: usize = 24;
    const G: f64 = 0.85;
    let Some(position) = light.emitter.position() else { return [0.0; 3] };
    let nearest = (position - eye).dot(line);
    let height = (eye + line * nearest - position).length().max(1e-4);
    let [first, last] = [begin, end.min(1e9)].map(|distance| math::atan((distance - nearest) / height));
    let step = (last - first) / STEPS as f64;
    let mut sum = [0.0; 3];
    for index in 0..STEPS {
        let along = height * math::tan(first + step * (index as f64 + 0.5));
        let incident = light.incident_light(eye + line * (nearest + along));
        let cosine = incident.toward.dot(line);
        let phase = (1.0 - G * G) / (4.0 * std::f64::consts::PI * math::pow(1.0 + G * G - 2.0 * G * cosine, 1.5));
        let length = step * (height * height + along * along) / height;
        let passed = math::exp(-extinction * (nearest + along - begin + incident.distance));
        (0..3).for_each(|c| sum[c] += f64::from(incident.illuminance[c]) * extinction * phase * passed * length);
    }
    sum
}

fn one_by_one(view: &View, surroundings: &Surroundings, slice: &DepthInterval, strip: &mut Strip) {
    let extinction = -math::ln(0.02) / VISIBILITY_M;
    for index in 0..strip.len() {
        let (x, y) = (index % strip.rect.width, strip.rect.y + index / strip.rect.width);
        let Some(direction) = view.camera.direction(DVec2::new(x as f64 + 0.5, y as f64 + 0.5)) else { continue };
        let (length, line) = (direction.length(), direction.normalize());
        let ends = [slice.near * length, slice.far * length];
        let passed = math::exp(-extinction * (ends[1] - ends[0]));
        let airlight = surroundings.sky.radiance(DVec3::new(line.x, line.y.max(0.0), line.z).normalize());
        let mut light = airlight.map(|value| f64::from(value) * (1.0 - passed));
        for source in &surroundings.others.lights {
            let from_source = scattered(source, view.camera.position, line, ends, extinction);
            (0..3).for_each(|c| light[c] += from_source[c]);
        }
        strip.add_behind(index, light.map(|value| value as f32), [passed as f32; 3], f32::INFINITY);
    }
}

fn fog(criterion: &mut Criterion) {
    let (view, wind) = (scene::view(SIZE), Wind::new(WindParameters::default(), 1, None));
    let surroundings = scene::surroundings(&wind, None);
    let fog = Fog::new(VISIBILITY_M.into());
    let mut group = criterion.benchmark_group("fog 640x360, 4 lamps");
    group.sample_size(10);
    group.bench_function("sixteen lines of sight at a time", |bencher| {
        bencher.iter(|| {
            let Ok(prepared) = fog.prepare(&view, &surroundings, &Unobserved) else { return };
            frame(|slice, strip| prepared.draw(slice, strip));
        });
    });
    group.bench_function("naive: one line of sight at a time", |bencher| {
        bencher.iter(|| frame(|slice, strip| one_by_one(&view, &surroundings, slice, strip)));
    });
    group.finish();
}

criterion_group!(benches, fog);
criterion_main!(benches);
