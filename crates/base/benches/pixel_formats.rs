//! A picture of 256 x 256 to linear sRGB as half and single floats on one core: the library by rows, and a straightforward implementation pixel
//! by pixel.

use std::hint::black_box;

use bansho_base::color::{
    ColorSpace, LinearTransform, SRGB_FROM_ACESCG, WhiteBalance, black_body, luminance, pixel_formats::f16,
};
use criterion::{Criterion, criterion_group, criterion_main};

const SIZE: usize = 256;

/// Flames of 1000 to 2000 K over the given fraction of the width, the rest empty.
fn picture(lit: f32) -> Vec<[f32; 4]> {
    let pixel = |index: usize| {
        let (x, y) = (index % SIZE, index / SIZE);
        if x as f32 >= lit * SIZE as f32 {
            return [0.0; 4];
        }
        let rgb = black_body().radiance(1000.0 + 1000.0 * y as f32 / SIZE as f32);
        let scale = 4.0 * (x % 97) as f32 / 97.0 / luminance(rgb);
        [rgb[0] * scale, rgb[1] * scale, rgb[2] * scale, 0.3 * (x % 31) as f32 / 31.0]
    };
    (0..SIZE * SIZE).map(pixel).collect()
}

/// Matrix, limits and rounding to half floats, pixel by pixel.
fn naive_rgba16f(pixels: &[[f32; 4]], out: &mut [[f16; 4]]) {
    let matrix = SRGB_FROM_ACESCG.single();
    for ([r, g, b, alpha], out) in pixels.iter().zip(out) {
        let component = |row: [f32; 3]| row[0] * r + row[1] * g + row[2] * b;
        let [r, g, b] = matrix.map(|row| f16::from_f32(component(row).clamp(0.0, 65_504.0)));
        *out = [r, g, b, f16::from_f32(alpha.clamp(0.0, 1.0))];
    }
}

fn pixel_formats(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("pixels_256x256");
    let level = bansho_base::math::simd::level();
    let mut halves = vec![[f16::ZERO; 4]; SIZE * SIZE];
    let mut singles = vec![[0.0; 4]; SIZE * SIZE];
    let transform = LinearTransform::new(ColorSpace::LinearSrgb, None);
    for (name, lit) in [("flame_30_percent", 0.3), ("full", 1.0)] {
        let pixels = picture(lit);
        group.bench_function(format!("{name}/rgba16f"), |bencher| {
            bencher.iter(|| {
                for (row, out) in black_box(&pixels).chunks(SIZE).zip(halves.chunks_mut(SIZE)) {
                    transform.rgba16f_row(level, row, out);
                }
            });
        });
        group.bench_function(format!("{name}/naive_rgba16f"), |bencher| {
            bencher.iter(|| naive_rgba16f(black_box(&pixels), &mut halves));
        });
        group.bench_function(format!("{name}/rgba32f"), |bencher| {
            bencher.iter(|| {
                for (row, out) in black_box(&pixels).chunks(SIZE).zip(singles.chunks_mut(SIZE)) {
                    transform.rgba32f_row(level, row, out);
                }
            });
        });
    }
    group.bench_function("white balance of a camera", |bencher| {
        bencher.iter(|| WhiteBalance::matrix(black_box(4000.0)));
    });
    group.finish();
}

criterion_group!(benches, pixel_formats);
criterion_main!(benches);
