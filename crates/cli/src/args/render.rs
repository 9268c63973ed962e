//! `bansho render`

use std::path::PathBuf;

use bansho::{
    AlphaConvention, BitDepth, Rect, View,
    job::{ContactBackground, Job, JobError},
};
use clap::Args;

use super::{
    input::InputArgs,
    values::{self, Frames},
    work::{OverwriteArgs, StateArgs, WorkArgs},
};

/// What to draw, how, and where it goes.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  bansho render fire.toml                          PNG files in out/fire/
  bansho render fire.toml -o shot/fire.####.exr --layers --aovs
  bansho render fire.toml -o fire.mov              ProRes 4444 with alpha
  bansho render fire.toml -o fire.gif --loop 4 --size 320x180
  bansho render fire.toml --frames 0-239x10        every tenth frame
  bansho render fire.toml --contact-sheet 16       16 frames in one picture
  bansho render fire.toml --crop 600,200,128,128   the same part of the whole
  bansho render fire.toml --set flame_sheet.height=1.2 --set wind.gust=0.5
  bansho render fire.toml --resume                 go on after an interruption

A PNG is exact over black in programs that blend as --alpha says; an EXR is exact over anything. Interrupt at any time: whole frames stay, and nothing half-written bears a final name.")]
pub(crate) struct RenderArgs {
    /// The scene file; `-` reads it from standard input.
    pub(crate) scene: PathBuf,

    /// Where frames go; the extension says what they are: .png .exr .apng .gif, and by ffmpeg .mp4 .mov .webm.
    /// `####` or `%04d` stands for the frame number. [default: out/SCENE/SCENE.####.png]
    #[arg(short, long, value_name = "PATH", help_heading = "Output")]
    out: Option<PathBuf>,
    /// Bits of each channel of .png, .apng, .mov and .webm.
    #[arg(long, default_value = "8", value_parser = values::bits_parser(), help_heading = "Output")]
    bits: BitDepth,
    /// How the light is shown in formats that are made to be looked at; `raw` writes the numbers, clamped to 0 to 1.
    #[arg(long, default_value = "display", value_parser = values::view_parser(), help_heading = "Output")]
    view: View,
    /// What straight alpha is made for (.png .apng .mov .webm): `encoded` for programs that blend encoded values, as browsers, 8-bit image
    /// editors and video players do; `linear` for those that blend linear light, as compositors do. [default: encoded; linear for
    /// `--view raw`]
    #[arg(long, value_name = "CONVENTION", value_parser = values::alpha_parser(), help_heading = "Output")]
    alpha: Option<AlphaConvention>,
    /// Leave out the sky, ground and lamps that the scene does not state, so that the picture keeps its alpha. Sky and lamps still light it.
    #[arg(long, help_heading = "Output")]
    transparent: bool,
    /// Give each phenomenon a layer of its own (.exr).
    #[arg(long, help_heading = "Output")]
    layers: bool,
    /// Write temperature, optical depth, motion and the like (.exr).
    #[arg(long, help_heading = "Output")]
    aovs: bool,
    /// Write a JSON file beside each picture with metadata of its frame, such as the rain rate and the visibility (.png, .exr).
    #[arg(long, help_heading = "Output")]
    metadata: bool,
    /// One .png of N frames: the first N of several --frames, or N consecutive ones from a single frame on. [default out:
    /// out/SCENE/SCENE.sheet.png]
    #[arg(long, value_name = "N", help_heading = "Output")]
    contact_sheet: Option<usize>,
    /// What the frames of a contact sheet are laid over.
    #[arg(
        long,
        default_value = "black",
        requires = "contact_sheet",
        value_parser = values::contact_background_parser(),
        help_heading = "Output"
    )]
    contact_background: ContactBackground,

    /// Frames: 0-239, 0-239x10 or 0-239:10 (every tenth), 17, -3-5, 1-5,9. Beyond the scene's own frames it goes on as
    /// if it were longer; beyond those of a --loop it repeats. [default: all]
    #[arg(long, value_name = "SPEC", allow_hyphen_values = true, value_parser = values::parse_frames, help_heading = "Picture")]
    frames: Option<Frames>,
    /// Another picture size than the scene's.
    #[arg(long, value_name = "WIDTHxHEIGHT", value_parser = values::parse_size, help_heading = "Picture")]
    size: Option<[usize; 2]>,
    /// Only this part of the picture, identical to the same part of the whole.
    #[arg(long, value_name = "X,Y,W,H", value_parser = values::parse_crop, help_heading = "Picture")]
    crop: Option<Rect>,
    /// A seamless loop of about so many seconds, rounded to whole frames.
    #[arg(
        long = "loop",
        value_name = "SECONDS",
        allow_hyphen_values = true,
        value_parser = values::parse_seconds,
        help_heading = "Picture"
    )]
    loop_s: Option<f64>,
    /// Another seed than the scene's.
    #[arg(long, value_name = "N", allow_hyphen_values = true, value_parser = values::parse_seed, help_heading = "Picture")]
    seed: Option<u64>,
    /// Change a setting of the scene for this once; may be repeated. A name or number picks one phenomenon of many:
    /// `flame_sheet.0.height=2`.
    #[arg(long, value_name = "KEY.PATH=VALUE", help_heading = "Picture")]
    set: Vec<String>,

    /// Keep frames that are there already, whole, and of this very scene; draw all others. Only for .png and .exr files.
    #[arg(long, help_heading = "Work")]
    resume: bool,
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
    /// The job that is asked for.
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
            figures: self.metadata,
            view: self.view,
            bits: self.bits,
            alpha: self.alpha,
            out: self.out.clone(),
            contact_sheet: self.contact_sheet,
            contact_background: self.contact_background,
            resume: self.resume,
            overwrite: self.output.overwrite,
            snapshots: self.states.snapshots.clone(),
            snapshot_every: self.states.snapshot_every,
        })
    }
}
