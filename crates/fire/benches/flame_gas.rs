//! Drawing of 100,000 particles at 1280 x 720, with and without heat haze, each compared with a naive implementation that evaluates
//! every sprite at every pixel that it covers.

mod plume;
mod support;

use std::hint::black_box;

use bansho_base::{
    camera::CameraParameters,
    color,
    host::observer::Unobserved,
    image::Rect,
    math::{self, DVec2, DVec3, random::Key},
    parameters::animated::Animated,
    phenomenon::{
        Prepared,
        strip::{DepthInterval, Shutter, Strip, View},
        surroundings::Surroundings,
    },
    world::{
        air::Air,
        wind::{Wind, WindParameters},
    },
};

use bansho_fire::particles::{
    GasParticles,
    render::{
        BufferPool, FadeOut, Gas, GasRenderingParameters, PreparedGas, line_gradient, line_integral, soot_absorption,
    },
};
use criterion::{Criterion, criterion_group, criterion_main};
use rayon::prelude::*;
use support::pinned_pool;

const SIZE: [usize; 2] = [1280, 720];
const STRIP: usize = 8;
const COUNT: usize = 100_000;
const HEIGHT: f64 = 1.5;
const TIME: f64 = 3.0;

/// A view in which the plume fills most of the height.
fn view() -> View {
    let camera = CameraParameters {
        position: Animated::from([0.0, 0.5 * HEIGHT, 2.2 * HEIGHT]),
        target: Animated::from([0.0, 0.5 * HEIGHT, 0.0]),
        ..CameraParameters::default()
    };
    View::new(camera, Shutter { open: TIME, close: TIME + 1.0 / 60.0 }, TIME + 1.0 / 30.0, SIZE, 0)
}

fn gas<'a>(particles: &'a GasParticles, buffers: &'a BufferPool) -> Gas<'a> {
    Gas {
        particles,
        time: TIME,
        air_temperature_k: 293.15,
        detail_speed: 0.3 * HEIGHT,
        base: DVec3::ZERO,
        size: DVec2::ONE,
        key: Key::new(1, "plume"),
        fade_out: FadeOut::NEVER,
        buffers,
    }
}

/// The particles and the view that are drawn, with scratch memory.
struct Subject {
    particles: GasParticles,
    view: View,
    buffers: BufferPool,
}

/// Prepares the gas and passes it to `visit`.
fn prepared(subject: &Subject, rendering: &GasRenderingParameters, visit: impl FnOnce(&PreparedGas)) {
    let (wind, air) = (Wind::new(WindParameters::default(), 1, None), Air::default());
    let surroundings = Surroundings { air: &air, ..Surroundings::from_wind(&wind) };
    let gas = gas(&subject.particles, &subject.buffers);
    if let Ok(prepared) = PreparedGas::new(gas, rendering, &subject.view, &surroundings, &Unobserved) {
        visit(&prepared);
    }
}

/// Draws the gas, after calling `before`.
fn draw(subject: &Subject, rendering: &GasRenderingParameters, before: impl Fn(&PreparedGas) + Sync) {
    prepared(subject, rendering, |prepared| {
        before(prepared);
        (0..SIZE[1].div_ceil(STRIP)).into_par_iter().for_each_init(Strip::default, |strip, index| {
            let y = index * STRIP;
            strip.reset(Rect { x: 0, y, width: SIZE[0], height: STRIP.min(SIZE[1] - y) }, None, 0);
            prepared.draw(&DepthInterval::ALL, strip);
            black_box(&strip.radiance);
        });
    });
}

/// Evaluates every sprite at every pixel that it covers, with `WIDTH` values: light or deflection.
fn naive<const WIDTH: usize>(
    particles: &GasParticles,
    view: &View,
    value: impl Fn(usize, [f64; 2], f64) -> [f64; WIDTH],
) {
    let mut picture = vec![[0.0_f64; WIDTH]; SIZE[0] * SIZE[1]];
    for index in 0..particles.len() {
        let position = DVec3::from(particles.positions().map(|values| f64::from(values[index])));
        let Some(projected) = view.camera.project(position) else { continue };
        let radius = f64::from(particles.support_radii()[index]);
        let reach = radius * projected.pixels_per_meter;
        let [left, right] =
            [-reach, reach + 1.0].map(|side| (projected.pixel.x + side).clamp(0.0, SIZE[0] as f64) as usize);
        let [top, bottom] =
            [-reach, reach + 1.0].map(|side| (projected.pixel.y + side).clamp(0.0, SIZE[1] as f64) as usize);
        for y in top..bottom {
            for x in left..right {
                let offset = [x as f64 + 0.5 - projected.pixel.x, y as f64 + 0.5 - projected.pixel.y];
                let offset = offset.map(|pixels| pixels / projected.pixels_per_meter);
                let sums = &mut picture[y * SIZE[0] + x];
                sums.iter_mut().zip(value(index, offset, radius)).for_each(|(sum, value)| *sum += value);
            }
        }
    }
    black_box(picture);
}

/// Volume of the gas of a particle, m^3.
fn volume(particles: &GasParticles, index: usize) -> f64 {
    f64::from(particles.masses()[index] / particles.densities()[index])
}

fn gas_720p(criterion: &mut Criterion) {
    let pool = pinned_pool(2);
    let subject =
        Subject { particles: plume::plume(COUNT, HEIGHT, TIME), view: view(), buffers: BufferPool::default() };
    let Subject { particles, view, .. } = &subject;
    let rendering = GasRenderingParameters::default();
    let mut group = criterion.benchmark_group("flame gas 1280x720");
    group.sample_size(10);
    group.bench_function("sums and detail", |bencher| {
        pool.install(|| bencher.iter(|| draw(&subject, &rendering, |_| ())));
    });
    group.bench_function("sums, detail and haze", |bencher| {
        pool.install(|| {
            bencher.iter(|| draw(&subject, &rendering, |prepared| assert!(prepared.deflection().is_some())));
        });
    });
    let smooth = GasRenderingParameters { detail: 0.0, ..rendering.clone() };
    group.bench_function("sums alone", |bencher| {
        pool.install(|| bencher.iter(|| draw(&subject, &smooth, |_| ())));
    });
    group.bench_function("naive sums", |bencher| {
        bencher.iter(|| {
            naive(particles, view, |index, [u, v], radius| {
                let tau = line_integral(math::hypot(u, v), radius)
                    * volume(particles, index)
                    * soot_absorption(f64::from(particles.soot_fractions()[index]), &rendering);
                let [red, green, blue] = color::black_body().radiance(particles.temperatures()[index]).map(f64::from);
                [tau, tau * red, tau * green, tau * blue]
            });
        });
    });
    // Gas that neither emits nor absorbs contributes only to the haze.
    let clear = GasRenderingParameters { soot_gain: 0.0, base_blue: 0.0, ..rendering.clone() };
    group.bench_function("haze of clear gas", |bencher| {
        pool.install(|| {
            bencher.iter(|| {
                prepared(&subject, &clear, |prepared| {
                    black_box(prepared.deflection().map(|deflection| deflection.depth));
                });
            });
        });
    });
    group.bench_function("naive haze", |bencher| {
        bencher.iter(|| {
            naive(particles, view, |index, [u, v], radius| {
                let b = math::hypot(u, v).max(1e-9);
                let slope = line_gradient(b, radius) * volume(particles, index) / b;
                [slope * u, slope * v]
            });
        });
    });
    group.finish();
}

criterion_group!(gas_benches, gas_720p);
criterion_main!(gas_benches);
