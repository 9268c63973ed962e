//! Light of black bodies by temperature: Inagaki et al., section 5.1, figure 1, as numbers.

use bansho::{
    View,
    base::{
        color::{black_body, encode_srgb, luminance, srgb_from_acescg},
        math,
    },
};

use crate::args::ColorTexture;

use super::{
    PlotError,
    csv::rows,
    figure::{Axis, ColorStrip, Figure, FigureTable, Panel, Plot, Rgb, Series},
    texture::FigureTexture,
    ticks,
};

/// Temperature (K), luminance (cd/m^2), linear sRGB of luminance 1: Planck's law with the CIE 1931 observer, computed independently.
const REFERENCE: &str = include_str!("data/black_body.csv");

/// Red, green and blue curves.
pub(super) const RGB: [(&str, Rgb); 3] = [("red", [213, 50, 40]), ("green", [0, 140, 70]), ("blue", [30, 90, 200])];

/// Lowest luminance of the logarithmic axis, cd/m^2: what an eye adapted to the dark still sees.
const DARKEST: f64 = 1e-6;

/// Rows of a table that are allowed: more than a texture has texels on a side.
const MOST_ROWS: f64 = 1e6;

/// Colors of the strip.
const STRIP_COLORS: usize = 544;

/// Temperatures to plot, K.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Temperatures {
    pub(crate) from: f64,
    pub(crate) to: f64,
    pub(crate) step: f64,
}

impl Temperatures {
    fn checked(self) -> Result<Vec<f64>, PlotError> {
        let Self { from, to, step } = self;
        if from >= to {
            return Err(PlotError::EmptyRange { option: "--from", from, to, unit: "K" });
        }
        let steps = ((to - from) / step + 1e-9).floor();
        if steps + 1.0 > MOST_ROWS {
            return Err(PlotError::Rows { option: "--step", rows: steps + 1.0, most: MOST_ROWS });
        }
        Ok((0..=steps as usize).map(|index| (index as f64).mul_add(step, from)).collect())
    }
}

/// The light of one temperature.
struct Light {
    acescg: [f64; 3],
    srgb: [f64; 3],
    ln_luminance: f64,
}

/// Colors of luminance 1; black where the body is dark.
fn light(temperature_k: f64) -> Light {
    let body = black_body();
    let ln_luminance = f64::from(body.ln_luminance(temperature_k as f32));
    let radiance = body.radiance(temperature_k as f32);
    let scale = luminance(radiance);
    let acescg = if scale > 0.0 { radiance.map(|value| value / scale) } else { [0.0; 3] };
    Light { acescg: acescg.map(f64::from), srgb: srgb_from_acescg(acescg).map(f64::from), ln_luminance }
}

/// The figure.
pub(crate) fn figure(temperatures: Temperatures) -> Result<Figure, PlotError> {
    let kelvins = temperatures.checked()?;
    let mut table = FigureTable::new([
        "temperature_k",
        "linear_srgb_r",
        "linear_srgb_g",
        "linear_srgb_b",
        "acescg_r",
        "acescg_g",
        "acescg_b",
        "ln_luminance_cd_per_m2",
    ]);
    for kelvin in kelvins {
        let Light { acescg, srgb, ln_luminance } = light(kelvin);
        table.rows.push([&[kelvin][..], &srgb, &acescg, &[ln_luminance]].concat());
    }
    let x = Axis::linear("Temperature T", "K", [temperatures.from, temperatures.to]);
    Ok(Figure {
        title: "Luminance and color of black bodies (Inagaki et al., figure 1)".to_owned(),
        panels: vec![
            Panel::Plot(luminance_plot(&table, &x)),
            Panel::Plot(color_plot(&table, &x)),
            Panel::Colors(ColorStrip { colors: strip(temperatures), x }),
        ],
        table,
    })
}

