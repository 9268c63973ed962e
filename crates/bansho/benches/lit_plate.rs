//! The light of six lamps that flicker on a plate with a depth, 1280 x 720, on two threads: the time of a whole frame, and of the first, which computes what
//! arrives from each lamp.
//!
//! The naive version computes Lambert's law for each pixel and lamp in double precision, without shadows.

use std::{hint::black_box, sync::Arc};

use bansho_base::{
    frame::Frame,
    host::{
        assets::{Encoding, MemoryAssets, Picture},
        observer::Unobserved,
    },
    image::Image,
    math::DVec3,
};
use bansho_render::{CompiledScene, Plan, PlanOptions, SceneLinear, Shot};
use bansho_scene::Scene;
use criterion::{Criterion, criterion_group, criterion_main};

const SIZE: [usize; 2] = [1280, 720];
const ALBEDO: f64 = 0.4;
const LAMPS: usize = 6;
/// Focal length of a vertical field of view of 90 degrees, pixels.
const FOCAL: f64 = 360.0;

/// A floor 1.5 m below the camera, a wall 8 m away, and pillars 4 m away.
fn depth(x: usize, y: usize) -> f64 {
    let down = (y as f64 + 0.5 - 360.0) / FOCAL;
    let wall: f64 = if x / 80 % 4 == 1 && (200..500).contains(&y) { 4.0 } else { 8.0 };
    if down > 0.0 { wall.min(1.5 / down) } else { wall }
}

fn lamp(index: usize) -> DVec3 {
    DVec3::new(index as f64 - 2.5, -0.5, -3.0 - 0.5 * (index % 2) as f64)
}

fn picture(value: impl Fn(usize, usize) -> f32) -> Image<4> {
    let at = |index: usize| {
        let value = value(index % SIZE[0], index / SIZE[0]);
        [value, value, value, 1.0]
    };
    Image::from_pixels(SIZE[0], SIZE[1], (0..SIZE[0] * SIZE[1]).map(at).collect()).expect("as many as its size says")
}

/// A shot of the lamps, and one of the same plate without light.
fn shot(is_lit: bool) -> Shot {
    let mut assets = MemoryAssets::default();
    let values = (0..SIZE[0] * SIZE[1]).map(|index| depth(index % SIZE[0], index / SIZE[0]) as f32).collect();
    let plate = Picture::opaque(picture(|x, y| ((x + y) % 83) as f32 / 830.0), Encoding::LinearAcescg);
    assets.insert_picture("plate", Picture { depth: Some(values), ..plate });
    assets.insert_picture("albedo", Picture::opaque(picture(|_, _| ALBEDO as f32), Encoding::LinearAcescg));
    let mut text = format!(
        "bansho = 2\n[picture]\nsize = {SIZE:?}\nframes = 1000\n[camera]\nposition = [0, 0, 0]\ntarget = [0, 0, -1]\nvertical_fov_deg = 90\nglare = 0\n\
         [plate]\nimage = \"plate\"\nexposure_ev100 = 6\n"
    );
    if is_lit {
        text += "albedo = \"albedo\"\n";
    }
    for index in 0..LAMPS {
        text += &format!(
            "[[light]]\nposition = {:?}\nvisible = false\nintensity = {{ keys = [[0, 100], [40, {}]] }}\n",
            lamp(index).to_array(),
            200 + index
        );
    }
    let scene = Scene::parse("bench.toml", &text, bansho::KINDS).expect("a valid scene");
    let compiled = Arc::new(CompiledScene::build(Arc::new(scene), Arc::new(assets), None).expect("a valid scene"));
    let plan = Arc::new(Plan::new(&compiled, &PlanOptions::default()).expect("a valid plan"));
    Shot::open(compiled, plan)
}

fn frame(shot: &mut Shot, number: i64) -> Frame {
    shot.advance(number, &Unobserved).expect("nobody cancels");
    shot.draw(&SceneLinear, &Unobserved).expect("nobody cancels")
}

/// The light of all lamps on each pixel, without shadows, one pixel at a time.
fn naive(intensity: f64) -> Vec<f32> {
    let point = |x: usize, y: usize| {
        DVec3::new((x as f64 + 0.5 - 640.0) / FOCAL, (360.0 - y as f64 - 0.5) / FOCAL, -1.0) * depth(x, y)
    };
    let mut light = vec![0.0; SIZE[0] * SIZE[1]];
    for y in 0..SIZE[1] - 1 {
        for x in 0..SIZE[0] - 1 {
            let here = point(x, y);
            let normal = (point(x, y + 1) - here).cross(point(x + 1, y) - here).normalize();
            let mut sum = 0.0;
            for index in 0..LAMPS {
                let toward = lamp(index) - here;
                let square = toward.length_squared();
                sum += intensity * toward.dot(normal).max(0.0) / (square * square.sqrt());
            }
            light[y * SIZE[0] + x] = (ALBEDO / std::f64::consts::PI * sum) as f32;
        }
    }
    light
}

/// Draws the next frame, and gives its memory back.
fn next_frame(shot: &mut Shot, number: &mut i64) -> [f32; 4] {
    *number = (*number + 1) % 1000;
    let frame = frame(shot, *number);
    let pixel = frame.beauty.at(700, 400);
    shot.recycle(frame);
    pixel
}

fn benches(criterion: &mut Criterion) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().expect("two threads");
    let mut group = criterion.benchmark_group("lit plate 1280x720, 6 lamps");
    group.sample_size(20);
    for (name, is_lit) in [("without light", false), ("flickering", true)] {
        let (mut shot, mut number) = (shot(is_lit), 0);
        group.bench_function(name, |bencher| {
            pool.install(|| bencher.iter(|| black_box(next_frame(&mut shot, &mut number))));
        });
    }
    group.sample_size(10);
    group.bench_function("first frame", |bencher| {
        pool.install(|| bencher.iter_with_setup(|| shot(true), |mut shot| black_box(frame(&mut shot, 0).content)));
    });
    group.bench_function("naive: pixel by pixel, without shadows", |bencher| {
        bencher.iter(|| black_box(naive(black_box(150.0))));
    });
    group.finish();
}

criterion_group!(lit_plate_benches, benches);
criterion_main!(lit_plate_benches);
