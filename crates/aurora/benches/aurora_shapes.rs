//! Validation of strokes, sampling of a shape and nearest-segment queries, each compared with the naive algorithm.

use std::hint::black_box;

use bansho_base::{
    host::assets::MemoryAssets,
    math::{
        DVec2,
        random::{Key, Purpose},
        sin_cos,
    },
};

use bansho_aurora::shapes::{MorphingParameters, NearestSegmentGrid, Sequence, Shape, SheetSampler, first_crossing};
use criterion::{Criterion, criterion_group, criterion_main};

/// A spiral of `count` points that does not intersect itself.
fn spiral(count: usize) -> Vec<DVec2> {
    let point = |index: usize| {
        let (sin, cos) = sin_cos(index as f64 * 0.05);
        DVec2::new(cos, sin) * (20.0 + index as f64 * 0.04)
    };
    (0..count).map(point).collect()
}

fn side(a: DVec2, b: DVec2, point: DVec2) -> f64 {
    (b - a).perp_dot(point - a)
}

/// Every segment with every other.
fn any_crossing(points: &[DVec2]) -> bool {
    let crosses = |a: DVec2, b: DVec2, c: DVec2, d: DVec2| {
        side(a, b, c) * side(a, b, d) <= 0.0 && side(c, d, a) * side(c, d, b) <= 0.0
    };
    (2..points.len() - 1).any(|i| (0..i - 1).any(|j| crosses(points[i], points[i + 1], points[j], points[j + 1])))
}

fn strokes(criterion: &mut Criterion) {
    let stroke = spiral(10_000);
    let mut group = criterion.benchmark_group("aurora stroke of 10,000 points");
    group.sample_size(20);
    group.bench_function("cell list", |bencher| bencher.iter(|| first_crossing(black_box(&[&stroke]))));
    group.bench_function("naive: all pairs", |bencher| bencher.iter(|| any_crossing(black_box(&stroke))));
    group.finish();
}

/// The default aurora in the middle of a transition.
fn shape() -> Shape {
    let sequence = Sequence::new(&[], &MorphingParameters::default(), 1000.0, &MemoryAssets::default(), None);
    sequence.map(|sequence| sequence.at(7.0)).unwrap_or_default()
}

const PARTICLES: u64 = 120_000;
const REACH_KM: f64 = 6.0;

fn uniforms(index: u64) -> [f64; 4] {
    Key::new(1, "scatter").uniforms(index, 0, Purpose::named("place")).map(f64::from)
}

fn scatter(criterion: &mut Criterion) {
    let shape = shape();
    let mut group = criterion.benchmark_group("aurora scatter 120,000");
    group.sample_size(10);
    group.bench_function("along the segments", |bencher| {
        let segments = SheetSampler::new(&shape);
        bencher.iter(|| {
            (0..PARTICLES).filter_map(|index| segments.sample(uniforms(index)[0])).map(|s| s.point.x).sum::<f64>()
        });
    });
    group.bench_function("naive: rejection in the bounding box", |bencher| bencher.iter(|| rejection(&shape)));
    group.finish();
}

/// The thesis's algorithm: random points in the bounding box until enough are within reach of a segment.
fn rejection(shape: &Shape) -> f64 {
    let points = || shape.sheets.iter().flat_map(|sheet| sheet.points.iter().copied());
    let low = points().fold(DVec2::INFINITY, DVec2::min) - REACH_KM;
    let high = points().fold(DVec2::NEG_INFINITY, DVec2::max) + REACH_KM;
    let near = |point: DVec2| {
        shape.sheets.iter().flat_map(|sheet| sheet.points.windows(2)).any(|pair| {
            let distance = pair[1] - pair[0];
            let fraction = ((point - pair[0]).dot(distance) / distance.length_squared()).clamp(0.0, 1.0);
            point.distance_squared(pair[0] + distance * fraction) <= REACH_KM * REACH_KM
        })
    };
    let random = |index: u64| {
        let [x, y, ..] = uniforms(index);
        low + (high - low) * DVec2::new(x, y)
    };
    (0..).map(random).filter(|&point| near(point)).take(PARTICLES as usize).map(|point| point.x).sum()
}

fn neighborhood(criterion: &mut Criterion) {
    let shape = shape();
    let mut group = criterion.benchmark_group("aurora in-between shape");
    group.bench_function("neighborhood of reach 6 km", |bencher| {
        bencher.iter(|| NearestSegmentGrid::new(black_box(&shape), REACH_KM));
    });
    group.finish();
}

criterion_group!(benches, strokes, scatter, neighborhood);
criterion_main!(benches);
