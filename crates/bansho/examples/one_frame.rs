//! One frame of a flame, drawn to memory: no files, no TOML.
//!
//! `cargo run --release --example one_frame` prints it as letters.

use std::{
    error::Error,
    io::{self, Write},
    sync::Arc,
};

use bansho::{
    AlphaConvention, Backend, BitDepth, CpuBackend, MemoryAssets, Plan, PlanOptions, SceneBuilder, Unobserved, View,
    base::image::DisplayPixels, fire::sheet::FlameSheetParameters, render::scene::PictureParameters,
};

fn main() -> Result<(), Box<dyn Error>> {
    let picture = PictureParameters { size: [72, 36], ..Default::default() };
    let flame = FlameSheetParameters { width: 1.4, ..Default::default() };
    let assets = Arc::new(MemoryAssets::default());
    let scene = SceneBuilder::new().picture(&picture).phenomenon("fire", &flame).build(assets.as_ref())?;

    let plan = Plan::new(scene, &PlanOptions::default(), assets)?;
    let mut shot = CpuBackend.open(Arc::new(plan))?;
    let frame = bansho::draw(shot.as_mut(), 30, &Unobserved)?;

    let shown = bansho::display(&frame, &View::DISPLAY, BitDepth::Eight, AlphaConvention::Encoded);
    let DisplayPixels::Eight(pixels) = &shown.pixels else { return Ok(()) };
    let mut text = String::new();
    for row in pixels.chunks(shown.width) {
        // Straight colour times alpha is the light; alpha alone is near enough for letters.
        text.extend(row.iter().map(|pixel| char::from(b" .:-=+*#%@"[usize::from(pixel[3]) * 9 / 255])));
        text.push('\n');
    }
    io::stdout().write_all(text.as_bytes())?;
    Ok(())
}
