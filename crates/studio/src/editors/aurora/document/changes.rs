//! Edits of shapes as operations on the scene.

use bansho::{
    aurora::shapes::{Correspondence, Form, LinkParameters, SheetParameters},
    base::{
        math::{DVec2, curve::Curve},
        parameters::{Parameters, Table, Value},
    },
    scene::{ValuePath, operation::Operation},
};

use super::{
    AuroraDrawing, Factor, SheetPosition,
    links::rounded,
    polyline,
    renumber::{JoinedPart, SheetRemap, integers},
    sheets::{DirectedCurve, curve_chain, curve_range, non_default, with_form, with_points},
};

/// An end of a sheet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StrokeEnd {
    /// Index of the sheet.
    pub sheet: usize,
    /// Whether it is the last point rather than the first.
    pub last: bool,
}

/// The sheets of a shape after an edit.
pub(super) struct RemappedSheets {
    pub(super) sheets: Vec<SheetParameters>,
    /// How positions on the old sheets map to the new ones.
    pub(super) remap: SheetRemap,
}

/// Half of the gap between the two halves of a split sheet, as a fraction of the map's side.
const HALF_GAP: f64 = 0.012;

impl AuroraDrawing {
    /// Draws a stroke in place of sheet `sheet` of shape `shape`, or as a new one.
    pub fn draw(&self, shape: usize, sheet: Option<usize>, stroke: &[DVec2]) -> Vec<Operation> {
        let points = self.simplified_points(stroke);
        self.put_sheet(shape, sheet, |old| with_points(old, points))
    }

    /// Puts a named form in place of sheet `sheet`, or as a new one.
    pub fn put_form(&self, shape: usize, sheet: Option<usize>, form: Form) -> Vec<Operation> {
        self.put_sheet(shape, sheet, |old| with_form(old, form))
    }

    fn put_sheet(
        &self,
        shape: usize,
        sheet: Option<usize>,
        change: impl FnOnce(&SheetParameters) -> SheetParameters,
    ) -> Vec<Operation> {
        // Default shapes are replaced by what is drawn.
        let mut sheets = if self.is_stated() { self.sheets(shape) } else { Vec::new() };
        match sheet.and_then(|sheet| sheets.get_mut(sheet)) {
            Some(old) => *old = change(old),
            None => sheets.push(change(&SheetParameters::default())),
        }
        self.write(shape, &sheets)
    }

    /// Puts the strokes of the SVG file `file` in place of the sheets of the first shape.
    pub fn trace(&self, file: Value) -> Vec<Operation> {
        let mut sheet = Table::default();
        sheet.push("svg_file", file);
        let sheets = Value::List(vec![Value::Table(sheet).into()]);
        if self.is_stated() {
            return vec![Operation::Set { path: self.shape(0).key("sheets"), value: sheets }];
        }
        let mut shape = Table::default();
        shape.push("sheets", sheets);
        vec![Operation::Append { path: self.path.key("shapes"), value: Value::Table(shape) }]
    }

    /// Sets the points of sheet `sheet`.
    pub fn set_points(&self, shape: usize, sheet: usize, points: &[DVec2]) -> Vec<Operation> {
        let mut sheets = self.sheets(shape);
        let points = points.iter().map(|&point| self.rounded(point)).collect();
        if let Some(old) = sheets.get_mut(sheet) {
            *old = with_points(old, points);
        }
        self.write(shape, &sheets)
    }

    /// Changes `factor` by `by` around the fraction `at` of the length of sheet `sheet`.
    pub fn paint(&self, shape: usize, sheet: usize, factor: Factor, at: f64, by: f64) -> Vec<Operation> {
        /// Number of intervals of the painted curve.
        const INTERVALS: usize = 16;
        /// Radius of the brush, as a fraction of the sheet's length.
        const RADIUS: f64 = 0.12;
        let mut sheets = self.sheets(shape);
        let Some(curve) = sheets.get_mut(sheet).map(|sheet| factor.of(sheet)) else { return Vec::new() };
        let even: Vec<[f64; 2]> =
            (0..=INTERVALS).map(|step| step as f64 / INTERVALS as f64).map(|at| [at, curve.eval(at)]).collect();
        let [low, high] = factor.bounds();
        let brushed = polyline::brushed(&even, at, by, RADIUS).into_iter();
        let points = brushed.map(|[at, factor]| [at, rounded(factor.clamp(low, high))]);
        if let Ok(painted) = Curve::new(points.collect(), curve.interpolation()) {
            *curve = painted;
        }
        self.write(shape, &sheets)
    }

