//! A picture of 1920 x 1080 through the view to 8-bit pixels on one core, and the colors of black bodies: the library and a straightforward
//! implementation in f64.

use std::hint::black_box;

use bansho_base::color::{
    ACESCG_FROM_XYZ, AlphaConvention, SRGB_FROM_ACESCG, View, black_body, decode_srgb, luminance,
    planck_radiance_per_nm, xyz_of_spectrum,
};
use criterion::{Criterion, criterion_group, criterion_main};
use fearless_simd::Level;

const WIDTH: usize = 1920;
const HEIGHT: usize = 1080;

/// Flames of 1000 to 2000 K over the given fraction of the width, the rest empty.
fn picture(lit: f32) -> Vec<[f32; 4]> {
    let pixel = |index: usize| {
        let (x, y) = (index % WIDTH, index / WIDTH);
        if x as f32 >= lit * WIDTH as f32 {
            return [0.0; 4];
        }
        let rgb = black_body().radiance(1000.0 + 1000.0 * y as f32 / HEIGHT as f32);
        let scale = 4.0 * (x % 97) as f32 / 97.0 / luminance(rgb);
        [rgb[0] * scale, rgb[1] * scale, rgb[2] * scale, 0.3 * (x % 31) as f32 / 31.0]
    };
    (0..WIDTH * HEIGHT).map(pixel).collect()
}

fn by_rows(view: &View, level: Level, pixels: &[[f32; 4]], alpha: Option<AlphaConvention>, out: &mut [[u8; 4]]) {
    for (y, (row, out)) in pixels.chunks(WIDTH).zip(out.chunks_mut(WIDTH)).enumerate() {
        view.display_row(level, row, y as i64, 0, alpha, out);
    }
}

/// The same view in f64, pixel by pixel and formula by formula, without dither.
fn naively(pixels: &[[f32; 4]], out: &mut [[u8; 4]]) {
    for (pixel, out) in pixels.iter().zip(out) {
        let light = naive_view(SRGB_FROM_ACESCG.apply([pixel[0], pixel[1], pixel[2]].map(f64::from)));
        let alpha = light.iter().fold(f64::from(pixel[3]), |a, b| a.max(*b)).clamp(0.0, 1.0);
        let code = |v: f64| (255.0 * naive_encode(if alpha > 0.0 { v / alpha } else { 0.0 })).round() as u8;
        *out = [code(light[0]), code(light[1]), code(light[2]), (alpha * 255.0).round() as u8];
    }
}

fn naive_encode(x: f64) -> f64 {
    if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * libm::pow(x, 1.0 / 2.4) - 0.055 }
}

fn naive_view(rgb: [f64; 3]) -> [f64; 3] {
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| rgb[b].total_cmp(&rgb[a]));
    let [most, mid, least] = order.map(|i| rgb[i]);
    if most <= 0.0 {
        return [0.0; 3];
    }
    let x = ((most - 0.6) / 0.4).max(0.0);
    let brightness = if most > 0.6 { (0.6 + 0.4 * x * (1.0 + x / (38.5 * 38.5)) / (1.0 + x)).min(1.0) } else { most };
    let c = 0.4 * x * x / (1.0 + x);
    let s = (most - least) / most;
    let w = c * c / (c * c + 289.0);
    let v = (s * (1.0 - w)).min(1.0);
    let saturation = if s > 1.0 && w > 0.0 { 1.0 - (1.0 - v) * (1.0 - v) / w } else { v };
    let bend = if order == [0, 1, 2] { 1.8 * c / (1.0 + 1.8 * c / 11.0) * s.min(1.0) } else { 0.0 };
    let t = if most > least { (mid - least) / (most - least) } else { 0.0 };
    let t = t * (1.0 + bend) / (1.0 + bend * t);
    let mut out = [0.0; 3];
    let values = [brightness, brightness * (1.0 - saturation * (1.0 - t)), brightness * (1.0 - saturation)];
    order.into_iter().zip(values).for_each(|(i, v)| out[i] = v);
    out
}

fn view(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("view_1920x1080");
    group.sample_size(20);
    let level = bansho_base::math::simd::level();
    let mut out = vec![[0_u8; 4]; WIDTH * HEIGHT];
    for (name, lit) in [("flame_30_percent", 0.3), ("full", 1.0)] {
        let pixels = picture(lit);
        group.bench_function(format!("{name}/simd"), |bencher| {
            bencher
                .iter(|| by_rows(&View::DISPLAY, level, black_box(&pixels), Some(AlphaConvention::Linear), &mut out));
        });
        group.bench_function(format!("{name}/simd_encoded_alpha"), |bencher| {
            bencher.iter(|| {
                by_rows(&View::DISPLAY, level, black_box(&pixels), Some(AlphaConvention::Encoded), &mut out);
            });
        });
        group.bench_function(format!("{name}/simd_opaque"), |bencher| {
            bencher.iter(|| by_rows(&View::DISPLAY, level, black_box(&pixels), None, &mut out));
        });
        group.bench_function(format!("{name}/naive"), |bencher| {
            bencher.iter(|| naively(black_box(&pixels), &mut out));
        });
    }
    let plate: Vec<[f32; 4]> = picture(1.0).iter().map(|p| p.map(|v| v.clamp(0.0, 1.0))).collect();
    let mut scene = plate.clone();
    group.bench_function("plate_to_scene/simd", |bencher| {
        bencher.iter(|| {
            scene.copy_from_slice(&plate);
            View::DISPLAY.to_scene_row(level, &mut scene);
        });
    });
    let codes: Vec<[u8; 4]> = plate.iter().map(|p| p.map(|v| (255.0 * v).round() as u8)).collect();
    group.bench_function("photograph_to_scene/codes", |bencher| {
        bencher.iter(|| {
            for (codes, scene) in black_box(&codes).chunks(WIDTH).zip(scene.chunks_mut(WIDTH)) {
                View::DISPLAY.codes_to_scene_row(level, codes, scene);
            }
        });
    });
    group.bench_function("photograph_to_scene/naive", |bencher| {
        bencher.iter(|| {
            for ([r, g, b, _], scene) in black_box(&codes).iter().zip(&mut scene) {
                let [r, g, b] = View::DISPLAY.to_scene([r, g, b].map(|code| decode_srgb(f32::from(*code) / 255.0)));
                *scene = [r, g, b, 1.0];
            }
        });
    });
    group.finish();
}

fn black_bodies(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("black_bodies_100");
    let temperatures: Vec<f32> = (0..100).map(|i| 1000.25 + 17.0 * i as f32).collect();
    group.bench_function("table", |bencher| {
        let table = black_body();
        bencher.iter(|| black_box(&temperatures).iter().fold(0.0, |sum, t| sum + table.radiance(*t)[1]));
    });
    group.bench_function("naive", |bencher| {
        let green = |t: f32| ACESCG_FROM_XYZ.apply(xyz_of_spectrum(|nm| planck_radiance_per_nm(nm, f64::from(t))))[1];
        bencher.iter(|| black_box(&temperatures).iter().fold(0.0, |sum, t| sum + green(*t)));
    });
    group.finish();
}

criterion_group!(benches, view, black_bodies);
criterion_main!(benches);
