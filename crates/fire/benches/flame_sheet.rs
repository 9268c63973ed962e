//! A full flame sheet at 1920 x 1080, from texture to color, and the paper's texture alone, each compared with a naive implementation.

use std::hint::black_box;

use bansho_base::{
    camera::CameraParameters,
    host::observer::Unobserved,
    image::Rect,
    math,
    parameters::{Auto, animated::Animated},
    phenomenon::{
        Prepared, Run,
        strip::{DepthInterval, Shutter, Strip, View},
        surroundings::Surroundings,
    },
    world::wind::{Wind, WindParameters},
};

use bansho_fire::sheet::{FlameSheet, FlameSheetParameters, PaperTexture, equations, paper_texture};
use criterion::{Criterion, criterion_group, criterion_main};

const SIZE: [usize; 2] = [1920, 1080];
const STRIP: usize = 16;
const OCTAVES: u32 = 5;

/// A camera for which the sheet fills the picture exactly.
fn view(parameters: &FlameSheetParameters) -> View {
    let height = parameters.height;
    let camera = CameraParameters {
        position: Animated::from([0.0, 0.5 * height, 10.0]),
        target: Animated::from([0.0, 0.5 * height, 0.0]),
        vertical_fov_deg: Animated::from(2.0 * math::atan2(0.5 * height, 10.0).to_degrees()),
        ..CameraParameters::default()
    };
    View::new(camera, Shutter { open: 3.0, close: 3.0 + 1.0 / 60.0 }, 3.03, SIZE, 0)
}

/// Draws one frame; the strips are distributed to the threads in turn.
fn draw_frame(sheet: &FlameSheet, view: &View, strips: &mut [Strip]) {
    let wind = Wind::new(WindParameters::default(), 1, None);
    let surroundings = Surroundings::from_wind(&wind);
    let Ok(prepared) = sheet.prepare(view, &surroundings, &Unobserved) else { return };
    let (prepared, threads) = (prepared.as_ref(), strips.len());
    std::thread::scope(|scope| {
        let Some((own, others)) = strips.split_first_mut() else { return };
        for (index, strip) in others.iter_mut().enumerate() {
            scope.spawn(move || draw_every_nth_strip(prepared, index + 1, threads, strip));
        }
        draw_every_nth_strip(prepared, 0, threads, own);
    });
}

/// Draws strip `first` of the picture and every `step`-th one after it.
fn draw_every_nth_strip(prepared: &dyn Prepared, first: usize, step: usize, strip: &mut Strip) {
    for y in (first * STRIP..SIZE[1]).step_by(step * STRIP) {
        strip.reset(Rect { x: 0, y, width: SIZE[0], height: STRIP.min(SIZE[1] - y) }, None, 0);
        prepared.draw(&DepthInterval::ALL, strip);
        black_box(&strip.radiance);
    }
}

/// All equations with trigonometric functions and curves evaluated at every pixel.
#[allow(clippy::disallowed_methods, reason = "the naive implementation calls the standard library")]
fn naive_pixel(parameters: &FlameSheetParameters, x: f64, y: f64, scroll: f64) -> [f64; 3] {
    let shape = &parameters.shape;
    let rise = equations::rise(y as f32, shape.initial_speed as f32);
    let distance = equations::axis_distance(x as f32);
    let (core, fringe) = (shape.core_width.eval(rise.into()) as f32, shape.fringe_width.eval(rise.into()) as f32);
    let falling = 1.0 - shape.slowing.eval(equations::fringe_position(distance, core, fringe).into()) as f32;
    let w = equations::slowed_rise(rise, equations::speed_profile(falling, shape.edge_speed as f32));
    let flutter = 0.5 + 0.5 * ((f64::from(w) - scroll) * 9.0).sin();
    let (core, fringe) = (shape.core_width.eval(w.into()) as f32, shape.fringe_width.eval(w.into()) as f32);
    let across = equations::across(distance, equations::fluttering_edge(core, fringe, flutter as f32));
    if w > 1.0 || across >= 1.0 {
        return [0.0; 3];
    }
    let texture = naive_texture(equations::texture_u(across, x as f32).into(), f64::from(w) - scroll);
    let vertical = parameters.texture.threshold.eval(w.into()) as f32;
    let limit = equations::threshold(vertical, parameters.texture.threshold_across.eval(across.into()) as f32);
    let sharp = parameters.texture.sharpen.eval(equations::above_threshold(texture as f32, limit).into());
    [&parameters.color.red, &parameters.color.green, &parameters.color.blue].map(|curve| curve.eval(sharp))
}