    /// Splits sheet `sheet` of the shape before `shape` at the fraction `at` of its length; the sheets that it becomes are cut too.
    pub fn split(&self, shape: usize, sheet: usize, at: f64) -> Vec<Operation> {
        let at = rounded(at);
        let mut change = Table::default();
        change.push("sheet", Value::Integer(sheet as i64 + 1));
        change.push("length_fraction", Value::Number(at));
        let mut operations =
            vec![Operation::Append { path: self.shape(shape).key("split"), value: Value::Table(change) }];
        let line = self.lines(shape - 1).into_iter().nth(sheet).unwrap_or_default();
        let from = polyline::at(&line, at);
        let changed = self.propagated(shape, from.as_slice(), |shape, targets| {
            let (sheets, cut) = self.cut_at(shape, *targets.first()?)?;
            Some(RemappedSheets { sheets, remap: SheetRemap::Cut(cut) })
        });
        // A link of the split sheet becomes one of its first half.
        let first_half = Some(rounded(0.5 * at));
        operations.extend(self.write_all(
            shape,
            &changed,
            |link| match link.from_length_fraction {
                None if link.from == sheet as i64 + 1 => {
                    LinkParameters { from_length_fraction: first_half, ..link.clone() }
                }
                _ => link.clone(),
            },
            |_| Vec::new(),
        ));
        operations
    }

    /// Merges two ends of the shape before `shape`; the sheets that they become are joined too.
    pub fn merge(&self, shape: usize, ends: [StrokeEnd; 2]) -> Vec<Operation> {
        let mut change = Table::default();
        change.push("sheets", integers(ends.map(|end| end.sheet as i64 + 1)));
        change.push("ends", integers(ends.map(|end| i64::from(end.last))));
        let mut operations =
            vec![Operation::Append { path: self.shape(shape).key("merge"), value: Value::Table(change) }];
        let before = self.lines(shape - 1);
        let points = ends.map(|end| {
            let line = before.get(end.sheet)?;
            if end.last { line.last().copied() } else { line.first().copied() }
        });
        if let [Some(first), Some(second)] = points {
            let joined = self.propagated(shape, &[first, second], |shape, targets| match targets {
                &[first, second] => self.joined_at(shape, [first, second]),
                _ => None,
            });
            operations.extend(self.write_all(shape, &joined, LinkParameters::clone, |_| Vec::new()));
        }
        operations
    }

    /// Applies `change` to shape `shape` and the shapes after it, at the points where `from` arrives, until it returns `None`.
    fn propagated(
        &self,
        shape: usize,
        from: &[DVec2],
        change: impl Fn(usize, &[DVec2]) -> Option<RemappedSheets>,
    ) -> Vec<RemappedSheets> {
        let mut points = from.to_vec();
        let mut changed = Vec::new();
        let shapes = if self.shows_changes() { shape..self.arrivals().len() } else { 0..0 };
        for shape in shapes {
            let arrived: Option<Vec<DVec2>> = points.iter().map(|&point| self.destination_of(shape, point)).collect();
            let Some(new) = arrived.and_then(|arrived| {
                points = arrived;
                change(shape, &points)
            }) else {
                break;
            };
            changed.push(new);
        }
        changed
    }

    /// The operations that write the changed shapes from `first` on, and renumber all references to their sheets, as [`renumbered`](Self::renumbered)
    /// says.
    pub(super) fn write_all(
        &self,
        first: usize,
        changed: &[RemappedSheets],
        update_link: impl Fn(&LinkParameters) -> LinkParameters,
        needless: impl Fn(usize) -> Vec<usize>,
    ) -> Vec<Operation> {
        let written = changed.iter().enumerate().flat_map(|(index, shape)| self.write(first + index, &shape.sheets));
        let mut operations: Vec<Operation> = written.collect();
        let remaps: Vec<SheetRemap> = changed.iter().map(|shape| shape.remap.clone()).collect();
        operations.extend(self.renumbered(first, &remaps, update_link, needless));
        operations
    }

    /// Exchanges two sheets in the list of shape `shape`.
    pub(super) fn exchange_sheets(&self, shape: usize, one: usize, other: usize) -> Vec<Operation> {
        let mut sheets = self.sheets(shape);
        if one < sheets.len() && other < sheets.len() {
            sheets.swap(one, other);
        }
        self.write(shape, &sheets)
    }

    /// Appends a copy of the last shape.
    pub fn add_shape(&self) -> Vec<Operation> {
        let mut shape = Table::default();
        shape.push("sheets", sheet_list(&self.sheets(self.arrivals().len() - 1)));
        let shape = Operation::Append { path: self.path.key("shapes"), value: Value::Table(shape) };
        // Default shapes must be stated before another can follow them.
        if self.is_stated() { vec![shape] } else { vec![shape.clone(), shape] }
    }

