//! Pictures without axes, for shaders: rows of texels from the top. One of them is made here: the deflection of light in a frame.

use std::sync::Arc;

use bansho::{
    AlphaConvention, DisplayImage, Plan, PlanOptions, Shot, Unobserved,
    base::{
        frame::{DisplayEncoding, DisplayPixels, Frame},
        math,
    },
    job::{JobError, SceneFile},
};

use super::{PlotError, figure::Rgb};

/// A texture.
pub(crate) struct FigureTexture {
    pub(crate) picture: DisplayImage,
    /// Whether its codes are linear; otherwise they are sRGB-encoded.
    pub(crate) is_linear: bool,
}

impl FigureTexture {
    /// Codes of sRGB.
    pub(super) fn srgb(width: usize, texels: impl IntoIterator<Item = Rgb>) -> Self {
        Self { is_linear: false, ..Self::linear_8(width, texels) }
    }

    /// Linear codes of 8 bits.
    pub(super) fn linear_8(width: usize, texels: impl IntoIterator<Item = Rgb>) -> Self {
        let texels = texels.into_iter().map(|[red, green, blue]| [red, green, blue, u8::MAX]);
        Self::new(width, DisplayPixels::Eight(texels.collect()))
    }

    /// Values from 0 to 1 as linear codes of 16 bits.
    pub(super) fn linear_16(width: usize, texels: impl IntoIterator<Item = [f64; 3]>) -> Self {
        let texels = texels.into_iter().map(|texel| {
            let [red, green, blue] = texel.map(|value| (value * 65_535.0).round().clamp(0.0, 65_535.0) as u16);
            [red, green, blue, u16::MAX]
        });
        Self::new(width, DisplayPixels::Sixteen(texels.collect()))
    }

    fn new(width: usize, pixels: DisplayPixels) -> Self {
        let texels = match &pixels {
            DisplayPixels::Eight(texels) => texels.len(),
            DisplayPixels::Sixteen(texels) => texels.len(),
        };
        let height = texels / width.max(1);
        let picture = DisplayImage {
            width,
            height,
            opaque: true,
            alpha: AlphaConvention::default(),
            encoding: DisplayEncoding::Srgb,
            pixels,
        };
        Self { picture, is_linear: true }
    }
}

/// The code of a value from 0 to 1.
pub(super) fn unsigned_code(value: f64) -> u8 {
    (value * 255.0).round().clamp(0.0, 255.0) as u8
}

/// The code of a value from -1 to 1, of which 0 is 128.
pub(super) fn signed_code(value: f64) -> u8 {
    value.mul_add(127.5, 127.5).round().clamp(0.0, 255.0) as u8
}

/// Deflection of light by hot gas in one frame, as seen from the camera: Inagaki et al., figure 4.
pub(crate) struct DeflectionFigure {
    /// x to the right, y up and z, which is 0, as red, green and blue.
    pub(crate) texture: FigureTexture,
    /// Largest deflection, rad.
    pub(crate) largest_rad: f64,
    /// The same, in pixels of what is far behind the gas.
    pub(crate) largest_pixels: f64,
    /// Angle along an axis that is shown as 0 or 255, rad.
    pub(crate) full_scale_rad: f64,
}

/// Draws the deflection in frame `number`.
///
/// # Errors
/// The scene is faulty, or nothing in the frame refracts light.
pub(crate) fn deflection(
    file: &SceneFile,
    number: i64,
    full_scale_rad: Option<f64>,
) -> anyhow::Result<DeflectionFigure> {
    let compiled = file.compile(file.parse()?, &file.assets())?;
    let options = PlanOptions { aovs: true, ..PlanOptions::default() };
    let plan = Arc::new(Plan::new(&compiled, &options).map_err(JobError::from)?);
    let focal_pixels = plan.view(number).camera.focal_pixels;
    let mut shot = Shot::open(compiled, plan);
    let frame = bansho::draw(&mut shot, number, &Unobserved).map_err(JobError::from)?;
    let [x, y] = [".deflection.X", ".deflection.Y"].map(|suffix| sum_of_channels(&frame, suffix));
    let largest_rad = x.iter().zip(&y).map(|(x, y)| math::hypot(*x, *y)).fold(0.0, f64::max);
    if largest_rad <= 0.0 {
        return Err(PlotError::NoDeflection { scene: file.name.clone(), frame: number }.into());
    }
    // Along one axis, since x and y have a channel each.
    let largest_component = x.iter().chain(&y).map(|value| value.abs()).fold(0.0, f64::max);
    let full_scale_rad = full_scale_rad.unwrap_or(largest_component);
    let texels = x.iter().zip(&y).map(|(x, y)| [x / full_scale_rad, y / full_scale_rad, 0.0].map(signed_code));
    Ok(DeflectionFigure {
        texture: FigureTexture::linear_8(frame.beauty.width(), texels),
        largest_rad,
        largest_pixels: largest_rad * focal_pixels,
        full_scale_rad,
    })
}

/// Sum over all phenomena of the channels with that end of their name.
fn sum_of_channels(frame: &Frame, suffix: &str) -> Vec<f64> {
    let mut sum = vec![0.0; frame.beauty.width() * frame.beauty.height()];
    for channel in frame.channels.iter().filter(|channel| channel.name.ends_with(suffix)) {
        for (sum, value) in sum.iter_mut().zip(&channel.values) {
            *sum += f64::from(*value);
        }
    }
    sum
}
