//! A frame of rain by billboards and drop by drop, each compared with the naive algorithm: every drop is projected, and its bounding box
//! is filled pixel by pixel by the distance from its axis.

use std::{hint::black_box, sync::Arc};

use bansho_base::{
    camera::CameraParameters,
    host::observer::Unobserved,
    image::Rect,
    math::{
        DVec2,
        random::{Key, Purpose},
    },
    parameters::animated::Animated,
    phenomenon::{
        Run,
        strip::{DepthInterval, Shutter, Strip, View},
        surroundings::{Emitter, Light, Publication, Surroundings},
    },
    world::wind::{Wind, WindParameters},
};

use bansho_rain::{Method, Rain, RainParameters, RainRun};
use criterion::{Criterion, criterion_group, criterion_main};

const SIZE: [usize; 2] = [1280, 720];
const STRIP: usize = 8;

fn view() -> View {
    let camera = CameraParameters {
        position: Animated::from([0.0, 1.6, 0.0]),
        target: Animated::from([0.0, 2.2, -4.0]),
        vertical_fov_deg: Animated::from(40.0),
        ..CameraParameters::default()
    };
    View::new(camera, Shutter { open: 3.0, close: 3.0 + 1.0 / 60.0 }, 3.03, SIZE, 0)
}

/// Heavy rain far around the camera.
fn wide() -> RainParameters {
    RainParameters { rate_mm_per_h: 100.0.into(), distance: 20.0, airlight_distance: 0.0, ..RainParameters::default() }
}

fn rain(method: Method, rate: f64, distance: f64, airlight_distance: f64) -> RainRun {
    let parameters =
        RainParameters { rate_mm_per_h: rate.into(), method, distance, airlight_distance, ..RainParameters::default() };
    RainRun::new(Arc::new(Rain::new(parameters, "bench", 1, None).expect("the parameters go together")))
}

fn surroundings(wind: &Wind) -> Surroundings<'_> {
    let emitter = Emitter::Spot {
        position: bansho_base::math::DVec3::new(0.5, 5.0, -4.0),
        axis: -bansho_base::math::DVec3::Y,
        cos_inner: 0.8,
        cos_outer: 0.4,
    };
    let lights = vec![Light { emitter, intensity: [3000.0, 2500.0, 1800.0] }];
    Surroundings { others: Publication { lights, ..Publication::default() }, ..Surroundings::from_wind(wind) }
}

/// Prepares and draws one frame with the threads of the pool.
fn draw_frame(rain: &RainRun, view: &View, surroundings: &Surroundings) {
    let Ok(prepared) = rain.prepare(view, surroundings, &Unobserved) else { return };
    use rayon::prelude::*;
    (0..SIZE[1] / STRIP).into_par_iter().for_each_init(Strip::default, |strip, index| {
        strip.reset(Rect { x: 0, y: index * STRIP, width: SIZE[0], height: STRIP }, None, 0);
        prepared.draw(&DepthInterval::ALL, strip);
        black_box(&strip.radiance);
    });
}

/// What gusts cost: streaks are prepared in a steady wind and in one with gusts, by one thread.
fn gusts(criterion: &mut Criterion) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    let rain = rain(Method::Billboards, 20.0, 10.0, 0.0);
    let mut group = criterion.benchmark_group("rain prepared, 20 mm/h to 10 m");
    group.sample_size(20);
    for (name, gust) in [("steady wind", 0.0), ("gusts", 0.4)] {
        let velocity = Animated::from([3.0, 0.0, 1.0]);
        let wind = Wind::new(WindParameters { velocity, gust, ..WindParameters::default() }, 1, None);
        let (view, surroundings) = (view(), surroundings(&wind));
        group.bench_function(name, |bencher| {
            bencher.iter(|| pool.install(|| black_box(rain.prepare(&view, &surroundings, &Unobserved).is_ok())));
        });
    }
    group.finish();
}