    /// Removes shape `shape`.
    pub fn remove_shape(&self, shape: usize) -> Vec<Operation> {
        let next = self.parameters.shapes.get(1).filter(|_| shape == 0);
        // The first shape has no transition.
        let stated = next.map_or(Vec::new(), |next| {
            let keys = [
                ("transition_s", next.transition_s.is_some()),
                ("transition_frames", next.transition_frames.is_some()),
                ("split", !next.split.is_empty()),
                ("merge", !next.merge.is_empty()),
                ("link", !next.link.is_empty()),
            ];
            keys.into_iter().filter(|(_, stated)| *stated).map(|(key, _)| key).collect()
        });
        let of_next = stated.into_iter().map(|key| Operation::Remove { path: self.shape(1).key(key) });
        of_next.chain([Operation::Remove { path: self.shape(shape) }]).collect()
    }

    /// Sets the duration of the transition to shape `shape`, s.
    pub fn retime(&self, shape: usize, transition_s: f64) -> Vec<Operation> {
        let path = self.shape(shape);
        let in_frames = self.parameters.shapes.get(shape).is_some_and(|shape| shape.transition_frames.is_some());
        let frames = in_frames.then(|| Operation::Remove { path: path.key("transition_frames") });
        let seconds = Value::Number((transition_s.max(0.1) * 100.0).round() / 100.0);
        frames.into_iter().chain([Operation::Set { path: path.key("transition_s"), value: seconds }]).collect()
    }

    /// Duration of the transition to shape `shape`, s.
    pub fn transition_s(&self, shape: usize) -> f64 {
        let hold = self.parameters.shapes.get(shape.wrapping_sub(1)).map_or(0.0, |before| before.hold_s);
        let [arrival, before] =
            [shape, shape.saturating_sub(1)].map(|shape| self.arrivals().get(shape).copied().unwrap_or_default());
        arrival - before - hold
    }

    /// Whether shapes are drawn as they are after their splits and merges, rather than before.
    pub fn shows_changes(&self) -> bool {
        self.parameters.morphing.correspondence == Correspondence::Automatic
    }

    pub(super) fn shape(&self, shape: usize) -> ValuePath {
        self.path.key("shapes").index(shape)
    }

    /// The point of shape `shape` at which `from` on the shape before arrives.
    fn destination_of(&self, shape: usize, from: DVec2) -> Option<DVec2> {
        let strands = self.point_paths(shape - 1);
        let arrivals = strands.iter().filter_map(|point_paths| {
            let [leaving, arriving] =
                [0, 1].map(|end| point_paths.iter().map(|point_path| point_path[end]).collect::<Vec<_>>());
            let on = polyline::nearest(&leaving, from)?;
            Some((on.distance, arriving.get(on.segment)?.lerp(*arriving.get(on.segment + 1)?, on.fraction)))
        });
        arrivals.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, point)| point)
    }

    /// The sheets of shape `shape`, with the one at `target` cut there, and the position of the cut; `None` where there is nothing to cut.
    fn cut_at(&self, shape: usize, target: DVec2) -> Option<(Vec<SheetParameters>, SheetPosition)> {
        let mut sheets = self.sheets(shape);
        let all = self.lines(shape);
        let (sheet, on) = polyline::nearest_among(&all, target)?;
        let line = &all[sheet];
        let fraction = polyline::fraction_of(line, on);
        // A short segment keeps most of its length.
        if fraction * (1.0 - fraction) < f64::EPSILON {
            // That the sheet is cut there already is reported by the validation.
            return None;
        }
        let gap = HALF_GAP * self.extent_km() / polyline::length(line).max(f64::MIN_POSITIVE);
        let ranges = [[0.0, fraction - gap.min(0.25 * fraction)], [fraction + gap.min(0.25 * (1.0 - fraction)), 1.0]];
        let parts = ranges.map(|range| SheetParameters {
            flux_factor: curve_range(&sheets[sheet].flux_factor, range),
            energy_factor: curve_range(&sheets[sheet].energy_factor, range),
            ..with_points(&sheets[sheet], self.simplified_points(&polyline::range(line, range)))
        });
        sheets.splice(sheet..=sheet, parts);
        Some((sheets, SheetPosition { sheet, fraction }))
    }

    /// The sheets of shape `shape`, with those that end at `targets` joined there; `None` where both ends are of one sheet.
    fn joined_at(&self, shape: usize, targets: [DVec2; 2]) -> Option<RemappedSheets> {
        let mut sheets = self.sheets(shape);
        let all = self.lines(shape);
        let ends = targets.map(|target| nearest_end(&all, target));
        let [Some(first), Some(second)] = ends else { return None };
        if first.sheet == second.sheet {
            return None;
        }
        // The first runs toward the seam, the second away from it.
        let parts = [
            JoinedPart { sheet: first.sheet, reversed: !first.last },
            JoinedPart { sheet: second.sheet, reversed: second.last },
        ];
        let lines = parts.map(|JoinedPart { sheet, reversed }| {
            let mut line = self.points(shape, sheet);
            if reversed {
                line.reverse();
            }
            line
        });
        let [one, other] = [polyline::length(&lines[0]), polyline::length(&lines[1])];
        let seam = one / (one + other);
        let directed = parts.map(|JoinedPart { sheet, reversed }| (&sheets[sheet], reversed));
        let flux_factors = directed.map(|(sheet, reversed)| DirectedCurve { curve: &sheet.flux_factor, reversed });
        let energy_factors = directed.map(|(sheet, reversed)| DirectedCurve { curve: &sheet.energy_factor, reversed });
        let (flux_factor, energy_factor) = (curve_chain(flux_factors, seam), curve_chain(energy_factors, seam));
        let points = lines.concat().into_iter().map(|point| self.rounded(point)).collect();
        let joined = SheetParameters { flux_factor, energy_factor, ..with_points(&sheets[first.sheet], points) };
        sheets[first.sheet.min(second.sheet)] = joined;
        sheets.remove(first.sheet.max(second.sheet));
        Some(RemappedSheets { sheets, remap: SheetRemap::Joined { parts, seam } })
    }

    /// The operations that set the sheets of shape `shape` and change nothing else.
    fn write(&self, shape: usize, sheets: &[SheetParameters]) -> Vec<Operation> {
        let path = self.shape(shape).key("sheets");
        let Some(old) = self.parameters.shapes.get(shape).map(|shape| &shape.sheets) else {
            let mut shape = Table::default();
            shape.push("sheets", sheet_list(sheets));
            return vec![Operation::Append { path: self.path.key("shapes"), value: Value::Table(shape) }];
        };
        list_edits(&path, old, sheets).unwrap_or_else(|| vec![Operation::Set { path, value: sheet_list(sheets) }])
    }
}

