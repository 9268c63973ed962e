//! Statistics of the flame in a scene, over its frames.

use bansho::{
    Plan, PlanOptions, Unobserved,
    flame_statistics::{FilmFrame, FlameStatistics, draw_film},
    job::{JobError, SceneFile},
};

use super::{
    PlotError, csv,
    figure::{Axis, Figure, FigureTable, Panel, Plot, Series, Style},
    ticks,
};

/// Columns after the frame, and what the axes call them.
const COLUMNS: [(&str, &str); 6] = [
    ("lit_height", "Lit height (of the picture)"),
    ("area", "Lit area (of the picture)"),
    ("pieces", "Pieces"),
    ("pale", "Pale part (of the lit area)"),
    ("base_width", "Width of the lowest row (of the widest)"),
    ("edge_redness", "Green over red at edges (of inside)"),
];

/// Statistics of each frame, and of the film.
pub(crate) struct MeasuredFlame {
    pub(crate) figure: Figure,
    film: FlameStatistics,
    frames: usize,
}

impl MeasuredFlame {
    /// The statistics of the film, a line each.
    pub(crate) fn summary(&self) -> String {
        let FlameStatistics { height, body, pieces, edge_redness, base_width, pale, area } = self.film;
        let lines = [
            ("height that burns half of the time, of the picture", height),
            ("lit part of the lower third of that height", body),
            ("pieces", pieces),
            ("green over red at edges, relative to inside", edge_redness),
            ("width of the lowest row, of the widest", base_width),
            ("pale part of the lit area", pale),
            ("lit area, of the picture", area),
        ];
        let lines: String = lines
            .iter()
            .map(|(what, value)| format!("  {what}: {}\n", csv::number((1e3 * value).round() * 1e-3)))
            .collect();
        format!("mean of {} frames:\n{lines}", self.frames)
    }
}

/// Draws `count` frames, evenly distributed over the shot, `height` pixels high, and measures them.
///
/// # Errors
/// The scene is faulty, or its frames are dark.
pub(crate) fn measure(file: &SceneFile, count: usize, height: usize) -> anyhow::Result<MeasuredFlame> {
    let compiled = file.compile(file.parse()?, &file.assets())?;
    let plan = Plan::new(&compiled, &PlanOptions::default()).map_err(JobError::from)?;
    let frames = draw_film(compiled, &plan, count, height, &Unobserved).map_err(JobError::from)?;
    let dark = || PlotError::NoFlame { scene: file.name.clone(), frames: frames.len() };
    let film = FlameStatistics::of_film(&frames).ok_or_else(dark)?;
    let mut table = FigureTable::of_functions("frame", COLUMNS.iter().map(|(name, _)| (*name).to_owned()));
    for FilmFrame { number, mask } in &frames {
        let pieces = mask.pieces() as f64;
        let row = [mask.lit_height(), mask.area(), pieces, mask.pale(), mask.base_width(), mask.edge_redness()];
        table.push(*number as f64, row);
    }
    let figure = Figure { title: format!("Statistics of the flame in {}", file.name), panels: panels(&table), table };
    Ok(MeasuredFlame { figure, film, frames: frames.len() })
}

/// A plot for each column.
fn panels(table: &FigureTable) -> Vec<Panel> {
    let [first, last] = table.bounds(&[0]).unwrap_or([0.0, 1.0]);
    let x = Axis::linear("Frame", "", [first, if first < last { last } else { first + 1.0 }]);
    // A line through a single point would be invisible.
    let style = if table.rows.len() > 1 { Style::Line } else { Style::Markers };
    let plot = |(index, (name, label)): (usize, &(&str, &str))| {
        let range = table.bounds(&[index + 1]).unwrap_or([0.0, 1.0]);
        let series = Series { style, ..Series::curve(*name, 0, table.points(0, index + 1)) };
        Panel::Plot(Plot { x: x.clone(), y: Axis::linear(label, "", ticks::padded(range)), series: vec![series] })
    };
    COLUMNS.iter().enumerate().map(plot).collect()
}
