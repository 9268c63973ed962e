//! Drawing of a volume flame of 30 cm and 60 kW at half of the height of a picture of 1280 x 720, with its smoke, beside the naive way: rays one at a time, which look
//! all gas up by themselves.

mod support;

use std::{hint::black_box, sync::Arc};

use bansho_base::{
    camera::CameraParameters,
    host::{assets::MemoryAssets, observer::Unobserved},
    image::Rect,
    parameters::{Auto, animated::Animated},
    phenomenon::{
        Prepared, Run, Stepped,
        strip::{DepthInterval, Shutter, Strip, View},
        surroundings::Surroundings,
    },
    world::wind::{Wind, WindParameters},
};
use bansho_fire::volume::{FlameVolume, FlameVolumeParameters, FlameVolumeRun, Fuel, VolumeBurnerParameters};
use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use rayon::prelude::*;
use support::pinned_pool;

const SIZE: [usize; 2] = [1280, 720];
const STRIP: usize = 8;
/// Steps before the state that is drawn.
const STEPS: u32 = 90;

fn view(time: f64) -> View {
    let camera = CameraParameters {
        position: Animated::from([0.0, 0.75, 5.2]),
        target: Animated::from([0.0, 0.75, 0.0]),
        vertical_fov_deg: Animated::from(28.0),
        ..CameraParameters::default()
    };
    View::new(camera, Shutter { open: time, close: time + 1.0 / 60.0 }, time + 1.0 / 30.0, SIZE, 0)
}

/// A fire that has developed, and its time.
fn fire(surroundings: &Surroundings) -> (FlameVolumeRun, f64) {
    let burner = VolumeBurnerParameters { diameter: 0.3, heat_release_kw: 60.0, ..Default::default() };
    let parameters = FlameVolumeParameters {
        burners: vec![burner],
        fuel: Fuel::Wood,
        preroll_s: Auto::Set(0.0),
        ..Default::default()
    };
    let step_s = parameters.step_s;
    let flame = FlameVolume::new(parameters, "fire", 1, None, &MemoryAssets::default()).expect("a flame");
    let mut run = FlameVolumeRun::new(Arc::new(flame));
    (0..STEPS).for_each(|number| run.step(f64::from(number) * step_s, surroundings));
    (run, f64::from(STEPS) * step_s)
}

fn prepared<'a>(
    run: &'a FlameVolumeRun,
    view: &'a View,
    surroundings: &'a Surroundings<'a>,
) -> Option<Box<dyn Prepared + 'a>> {
    run.prepare(view, surroundings, &Unobserved).ok()
}

fn draw(prepared: &dyn Prepared) {
    (0..SIZE[1].div_ceil(STRIP)).into_par_iter().for_each_init(Strip::default, |strip, index| {
        let y = index * STRIP;
        strip.reset(Rect { x: 0, y, width: SIZE[0], height: STRIP.min(SIZE[1] - y) }, None, 0);
        prepared.draw(&DepthInterval::ALL, strip);
        black_box(&strip.radiance);
    });
}

fn volume_720p(criterion: &mut Criterion) {
    let wind = Wind::new(WindParameters::default(), 1, None);
    let surroundings = Surroundings::from_wind(&wind);
    let (run, time) = fire(&surroundings);
    let view = view(time);
    let mut group = criterion.benchmark_group("flame volume 1280x720");
    group.sample_size(10);
    for threads in [1, 2] {
        let pool = pinned_pool(threads);
        group.bench_function(format!("prepare, {threads} threads"), |bencher| {
            pool.install(|| bencher.iter(|| prepared(&run, &view, &surroundings).is_some()));
        });
        // Pixels that are drawn once are kept.
        group.bench_function(format!("draw, {threads} threads"), |bencher| {
            pool.install(|| {
                let prepare = || prepared(&run, &view, &surroundings);
                bencher.iter_batched_ref(
                    prepare,
                    |prepared| prepared.iter().for_each(|prepared| draw(&**prepared)),
                    BatchSize::PerIteration,
                );
            });
        });
    }
    let pool = pinned_pool(2);
    group.bench_function("naive: rays one at a time, 2 threads", |bencher| {
        pool.install(|| bencher.iter(|| run.single_ray_luminance(&view, &surroundings)));
    });
    group.bench_function("heat haze, 2 threads", |bencher| {
        pool.install(|| {
            bencher.iter(|| {
                let prepared = prepared(&run, &view, &surroundings);
                prepared.is_some_and(|prepared| prepared.deflection().is_some())
            });
        });
    });
    group.finish();
}

criterion_group!(volume_benches, volume_720p);
criterion_main!(volume_benches);
