//! Time to encode a frame, compared with a naive implementation.

use std::{hint::black_box, path::Path};

use bansho_base::{
    camera::CameraHeader,
    color::AlphaConvention,
    frame::{DisplayEncoding, DisplayImage, DisplayPixels, Frame, FrameHeader},
    image::{Image, Rect},
};
use bansho_media::{
    exr,
    files::naming::OutputPattern,
    format::OutputKind,
    output::{
        frame_file,
        sink::{FinishedPicture, FrameSlot, Sink, SinkOptions},
    },
    png,
};
use criterion::{Criterion, criterion_group, criterion_main};
use rayon::prelude::*;

const WIDTH: usize = 1280;
const HEIGHT: usize = 720;

fn noise(i: usize) -> f32 {
    let mut bits = (i as u32).wrapping_mul(0x9E37_79B9);
    bits = (bits ^ (bits >> 15)).wrapping_mul(0x85EB_CA6B);
    ((bits ^ (bits >> 13)) & 255) as f32 / 256.0
}

/// Intensity of a picture like a flame, 0 to 1: a soft shape with streaks that covers an eighth of the picture.
fn heat(i: usize) -> f32 {
    let (x, y) = ((i % WIDTH) as f32 / WIDTH as f32 - 0.5, 1.0 - (i / WIDTH) as f32 / HEIGHT as f32);
    let streaks = 0.12 * ((y * 40.0 + x * 31.0) % 1.0);
    (1.0 - (x * x * 14.0 + (y - 0.3) * (y - 0.3) * 3.0 + streaks)).max(0.0)
}

fn dithered(i: usize) -> [u8; 4] {
    let heat = heat(i);
    if heat == 0.0 {
        return [0; 4];
    }
    [255.0, 200.0 * heat, 90.0 * heat * heat, 255.0 * heat].map(|code| (code + noise(i)).min(255.0) as u8)
}

fn display() -> DisplayImage {
    let pixels = DisplayPixels::Eight((0..WIDTH * HEIGHT).map(dithered).collect());
    DisplayImage {
        width: WIDTH,
        height: HEIGHT,
        opaque: false,
        alpha: AlphaConvention::Linear,
        encoding: DisplayEncoding::Srgb,
        pixels,
    }
}

fn frame() -> Frame {
    let identity = std::array::from_fn(|i| std::array::from_fn(|j| if i == j { 1.0 } else { 0.0 }));
    let camera = CameraHeader {
        world_to_camera: identity,
        world_to_ndc: Some(identity),
        vertical_fov_deg: Some(40.0),
        lens: None,
        fisheye_fov_deg: None,
    };
    let header = FrameHeader {
        number: 1,
        exposure_ev100: 7.0,
        white_balance_k: None,
        fps: [24, 1],
        exposure_time_s: 0.02,
        camera,
        fingerprint: [7; 32],
        display_size: [WIDTH, HEIGHT],
        data_origin: [0, 0],
    };
    let pixels =
        (0..WIDTH * HEIGHT).map(|i| [3.0, 1.2, 0.3, 1.0].map(|c| c * heat(i) * (1.0 + 0.01 * noise(i)))).collect();
    let depth = (0..WIDTH * HEIGHT).map(|i| if heat(i) > 0.0 { 4.0 } else { f32::INFINITY }).collect();
    let beauty = Image::from_pixels(WIDTH, HEIGHT, pixels).expect("as many pixels as the size says");
    let content = Rect::from_size(beauty.width(), beauty.height());
    Frame { header, beauty, depth: Some(depth), channels: Vec::new(), opaque: false, content, metadata: Vec::new() }
}

/// Naive: the encoder's default filter and compression.
fn plain_png(pixels: &[[u8; 4]]) -> Vec<u8> {
    let mut file = Vec::new();
    let mut encoder = ::png::Encoder::new(&mut file, WIDTH as u32, HEIGHT as u32);
    encoder.set_color(::png::ColorType::Rgba);
    encoder.set_depth(::png::BitDepth::Eight);
    let mut writer = encoder.write_header().expect("a header");
    writer.write_image_data(pixels.as_flattened()).expect("pixels");
    writer.finish().expect("an end");
    file
}

