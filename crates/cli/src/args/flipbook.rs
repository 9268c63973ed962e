//! `bansho flipbook`

use std::path::PathBuf;

use bansho::{
    AlphaConvention, BitDepth, View,
    job::{Flipbook, FlipbookCrop, JobError},
};
use clap::Args;

use super::{
    input::InputArgs,
    values,
    work::{OverwriteArgs, WorkArgs},
};

/// The sheets that are wanted.
#[derive(Args, Debug)]
#[command(after_help = "\
Writes NAME_color.png (sRGB, straight alpha), NAME_alpha.png (the same alpha as gray), NAME_motion.png (16 bits: how far \
each pixel moves to the next frame) and NAME.json (grid, frame rate, rectangles, how to read the motion). As .exr: color is \
scene-linear with premultiplied alpha, motion is in pixels, and there is no alpha sheet.

Examples:
  bansho flipbook torch.toml --grid 8x8 --loop 2   64 frames, one turn of 2 s
  bansho flipbook torch.toml --grid 4x4 --size 128x256 -o game/torch.png")]
pub(crate) struct FlipbookArgs {
    /// The scene file; `-` reads it from standard input.
    pub(crate) scene: PathBuf,
    /// Columns and rows of the sheet; as many frames are drawn.
    #[arg(long, value_name = "COLUMNSxROWS", value_parser = values::parse_grid)]
    grid: [usize; 2],
    /// Size of one frame; with `--crop auto` of the whole picture. [default: such that the sheet has up to 2048 pixels]
    #[arg(long, value_name = "WIDTHxHEIGHT", value_parser = values::parse_size)]
    size: Option<[usize; 2]>,
    /// What of the picture frames show: what is lit in any of them, or all. [default: auto; none with --size]
    #[arg(long, value_name = "CROP", value_parser = values::flipbook_crop_parser())]
    crop: Option<FlipbookCrop>,
    /// Where it goes: NAME.png or NAME.exr. [default: out/SCENE/SCENE.png]
    #[arg(short, long, value_name = "PATH")]
    out: Option<PathBuf>,
    /// Fill the sheet with exactly one turn of a seamless loop of so many seconds; without it with the scene's first
    /// frames.
    #[arg(long = "loop", value_name = "SECONDS", allow_hyphen_values = true, value_parser = values::parse_seconds)]
    loop_s: Option<f64>,
    /// The first frame. [default: the scene's first]
    #[arg(long, value_name = "NUMBER", allow_hyphen_values = true)]
    first_frame: Option<i32>,
    /// Another seed than the scene's.
    #[arg(long, value_name = "N", allow_hyphen_values = true, value_parser = values::parse_seed)]
    seed: Option<u64>,
    /// Change a setting of the scene for this once; may be repeated.
    #[arg(long, value_name = "KEY.PATH=VALUE")]
    set: Vec<String>,
    /// Bits of each channel of the color and alpha sheets.
    #[arg(long, default_value = "8", value_parser = values::bits_parser())]
    bits: BitDepth,
    /// What straight alpha in .png is made for: engines that blend linear light (Unity, Unreal and Godot in 3-D, as usually
    /// set up), or
    /// `encoded` values (most user interfaces, three.js straight to the canvas). [default: linear]
    #[arg(long, value_name = "CONVENTION", value_parser = values::alpha_parser())]
    alpha: Option<AlphaConvention>,
    /// How the light is shown in .png.
    #[arg(long, default_value = "display", value_parser = values::view_parser())]
    view: View,
    #[command(flatten)]
    inputs: InputArgs,
    #[command(flatten)]
    output: OverwriteArgs,
    #[command(flatten)]
    pub(crate) work: WorkArgs,
}

impl FlipbookArgs {
    /// The flipbook that is asked for.
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
            out: self.out.clone(),
            overwrite: self.output.overwrite,
            ..Flipbook::new(scene, self.grid)
        })
    }
}
