//! Drawing an aurora of 120,000 particles with 100 collisions each at 1280 x 720.
//!
//! The naive way adds a Gaussian to the picture for each of the 12 million points. It does so for a tenth of them, and what that takes counts
//! tenfold.

use std::{
    hint::black_box,
    sync::Arc,
    time::{Duration, Instant},
};

use bansho_base::{
    camera::{CameraParameters, Lens},
    host::{assets::MemoryAssets, observer::Unobserved},
    image::Rect,
    math::{self, DVec3},
    parameters::animated::Animated,
    phenomenon::{
        Run,
        strip::{DepthInterval, Shutter, Strip, View},
        surroundings::Surroundings,
    },
    world::wind::{Wind, WindParameters},
};

use bansho_aurora::{
    Aurora, AuroraParameters, AuroraRun, ParticleParameters, RenderingParameters, Sampling, TrackModel,
};
use criterion::{Criterion, criterion_group, criterion_main};

const STRIP_ROWS: usize = 8;
/// One particle of so many is splatted the naive way.
const SPLATTED: usize = 10;
/// Half-width of the support of a naive point's Gaussian, pixels, and its standard deviation.
const REACH: i64 = 3;
const SIGMA: f64 = 1.2;

fn run(sampling: Sampling) -> AuroraRun {
    // Single photons are drawn by the rules of hard spheres.
    let energy_deposition = match sampling {
        Sampling::SinglePhotons => TrackModel::HardSphereAtmosphere,
        Sampling::MeanProfile | Sampling::SingleCollisions => TrackModel::Fang2010,
    };
    let parameters = AuroraParameters {
        energy_ev: Animated::from(10_000.0),
        particles: ParticleParameters { count: 120_000, ..ParticleParameters::default() },
        rendering: RenderingParameters { sampling, energy_deposition, ..RenderingParameters::default() },
        ..AuroraParameters::default()
    };
    let aurora = Aurora::new(parameters, "aurora", 1, None, &MemoryAssets::default());
    AuroraRun::new(Arc::new(aurora.expect("the usual shapes are an aurora's")))
}

fn view(lens: Lens, target: [f64; 3], size: [usize; 2]) -> View {
    let camera = CameraParameters {
        lens,
        position: [0.0; 3].into(),
        target: target.into(),
        vertical_fov_deg: 56.0.into(),
        ..CameraParameters::default()
    };
    View::new(camera, Shutter { open: 0.0, close: 0.0 }, 0.0, size, 0)
}

/// The whole frame, strip by strip.
fn frame(run: &AuroraRun, view: &View) -> f32 {
    use rayon::prelude::*;
    let wind = Wind::new(WindParameters::default(), 1, None);
    let surroundings = Surroundings::from_wind(&wind);
    let prepared = run.prepare(view, &surroundings, &Unobserved).expect("nobody asks to stop");
    let strips = (0..view.size[1]).into_par_iter().step_by(STRIP_ROWS);
    let sums = strips.map_init(Strip::default, |strip, y| {
        let height = STRIP_ROWS.min(view.size[1] - y);
        strip.reset(Rect { x: 0, y, width: view.size[0], height }, None, 0);
        prepared.draw(&DepthInterval::ALL, strip);
        strip.radiance[1].iter().sum::<f32>()
    });
    sums.sum()
}

/// A Gaussian per point for one particle of [`SPLATTED`], one after the other.
fn splat(run: &AuroraRun, view: &View) -> f32 {
    let particles = run.simulation().particles();
    let [width, height] = view.size.map(|side| side as i64);
    let mut picture = vec![[0.0_f32; 3]; (width * height) as usize];
    for index in (0..particles.len()).step_by(SPLATTED) {
        for collision in 0..100 {
            let altitude = 95.0 + 1.5 * f64::from(collision);
            let place = particles.position(index);
            let point = DVec3::new(place.x, altitude, place.y + 0.23 * (altitude - 100.0)) * 1e3;
            let Some(seen) = view.camera.project(point) else { continue };
            for y in seen.pixel.y as i64 - REACH..=seen.pixel.y as i64 + REACH {
                for x in seen.pixel.x as i64 - REACH..=seen.pixel.x as i64 + REACH {
                    if (0..width).contains(&x) && (0..height).contains(&y) {
                        let (dx, dy) = (x as f64 + 0.5 - seen.pixel.x, y as f64 + 0.5 - seen.pixel.y);
                        let weight = math::exp(-0.5 * (dx * dx + dy * dy) / (SIGMA * SIGMA)) as f32;
                        let pixel = &mut picture[(y * width + x) as usize];
                        pixel.iter_mut().for_each(|value| *value += weight);
                    }
                }
            }
        }
    }
    picture.iter().map(|pixel| pixel[1]).sum()
}

fn draw(criterion: &mut Criterion) {
    let north = view(Lens::Perspective, [0.0, 25.0, -60.0], [1280, 720]);
    let mean = run(Sampling::MeanProfile);
    let mut group = criterion.benchmark_group("aurora 1280x720, 120,000 particles");
    group.sample_size(10).measurement_time(Duration::from_secs(3));
    group.bench_function("profile", |bencher| bencher.iter(|| frame(black_box(&mean), &north)));
    let single = run(Sampling::SingleCollisions);
    group.bench_function("collisions", |bencher| bencher.iter(|| frame(black_box(&single), &north)));
    let photons = run(Sampling::SinglePhotons);
    group.bench_function("photons", |bencher| bencher.iter(|| frame(black_box(&photons), &north)));
    group.bench_function("naive: a Gaussian for each point", |bencher| {
        bencher.iter_custom(|iterations| {
            let start = Instant::now();
            for _ in 0..iterations {
                black_box(splat(black_box(&mean), &north));
            }
            start.elapsed() * SPLATTED as u32
        });
    });
    group.finish();
    let dome = view(Lens::Fisheye, [0.0, 1.0, 0.0], [4096, 4096]);
    let mut group = criterion.benchmark_group("aurora dome 4096x4096, 120,000 particles");
    group.sample_size(10).measurement_time(Duration::from_secs(3));
    group.bench_function("profile", |bencher| bencher.iter(|| frame(black_box(&mean), &dome)));
    group.finish();
}

criterion_group!(benches, draw);
criterion_main!(benches);
