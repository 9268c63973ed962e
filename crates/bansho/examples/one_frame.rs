//! One frame of a flame, drawn to memory: no files, no TOML.
//!
//! `cargo run --release --example one_frame` prints it as letters.

use std::{
    error::Error,
    io::{self, Write},
    sync::Arc,
};

use bansho::{
    CompiledScene, DisplayOptions, MemoryAssets, Plan, PlanOptions, SceneBuilder, Shot, Unobserved,
    base::frame::DisplayPixels, fire::sheet::FlameSheetParameters, scene::PictureParameters,
};

fn main() -> Result<(), Box<dyn Error>> {
    let picture = PictureParameters { size: [72, 36], ..Default::default() };
    let flame = FlameSheetParameters { width: 1.4, ..Default::default() };
    let scene = SceneBuilder::new().picture(&picture).phenomenon("fire", &flame).build()?;

    let compiled = Arc::new(CompiledScene::build(Arc::new(scene), Arc::new(MemoryAssets::default()), None)?);
    let plan = Plan::new(&compiled, &PlanOptions::default())?;
    let mut shot = Shot::open(compiled, Arc::new(plan));
    shot.advance(30, &Unobserved)?;
    let shown = shot.draw(&DisplayOptions::default(), &Unobserved)?.image; // 8 bits, sRGB

    let DisplayPixels::Eight(pixels) = &shown.pixels else { return Ok(()) };
    let mut text = String::new();
    for row in pixels.chunks(shown.width) {
        // Straight color times alpha is the light; alpha alone is near enough for letters.
        text.extend(row.iter().map(|pixel| char::from(b" .:-=+*#%@"[usize::from(pixel[3]) * 9 / 255])));
        text.push('\n');
    }
    io::stdout().write_all(text.as_bytes())?;
    Ok(())
}
