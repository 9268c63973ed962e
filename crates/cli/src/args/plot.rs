//! `bansho plot`

use std::path::PathBuf;

use bansho::{
    aurora::{
        SpectrumShape,
        physics::precipitation::energy_grid::{HIGHEST_EV, LOWEST_EV},
    },
    base::color::blackbody::{HIGHEST_K, LOWEST_K},
    rain::VelocityLaw,
};
use clap::{
    Args, Subcommand,
    builder::{PossibleValuesParser, TypedValueParser},
};

use super::{
    shared::OverwriteArgs,
    values::{self, Numbers},
};

/// What to plot.
#[derive(Args, Debug)]
#[command(after_help = "\
The extension of --out says the format: .svg (the default), .png, or .csv with the numbers.

Examples:
  bansho plot black-body                          out/plots/black-body.svg
  bansho plot black-body -o black_body.csv        a table for a shader
  bansho plot black-body --texture srgb           a texture, a texel for 1 K
  bansho plot drop-sizes --rates 1,10,100 -o -    numbers to standard output
  bansho plot emission --energy-ev 3000 -o 3kev.png
  bansho plot parameters torch.toml --path wind.velocity")]
pub(crate) struct PlotArgs {
    #[command(subcommand)]
    pub(crate) what: PlotCommand,
}

/// The curves that can be plotted.
#[derive(Debug, Subcommand)]
pub(crate) enum PlotCommand {
    /// Luminance and color of black bodies by temperature (Inagaki et al., figure 1); the CSV is a table for shaders.
    BlackBody(BlackBodyArgs),
    /// The poly6 kernel, its gradient and their line integrals; the textures of Inagaki et al., figures 2 and 3.
    Kernel(KernelArgs),
    /// Deflection of light by the hot gas of a scene, as a picture (Inagaki et al., figure 4).
    Deflection(DeflectionArgs),
    /// Drop size distributions of Marshall and Palmer (1948) by rain rate.
    DropSizes(DropSizesArgs),
    /// Terminal velocity of raindrops by diameter: both laws, and the measurements of Gunn and Kinzer (1949).
    TerminalVelocity(TerminalVelocityArgs),
    /// Opacity of rain streaks by drop diameter and exposure time.
    StreakOpacity(StreakOpacityArgs),
    /// Illuminance along the beam of a lamp in rain by distance, and across it by angle.
    Beam(BeamArgs),
    /// Volume emission rate of the auroral lines by altitude.
    Emission(EmissionArgs),
    /// Ionization, and so the deposited energy, by altitude and energy of the electrons (Fang et al. 2010).
    Deposition(DepositionArgs),
    /// Fraction of excited atoms and molecules that radiate before a collision quenches them, by altitude.
    Quenching(QuenchingArgs),
    /// Keyed parameters of a scene over time.
    Parameters(ParametersArgs),
    /// Sharpening and color curves of a flame sheet in a scene (Ohshima & Itahashi, eqs. (6) and (7)).
    TransferCurves(TransferCurvesArgs),
    /// Thresholds, widths, speeds and edges of a flame sheet in a scene (Ohshima & Itahashi, figures 2, 6 and 7).
    FlameShape(FlameShapeArgs),
    /// Height, lit area, pieces and pale part of the flame in a scene over its frames, by which flames can be compared (Ohshima & Itahashi, section 5).
    FlameStatistics(FlameStatisticsArgs),
    /// The numbers of the JSON files that `bansho render --metadata` wrote, over the frames.
    Metadata(MetadataArgs),
}

/// Where the figure goes.
#[derive(Args, Debug)]
pub(crate) struct PlotOutputArgs {
    /// The file: .svg, .png or .csv; `-` writes CSV to standard output; a picture without axes is a .png. [default: out/plots/NAME.svg or
    /// .png, by the curve's name]
    #[arg(short, long, value_name = "PATH", help_heading = "Output")]
    pub(crate) out: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) policy: OverwriteArgs,
}

/// `bansho plot black-body`
#[derive(Args, Debug)]
pub(crate) struct BlackBodyArgs {
    /// Lowest temperature.
    #[arg(long, value_name = "K", default_value = "1", allow_hyphen_values = true, value_parser = parse_kelvin)]
    pub(crate) from: f64,
    /// Highest temperature.
    #[arg(long, value_name = "K", default_value = "10000", allow_hyphen_values = true, value_parser = parse_kelvin)]
    pub(crate) to: f64,
    /// Between two rows of the table.
    #[arg(long, value_name = "K", default_value = "1", allow_hyphen_values = true, value_parser = parse_step)]
    pub(crate) step: f64,
    /// Write a texture instead, without axes: a .png that is one pixel high, with one pixel for each row of the table. Each color is
    /// scaled so that its brightest channel is 1; negative values are 0, and bodies below 1e-6 cd/m^2 are black.
    #[arg(long, value_name = "ENCODING")]
    pub(crate) texture: Option<ColorTexture>,
    #[command(flatten)]
    pub(crate) output: PlotOutputArgs,
}

