//! Transfer curves of a flame sheet: eqs. (6) and (7) of Ohshima & Itahashi.

use bansho::{
    Scene,
    base::{
        color::{decode_srgb8, srgb_from_acescg},
        parameters::{Parameters, Reader, nearest},
    },
    fire::sheet::{Coloring, FlameSheetParameters},
    job::SceneFile,
};

use super::{
    PlotError,
    black_body::{RGB, code, display_color},
    did_you_mean,
    figure::{Axis, ColorStrip, Figure, FigureTable, Panel, Plot, Rgb, Series},
    ticks,
};

/// Samples of a transfer curve.
const CURVE_SAMPLES: usize = 256;

/// The flame sheet of that name, or the first.
pub(super) fn flame_sheet(
    file: &SceneFile,
    scene: &Scene,
    name: Option<&str>,
) -> Result<(String, FlameSheetParameters), PlotError> {
    const KIND: &str = "flame_sheet";
    let sheets: Vec<_> = scene.instances.iter().filter(|instance| instance.kind.key == KIND).collect();
    let found = match name {
        None => sheets.first(),
        Some(name) => sheets.iter().find(|sheet| sheet.name == name),
    };
    let Some(sheet) = found else {
        let names: Vec<&str> = sheets.iter().map(|sheet| sheet.name.as_str()).collect();
        return Err(match name.filter(|_| !names.is_empty()) {
            None => PlotError::NoPhenomenon { scene: file.name.clone(), kind: KIND },
            Some(name) => PlotError::NoSuchName {
                scene: file.name.clone(),
                kind: KIND,
                name: name.to_owned(),
                hint: did_you_mean(&nearest(name, names.iter().copied()).map(str::to_owned)),
                allowed: names.join(", "),
            },
        });
    };
    let parameters = FlameSheetParameters::read_table(&sheet.parameters.canonical(), &mut Reader::new(), &[]);
    Ok((sheet.name.clone(), parameters))
}

/// Red, green and blue of eq. (7), and sharpening, eq. (6), of a flame sheet.
///
/// # Errors
/// The scene is faulty, or has no such flame sheet.
pub(crate) fn figure(file: &SceneFile, name: Option<&str>) -> anyhow::Result<Figure> {
    let scene = file.parse()?;
    let (name, sheet) = flame_sheet(file, &scene, name)?;
    let (light, is_display) = (sheet.color.light(), sheet.color.kind == Coloring::RgbCurves);
    let columns = ["s", "sharpen", "r", "g", "b"];
    let mut table = FigureTable::new(columns);
    let mut colors = Vec::new();
    for index in 0..=CURVE_SAMPLES {
        let s = index as f64 / CURVE_SAMPLES as f64;
        let acescg = light(s);
        let rgb = if is_display {
            [&sheet.color.red, &sheet.color.green, &sheet.color.blue].map(|curve| curve.eval(s))
        } else {
            srgb_from_acescg(acescg.map(|value| value as f32)).map(f64::from)
        };
        colors.push(if is_display { rgb.map(|value| (value * 255.0).round() as u8) } else { shown(acescg, rgb) });
        table.rows.push([&[s, sheet.texture.sharpen.eval(s)][..], &rgb].concat());
    }
    let x = Axis::linear("T₁ of eq. (6), T₂ of eq. (7)", "", [0.0, 1.0]);
    let range = table.bounds(&[2, 3, 4]).unwrap_or([0.0, 1.0]);
    let y = if is_display { "R, G, B, eq. (7), sRGB-encoded" } else { "R, G, B, eq. (7), linear sRGB" };
    let mut rgb = Vec::new();
    for (c, (label, color)) in RGB.into_iter().enumerate() {
        rgb.push(Series::curve(label, c, table.points(0, 2 + c)).colored(color));
    }
    let sharpen = vec![Series::curve("C(T₁)", 6, table.points(0, 1))];
    let panels = vec![
        Panel::Plot(Plot {
            x: x.clone(),
            y: Axis::linear("Sharpened T₂ = C(T₁), eq. (6)", "", [0.0, 1.05]),
            series: sharpen,
        }),
        Panel::Plot(Plot {
            x: x.clone(),
            y: Axis::linear(y, "", if is_display { [0.0, 1.05] } else { ticks::rounded(range, 5) }),
            series: rgb,
        }),
        Panel::Colors(ColorStrip { x, colors }),
    ];
    Ok(Figure { title: format!("Transfer curves of the flame sheet \"{name}\" (Ohshima & Itahashi)"), panels, table })
}

/// The display color of light whose largest component is `brightest` in linear sRGB of the brightest flame.
fn shown(acescg: [f64; 3], srgb: [f64; 3]) -> Rgb {
    let brightest = srgb.into_iter().fold(0.0, f64::max).min(1.0) as f32;
    let hue = display_color(acescg).map(decode_srgb8);
    hue.map(|value| code(value * brightest))
}
