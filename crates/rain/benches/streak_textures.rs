//! The paper's 24 streak textures of 512 x 512 with their drops, compared with the naive algorithm: each sample of each pixel
//! that a streak touches.

use std::hint::black_box;

use bansho_base::image::Image;

use bansho_rain::{
    billboards::texture::{FallingDrop, StreakCube},
    drops::size_distribution::{DropSizeDistribution, SizeBin},
    lighting::drop_phase_function::DropPhaseFunction,
};
use criterion::{Criterion, criterion_group, criterion_main};

const RATES: [f64; 4] = [1.0, 5.0, 10.0, 20.0];
const DIAMETERS: [f64; 6] = [1.0, 1.2, 1.4, 1.6, 1.8, 2.0];
/// Samples of a pixel in each direction, for opacities to about a percent: eight lie across a drop of 1 mm.
const SAMPLES: i64 = 16;

/// Every rain and bin of the paper.
fn every(mut each: impl FnMut(&DropSizeDistribution, &SizeBin)) {
    for rate in RATES {
        let sizes = DropSizeDistribution::marshall_palmer(rate);
        SizeBin::around(&DIAMETERS).iter().for_each(|bin| each(&sizes, bin));
    }
}

/// The drops of a bin.
fn drops(cube: &StreakCube, sizes: &DropSizeDistribution, bin: &SizeBin) -> Vec<FallingDrop> {
    cube.drops(sizes, bin, 1, 0).expect("the cube is the paper's")
}

/// A streak by its opacity at many points of each pixel.
fn naive_streak(cube: &StreakCube, drop: &FallingDrop, image: &mut Image<1>) {
    let (streak, pixel, size) = (cube.streak(drop), cube.pixel(), cube.size as i64);
    let (axis, start) = (drop.position[0], cube.edge - drop.position[1]);
    let span = |from: f64, to: f64| (from / pixel).floor() as i64..=(to / pixel).floor() as i64;
    for row in span(start - streak.radius, start + streak.length + streak.radius) {
        for column in span(axis - streak.radius, axis + streak.radius) {
            let at = |cell: i64, part: i64| (cell as f64 + (part as f64 + 0.5) / SAMPLES as f64) * pixel;
            let mut sum = 0.0;
            for y in 0..SAMPLES {
                for x in 0..SAMPLES {
                    let (b, s) = (at(column, x) - axis, at(row, y) - start);
                    if b.abs() < streak.radius {
                        sum += streak.opacity(b, s);
                    }
                }
            }
            let [under] = &mut image.row_mut(row.rem_euclid(size) as usize)[column.rem_euclid(size) as usize];
            *under += (sum / (SAMPLES * SAMPLES) as f64) as f32 * (1.0 - *under);
        }
    }
}

fn textures(criterion: &mut Criterion) {
    let cube = StreakCube::default();
    let mut group = criterion.benchmark_group("24 streak textures");
    group.sample_size(20);
    group.bench_function("drawn", |bencher| {
        bencher.iter(|| every(|sizes, bin| drop(black_box(cube.draw(&drops(&cube, sizes, bin))))));
    });
    group.bench_function("naive", |bencher| {
        bencher.iter(|| {
            every(|sizes, bin| {
                let mut image = Image::filled(cube.size, cube.size, [0.0]);
                drops(&cube, sizes, bin).iter().for_each(|drop| naive_streak(&cube, drop, &mut image));
                black_box(&image);
            });
        });
    });
    group.finish();
}

fn lens(criterion: &mut Criterion) {
    criterion.bench_function("drop lens", |bencher| bencher.iter(DropPhaseFunction::new));
}

criterion_group!(benches, textures, lens);
criterion_main!(benches);