fn luminance_plot(table: &FigureTable, x: &Axis) -> Plot {
    let points: Vec<[f64; 2]> = table.rows.iter().map(|row| [row[0], math::exp(row[7])]).collect();
    let brightest = points.iter().map(|point| point[1]).fold(10.0 * DARKEST, f64::max);
    let reference = rows::<5>(REFERENCE).iter().map(|row| [row[0], row[1]]).collect();
    Plot {
        x: x.clone(),
        y: Axis::log("Luminance", "cd/m²", [DARKEST, brightest]),
        series: vec![
            Series::curve("Bansho", 0, points),
            Series::reference("Planck's law, CIE 1931 observer", reference),
        ],
    }
}

fn color_plot(table: &FigureTable, x: &Axis) -> Plot {
    let reference = rows::<5>(REFERENCE);
    let mut series = Vec::new();
    for (c, (label, color)) in RGB.into_iter().enumerate() {
        // Bodies too dark for single precision have no color.
        let points = table.points(0, 1 + c).into_iter().filter(|point| point[1] != 0.0).collect();
        series.push(Series::curve(label, c, points).colored(color));
    }
    let points = (0..3).flat_map(|c| reference.iter().map(move |row| [row[0], row[2 + c]])).collect();
    series.push(Series::reference("Planck's law, CIE 1931 observer", points));
    let [low, high] = table.bounds(&[1, 2, 3]).unwrap_or([0.0, 1.0]);
    Plot {
        x: x.clone(),
        y: Axis::linear("Linear sRGB of luminance 1", "", ticks::rounded([low, high.min(6.0)], 5)),
        series,
    }
}

/// Colors as a display shows them at the greatest brightness that it has for each; black below [`DARKEST`].
fn strip(temperatures: Temperatures) -> Vec<Rgb> {
    let mut colors = Vec::with_capacity(STRIP_COLORS);
    for index in 0..STRIP_COLORS {
        let t = (index as f64 + 0.5) / STRIP_COLORS as f64;
        let light = light(math::lerp(temperatures.from, temperatures.to, t));
        colors.push(if light.ln_luminance < math::ln(DARKEST) { [0; 3] } else { display_color(light.acescg) });
    }
    colors
}

/// The color of each temperature as a row of texels: linear sRGB without negative values, scaled such that its brightest channel is 1; black
/// below [`DARKEST`].
pub(crate) fn texture(temperatures: Temperatures, encoding: ColorTexture) -> Result<FigureTexture, PlotError> {
    let kelvins = temperatures.checked()?;
    let width = kelvins.len();
    let lights = kelvins.into_iter().map(light);
    let colors = lights.map(|Light { srgb, ln_luminance, .. }| match ln_luminance < math::ln(DARKEST) {
        true => [0.0; 3],
        false => full(srgb),
    });
    Ok(match encoding {
        ColorTexture::Srgb => FigureTexture::srgb(width, colors.map(|color| color.map(|value| code(value as f32)))),
        ColorTexture::Linear => FigureTexture::linear_16(width, colors),
    })
}

/// A color scaled such that its brightest channel is 1, without its negative values.
fn full(color: [f64; 3]) -> [f64; 3] {
    let brightest = color.into_iter().fold(f64::MIN_POSITIVE, f64::max);
    color.map(|value| (value / brightest).max(0.0))
}

/// sRGB of the hue of an ACEScg color, as bright as a display shows it.
pub(super) fn display_color(acescg: [f64; 3]) -> Rgb {
    let acescg = acescg.map(|value| value as f32);
    let brightest = srgb_from_acescg(acescg).into_iter().fold(0.0_f32, f32::max);
    if brightest <= 0.0 {
        return [0; 3];
    }
    View::STANDARD.to_display(acescg.map(|value| value / brightest)).map(code)
}

/// The 8-bit sRGB code of a linear value.
pub(super) fn code(linear: f32) -> u8 {
    (encode_srgb(linear) * 255.0).round().clamp(0.0, 255.0) as u8
}