/// Encoding of a texture of colors.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum ColorTexture {
    /// 8 bits, sRGB-encoded.
    Srgb,
    /// 16 bits, linear, with the primaries of sRGB.
    Linear,
}

/// `bansho plot kernel`
#[derive(Args, Debug)]
pub(crate) struct KernelArgs {
    /// Write a texture instead, without axes: a .png of 8 bits, linear.
    #[arg(long, value_name = "WHAT")]
    pub(crate) texture: Option<KernelTexture>,
    /// Side of the texture, pixels.
    #[arg(long, value_name = "N", default_value = "64", allow_hyphen_values = true, value_parser = parse_side)]
    pub(crate) size: usize,
    #[command(flatten)]
    pub(crate) output: PlotOutputArgs,
}

/// What a texture of the kernel holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum KernelTexture {
    /// Poly6, 0 to 255 (figure 2).
    Density,
    /// The direction in which hot gas deflects light, outward by the gradient of poly6: x to the right, y up and z toward the viewer as red, green
    /// and blue; -1 is 0, none is 128, 1 is 255 (figure 3).
    Deflection,
}

/// `bansho plot deflection`
#[derive(Args, Debug)]
pub(crate) struct DeflectionArgs {
    /// The scene file; `-` reads it from standard input.
    pub(crate) scene: PathBuf,
    /// Number of the frame.
    #[arg(long, value_name = "N", default_value = "0", allow_hyphen_values = true)]
    pub(crate) frame: i64,
    /// Angle that is shown as 0 or 255. [default: the largest of the frame]
    #[arg(long, value_name = "RAD", allow_hyphen_values = true, value_parser = parse_angle)]
    pub(crate) full_scale: Option<f64>,
    #[command(flatten)]
    pub(crate) output: PlotOutputArgs,
}

/// `bansho plot drop-sizes`
#[derive(Args, Debug)]
pub(crate) struct DropSizesArgs {
    /// Rain rates R, mm/h.
    #[arg(long, value_name = "R,...", default_value = "1,5,20,50", allow_hyphen_values = true, value_parser = parse_rates)]
    pub(crate) rates: Numbers,
    #[command(flatten)]
    pub(crate) output: PlotOutputArgs,
}

/// `bansho plot terminal-velocity`
#[derive(Args, Debug)]
pub(crate) struct TerminalVelocityArgs {
    #[command(flatten)]
    pub(crate) output: PlotOutputArgs,
}

/// `bansho plot streak-opacity`
#[derive(Args, Debug)]
pub(crate) struct StreakOpacityArgs {
    /// Exposure times T: seconds, such as 0.02 or 1/30.
    #[arg(
        long,
        value_name = "T,...",
        default_value = "1/30,1/60,1/125,1/250,1/1000",
        allow_hyphen_values = true,
        value_parser = parse_exposure_times
    )]
    pub(crate) exposure_times: Numbers,
    /// How fast drops fall: as measured by Gunn and Kinzer, or by the paper's formula for a rigid sphere.
    #[arg(long, default_value = "gunn_kinzer", value_parser = values::velocity_parser())]
    pub(crate) terminal_velocity: VelocityLaw,
    #[command(flatten)]
    pub(crate) output: PlotOutputArgs,
}

/// `bansho plot beam`
#[derive(Args, Debug)]
pub(crate) struct BeamArgs {
    /// Luminous intensity on the axis, cd, as `intensity` of a scene's light.
    #[arg(long, value_name = "CD", default_value = "9000", allow_hyphen_values = true, value_parser = parse_intensity)]
    pub(crate) intensity: f64,
    /// Angle from the axis up to which the intensity is full, as `inner_cone_deg` of a scene.
    #[arg(long, value_name = "DEG", default_value = "5", allow_hyphen_values = true, value_parser = parse_inner_cone)]
    pub(crate) inner_cone_deg: f64,
    /// Angle from the axis beyond which there is no light, as `outer_cone_deg` of a scene.
    #[arg(long, value_name = "DEG", default_value = "22", allow_hyphen_values = true, value_parser = parse_outer_cone)]
    pub(crate) outer_cone_deg: f64,
    /// Rain rates R, mm/h.
    #[arg(long, value_name = "R,...", default_value = "0,10,50,150", allow_hyphen_values = true, value_parser = parse_rates_from_0)]
    pub(crate) rates: Numbers,
    #[command(flatten)]
    pub(crate) output: PlotOutputArgs,
}