/// Eq. (20), literally.
#[allow(clippy::disallowed_methods, reason = "the naive implementation calls the standard library")]
fn naive_texture(p: f64, q: f64) -> f64 {
    let (mut sum, mut total, mut weight, mut fx, mut fy) = (0.0, 0.0, 1.0, 16.0, 26.0);
    for _ in 0..OCTAVES {
        let phi = fx * p + std::f64::consts::FRAC_PI_2 * f64::sin(0.5 * fy * q);
        let psi = fy * q + std::f64::consts::FRAC_PI_2 * f64::sin(0.5 * fx * p);
        sum += weight * (phi.cos() * psi.cos() + 1.0);
        total += weight;
        (weight, fx, fy) = (weight * 0.707 * 0.707, 2.0 * fx, 2.0 * fy);
    }
    0.5 * sum / total
}

fn sheet_1080p(criterion: &mut Criterion) {
    let parameters = FlameSheetParameters {
        width: 1920.0 / 1080.0 * 1.7,
        time_samples: Auto::Set(1),
        ..FlameSheetParameters::default()
    };
    let view = view(&parameters);
    let sheet = FlameSheet::new(parameters.clone(), "bench", 1, None).expect("the defaults go together");
    let mut group = criterion.benchmark_group("flame sheet 1920x1080");
    group.sample_size(30);
    for threads in [1, 2] {
        let mut strips = vec![Strip::default(); threads];
        let name = if threads == 1 { "1 thread" } else { "2 threads" };
        group.bench_function(name, |bencher| bencher.iter(|| draw_frame(&sheet, &view, &mut strips)));
    }
    group.sample_size(10);
    group.bench_function("naive, 1 thread", |bencher| {
        bencher.iter(|| {
            for row in 0..SIZE[1] {
                for column in 0..SIZE[0] {
                    let (x, y) = ((column as f64 + 0.5) / SIZE[0] as f64, 1.0 - (row as f64 + 0.5) / SIZE[1] as f64);
                    black_box(naive_pixel(&parameters, x, y, 3.3));
                }
            }
        });
    });
    group.finish();
}

#[inline(always)]
fn fill_rows(texture: &PaperTexture, values: &mut [f32]) {
    for (row, values) in values.chunks_exact_mut(SIZE[0]).enumerate() {
        texture.fill_row(row, values);
    }
}

fn texture_sum(criterion: &mut Criterion) {
    let p: Vec<f64> = (0..SIZE[0]).map(|i| i as f64 / SIZE[0] as f64).collect();
    let q: Vec<f64> = (0..SIZE[1]).map(|i| i as f64 / SIZE[1] as f64 - 3.3).collect();
    let mut values = vec![0.0_f32; SIZE[0] * SIZE[1]];
    let mut group = criterion.benchmark_group("texture sum 1920x1080");
    group.bench_function("row and column functions", |bencher| {
        let level = bansho_base::math::simd::level();
        bencher.iter(|| {
            let texture = PaperTexture::new(&p, &q, OCTAVES);
            fearless_simd::dispatch!(level, _simd => fill_rows(&texture, &mut values));
            black_box(&values);
        });
    });
    group.sample_size(10);
    group.bench_function("naive", |bencher| {
        bencher.iter(|| {
            for (row, q) in values.chunks_exact_mut(SIZE[0]).zip(&q) {
                for (value, p) in row.iter_mut().zip(&p) {
                    *value = naive_texture(*p, *q) as f32;
                }
            }
            black_box(&values);
        });
    });
    black_box(paper_texture(0.1, 0.2, OCTAVES));
    group.finish();
}

criterion_group!(benches, sheet_1080p, texture_sum);
criterion_main!(benches);
