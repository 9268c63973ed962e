//! Effects as a game uses them: a torch of 256 x 256 pixels to half floats while the wind changes every frame, on one thread and on two; late in a run, as
//! early in it; a change of a parameter.
//!
//! The naive ways beside them: the frame is converted pixel by pixel; the wind is a keyframed curve to which each frame adds a key; a changed
//! parameter is printed as text, parsed, and the whole scene is built again.

use std::{hint::black_box, sync::Arc};

use bansho::{
    Animated, Effect, FlameSheetParameters, LiveEffect, MemoryAssets, Plan, PlanOptions, RainParameters, SceneBuilder,
    Shot, Unobserved, WindParameters, base::color::srgb_from_acescg, base::math::curve::Interpolation, compile_scene,
    f16,
};
use criterion::{Criterion, criterion_group, criterion_main};
use rayon::{ThreadPool, ThreadPoolBuilder};

const SIZE: usize = 256;
const DT: f64 = 1.0 / 60.0;

fn torch() -> FlameSheetParameters {
    FlameSheetParameters { width: 0.4, height: 0.8, ..Default::default() }
}

fn pool(threads: usize) -> Arc<ThreadPool> {
    let cores = core_affinity::get_core_ids().unwrap_or_default();
    let pin = move |index: usize| {
        if let Some(core) = cores.get(index) {
            core_affinity::set_for_current(*core);
        }
    };
    Arc::new(ThreadPoolBuilder::new().num_threads(threads).start_handler(pin).build().expect("threads can be started"))
}

fn wind(frame: u32) -> [f64; 3] {
    [0.5 + 0.02 * f64::from(frame % 7), 0.0, 0.1]
}

fn frame(live: &mut LiveEffect, number: &mut u32, texture: &mut [f16]) {
    *number += 1;
    live.set_wind(wind(*number), 0.8).expect("the wind is possible");
    let picture = live.advance(DT).expect("the time is possible");
    picture.write_rgba16f(texture).expect("the buffer has the length of the picture");
}

fn effects(c: &mut Criterion) {
    let mut group = c.benchmark_group("torch 256x256");
    let mut texture = vec![f16::ZERO; SIZE * SIZE * 4];
    for threads in [1, 2] {
        let mut live = Effect::new(torch()).size(SIZE, SIZE).pool(pool(threads)).open().expect("it opens");
        let mut number = 0;
        group.bench_function(format!("{threads} threads"), |b| b.iter(|| frame(&mut live, &mut number, &mut texture)));
    }
    // A minute of frames later.
    let mut live = Effect::new(torch()).size(SIZE, SIZE).pool(pool(1)).open().expect("it opens");
    let mut number = 0;
    for _ in 0..3600 {
        number += 1;
        live.set_wind(wind(number), 0.8).expect("the wind is possible");
        live.advance(DT).expect("the time is possible");
    }
    group.bench_function("1 thread after a minute", |b| b.iter(|| frame(&mut live, &mut number, &mut texture)));

    // The same with a curve that gets a key with every frame: after a minute it has 3600.
    let keys = (0..3600).map(|frame| (f64::from(frame) * DT, wind(frame))).collect();
    let velocity = Animated::keyed(keys, Interpolation::Linear).expect("the keys ascend");
    let keyed = WindParameters { velocity, gust: 0.8, ..Default::default() };
    let mut live = Effect::new(torch()).wind(keyed).size(SIZE, SIZE).pool(pool(1)).open().expect("it opens");
    let mut t = 60.0;
    group.bench_function("naive: a keyframe for each frame, all parsed again", |b| {
        b.iter(|| {
            t += DT;
            let picture = live.at(t).expect("the time is possible");
            naive_rgba16f(picture.frame().beauty.pixels(), &mut texture);
            black_box(rekeyed(3600));
        });
    });
    group.finish();

    let mut group = c.benchmark_group("a changed parameter and its picture");
    let mut live = Effect::new(torch()).size(SIZE, SIZE).pool(pool(1)).open().expect("it opens");
    let mut width = 0.4;
    group.bench_function("live", |b| {
        b.iter(|| {
            width = 0.4 + (width - 0.4 + 1e-4) % 0.1;
            live.set_parameters("flame_sheet", FlameSheetParameters { width, ..torch() }).expect("it is possible");
            let picture = live.picture().expect("nothing stops it");
            picture.write_rgba16f(&mut texture).expect("the buffer has the length of the picture");
        });
    });
    group.bench_function("naive: printed, parsed, built and drawn", |b| {
        b.iter(|| {
            width = 0.4 + (width - 0.4 + 1e-4) % 0.1;
            let parameters = FlameSheetParameters { width, ..torch() };
            let text = SceneBuilder::new().phenomenon("flame_sheet", &parameters).to_toml();
            let compiled = compile_scene("scene", &text, Arc::new(MemoryAssets::default())).expect("it is valid");
            let options = PlanOptions { size: Some([SIZE, SIZE]), ..Default::default() };
            let plan = Plan::new(&compiled, &options).expect("the size is possible");
            let mut shot = Shot::open(compiled, Arc::new(plan));
            let frame = bansho::draw(&mut shot, 0, &Unobserved).expect("nothing stops it");
            naive_rgba16f(frame.beauty.pixels(), &mut texture);
        });
    });
    group.finish();

    let mut group = c.benchmark_group("rain 256x256");
    for threads in [1, 2] {
        let open = || Effect::new(RainParameters::default()).size(SIZE, SIZE).pool(pool(threads)).open();
        let mut live = open().expect("it opens");
        group.bench_function(format!("calm, {threads} threads"), |b| {
            b.iter(|| {
                let picture = live.advance(DT).expect("the time is possible");
                picture.write_rgba16f(&mut texture).expect("the buffer has the length of the picture");
            });
        });
        let (mut live, mut number) = (open().expect("it opens"), 0);
        group.bench_function(format!("gusts, {threads} threads"), |b| {
            b.iter(|| frame(&mut live, &mut number, &mut texture));
        });
    }
    // Light of lamps that is scattered anew for each frame, as when the camera moves.
    let mut live = Effect::new(RainParameters::default()).size(SIZE, SIZE).pool(pool(1)).open().expect("it opens");
    let mut camera = live.camera().clone();
    let ([x, y, z], mut shift) = (camera.position.at(0.0), 0.0);
    group.bench_function("naive: light of lamps scattered again, 1 thread", |b| {
        b.iter(|| {
            shift = (shift + 1e-4) % 0.1;
            camera.position = [x + shift, y, z].into();
            live.set_camera(camera.clone()).expect("the camera is possible");
            let picture = live.advance(DT).expect("the time is possible");
            picture.write_rgba16f(&mut texture).expect("the buffer has the length of the picture");
        });
    });
    group.finish();
}

/// A curve of `keys` keys, made again as for each new key.
fn rekeyed(keys: u32) -> Animated<[f64; 3]> {
    let keys = (0..keys).map(|frame| (f64::from(frame) * DT, wind(frame))).collect();
    Animated::keyed(keys, Interpolation::Linear).expect("the keys ascend")
}

fn naive_rgba16f(pixels: &[[f32; 4]], texture: &mut [f16]) {
    for ([r, g, b, a], out) in pixels.iter().zip(texture.chunks_mut(4)) {
        let [r, g, b] = srgb_from_acescg([*r, *g, *b]);
        for (out, value) in out.iter_mut().zip([r, g, b, *a]) {
            *out = f16::from_f32(value.clamp(0.0, 65504.0));
        }
    }
}

criterion_group!(benches, effects);
criterion_main!(benches);