/// Naive: the same channels and compression by the writer of the `exr` crate, which calls a closure for every pixel.
fn plain_exr(frame: &Frame) -> Vec<u8> {
    use ::exr::prelude::{Blocks, Compression, Encoding, Image, LineOrder, SpecificChannels, Vec2, WritableImage};
    let half = half::f16::from_f32;
    let depth = frame.depth.as_deref().unwrap_or_default();
    let names = SpecificChannels::build().with_channel("R").with_channel("G").with_channel("B").with_channel("A");
    let channels = names.with_channel("Z").with_pixel_fn(|Vec2(x, y)| {
        let [r, g, b, a] = frame.beauty.at(x, y);
        (half(r), half(g), half(b), half(a), depth[y * WIDTH + x])
    });
    let mut file = std::io::Cursor::new(Vec::new());
    let blocks = Blocks::ScanLines;
    let encoding = Encoding { compression: Compression::ZIP16, blocks, line_order: LineOrder::Increasing };
    let image = Image::from_encoded_channels((WIDTH, HEIGHT), encoding, channels);
    image.write().non_parallel().to_buffered(&mut file).expect("in memory");
    file.into_inner()
}

const FILM_FRAMES: usize = 8;

/// A short GIF, written as the program does.
fn gif_film(picture: &DisplayImage, folder: &Path) {
    let pattern = OutputPattern::parse(&folder.join("a.gif"), FILM_FRAMES).expect("a name");
    let sink = Sink::open(pattern, SinkOptions::new([WIDTH, HEIGHT], [24, 1], FILM_FRAMES)).expect("a sink");
    (0..FILM_FRAMES).into_par_iter().for_each(|index| {
        sink.write(FrameSlot { index, number: 0 }, FinishedPicture::Display(picture, &[0; 32])).expect("a frame");
    });
    sink.finish().expect("a film");
}

/// Naive: a palette for each frame by the `gif` crate, which shimmers.
fn plain_gif(pixels: &[[u8; 4]]) -> Vec<u8> {
    let mut file = Vec::new();
    let mut encoder = ::gif::Encoder::new(&mut file, WIDTH as u16, HEIGHT as u16, &[]).expect("a header");
    for _ in 0..FILM_FRAMES {
        let mut pixels = pixels.to_vec();
        let frame = ::gif::Frame::from_rgba_speed(WIDTH as u16, HEIGHT as u16, pixels.as_flattened_mut(), 10);
        encoder.write_frame(&frame).expect("a frame");
    }
    drop(encoder);
    file
}

fn film(criterion: &mut Criterion) {
    let (picture, folder) = (display(), tempfile::tempdir().expect("a folder"));
    let DisplayPixels::Eight(pixels) = &picture.pixels else { return };
    let mut group = criterion.benchmark_group("gif of 8 frames 1280x720");
    group.sample_size(10);
    group.bench_function("one palette", |bencher| bencher.iter(|| gif_film(&picture, folder.path())));
    group.bench_function("plain", |bencher| bencher.iter(|| black_box(plain_gif(pixels))));
    group.finish();
}

fn png_frame(criterion: &mut Criterion) {
    let picture = display();
    let encode = || png::encode(&picture, &[7; 32], png::PngEffort::Fast, Path::new("a.png")).expect("a picture");
    let DisplayPixels::Eight(pixels) = &picture.pixels else { return };
    let mut group = criterion.benchmark_group("png 1280x720");
    group.bench_function("fast", |bencher| bencher.iter(|| black_box(encode())));
    group.bench_function("plain", |bencher| bencher.iter(|| black_box(plain_png(pixels))));
    let file = encode();
    group.bench_function("is it whole", |bencher| {
        bencher.iter(|| black_box(frame_file::fingerprint(&file, OutputKind::Png)));
    });
    group.finish();
}

fn exr_frame(criterion: &mut Criterion) {
    let frame = frame();
    let mut group = criterion.benchmark_group("exr 1280x720");
    let encode = || exr::encode(&frame, Path::new("a.exr")).expect("a frame");
    group.bench_function("blocks in parallel", |bencher| bencher.iter(|| black_box(encode())));
    group.bench_function("plain", |bencher| bencher.iter(|| black_box(plain_exr(&frame))));
    let file = encode();
    group.bench_function("is it whole", |bencher| {
        bencher.iter(|| black_box(frame_file::fingerprint(&file, OutputKind::Exr)));
    });
    group.finish();
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(20);
    targets = png_frame, exr_frame, film
}
criterion_main!(benches);