/// Streaks at random positions in the picture, as long and wide as those of a real frame.
fn naive(count: u64, pixels: &mut [[f32; 4]]) {
    let key = Key::new(1, "naive");
    for index in 0..count {
        let uniforms = key.uniforms(index, 0, Purpose::named("streak")).map(f64::from);
        let middle = DVec2::new(uniforms[0] * SIZE[0] as f64, uniforms[1] * SIZE[1] as f64);
        let scale = 990.0 / (1.0 + 4.0 * bansho_base::math::cbrt(uniforms[2]));
        let way = DVec2::new(0.002, 0.09) * scale;
        let (from, to, radius) = (middle - 0.5 * way, middle + 0.5 * way, 0.0007 * scale);
        let soft = radius.max(0.5) + 0.5;
        let rows = (from.y - soft).max(0.0) as usize..((to.y + soft).max(0.0) as usize + 1).min(SIZE[1]);
        let columns = (from.x - soft).max(0.0) as usize..((to.x + soft).max(0.0) as usize + 1).min(SIZE[0]);
        for y in rows {
            for x in columns.clone() {
                let point = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
                let place = ((point - from).dot(way) / way.length_squared()).clamp(0.0, 1.0);
                let distance = (point - from - way * place).length();
                let opacity = (0.01 * radius.min(0.5) * (soft - distance).clamp(0.0, 1.0)) as f32;
                let pixel = &mut pixels[y * SIZE[0] + x];
                (0..3).for_each(|c| pixel[c] = (1.0 - opacity) * pixel[c] + opacity);
                pixel[3] += opacity * (1.0 - pixel[3]);
            }
        }
    }
}

fn frames(criterion: &mut Criterion) {
    let wind = Wind::new(WindParameters::default(), 1, None);
    let (view, surroundings) = (view(), surroundings(&wind));
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().expect("two threads");
    let mut group = criterion.benchmark_group("rain 1280x720");
    group.sample_size(20);
    let cases = [
        ("billboards, 20 mm/h to 5 m", rain(Method::Billboards, 20.0, 5.0, 0.0)),
        ("billboards and airlight, 20 mm/h to 5 m", rain(Method::Billboards, 20.0, 5.0, 100.0)),
        ("billboards and airlight, 100 mm/h to 50 m", rain(Method::Billboards, 100.0, 5.0, 45.0)),
        ("drops, 20 mm/h to 5 m", rain(Method::Drops, 20.0, 5.0, 0.0)),
        ("drops, 150,000 streaks", rain(Method::Drops, 100.0, 7.5, 0.0)),
    ];
    for (name, rain) in &cases {
        if let Ok(prepared) = rain.prepare(&view, &surroundings, &Unobserved) {
            let metadata = prepared.metadata();
            let drops = metadata.iter().find(|entry| entry.name == "drops_in_view").map_or(0.0, |entry| entry.value);
            let named = !name.contains("150,000") || (150_000.0..160_000.0).contains(&drops);
            assert!(drops > 5000.0 && named, "{name}: {drops} drops");
        }
        group.bench_function(*name, |bencher| {
            bencher.iter(|| pool.install(|| draw_frame(rain, &view, &surroundings)));
        });
    }
    group.sample_size(10);
    for (name, simplification_codes) in [("billboards, 100 mm/h to 20 m", 1.5), ("naive: every drop of them", 0.0)] {
        let parameters = RainParameters { simplification_codes, ..wide() };
        let rain = RainRun::new(Arc::new(Rain::new(parameters, "bench", 1, None).expect("the parameters go together")));
        let view = View { white_luminance: Some(40.0), ..view.clone() };
        group.bench_function(name, |bencher| {
            bencher.iter(|| pool.install(|| draw_frame(&rain, &view, &surroundings)));
        });
    }
    let mut pixels = vec![[0.0; 4]; SIZE[0] * SIZE[1]];
    group.bench_function("naive, 150,000 streaks, 1 thread", |bencher| {
        bencher.iter(|| {
            naive(150_000, &mut pixels);
            black_box(&pixels);
        });
    });
    group.finish();
}

criterion_group!(benches, gusts, frames);
criterion_main!(benches);
