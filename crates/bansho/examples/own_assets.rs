//! Provides the pictures of a scene from memory, as an engine or an archive of assets would: here a plate that is generated on request.
//!
//! `cargo run --release -p bansho --example own_assets`

use std::{
    error::Error,
    io::{self, Write},
    sync::Arc,
};

use bansho::{
    Assets, Image, Plan, PlanOptions, Shot, Unobserved,
    base::{
        geometry::{mesh::Mesh, strokes::Drawing},
        host::assets::{AssetError, AssetProblem, Encoding, Picture},
    },
    compile_scene,
};

const SCENE: &str =
    "bansho = 2\n[picture]\nsize = [160, 90]\n[plate]\nimage = \"gradient\"\n[[rain]]\nrate_mm_per_h = 20.0\n";

/// Provides only one picture, `gradient`.
struct Procedural;

fn missing(path: &str) -> AssetError {
    AssetError { path: path.to_owned(), problem: AssetProblem::Missing }
}

impl Assets for Procedural {
    fn picture(&self, path: &str, _frame: i64) -> Result<Arc<Picture>, AssetError> {
        if path != "gradient" {
            return Err(missing(path));
        }
        let mut color = Image::filled(160, 90, [0.0; 4]);
        for (index, pixel) in color.pixels_mut().iter_mut().enumerate() {
            let height = 1.0 - (index / 160) as f32 / 90.0;
            *pixel = [0.2 * height, 0.25 * height, 0.3 * height, 1.0];
        }
        Ok(Arc::new(Picture::opaque(color, Encoding::DisplaySrgb)))
    }

    fn mesh(&self, path: &str) -> Result<Arc<Mesh>, AssetError> {
        Err(missing(path))
    }

    fn drawing(&self, path: &str) -> Result<Arc<Drawing>, AssetError> {
        Err(missing(path))
    }

    fn text(&self, path: &str) -> Result<Arc<str>, AssetError> {
        Err(missing(path))
    }

    /// Part of the fingerprints of frames: it must change if the contents of the asset change.
    fn digest(&self, path: &str, frame: i64) -> Result<[u8; 32], AssetError> {
        self.picture(path, frame).map(|_| [1; 32])
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let compiled = compile_scene("scene.toml", SCENE, Arc::new(Procedural))?;
    let plan = Plan::new(&compiled, &PlanOptions::default())?;
    let frame = bansho::draw(&mut Shot::open(compiled, Arc::new(plan)), 0, &Unobserved)?;
    let brightest = frame.beauty.pixels().iter().map(|pixel| pixel[1]).fold(0.0, f32::max);
    writeln!(io::stdout(), "rain over a plate: the brightest green is {brightest:.3} where 1 is display white")?;
    Ok(())
}