/// The operations that turn the list at `path` from `old` into `new` entry by entry, which keeps comments; `None` where entries would
/// have to be inserted.
fn list_edits(path: &ValuePath, old: &[SheetParameters], new: &[SheetParameters]) -> Option<Vec<Operation>> {
    if old.is_empty() {
        return None;
    }
    let mut rest = new.iter().peekable();
    let gone: Vec<usize> =
        (0..old.len()).filter(|&index| rest.next_if(|sheet| **sheet == old[index]).is_none()).collect();
    if rest.peek().is_none() {
        // From the last to the first, so that indices stay valid.
        return Some(gone.iter().rev().map(|&index| Operation::Remove { path: path.index(index) }).collect());
    }
    let behind = old.iter().rev().zip(new.iter().rev()).take_while(|(old, new)| old == new).count();
    let [kept, made] = [old.len(), new.len()].map(|count| count - behind);
    if made > kept && behind > 0 {
        return None;
    }
    let pairs = old.iter().zip(new).take(kept.min(made)).enumerate();
    let mut operations: Vec<Operation> =
        pairs.flat_map(|(sheet, (old, new))| differences(&path.index(sheet), old, new)).collect();
    operations.extend((made..kept).rev().map(|sheet| Operation::Remove { path: path.index(sheet) }));
    let added = new.get(kept..).filter(|_| made > kept).unwrap_or_default();
    operations.extend(
        added.iter().map(|sheet| Operation::Append { path: path.clone(), value: Value::Table(non_default(sheet)) }),
    );
    Some(operations)
}

fn nearest_end(all: &[Vec<DVec2>], target: DVec2) -> Option<StrokeEnd> {
    let ends = all.iter().enumerate().flat_map(|(sheet, line)| {
        let end =
            |last: bool, point: Option<&DVec2>| point.map(|point| (point.distance(target), StrokeEnd { sheet, last }));
        [end(false, line.first()), end(true, line.last())]
    });
    ends.flatten().min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, end)| end)
}

fn sheet_list(sheets: &[SheetParameters]) -> Value {
    Value::List(sheets.iter().map(|sheet| Value::Table(non_default(sheet)).into()).collect())
}

/// The keys to set and to remove so that `old` becomes `new`.
fn differences(path: &ValuePath, old: &SheetParameters, new: &SheetParameters) -> Vec<Operation> {
    let [old, new] = [non_default(old), non_default(new)];
    let keys = SheetParameters::table().parameters.iter().map(|parameter| parameter.key);
    let changes = keys.filter_map(|key| match (old.get(key), new.get(key)) {
        (old, new) if old == new => None,
        (_, Some(node)) => Some(Operation::Set { path: path.key(key), value: node.value.clone() }),
        (_, None) => Some(Operation::Remove { path: path.key(key) }),
    });
    changes.collect()
}