/// `bansho plot emission`
#[derive(Args, Debug)]
pub(crate) struct EmissionArgs {
    /// Energy of the electrons, as `energy_ev` of a scene.
    #[arg(long, value_name = "EV", default_value = "5000", allow_hyphen_values = true, value_parser = parse_energy)]
    pub(crate) energy_ev: f64,
    /// Energy flux of the electrons, mW/m^2.
    #[arg(long, value_name = "FLUX", default_value = "10", allow_hyphen_values = true, value_parser = parse_flux)]
    pub(crate) flux_mw_per_m2: f64,
    /// Distribution of the energies.
    #[arg(long, default_value = "gaussian", value_parser = spectrum_parser())]
    pub(crate) spectrum: SpectrumShape,
    #[command(flatten)]
    pub(crate) output: PlotOutputArgs,
}

/// `bansho plot deposition`
#[derive(Args, Debug)]
pub(crate) struct DepositionArgs {
    /// Energies of the electrons, eV.
    #[arg(
        long,
        value_name = "EV,...",
        default_value = "500,1000,3000,10000,30000",
        allow_hyphen_values = true,
        value_parser = parse_energies
    )]
    pub(crate) energies_ev: Numbers,
    /// Distribution of the energies.
    #[arg(long, default_value = "monoenergetic", value_parser = spectrum_parser())]
    pub(crate) spectrum: SpectrumShape,
    #[command(flatten)]
    pub(crate) output: PlotOutputArgs,
}

/// `bansho plot quenching`
#[derive(Args, Debug)]
pub(crate) struct QuenchingArgs {
    #[command(flatten)]
    pub(crate) output: PlotOutputArgs,
}

/// `bansho plot parameters`
#[derive(Args, Debug)]
pub(crate) struct ParametersArgs {
    /// The scene file; `-` reads it from standard input.
    pub(crate) scene: PathBuf,
    /// Keyed parameters, such as wind.velocity or flame_sheet.0.color.luminance.
    #[arg(long, value_name = "KEY.PATH", required = true, num_args = 1.., action = clap::ArgAction::Append)]
    pub(crate) path: Vec<String>,
    #[command(flatten)]
    pub(crate) output: PlotOutputArgs,
}

/// `bansho plot transfer-curves`
#[derive(Args, Debug)]
pub(crate) struct TransferCurvesArgs {
    /// The scene file; `-` reads it from standard input.
    pub(crate) scene: PathBuf,
    /// Name of the flame sheet. [default: the first]
    #[arg(long, value_name = "NAME")]
    pub(crate) name: Option<String>,
    #[command(flatten)]
    pub(crate) output: PlotOutputArgs,
}

/// `bansho plot flame-shape`
#[derive(Args, Debug)]
pub(crate) struct FlameShapeArgs {
    /// The scene file; `-` reads it from standard input.
    pub(crate) scene: PathBuf,
    /// Name of the flame sheet. [default: the first]
    #[arg(long, value_name = "NAME")]
    pub(crate) name: Option<String>,
    /// Time at which the edges are plotted.
    #[arg(long, value_name = "SECONDS", default_value = "1", allow_hyphen_values = true, value_parser = parse_flame_time)]
    pub(crate) time: f64,
    /// Height w of the horizontal section whose speed is plotted.
    #[arg(long, value_name = "W", default_value = "0.5", allow_hyphen_values = true, value_parser = parse_flame_height)]
    pub(crate) height: f64,
    #[command(flatten)]
    pub(crate) output: PlotOutputArgs,
}

/// `bansho plot flame-statistics`
#[derive(Args, Debug)]
pub(crate) struct FlameStatisticsArgs {
    /// The scene file, which should show only the flame; `-` reads it from standard input.
    pub(crate) scene: PathBuf,
    /// Number of frames, evenly distributed over the shot.
    #[arg(long, value_name = "N", default_value = "24", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub(crate) frames: u32,
    /// Height of the pictures that are measured, pixels.
    #[arg(long, value_name = "PIXELS", default_value = "128", value_parser = clap::value_parser!(u32).range(16..=4320))]
    pub(crate) height: u32,
    #[command(flatten)]
    pub(crate) output: PlotOutputArgs,
}

/// `bansho plot metadata`
#[derive(Args, Debug)]
pub(crate) struct MetadataArgs {
    /// JSON files of frames, in any order.
    #[arg(required = true, value_name = "FILE")]
    pub(crate) files: Vec<PathBuf>,
    #[command(flatten)]
    pub(crate) output: PlotOutputArgs,
}

