//! The numbers of a frame that `bansho render --metadata` writes, over the frames.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use bansho::media::files::input;
use serde_json::Value;

use super::{
    PlotError,
    figure::{Axis, Figure, FigureTable, Panel, Plot, Series, Style, bounds, pretty_unit},
    ticks,
};

/// Most bytes of a file.
const MOST_BYTES: u64 = 16 << 20;

/// A number over the frames: of which phenomenon, which, in which unit.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Quantity {
    name: String,
    unit: String,
    phenomenon: String,
}

impl Quantity {
    /// The name of its column, with the unit.
    fn column(&self) -> String {
        let unit = if self.unit.is_empty() { String::new() } else { format!(" ({})", self.unit) };
        format!("{} {}{unit}", self.phenomenon, self.name)
    }
}

/// Every number of some metadata files, over the frames.
///
/// # Errors
/// A file cannot be read, is not metadata, or none states a number.
pub(crate) fn figure(paths: &[PathBuf]) -> Result<Figure, PlotError> {
    let mut frames: BTreeMap<i64, BTreeMap<Quantity, f64>> = BTreeMap::new();
    for path in paths {
        let (frame, numbers) = read(path)?;
        frames.entry(frame).or_default().extend(numbers);
    }
    let mut quantities: Vec<Quantity> = frames.values().flat_map(|numbers| numbers.keys().cloned()).collect();
    quantities.sort();
    quantities.dedup();
    let (Some(first), Some(last)) = (frames.keys().next(), frames.keys().next_back()) else {
        return Err(PlotError::NoNumbers { path: paths.first().cloned().unwrap_or_default() });
    };
    if quantities.is_empty() {
        return Err(PlotError::NoNumbers { path: paths.first().cloned().unwrap_or_default() });
    }
    let x = Axis::linear("Frame", "", [*first as f64, if first < last { *last as f64 } else { *first as f64 + 1.0 }]);
    let mut table = FigureTable::of_functions("frame", quantities.iter().map(Quantity::column));
    for (frame, numbers) in &frames {
        // What a frame does not state is a gap in the curve.
        table.push(*frame as f64, quantities.iter().map(|quantity| numbers.get(quantity).copied().unwrap_or(f64::NAN)));
    }
    // One plot for each number of all phenomena that report it.
    let mut panels = Vec::new();
    for (start, group) in grouped(&quantities) {
        // A line through a single point would be invisible.
        let style = if table.rows.len() > 1 { Style::Line } else { Style::Markers };
        let mut series = Vec::new();
        for (index, quantity) in group.iter().enumerate() {
            let points = table.points(0, 1 + start + index);
            series.push(Series { style, ..Series::curve(&quantity.phenomenon, index, points) });
        }
        let range = bounds(series.iter().flat_map(|series| &series.points).map(|point| point[1]));
        // The name of a single curve stands beside its axis, since it has no legend.
        let label = if let [one] = group { format!("{}: {}", one.phenomenon, one.name) } else { group[0].name.clone() };
        let y = Axis::linear(&label, &pretty_unit(&group[0].unit), ticks::padded(range.unwrap_or([0.0, 1.0])));
        panels.push(Panel::Plot(Plot { x: x.clone(), y, series }));
    }
    Ok(Figure { title: format!("Metadata of frames {first} to {last}"), panels, table })
}

/// Runs of quantities of equal name and unit, each with its index.
fn grouped(quantities: &[Quantity]) -> Vec<(usize, &[Quantity])> {
    let mut start = 0;
    let runs = quantities.chunk_by(|a, b| (&a.name, &a.unit) == (&b.name, &b.unit));
    runs.map(|run| {
        start += run.len();
        (start - run.len(), run)
    })
    .collect()
}

/// The frame of a file of metadata, and all numbers of its phenomena.
fn read(path: &Path) -> Result<(i64, BTreeMap<Quantity, f64>), PlotError> {
    numbers(path).map_err(|problem| PlotError::NotMetadata { path: path.to_path_buf(), problem })
}

/// Does what [`read`] does; the error says what is wrong with the file.
fn numbers(path: &Path) -> Result<(i64, BTreeMap<Quantity, f64>), String> {
    let bytes = input::read(path, MOST_BYTES).map_err(|error| error.to_string())?;
    let value: Value = serde_json::from_slice(&bytes).map_err(|error| error.to_string())?;
    let frame = value["frame"].as_i64().ok_or("states no `frame`")?;
    let phenomena = value["phenomena"].as_object().ok_or("states no `phenomena`")?;
    let mut numbers = BTreeMap::new();
    for (phenomenon, stated) in phenomena {
        for (name, number) in stated.as_object().into_iter().flatten() {
            let unit = number["unit"].as_str().unwrap_or_default().to_owned();
            let quantity = Quantity { name: name.clone(), unit, phenomenon: phenomenon.clone() };
            numbers.insert(quantity, number["value"].as_f64().unwrap_or(f64::NAN));
        }
    }
    Ok((frame, numbers))
}
