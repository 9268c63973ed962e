//! A custom phenomenon together with one of Bansho: a slab of fog in front of a flame.
//!
//! `cargo run --release -p bansho --example own_phenomenon` prints the luminance of the flame with and without the fog. The phenomenon
//! itself is in `absorber.rs`, whose documentation describes all parts.

mod absorber;

use std::{
    error::Error,
    io::{self, Write},
    sync::Arc,
};

use absorber::AbsorberParameters;
use bansho::{CompiledScene, KINDS, MemoryAssets, Plan, PlanOptions, Scene, Shot, Unobserved, base::color::luminance};

const FLAME: &str = "\
bansho = 2
[picture]
size = [64, 64]
exposure_ev100 = 10.0
[camera]
position = [0.0, 0.76, 2.75]
target = [0.0, 0.76, 0.0]
[[flame_sheet]]
";
const FOG: &str = "\
[[absorber]]
near = 0.5
far = 1.5
extinction = [0.7, 0.7, 0.7]
";

/// Mean luminance of a frame of the scene `text`, where 1 is display white.
fn mean_luminance(text: &str) -> Result<f64, Box<dyn Error>> {
    let kinds: Vec<_> = KINDS.iter().copied().chain([AbsorberParameters::KIND]).collect();
    let scene = Arc::new(Scene::parse("scene.toml", text, &kinds)?);
    let compiled = Arc::new(CompiledScene::build(scene, Arc::new(MemoryAssets::default()), None)?);
    let plan = Plan::new(&compiled, &PlanOptions::default())?;
    let frame = bansho::draw(&mut Shot::open(compiled, Arc::new(plan)), 0, &Unobserved)?;
    let pixels = frame.beauty.pixels();
    let sum: f64 = pixels.iter().map(|&[red, green, blue, _]| f64::from(luminance([red, green, blue]))).sum();
    Ok(sum / pixels.len() as f64)
}

fn main() -> Result<(), Box<dyn Error>> {
    let clear = mean_luminance(FLAME)?;
    let fogged = mean_luminance(&format!("{FLAME}{FOG}"))?;
    // Beer's law for 1 m of fog: exp(-0.7) = 0.497.
    writeln!(io::stdout(), "mean luminance {clear:.4} without fog, {fogged:.4} with it: {:.3} of it", fogged / clear)?;
    Ok(())
}
