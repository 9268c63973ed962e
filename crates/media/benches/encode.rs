use bansho_base::image::{DisplayImage, DisplayPixels};
use bansho_media::png;
use criterion::{Criterion, criterion_group, criterion_main};
use std::hint::black_box;

fn hash(x: u32) -> u32 { let mut h = x.wrapping_mul(0x9E3779B9); h ^= h >> 15; h = h.wrapping_mul(0x85EBCA6B); h ^ (h >> 13) }

fn flame(width: usize, height: usize) -> DisplayImage {
    let pixels = (0..width * height).map(|i| {
        let (x, y) = ((i % width) as f32 / width as f32 - 0.5, 1.0 - (i / width) as f32 / height as f32);
        let r = (x * x * 14.0 + (y - 0.3) * (y - 0.3) * 3.0 + 0.12 * ((y * 40.0 + x * 31.0) % 1.0)).min(4.0);
        let e = (1.0 - r).max(0.0) * 255.0;
        let d = (hash(i as u32) & 255) as f32 / 256.0;
        let c = |k: f32| { if e == 0.0 { 0 } else { (e * k + d) as u32 as u8 } };
        let a = c(1.0);
        if a == 0 { [0, 0, 0, 0] } else { [255, (200.0 * e / 255.0 + d) as u8, (90.0 * e * e / 65025.0 + d) as u8, a] }
    }).collect();
    DisplayImage { width, height, opaque: false, pixels: DisplayPixels::Eight(pixels) }
}

fn bench(c: &mut Criterion) {
    let image = flame(1280, 720);
    let mut opaque = image.clone();
    opaque.opaque = true;
    for (name, im) in [("rgba", &image), ("rgb", &opaque)] {
        let data = if name == "rgba" { let DisplayPixels::Eight(p) = &im.pixels else { panic!() }; bytemuck::cast_slice::<_, u8>(p).to_vec() } else {
            let DisplayPixels::Eight(p) = &im.pixels else { panic!() }; p.iter().flat_map(|p| [p[0], p[1], p[2]]).collect() };
        use ::png::*;
        for (comp, cn) in [(DeflateCompression::FdeflateUltraFast, "fd"), (DeflateCompression::Level(1), "l1"), (DeflateCompression::Level(2), "l2"), (DeflateCompression::Level(3), "l3")] {
            for (fil, fname) in [(Filter::NoFilter, "none"), (Filter::Sub, "sub"), (Filter::Up, "up"), (Filter::Paeth, "paeth"), (Filter::Adaptive, "adaptive")] {
                let enc = || { let mut v = Vec::new(); let mut e = Encoder::new(&mut v, 1280, 720); e.set_color(if name == "rgba" { ColorType::Rgba } else { ColorType::Rgb }); e.set_depth(BitDepth::Eight);
                    e.set_deflate_compression(comp); e.set_filter(fil);
                    let mut w = e.write_header().unwrap(); w.write_image_data(&data).unwrap(); drop(w); v };
                let t = std::time::Instant::now();
                for _ in 0..5 { black_box(enc()); }
                println!("{name} {cn} {fname}: {} bytes {:?}", enc().len(), t.elapsed() / 5);
            }
        }
    }
    c.bench_function("x", |b| b.iter(|| black_box(png::encode(&image, &[0; 32], png::PngEffort::Fast))));
}
criterion_group!(benches, bench);
criterion_main!(benches);
