//! Keyed parameters of a scene over time.

use std::path::Path;

use bansho::{
    KINDS, SceneError,
    base::{
        math::curve::{Curve, Interpolation},
        parameters::{Descriptor, InterpolationName, Kind, ModelError, Node, ProblemKind, Table, Value, nearest},
        tables,
    },
    job::{JobError, SceneFile},
    scene::parse_values,
};

use super::{
    PlotError, did_you_mean,
    figure::{Axis, Figure, FigureTable, Panel, Plot, Series, bounds, pretty_unit},
    ticks,
};

/// Rows of a table over time that are allowed.
const MOST_ROWS: usize = 1_000_000;

/// One step from the root of a scene to a value.
#[derive(Clone, Debug)]
enum Step {
    Key(String),
    /// An item of a list: its index, and its `name` if it has one.
    Item {
        index: usize,
        name: Option<String>,
    },
}

/// A value of a scene, with the way to it.
struct Stated<'a> {
    steps: Vec<Step>,
    node: &'a Node,
}

impl Stated<'_> {
    /// The path as `--set` takes it.
    fn path(&self) -> String {
        let steps = self.steps.iter().map(|step| match step {
            Step::Key(key) => key.clone(),
            Step::Item { index, .. } => index.to_string(),
        });
        steps.collect::<Vec<_>>().join(".")
    }

    /// Whether `path` means this value: list items by index or name, or all of a list.
    fn is_meant_by(&self, path: &[&str]) -> bool {
        matches(&self.steps, path)
    }

    fn is_keyed(&self) -> bool {
        matches!(&self.node.value, Value::Table(table) if table.get("keys").is_some())
    }
}

fn matches(steps: &[Step], path: &[&str]) -> bool {
    match (steps.split_first(), path.split_first()) {
        (None, None) => true,
        (Some((Step::Key(key), steps)), Some((first, path))) => key == first && matches(steps, path),
        (Some((Step::Item { index, name }, steps)), Some((first, rest))) => {
            let is_picked = *first == index.to_string() || name.as_deref() == Some(*first);
            is_picked && matches(steps, rest) || matches(steps, path)
        }
        _ => false,
    }
}

/// Every value of a scene; keyed values are not entered.
fn all_values<'a>(table: &'a Table, steps: &[Step], found: &mut Vec<Stated<'a>>) {
    for entry in &table.entries {
        add_value(&entry.node, [steps, &[Step::Key(entry.key.clone())]].concat(), found);
    }
}

fn add_value<'a>(node: &'a Node, steps: Vec<Step>, found: &mut Vec<Stated<'a>>) {
    let stated = Stated { steps: steps.clone(), node };
    let is_keyed = stated.is_keyed();
    found.push(stated);
    match &node.value {
        Value::Table(table) if !is_keyed => all_values(table, &steps, found),
        Value::List(items) => {
            for (index, item) in items.iter().enumerate() {
                if let Value::Table(table) = &item.value {
                    let name = match table.get("name").map(|name| &name.value) {
                        Some(Value::Text(name)) => Some(name.clone()),
                        _ => None,
                    };
                    add_value(item, [&steps[..], &[Step::Item { index, name }]].concat(), found);
                }
            }
        }
        _ => {}
    }
}

/// Why a path means no keyed value.
#[derive(Clone, Debug, thiserror::Error)]
enum PathError {
    #[error("--path matches no value of the scene{}; keyed in it: {keyed}", did_you_mean(.hint))]
    Unknown { hint: Option<String>, keyed: String },
    #[error("is not keyed; --path needs a keyed parameter{}; keyed in the scene: {keyed}", did_you_mean(.hint))]
    NotKeyed { hint: Option<String>, keyed: String },
}

/// The keyed values that `path` means.
fn find<'a, 'b>(file: &SceneFile, all: &'b [Stated<'a>], path: &str) -> Result<Vec<&'b Stated<'a>>, JobError> {
    let segments: Vec<&str> = path.split('.').map(str::trim).collect();
    let meant: Vec<&Stated> = all.iter().filter(|stated| stated.is_meant_by(&segments)).collect();
    let keyed: Vec<&Stated> = meant.iter().copied().filter(|stated| stated.is_keyed()).collect();
    if !keyed.is_empty() {
        return Ok(keyed);
    }
    let paths: Vec<String> = all.iter().filter(|stated| stated.is_keyed()).map(Stated::path).collect();
    let hint = nearest(path, paths.iter().map(String::as_str)).map(str::to_owned);
    let keyed = if paths.is_empty() { "nothing".to_owned() } else { paths.join(", ") };
    let (at, error) = match meant.first() {
        Some(stated) => (stated.path(), PathError::NotKeyed { hint, keyed }),
        None => (path.to_owned(), PathError::Unknown { hint, keyed }),
    };
    let kind = ProblemKind::Model(ModelError::new(error));
    Err(JobError::ChangedScene(Box::new(SceneError::at(&file.name, &file.text, &at, kind))))
}

