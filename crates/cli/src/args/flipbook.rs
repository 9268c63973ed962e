//! `bansho flipbook`

use std::path::PathBuf;

use bansho::{
    AlphaConvention, BitDepth, View,
    job::{Flipbook, FlipbookCrop, JobError},
};
use clap::Args;

use super::{
    shared::{InputArgs, OverwriteArgs, WorkArgs},
    values,
};

/// Options of a flipbook.
#[derive(Args, Debug)]
#[command(after_help = "\
Writes NAME_color.png (sRGB, straight alpha), NAME_alpha.png (the same alpha as gray), NAME_motion.png (16 bits: the \
motion of each pixel to the next frame) and NAME.json (grid, frame rate, rectangles, encoding of the motion). With .exr, color is \
scene-linear with premultiplied alpha, motion is in pixels, and there is no alpha sheet.

Examples:
  bansho flipbook torch.toml --grid 8x8 --loop 2   64 frames, a loop of 2 s
  bansho flipbook torch.toml --grid 4x4 --size 128x256 -o game/torch.png")]
pub(crate) struct FlipbookArgs {
    /// The scene file; `-` reads it from standard input.
    pub(crate) scene: PathBuf,
    /// Columns and rows of the sheet. Their product is the number of frames.
    #[arg(long, value_name = "COLUMNSxROWS", value_parser = values::parse_grid)]
    grid: [usize; 2],
    /// Size of one frame; with `--crop auto`, of the whole picture. [default: the sheet is up to 2048 pixels wide or high]
    #[arg(long, value_name = "WIDTHxHEIGHT", value_parser = values::parse_size)]
    size: Option<[usize; 2]>,
    /// Crop the frames to the part of the picture that is lit in any of them, or not at all. [default: auto; none with --size]
    #[arg(long, value_name = "CROP", value_parser = values::flipbook_crop_parser())]
    crop: Option<FlipbookCrop>,
    /// Output: NAME.png or NAME.exr. [default: out/SCENE/SCENE.png]
    #[arg(short, long, value_name = "PATH")]
    out: Option<PathBuf>,
    /// Fill the sheet with a seamless loop of this length. If omitted, the sheet has consecutive frames of the scene.
    #[arg(long = "loop", value_name = "SECONDS", allow_hyphen_values = true, value_parser = values::parse_seconds)]
    loop_s: Option<f64>,
    /// Number of the first frame. [default: the scene's first]
    #[arg(long, value_name = "NUMBER", allow_hyphen_values = true)]
    first_frame: Option<i32>,
    /// Replace the scene's seed.
    #[arg(long, value_name = "N", allow_hyphen_values = true, value_parser = values::parse_seed)]
    seed: Option<u64>,
    /// Change a setting of the scene for this run. May be repeated.
    #[arg(long, value_name = "KEY.PATH=VALUE")]
    set: Vec<String>,
    /// Bits per channel of the color and alpha sheets.
    #[arg(long, default_value = "8", value_parser = values::bits_parser())]
    bits: BitDepth,
    /// Convention of straight alpha in .png: `linear` for engines that blend linear light (Unity, Unreal and Godot in 3-D with their usual
    /// settings), `encoded` for those that blend encoded values (most user interfaces, three.js directly to the canvas). [default: linear]
    #[arg(long, value_name = "CONVENTION", value_parser = values::alpha_parser())]
    alpha: Option<AlphaConvention>,
    /// Also write NAME.gltf: the lights of the flames as animated point lights, which engines and Blender import.
    #[arg(long)]
    gltf: bool,
    /// View transform of .png. [default: `picture.view` of the scene]
    #[arg(long, value_parser = values::view_parser())]
    view: Option<View>,
    #[command(flatten)]
    inputs: InputArgs,
    #[command(flatten)]
    output: OverwriteArgs,
    #[command(flatten)]
    pub(crate) work: WorkArgs,
}

impl FlipbookArgs {
    /// The flipbook job.
    pub(crate) fn flipbook(&self) -> Result<Flipbook, JobError> {
        let scene = self.inputs.read(&self.scene, &self.set)?;
        Ok(Flipbook {
            tile: self.size,
            crop: self.crop.unwrap_or(if self.size.is_some() { FlipbookCrop::None } else { FlipbookCrop::Auto }),
            first_frame: self.first_frame.map(i64::from),
            seed: self.seed,
            loop_s: self.loop_s,
            view: self.view,
            bits: self.bits,
            alpha: self.alpha,
            gltf: self.gltf,
            out: self.out.clone(),
            overwrite: self.output.overwrite,
            ..Flipbook::new(scene, self.grid)
        })
    }
}
