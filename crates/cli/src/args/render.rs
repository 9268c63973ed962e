//! `bansho render`

use std::path::PathBuf;

use bansho::{
    AlphaConvention, BitDepth, Rect, View,
    job::{ContactBackground, FramesInFlight, Job, JobError},
};
use clap::Args;

use super::{
    shared::{InputArgs, OverwriteArgs, StateArgs, WorkArgs},
    values::{self, Frames},
};

/// Options of rendering.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  bansho render fire.toml                          PNG files in out/fire/
  bansho render fire.toml -o shot/fire.####.exr --layers --aovs
  bansho render fire.toml -o fire.mov              ProRes 4444 with alpha
  bansho render fire.toml -o fire.gif --loop 4 --size 320x180
  bansho render fire.toml --frames 0-239x10        every tenth frame
  bansho render fire.toml --contact-sheet 16       16 frames in one picture
  bansho render fire.toml --crop 600,200,128,128   a part of the picture
  bansho render fire.toml --set flame_sheet.height=1.2 --set wind.gust=0.5
  bansho render fire.toml --resume                 continue after interruption

A PNG composites exactly over black in programs with the convention of --alpha, an EXR over any background. Rendering can be interrupted at any time: finished frames are kept, and no file with a final name is incomplete.")]
pub(crate) struct RenderArgs {
    /// The scene file; `-` reads it from standard input.
    pub(crate) scene: PathBuf,

    /// Output files. The extension selects the format: .png .exr .apng .gif, and with ffmpeg .mp4 .mov .webm.
    /// `####` or `%04d` is replaced by the frame number. [default: out/SCENE/SCENE.####.png]
    #[arg(short, long, value_name = "PATH", help_heading = "Output")]
    out: Option<PathBuf>,
    /// Bits per channel of .png, .apng, .mov and .webm.
    #[arg(long, default_value = "8", value_parser = values::bits_parser(), help_heading = "Output")]
    bits: BitDepth,
    /// View transform of display formats; `raw` writes linear values, clamped to 0 to 1. [default: `picture.view` of the scene]
    #[arg(long, value_parser = values::view_parser(), help_heading = "Output")]
    view: Option<View>,
    /// Add the glare of the camera (`camera.glare`) to .exr too; with --layers as the layer `glare`. Pictures and films for display always have it.
    #[arg(long, help_heading = "Output")]
    glare: bool,
    /// Convention of straight alpha (.png .apng .mov .webm): `encoded` for programs that blend encoded values, such as browsers, 8-bit image
    /// editors and video players; `linear` for those that blend linear light, such as compositors. [default: encoded; linear for
    /// `--view raw`]
    #[arg(long, value_name = "CONVENTION", value_parser = values::alpha_parser(), help_heading = "Output")]
    alpha: Option<AlphaConvention>,
    /// Hide the sky, ground and lamps that the scene does not state, so that the picture keeps its alpha. Sky and lamps still light the scene.
    #[arg(long, help_heading = "Output")]
    transparent: bool,
    /// Write each phenomenon to a layer of its own (.exr).
    #[arg(long, help_heading = "Output")]
    layers: bool,
    /// Write AOVs such as temperature, optical depth and motion (.exr).
    #[arg(long, help_heading = "Output")]
    aovs: bool,
    /// Write a JSON file with metadata of the frame beside each picture, such as the rain rate and the visibility (.png, .exr).
    #[arg(long, help_heading = "Output")]
    metadata: bool,
    /// Draw N frames into one .png: the first N of several --frames, or N consecutive ones from a single frame on. The default of --out is then
    /// out/SCENE/SCENE.sheet.png.
    #[arg(long, value_name = "N", help_heading = "Output")]
    pub(crate) contact_sheet: Option<usize>,
    /// Background of the frames of a contact sheet.
    #[arg(
        long,
        default_value = "black",
        requires = "contact_sheet",
        value_parser = values::contact_background_parser(),
        help_heading = "Output"
    )]
    contact_background: ContactBackground,

    /// Frames: 0-239, 0-239x10 or 0-239:10 (every tenth), 17, -3-5, 1-5,9. Outside its own frames, a scene is continued, and a --loop is
    /// repeated. [default: all]
    #[arg(long, value_name = "SPEC", allow_hyphen_values = true, value_parser = values::parse_frames, help_heading = "Picture")]
    frames: Option<Frames>,
    /// Replace the scene's picture size.
    #[arg(long, value_name = "WIDTHxHEIGHT", value_parser = values::parse_size, help_heading = "Picture")]
    size: Option<[usize; 2]>,
    /// Draw only this rectangle of the picture, with the same pixels as in the whole picture.
    #[arg(long, value_name = "X,Y,W,H", value_parser = values::parse_crop, help_heading = "Picture")]
    crop: Option<Rect>,
    /// Make a seamless loop of this length, rounded to whole frames.
    #[arg(
        long = "loop",
        value_name = "SECONDS",
        allow_hyphen_values = true,
        value_parser = values::parse_seconds,
        help_heading = "Picture"
    )]
    loop_s: Option<f64>,
    /// Replace the scene's seed.
    #[arg(long, value_name = "N", allow_hyphen_values = true, value_parser = values::parse_seed, help_heading = "Picture")]
    seed: Option<u64>,
    /// Change a setting of the scene for this run. May be repeated. A name or number selects one of several phenomena:
    /// `flame_sheet.0.height=2`.
    #[arg(long, value_name = "KEY.PATH=VALUE", help_heading = "Picture")]
    set: Vec<String>,

    /// Keep existing frames that are complete and belong to this scene; draw all others. Only for .png and .exr files.
    #[arg(long, help_heading = "Work")]
    resume: bool,
    /// How many frames are drawn at once, where they do not follow from each other as in simulations: a number, or `auto`: one with fewer than 8 threads or
    /// over a plate, else up to one for each thread. The files are the same for any number.
    #[arg(long, value_name = "auto|N", default_value = "auto", allow_hyphen_values = true, value_parser = values::parse_frames_in_flight, help_heading = "Work")]
    frames_in_flight: FramesInFlight,
    #[command(flatten)]
    states: StateArgs,
    #[command(flatten)]
    inputs: InputArgs,
    #[command(flatten)]
    output: OverwriteArgs,
    #[command(flatten)]
    pub(crate) work: WorkArgs,
}

impl RenderArgs {
    /// The render job.
    pub(crate) fn job(&self) -> Result<Job, JobError> {
        let scene = self.inputs.read(&self.scene, &self.set)?;
        Ok(Job {
            scene,
            frames: self.frames.clone().map(|Frames(numbers)| numbers),
            size: self.size,
            crop: self.crop,
            seed: self.seed,
            loop_s: self.loop_s,
            transparent: self.transparent,
            layers: self.layers,
            aovs: self.aovs,
            metadata: self.metadata,
            view: self.view,
            scene_linear_glare: self.glare,
            bits: self.bits,
            alpha: self.alpha,
            out: self.out.clone(),
            contact_sheet: self.contact_sheet,
            contact_background: self.contact_background,
            resume: self.resume,
            frames_in_flight: self.frames_in_flight,
            overwrite: self.output.overwrite,
            snapshots: self.states.snapshots.clone(),
            snapshot_every: self.states.snapshot_every,
        })
    }
}