/// A keyed value as one curve per component.
fn curves(node: &Node) -> Vec<Curve> {
    let Value::Table(table) = &node.value else { return Vec::new() };
    let interpolation = match table.get("interpolation").map(|node| &node.value) {
        Some(Value::Text(name)) => InterpolationName::from_name(name).unwrap_or_default(),
        _ => InterpolationName::default(),
    };
    let Some(Value::List(keys)) = table.get("keys").map(|node| &node.value) else { return Vec::new() };
    let keys: Vec<(f64, Vec<f64>)> = keys.iter().filter_map(time_and_components).collect();
    let count = keys.iter().map(|(_, values)| values.len()).min().unwrap_or(0);
    let mut curves = Vec::new();
    for c in 0..count {
        let points = keys.iter().map(|(time, values)| [*time, values[c]]).collect();
        // It cannot fail: the scene was checked with the same curve.
        curves.extend(Curve::new(points, Interpolation::from(interpolation)));
    }
    curves
}

/// A key, `[time, number]` or `[time, [numbers]]`.
fn time_and_components(key: &Node) -> Option<(f64, Vec<f64>)> {
    match &key.value {
        Value::List(pair) => Some((pair.first()?.value.as_number()?, components(&pair.get(1)?.value)?)),
        _ => None,
    }
}

fn components(value: &Value) -> Option<Vec<f64>> {
    match value {
        Value::List(items) => items.iter().map(|item| item.value.as_number()).collect(),
        value => value.as_number().map(|number| vec![number]),
    }
}

/// The unit of the parameter that some steps lead to.
fn unit(steps: &[Step]) -> &'static str {
    let mut keys = steps.iter().filter_map(|step| match step {
        Step::Key(key) => Some(key.as_str()),
        Step::Item { .. } => None,
    });
    let root = keys.next().unwrap_or_default();
    let Some(kind) = tables::find(KINDS, root) else { return "" };
    let mut parameters: &[Descriptor] = &(kind.table)().parameters;
    let mut unit = "";
    for key in keys {
        let Some(descriptor) = parameters.iter().find(|descriptor| descriptor.key == key) else { break };
        unit = descriptor.unit;
        parameters = inner_table(&descriptor.kind);
    }
    unit
}

fn inner_table(kind: &Kind) -> &'static [Descriptor] {
    match kind {
        Kind::Table(table) => &table().parameters,
        Kind::Optional(inner) | Kind::Auto(inner) | Kind::Animated(inner) => inner_table(inner),
        Kind::List { item, .. } => inner_table(item),
        _ => &[],
    }
}

/// Keyed parameters over the time of the shot.
///
/// # Errors
/// The scene is faulty, or a path means nothing that is keyed.
pub(crate) fn figure(file: &SceneFile, paths: &[String]) -> anyhow::Result<Figure> {
    let scene = file.parse()?;
    let root = parse_values(&file.text).unwrap_or_default();
    let mut all = Vec::new();
    all_values(&root, &[], &mut all);
    let mut meant = Vec::new();
    for path in paths {
        meant.extend(find(file, &all, path)?);
    }
    let picture = &scene.picture;
    let frames = picture.frames.max(1) as usize;
    if frames > MOST_ROWS {
        return Err(PlotError::Rows { option: "picture.frames", rows: frames as f64, most: MOST_ROWS as f64 }.into());
    }
    let end = frames as f64 * picture.fps.frame_s();
    let mut table = FigureTable::new(["frame", "time_s"]);
    table.rows = (0..=frames)
        .map(|index| vec![picture.first_frame as f64 + index as f64, index as f64 * picture.fps.frame_s()])
        .collect();
    let x = Axis::linear("Time", "s", [0.0, end]);
    let mut panels = Vec::new();
    for stated in meant {
        panels.push(Panel::Plot(parameter_plot(stated, &x, &mut table)));
    }
    let title = format!("Keyed parameters of {}", Path::new(&file.name).file_name().unwrap_or_default().display());
    Ok(Figure { title, panels, table })
}

/// The points of a curve at the frames, and at its keys and just before them, where it may jump.
fn drawn(curve: &Curve, at_frames: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let end = at_frames.last().map_or(0.0, |point| point[0]);
    let times = curve.points().iter().flat_map(|key| [key[0] - 1e-6, key[0]]);
    let keys = times.filter(|time| (0.0..=end).contains(time)).map(|time| [time, curve.eval(time)]);
    let mut points: Vec<[f64; 2]> = at_frames.iter().copied().chain(keys).collect();
    points.sort_by(|a, b| a[0].total_cmp(&b[0]));
    points
}

/// The plot of one keyed parameter; its values are added to the table.
fn parameter_plot(stated: &Stated, x: &Axis, table: &mut FigureTable) -> Plot {
    let (path, unit, curves) = (stated.path(), unit(&stated.steps), curves(stated.node));
    let names: &[&str] = if curves.len() == 1 { &[""] } else { &["x", "y", "z", "w"] };
    let mut series = Vec::new();
    for (c, curve) in curves.iter().enumerate() {
        let name = names.get(c).copied().unwrap_or_default();
        let column = table.columns.len();
        table.columns.push(if name.is_empty() { path.clone() } else { format!("{path}.{name}") });
        for row in &mut table.rows {
            row.push(curve.eval(row[1]));
        }
        let label = if name.is_empty() { "value".to_owned() } else { name.to_owned() };
        series.push(Series::curve(label, c, drawn(curve, &table.points(1, column))));
    }
    let keys: Vec<[f64; 2]> = curves.iter().flat_map(|curve| curve.points().iter().copied()).collect();
    let shown = series.iter().flat_map(|series| &series.points).map(|point| point[1]);
    let range = bounds(shown).unwrap_or([0.0, 1.0]);
    series.push(Series::reference("keys", keys));
    Plot { x: x.clone(), y: Axis::linear(&path, &pretty_unit(unit), ticks::padded(range)), series }
}
