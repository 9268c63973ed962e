//! `bansho streaks`

use std::path::PathBuf;

use bansho::{
    BitDepth,
    job::{StreakFormat, Streaks},
    rain::{DropCountLaw, OpacityLaw, VelocityLaw, billboards::texture::StreakCube},
};

use super::{
    shared::{OverwriteArgs, WorkArgs},
    values::{self, Numbers},
};
use clap::Args;

/// Options of streak textures; the defaults give the 24 textures of Yoshida, Dobashi and Yamamoto.
#[derive(Args, Debug)]
#[command(after_help = "\
Each texture shows all drops of one diameter in a cube of air, from the side, during one exposure. The value of a pixel is \
the fraction of it that drops cover (opacity). The textures tile: a streak that leaves at an edge enters at the opposite one. Values are linear; \
streaks.json describes how to read them, and lists every drop with its diameter, velocity, opacity and position.

Examples:
  bansho streaks                                   24 textures in out/streaks/
  bansho streaks --rates 50 --diameters 0.5,1,2,4 --exposure-time 1/60 -o heavy
  bansho streaks --format exr --light-direction 0,0.3,-1   lit from behind
  bansho streaks --opacity paper --bits 8          to the letter of the paper
  bansho streaks --cube-size 0.25 --size 2048 --variants 8")]
pub(crate) struct StreaksArgs {
    /// Rain rates R, ascending, mm/h.
    #[arg(long, value_name = "R,...", default_value = "1,5,10,20", allow_hyphen_values = true, value_parser = values::parse_numbers)]
    rates: Numbers,
    /// Drop diameters D, ascending, mm. Each is a bin that extends half way to its neighbors.
    #[arg(
        long,
        value_name = "D,...",
        default_value = "1,1.2,1.4,1.6,1.8,2",
        allow_hyphen_values = true,
        value_parser = values::parse_numbers
    )]
    diameters: Numbers,
    /// Exposure time: seconds, such as 0.02 or 1/30.
    #[arg(long, value_name = "SECONDS", default_value = "1/30", allow_hyphen_values = true, value_parser = values::parse_exposure)]
    exposure_time: f64,
    /// Width and height of a texture, pixels.
    #[arg(long, value_name = "PIXELS", default_value_t = 512)]
    size: usize,
    /// Edge of the cube of air, m.
    #[arg(long, value_name = "METERS", default_value_t = 1.0, allow_hyphen_values = true)]
    cube_size: f64,
    /// Terminal velocity of drops: as measured by Gunn and Kinzer, or by the paper's formula for a rigid sphere.
    #[arg(long, default_value = "gunn_kinzer", value_parser = values::velocity_parser())]
    terminal_velocity: VelocityLaw,
    /// Opacity of streaks: the fraction of the exposure during which the drop covers a point, or the paper's 2 D / v for lines of uniform opacity.
    #[arg(long, default_value = "exposure_fraction", value_parser = values::opacity_parser())]
    opacity: OpacityLaw,
    /// Number of drops of a diameter: n(D) integrated over its bin, or n(D) itself as the paper says, per millimeter.
    #[arg(long, default_value = "bin", value_parser = values::drop_count_parser())]
    drop_count: DropCountLaw,
    /// Sample the diameter of each drop within its bin, from the drop size distribution.
    #[arg(long)]
    vary_diameter: bool,
    /// Number of textures with different drops for each rate and diameter.
    #[arg(long, value_name = "N", default_value_t = 1)]
    variants: u32,
    /// Seed of the positions of the drops.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Light the drops by a distant light; the vector toward it: right, up, toward the viewer.
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = values::parse_vector)]
    light_direction: Option<[f64; 3]>,
    /// Amplitude of the brightness of lit streaks as their drops oscillate, 0 to 1; with --light-direction.
    #[arg(long, value_name = "AMPLITUDE", default_value_t = 0.0, allow_hyphen_values = true)]
    oscillation: f64,

    /// Output folder. [default: out/streaks]
    #[arg(short, long, value_name = "DIR", help_heading = "Output")]
    out: Option<PathBuf>,
    /// File format of the textures.
    #[arg(long, default_value = "png", value_parser = values::streak_format_parser(), help_heading = "Output")]
    format: StreakFormat,
    /// Bits per channel of .png.
    #[arg(long, default_value = "16", value_parser = values::bits_parser(), help_heading = "Output")]
    bits: BitDepth,
    #[command(flatten)]
    output: OverwriteArgs,
    #[command(flatten)]
    pub(crate) work: WorkArgs,
}

impl StreaksArgs {
    /// The streak texture job.
    pub(crate) fn streaks(&self) -> Streaks {
        let Numbers(rates) = self.rates.clone();
        let Numbers(diameters) = self.diameters.clone();
        let cube = StreakCube {
            edge: self.cube_size,
            size: self.size,
            exposure: self.exposure_time,
            opacity: self.opacity,
            drop_count: self.drop_count,
            spread: self.vary_diameter,
            ..StreakCube::default()
        };
        Streaks {
            rates,
            diameters,
            cube,
            law: self.terminal_velocity,
            variants: self.variants,
            seed: self.seed,
            light: self.light_direction,
            oscillation: self.oscillation,
            format: self.format,
            bits: self.bits,
            out: self.out.clone(),
            overwrite: self.output.overwrite,
        }
    }
}
