//! Two phenomena for tests of the traits: an absorber in closed form and a stepped emitter.

#[path = "../../examples/own_phenomenon/absorber.rs"]
mod absorber;
mod emitter;
mod planned;

use std::sync::Arc;

use bansho_base::{
    frame::Frame,
    host::{
        assets::{Assets, Encoding, MemoryAssets, Picture},
        observer::Unobserved,
    },
    image::Image,
    tables::{self, TableKind},
};
use bansho_render::{CompiledScene, PlanOptions, Shot};
use bansho_scene::{Scene, SceneError, SceneOptions};

pub(crate) use absorber::AbsorberParameters;
pub(crate) use emitter::EmitterParameters;
pub(crate) use planned::Planned;

/// The two phenomena.
pub(crate) fn phenomena() -> [TableKind; 2] {
    [AbsorberParameters::KIND, EmitterParameters::KIND]
}

/// The tables that phenomena share, and the two phenomena.
pub(crate) fn kinds() -> Vec<TableKind> {
    tables::shared(bansho::KINDS).copied().chain(phenomena()).collect()
}

/// A camera at the origin that looks along -z: 45 pixels per meter at 1 m if the picture is 90 pixels high.
pub(crate) const CAMERA: &str = "\
bansho = 2
[picture]
size = [120, 90]
fps = 24
exposure_ev100 = 0
[camera]
position = [0, 0, 0]
target = [0, 0, -1]
vertical_fov_deg = 90
";

pub(crate) fn parse(text: &str) -> Result<Scene, SceneError> {
    Scene::parse("test.toml", text, &kinds())
}

/// Reads a scene and builds all that it shows.
pub(crate) fn compiled(
    file: &str,
    text: &str,
    kinds: &[TableKind],
    assets: MemoryAssets,
) -> Result<CompiledScene, SceneError> {
    let scene = Arc::new(Scene::parse(file, text, kinds)?);
    CompiledScene::build(scene, Arc::new(assets), None).map_err(|errors| errors.located(file, text))
}

pub(crate) fn plan(text: &str, options: &PlanOptions) -> Planned {
    plan_with(text, options, Arc::new(MemoryAssets::default()))
}

pub(crate) fn plan_with(text: &str, options: &PlanOptions, assets: Arc<dyn Assets>) -> Planned {
    Planned::new(parse(text).unwrap_or_else(|error| panic!("{error}")), options, assets)
}

/// A loop of this length, s.
pub(crate) fn looped(text: &str, seconds: f64) -> Result<Planned, String> {
    let scene = parse(text).map_err(|error| error.to_string())?;
    let adapted = SceneOptions { loop_s: Some(seconds), ..SceneOptions::default() };
    Planned::of(scene, (&adapted, &PlanOptions::default()), Arc::new(MemoryAssets::default()))
}

pub(crate) fn draw(shot: &mut Shot, number: i64) -> Frame {
    bansho::draw(shot, number, &Unobserved).unwrap()
}

pub(crate) fn render(text: &str, options: &PlanOptions, number: i64) -> Frame {
    draw(&mut plan(text, options).open(), number)
}

/// Absolute luminance of a pixel value.
pub(crate) fn luminance(frame: &Frame, x: usize, y: usize) -> f64 {
    let [r, g, b, _] = frame.beauty.at(x, y);
    f64::from(bansho_base::color::luminance([r, g, b]))
        / bansho_base::color::exposure_scale(f64::from(frame.header.exposure_ev100))
}

pub(crate) fn channel<'a>(frame: &'a Frame, name: &str) -> &'a [f32] {
    let named = frame.channels.iter().find(|channel| channel.name == name);
    &named.unwrap_or_else(|| panic!("no channel {name}")).values
}

/// A checkerboard plate of 8-pixel squares with every pixel a different shade, `depth` meters away.
pub(crate) fn checkerboard(width: usize, height: usize, depth: Option<f32>) -> MemoryAssets {
    checkerboard_at(width, height, depth.map(|depth| vec![depth; width * height]))
}

/// The same with a depth for each pixel.
pub(crate) fn checkerboard_at(width: usize, height: usize, depth: Option<Vec<f32>>) -> MemoryAssets {
    let shade = |index: usize| {
        let (x, y) = (index % width, index / width);
        let code = if (x / 8 + y / 8) % 2 == 0 { 200 + (x * 7 + y) % 56 } else { (x + y * 5) % 60 };
        [code, code / 2, 255 - code, 255].map(|code| code as f32 / 255.0)
    };
    let color = Image::from_pixels(width, height, (0..width * height).map(shade).collect()).unwrap();
    let mut assets = MemoryAssets::default();
    assets.insert_picture("plate.png", Picture { depth, ..Picture::opaque(color, Encoding::DisplaySrgb) });
    assets
}
