//! Deflection of light by hot gas, as seen from the camera: Inagaki et al., figure 4.

use std::sync::Arc;

use bansho::{
    Plan, PlanOptions, Shot, Unobserved,
    base::{frame::Frame, math},
    job::{JobError, SceneFile},
};

use super::{
    PlotError,
    texture::{FigureTexture, signed_code},
};

/// The deflection of one frame.
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
    let largest = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, f64::max);
    let largest_rad = largest(&mut x.iter().zip(&y).map(|(x, y)| math::hypot(*x, *y)));
    if largest_rad <= 0.0 {
        return Err(PlotError::NoDeflection { scene: file.name.clone(), frame: number }.into());
    }
    let full_scale_rad = full_scale_rad.unwrap_or_else(|| largest(&mut x.iter().chain(&y).map(|value| value.abs())));
    let texel = |(x, y): (&f64, &f64)| [x / full_scale_rad, y / full_scale_rad, 0.0].map(signed_code);
    Ok(DeflectionFigure {
        texture: FigureTexture::linear_8(frame.beauty.width(), x.iter().zip(&y).map(texel)),
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
