//! The ground with its row cache, without it, and the naive way: one pixel at a time in double precision.

use std::{hint::black_box, sync::Arc};

use bansho_base::{
    host::observer::Unobserved,
    image::Rect,
    phenomenon::{
        Run,
        strip::{DepthInterval, Strip},
    },
    world::wind::{Wind, WindParameters},
};
use bansho_environment::ground::{Ground, GroundParameters};
use criterion::{Criterion, criterion_group, criterion_main};

#[path = "support/pixel_by_pixel.rs"]
mod pixel_by_pixel;
#[path = "support/scene.rs"]
mod scene;

use pixel_by_pixel::PixelByPixel;

const SIZE: [usize; 2] = [1280, 720];
const SEED: u64 = 1;

/// Draws a frame in strips of eight rows.
fn strips(mut draw: impl FnMut(&mut Strip)) {
    let mut strip = Strip::default();
    for y in (0..SIZE[1]).step_by(8) {
        strip.reset(Rect { x: 0, y, width: SIZE[0], height: 8 }, None, 0);
        draw(&mut strip);
        black_box(&strip.radiance);
    }
}

fn ground(criterion: &mut Criterion, name: &str, parameters: &GroundParameters) {
    let (view, wind) = (scene::view(SIZE), Wind::new(WindParameters::default(), 1, None));
    let reflection = scene::reflection(SIZE, 2);
    let surroundings = scene::surroundings(&wind, Some(&reflection));
    let mut group = criterion.benchmark_group(name);
    group.sample_size(10);
    let draw = |ground: &Ground| {
        let Ok(prepared) = ground.prepare(&view, &surroundings, &Unobserved) else { return };
        strips(|strip| prepared.draw(&DepthInterval::ALL, strip));
    };
    group.bench_function("first frame", |bencher| {
        bencher.iter(|| draw(&Ground::new(parameters.clone(), SEED, None)));
    });
    let known = Arc::new(Ground::new(parameters.clone(), SEED, None));
    (0..2).for_each(|_| draw(&known));
    group.bench_function("third frame", |bencher| bencher.iter(|| draw(&known)));
    group.bench_function("naive: one pixel at a time", |bencher| {
        bencher.iter(|| {
            let naive = PixelByPixel::new(parameters, SEED, &view, &surroundings);
            strips(|strip| naive.draw(strip));
        });
    });
    group.finish();
}

fn street(criterion: &mut Criterion) {
    ground(criterion, "wet street 1280x720", &scene::street());
}

fn lake(criterion: &mut Criterion) {
    ground(criterion, "lake 1280x720", &scene::lake());
}

criterion_group!(benches, street, lake);
criterion_main!(benches);