/// A number, or a list of them, that is not allowed.
#[derive(Debug, thiserror::Error)]
enum RangeError {
    #[error("allowed: a number from {min} to {max} {unit}")]
    Number { min: f64, max: f64, unit: &'static str },
    #[error("allowed: 1 to {MOST_CURVES} numbers with commas between, each from {min} to {max} {unit}")]
    List { min: f64, max: f64, unit: &'static str },
}

/// Curves that have a color of their own.
const MOST_CURVES: usize = 8;

fn number(text: &str, min: f64, max: f64, unit: &'static str) -> Result<f64, RangeError> {
    let value = text.trim().parse().ok().filter(|value| (min..=max).contains(value));
    value.ok_or(RangeError::Number { min, max, unit })
}

/// Up to [`MOST_CURVES`] numbers with commas between, each as `parse` reads it, from `min` to `max`.
fn list(
    text: &str,
    parse: impl Fn(&str) -> Option<f64>,
    min: f64,
    max: f64,
    unit: &'static str,
) -> Result<Numbers, RangeError> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|text| parse(text.trim())).collect();
    let allowed = numbers
        .filter(|numbers| numbers.len() <= MOST_CURVES && numbers.iter().all(|value| (min..=max).contains(value)));
    allowed.map(Numbers).ok_or(RangeError::List { min, max, unit })
}

fn parse_kelvin(text: &str) -> Result<f64, RangeError> {
    number(text, f64::from(LOWEST_K), f64::from(HIGHEST_K), "K")
}

fn parse_flame_time(text: &str) -> Result<f64, RangeError> {
    number(text, -1e6, 1e6, "s")
}

fn parse_flame_height(text: &str) -> Result<f64, RangeError> {
    number(text, 0.0, 1.0, "sheet heights")
}

fn parse_step(text: &str) -> Result<f64, RangeError> {
    number(text, 0.01, f64::from(HIGHEST_K), "K")
}

fn parse_side(text: &str) -> Result<usize, RangeError> {
    const SIDES: [usize; 2] = [2, 4096];
    let side = text.trim().parse().ok().filter(|side| (SIDES[0]..=SIDES[1]).contains(side));
    side.ok_or(RangeError::Number { min: SIDES[0] as f64, max: SIDES[1] as f64, unit: "pixels" })
}

fn parse_angle(text: &str) -> Result<f64, RangeError> {
    number(text, 1e-9, 10.0, "rad")
}

fn parse_energy(text: &str) -> Result<f64, RangeError> {
    number(text, LOWEST_EV, HIGHEST_EV, "eV")
}

fn parse_flux(text: &str) -> Result<f64, RangeError> {
    number(text, 0.001, 10_000.0, "mW/m^2")
}

fn parse_energies(text: &str) -> Result<Numbers, RangeError> {
    list(text, |text| text.parse().ok(), LOWEST_EV, HIGHEST_EV, "eV")
}

fn parse_rates(text: &str) -> Result<Numbers, RangeError> {
    list(text, |text| text.parse().ok(), 0.01, 500.0, "mm/h")
}

fn parse_rates_from_0(text: &str) -> Result<Numbers, RangeError> {
    list(text, |text| text.parse().ok(), 0.0, 500.0, "mm/h")
}

fn parse_intensity(text: &str) -> Result<f64, RangeError> {
    number(text, 1e-3, 1e9, "cd")
}

fn parse_inner_cone(text: &str) -> Result<f64, RangeError> {
    number(text, 0.0, 89.0, "degrees")
}

fn parse_outer_cone(text: &str) -> Result<f64, RangeError> {
    number(text, 0.1, 90.0, "degrees")
}

fn parse_exposure_times(text: &str) -> Result<Numbers, RangeError> {
    list(text, |text| values::parse_exposure(text).ok(), 1e-6, 10.0, "s")
}

fn spectrum_parser() -> impl TypedValueParser<Value = SpectrumShape> {
    let names = SpectrumShape::CHOICES.iter().map(|choice| choice.name);
    PossibleValuesParser::new(names).map(|name| SpectrumShape::from_name(&name).unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_and_lists_are_bounded() {
        assert_eq!(parse_kelvin("6500").unwrap(), 6500.0);
        assert_eq!(parse_rates("1, 5,20").unwrap().0, [1.0, 5.0, 20.0]);
        assert_eq!(parse_exposure_times("1/50,0.25").unwrap().0, [0.02, 0.25]);
        for bad in ["", "0", "-1", "10001", "nan", "inf", "warm", "1,2"] {
            assert!(parse_kelvin(bad).is_err(), "{bad}");
        }
        for bad in ["", "1,", "0", "501", "1;2", "nan", "1,2,3,4,5,6,7,8,9"] {
            assert!(parse_rates(bad).is_err(), "{bad}");
        }
        let told = parse_energy("99").unwrap_err().to_string();
        assert_eq!(told, "allowed: a number from 100 to 100000 eV");
    }
}
