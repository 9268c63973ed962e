//! Rows of fractal noise: 16 lanes under run-time dispatch, compared with one point at a time and the textbook permutation table.
#![allow(missing_docs, reason = "criterion's macros make public functions")]

use std::{hint::black_box, time::Duration};

use bansho_base::{
    math,
    math::random::{Key, Purpose},
    noise::{Coordinate, Dimension, Fractal, LANES, Noise},
};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use fearless_simd::dispatch;

const POINTS: usize = 1024;
const DETAILED: Fractal = Fractal { octaves: 4, lacunarity: 2, gain: 0.5 };

/// Perlin's reference implementation of 2002: table of 512, one point at a time.
struct PermutationTable([usize; 512]);

impl PermutationTable {
    fn new() -> Self {
        let mut order: Vec<usize> = (0..256).collect();
        order.sort_by_key(|&i| Key::new(1, "table").words(i as u64, 0, Purpose(0)));
        Self(std::array::from_fn(|i| order[i & 255]))
    }

    fn at(&self, [x, y, z]: [f32; 3]) -> f32 {
        let p = &self.0;
        let (cx, cy, cz) =
            (x.floor() as i32 as usize & 255, y.floor() as i32 as usize & 255, z.floor() as i32 as usize & 255);
        let (x, y, z) = (x - x.floor(), y - y.floor(), z - z.floor());
        let (u, v, w) = (fade(x), fade(y), fade(z));
        let (a, b) = (p[cx] + cy, p[cx + 1] + cy);
        let (aa, ab, ba, bb) = (p[a] + cz, p[a + 1] + cz, p[b] + cz, p[b + 1] + cz);
        let near = lerp(
            v,
            lerp(u, slope(p[aa], x, y, z), slope(p[ba], x - 1.0, y, z)),
            lerp(u, slope(p[ab], x, y - 1.0, z), slope(p[bb], x - 1.0, y - 1.0, z)),
        );
        let far = lerp(
            v,
            lerp(u, slope(p[aa + 1], x, y, z - 1.0), slope(p[ba + 1], x - 1.0, y, z - 1.0)),
            lerp(u, slope(p[ab + 1], x, y - 1.0, z - 1.0), slope(p[bb + 1], x - 1.0, y - 1.0, z - 1.0)),
        );
        lerp(w, near, far)
    }
}

fn fade(t: f32) -> f32 {
    t * t * t * (t * (t * 6.0 - 15.0) + 10.0)
}

fn lerp(t: f32, a: f32, b: f32) -> f32 {
    a + t * (b - a)
}

fn slope(hash: usize, x: f32, y: f32, z: f32) -> f32 {
    let h = hash & 15;
    let u = if h < 8 { x } else { y };
    let v = if h < 4 {
        y
    } else if h == 12 || h == 14 {
        x
    } else {
        z
    };
    (if h & 1 == 0 { u } else { -u }) + (if h & 2 == 0 { v } else { -v })
}

fn rows<const N: usize>(criterion: &mut Criterion, table: Option<&PermutationTable>)
where
    [f32; N]: Dimension<Cells = [u32; N]>,
{
    let level = bansho_base::math::simd::level();
    let noise = Noise::<N>::new(7, DETAILED, [0; N]).expect("valid octaves");
    let origin: [Coordinate; N] = std::array::from_fn(|axis| Coordinate::from_f64(1.7 + axis as f64 * 3.3));
    let along: Vec<f32> = (0..POINTS).map(|i| i as f32 * 0.011).collect();
    let mut out = vec![0.0; POINTS];
    let mut group = criterion.benchmark_group(format!("noise {N}-D, 4 octaves"));
    group
        .throughput(Throughput::Elements(POINTS as u64))
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_secs(1));
    group.bench_function("row", |bencher| bencher.iter(|| noise.row(level, black_box(origin), &along, &mut out)));
    group.bench_function(BenchmarkId::new("lanes", LANES), |bencher| {
        let cells = origin.map(|coordinate| [coordinate.cell; LANES]);
        let fractions = origin.map(|_| std::array::from_fn(|lane| lane as f32 / 16.0));
        bencher.iter(|| {
            for out in out.chunks_exact_mut(LANES) {
                out.copy_from_slice(&dispatch!(level, _simd => noise.lanes(black_box(&cells), &fractions)));
            }
        });
    });
    group.bench_function("naive: one point at a time", |bencher| {
        bencher.iter(|| {
            for (along, out) in along.iter().zip(&mut out) {
                let mut point = black_box(origin);
                point[0] = point[0].offset_by(*along);
                *out = noise.at(point);
            }
        });
    });
    if let Some(table) = table {
        group.bench_function("naive: permutation table", |bencher| {
            bencher.iter(|| {
                for (along, out) in along.iter().zip(&mut out) {
                    let octave = |k: i32| {
                        table.at([1.7 + along, 5.0, 8.3].map(|x| black_box(x) * (1 << k) as f32)) / (1 << k) as f32
                    };
                    *out = (0..4).map(octave).sum();
                }
            });
        });
    }
    group.finish();
}

fn exponentials(criterion: &mut Criterion) {
    let level = bansho_base::math::simd::level();
    let x: Vec<f32> = (0..POINTS).map(|i| i as f32 * 0.02 - 10.0).collect();
    let mut out = vec![0.0; POINTS];
    let mut group = criterion.benchmark_group("exp");
    group
        .throughput(Throughput::Elements(POINTS as u64))
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_secs(1));
    group.bench_function("lanes", |bencher| {
        bencher.iter(|| dispatch!(level, _simd => apply(math::approximations::exp, black_box(&x), &mut out)));
    });
    group.bench_function("naive: libm", |bencher| bencher.iter(|| apply(math::f32::exp, black_box(&x), &mut out)));
    group.finish();
}

#[inline(always)]
fn apply(function: impl Fn(f32) -> f32, x: &[f32], out: &mut [f32]) {
    for (x, out) in x.iter().zip(out) {
        *out = function(*x);
    }
}

fn all(criterion: &mut Criterion) {
    rows::<2>(criterion, None);
    rows::<3>(criterion, Some(&PermutationTable::new()));
    rows::<4>(criterion, None);
    exponentials(criterion);
}

criterion_group!(benches, all);
criterion_main!(benches);
