//! Shape of a flame sheet: thresholds, widths, speed and edges, eqs. (4), (9), (11) and (15) of Ohshima & Itahashi.

use bansho::{
    BuildErrors, Scene,
    base::parameters::{BuildError, ParameterError},
    fire::sheet::{FlameSheet, FlameSheetParameters, TextureKind, TextureParameters, equations},
    job::{JobError, SceneFile},
};

use super::{
    figure::{Axis, Figure, FigureTable, Panel, Plot, Series},
    transfer_curves::flame_sheet,
};

/// Samples of a curve.
const SAMPLES: usize = 256;

/// Columns of the table: arguments from 0 to 1, and functions of them.
const COLUMNS: [&str; 10] = [
    "argument",
    "threshold",
    "threshold_across",
    "rise",
    "core_width",
    "core_and_fringe_width",
    "falloff",
    "speed",
    "left_edge",
    "right_edge",
];

/// Figures 2, 6 and 7 of the paper for a flame sheet: its edges at `time` s, and its speed across the section at the height `height`.
///
/// # Errors
/// The scene is faulty, or has no such flame sheet.
pub(crate) fn figure(file: &SceneFile, name: Option<&str>, time: f64, height: f64) -> anyhow::Result<Figure> {
    let scene = file.parse()?;
    let (name, parameters) = flame_sheet(file, &scene, name)?;
    // The shape does not depend on the texture, which may be a file.
    let texture = TextureParameters { kind: TextureKind::Fractal, ..parameters.texture.clone() };
    let shape_only = FlameSheetParameters { texture, ..parameters.clone() };
    let sheet = FlameSheet::new(shape_only, &name, scene.seed, None);
    let sheet = sheet.map_err(|error| located(file, &scene, &name, error))?;
    let edges = sheet.edges(time);
    let mut table = FigureTable::new(COLUMNS);
    for index in 0..=SAMPLES {
        let s = index as f64 / SAMPLES as f64;
        table.rows.push([row(&parameters, s, height), edges(s).to_vec()].concat());
    }
    let title = format!("Shape of the flame sheet \"{name}\" (Ohshima & Itahashi)");
    Ok(Figure { title, panels: panels(&table, time, height), table })
}

/// An error of the flame sheet `name` with its line in the file.
fn located(file: &SceneFile, scene: &Scene, name: &str, error: ParameterError) -> JobError {
    let sheets = scene.instances.iter().filter(|instance| instance.kind.key == "flame_sheet");
    let index = sheets.take_while(|sheet| sheet.name != name).count();
    let errors = BuildErrors(vec![(format!("flame_sheet.{index}"), BuildError::new(error.key, error.kind))]);
    JobError::Scene(Box::new(errors.located(&file.name, &file.text)))
}

/// All columns but the edges.
fn row(parameters: &FlameSheetParameters, s: f64, height: f64) -> Vec<f64> {
    let (shape, texture) = (&parameters.shape, &parameters.texture);
    let core = shape.core_width.eval(s);
    let widths = [shape.core_width.eval(height), shape.fringe_width.eval(height)].map(|width| width as f32);
    let position = equations::fringe_position(s as f32, widths[0], widths[1]);
    let falloff = 1.0 - shape.slowing.eval(f64::from(position)) as f32;
    vec![
        s,
        texture.threshold.eval(s),
        texture.threshold_across.eval((2.0 * s - 1.0).abs()),
        f64::from(equations::rise(s as f32, shape.initial_speed as f32)),
        core,
        core + shape.fringe_width.eval(s),
        1.0 - shape.slowing.eval(s),
        f64::from(equations::speed_profile(falloff, shape.edge_speed as f32)),
    ]
}

fn panels(table: &FigureTable, time: f64, height: f64) -> Vec<Panel> {
    vec![
        panel(table, "w, u", "Thresholds, eq. (4), figure 2", &[("V(w)", 1), ("H(u)", 2)]),
        panel(table, "y", "Rise, eq. (9)", &[("w(y)", 3)]),
        panel(table, "w", "Widths, figure 6 (a)", &[("A(w)", 4), ("A(w) + D(w)", 5)]),
        panel(table, "x'", "Speed, eq. (11), figure 6 (b)", &[(&format!("K(x', {height})"), 7)]),
        panel(table, "position in the fringe", "Falloff, figure 6 (c)", &[("F", 6)]),
        panel(table, "w", "Edges, eq. (15), figure 7", &[(&format!("E(w, {time} s), left"), 8), ("right", 9)]),
    ]
}

/// A plot of some columns, each with its label, over the argument from 0 to 1.
fn panel(table: &FigureTable, x: &str, y: &str, curves: &[(&str, usize)]) -> Panel {
    let curves = curves.iter().enumerate();
    Panel::Plot(Plot {
        x: Axis::linear(x, "", [0.0, 1.0]),
        y: Axis::linear(y, "", [0.0, 1.05]),
        series: curves.map(|(index, (label, column))| Series::curve(*label, index, table.points(0, *column))).collect(),
    })
}
