//! A persistent arc-length coordinate along the sheets, carried along as they move, split and merge: the texture
//! coordinate of rays and folds.

use std::collections::BTreeMap;

use bansho_base::math::{DVec2, lerp};

use crate::shapes::{ControlPointIds, NearestSegmentGrid, Shape, Sheet, cumulative_lengths};

/// Offset between the coordinates of successive sheets of the first shape, km, so that no two have the same rays.
const SHEET_OFFSET_KM: f64 = 40_000.0;
/// Relaxation time of the coordinate toward arc length after stretching, s.
const RELAXATION_S: f64 = 2.0;
/// Maximum ratio between changes of the coordinate and of the length; beyond it two sheets have merged there.
const MAX_STRETCH: f64 = 6.0;
/// Minimum length for that test, km.
const SHORT_KM: f64 = 0.5;

/// Maximum distance for the coordinate of an inserted control point, km.
const REACH_KM: f64 = 30.0;

/// Coordinate of each control point of a shape, km.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct ArcLengthMap {
    pub(crate) coordinates: Vec<Vec<f64>>,
    /// Whether the sheet is listed there against the original direction of the coordinate, which defines left and
    /// right.
    pub(crate) reversed: Vec<Vec<bool>>,
    /// Positions of the control points.
    pub(crate) points: Vec<Vec<DVec2>>,
    /// Their ids, and the cycle of the loop.
    tracks: Vec<Vec<usize>>,
    cycle: i64,
}

/// Coordinate at a position, km, and 1 or -1 for a sheet listed along or against it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ArcPosition {
    pub(super) coordinate: f64,
    pub(super) direction: f64,
}

impl ArcLengthMap {
    /// Initializes the coordinate with the arc length of each sheet.
    pub(crate) fn from_lengths(shape: &Shape, ids: &ControlPointIds) -> Self {
        let points = points(shape);
        let mut coordinates = Vec::with_capacity(points.len());
        for (index, sheet) in points.iter().enumerate() {
            let lengths = cumulative_lengths(sheet).into_iter();
            coordinates.push(lengths.map(|length| length + SHEET_OFFSET_KM * index as f64).collect());
        }
        Self {
            coordinates,
            reversed: points.iter().map(|points| vec![false; points.len()]).collect(),
            points,
            tracks: ids.sheets.to_vec(),
            cycle: ids.cycle,
        }
    }

    /// The same for a shape without a sequence.
    #[cfg(test)]
    pub(crate) fn alone(shape: &Shape) -> Self {
        let mut numbers = 0..;
        let sheets = shape.sheets.iter().map(|sheet| numbers.by_ref().take(sheet.points.len()).collect());
        Self::from_lengths(shape, &ControlPointIds::alone(&sheets.collect::<Vec<_>>()))
    }

    /// Transfers the coordinate to `shape`, whose control points are `ids`: existing points keep theirs, in whichever
    /// order and direction they are listed; new points take that of the position where they appear.
    pub(crate) fn transfer(&self, shape: &Shape, ids: &ControlPointIds) -> Self {
        let points = points(shape);
        if ids.cycle == self.cycle && ids.sheets == self.tracks {
            let (tracks, reversed) = (self.tracks.clone(), self.reversed.clone());
            return Self { coordinates: self.coordinates.clone(), reversed, points, tracks, cycle: self.cycle };
        }
        let before = PreviousArcMap::new(self, ids);
        let mut next = Self { tracks: ids.sheets.to_vec(), cycle: ids.cycle, ..Self::default() };
        for (index, (tracks, points)) in ids.sheets.iter().zip(&points).enumerate() {
            let (coordinates, reversed) = before.transfer_sheet(tracks, points, SHEET_OFFSET_KM * index as f64);
            next.coordinates.push(coordinates);
            next.reversed.push(reversed);
        }
        Self { points, ..next }
    }

    /// Sets the ids after deserialization; `false` if the number of points differs.
    pub(crate) fn take_control_point_ids(&mut self, ids: &ControlPointIds) -> bool {
        self.tracks = ids.sheets.to_vec();
        self.cycle = ids.cycle;
        self.coordinates.iter().map(Vec::len).eq(self.tracks.iter().map(Vec::len))
    }

    /// Relaxes the coordinate toward arc length for a time in s.
    pub(crate) fn relax(&mut self, seconds: f64) {
        let fraction = (seconds / RELAXATION_S).min(1.0);
        for ((coordinates, reversed), points) in self.coordinates.iter_mut().zip(&self.reversed).zip(&self.points) {
            let cumulative_lengths = cumulative_lengths(points);
            let mut start = 0;
            while start < points.len() {
                let end = run_end(coordinates, &cumulative_lengths, reversed, start);
                relax_run(&mut coordinates[start..end], &cumulative_lengths[start..end], reversed[start], fraction);
                start = end;
            }
        }
    }

    /// The coordinate at fraction `t` between control point `index` and the next. Where two sheets have merged, each
    /// half continues its own end, so the result does not depend on the direction.
    pub(super) fn interpolate(&self, sheet: usize, index: usize, t: f64) -> ArcPosition {
        let (coordinates, points) = (&self.coordinates[sheet], &self.points[sheet]);
        let length = points[index].distance(points[index + 1]);
        let step = coordinates[index + 1] - coordinates[index];
        let [direction, next] = [index, index + 1].map(|point| if self.reversed[sheet][point] { -1.0 } else { 1.0 });
        if direction == next && joined(step, length) {
            ArcPosition { coordinate: coordinates[index] + t * step, direction }
        } else if t < 0.5 {
            ArcPosition { coordinate: coordinates[index] + direction * t * length, direction }
        } else {
            ArcPosition { coordinate: coordinates[index + 1] - next * (1.0 - t) * length, direction: next }
        }
    }
}

/// The previous map and lookup structures.
struct PreviousArcMap<'a> {
    map: &'a ArcLengthMap,
    /// Sorted control-point ids with sheet and index.
    slots: Vec<(usize, [usize; 2])>,
    /// Sheet and index of the start of each segment.
    starts: Vec<[usize; 2]>,
    near: NearestSegmentGrid,
}

impl<'a> PreviousArcMap<'a> {
    fn new(map: &'a ArcLengthMap, ids: &ControlPointIds) -> Self {
        let same_turn = ids.cycle == map.cycle;
        let (mut slots, mut starts) = (Vec::new(), Vec::new());
        for (sheet, tracks) in map.tracks.iter().enumerate() {
            starts.extend((1..tracks.len()).map(|point| [sheet, point - 1]));
            for (slot, &track) in tracks.iter().enumerate() {
                let track = if same_turn { Some(track) } else { ids.after_cycle(track) };
                slots.extend(track.map(|track| (track, [sheet, slot])));
            }
        }
        slots.sort_unstable();
        let sheets = map.points.iter().map(|points| Sheet { points: points.clone(), ..Sheet::default() });
        let shape = Shape { sheets: sheets.collect() };
        Self { map, slots, starts, near: NearestSegmentGrid::new(&shape, REACH_KM) }
    }

    fn slot(&self, track: usize) -> Option<[usize; 2]> {
        let index = self.slots.binary_search_by_key(&track, |(id, _)| *id).ok()?;
        Some(self.slots[index].1)
    }

    /// Coordinates and directions of a sheet with these control points; a sheet without predecessor starts at the coordinate
    /// `start`, km.
    fn transfer_sheet(&self, tracks: &[usize], points: &[DVec2], start: f64) -> (Vec<f64>, Vec<bool>) {
        let slots: Vec<Option<[usize; 2]>> = tracks.iter().map(|&track| self.slot(track)).collect();
        let (reversed, cumulative_lengths) = (self.reversed(&slots, points), cumulative_lengths(points));
        let mut coordinates: Vec<f64> = Vec::with_capacity(points.len());
        let (mut before, mut after) = (None, 0);
        for (index, slot) in slots.iter().enumerate() {
            let found = match slot {
                Some([sheet, slot]) => {
                    before = Some(index);
                    Some(self.map.coordinates[*sheet][*slot])
                }
                None => {
                    while after < slots.len() && (after < index || slots[after].is_none()) {
                        after += 1;
                    }
                    let between = before.filter(|_| after < slots.len()).map(|before| [before, after]);
                    let within = between
                        .and_then(|ends| self.between_known(ends, &slots, &reversed, &cumulative_lengths, index));
                    within.or_else(|| Some(self.nearest(points[index])?.0.coordinate))
                }
            };
            // Beyond the search distance: continue from the previous point.
            let beyond = match index.checked_sub(1) {
                Some(last) if reversed[index] => {
                    coordinates[last] - (cumulative_lengths[index] - cumulative_lengths[last])
                }
                Some(last) => coordinates[last] + (cumulative_lengths[index] - cumulative_lengths[last]),
                None => start,
            };
            coordinates.push(found.unwrap_or(beyond));
        }
        (coordinates, reversed)
    }

    /// Direction of a sheet at its control points: reversed where it passes those of a previous sheet in the opposite
    /// order. New points take the direction of their neighbors, and a sheet of new points that of the nearest previous
    /// sheet.
    fn reversed(&self, slots: &[Option<[usize; 2]>], points: &[DVec2]) -> Vec<bool> {
        // First and last slot by previous sheet, in the new order.
        let mut ends: BTreeMap<usize, [usize; 2]> = BTreeMap::new();
        for [sheet, slot] in slots.iter().flatten() {
            ends.entry(*sheet).or_insert([*slot; 2])[1] = *slot;
        }
        let mut all: Vec<Option<bool>> = Vec::with_capacity(slots.len());
        for slot in slots {
            let reversed = slot.map(|[sheet, slot]| {
                let is_opposite = ends.get(&sheet).is_some_and(|[first, last]| first > last);
                self.map.reversed[sheet][slot] != is_opposite
            });
            all.push(reversed);
        }
        // New points before the first known one take its direction, others that of the known one before them.
        let first = all.iter().flatten().next().copied();
        let mut last = first.unwrap_or_else(|| self.reversed_by_position(points));
        all.into_iter()
            .map(|reversed| {
                last = reversed.unwrap_or(last);
                last
            })
            .collect()
    }

    /// Whether the middle of a sheet of new control points runs against the nearest previous sheet.
    fn reversed_by_position(&self, points: &[DVec2]) -> bool {
        let middle = points.len() / 2;
        let displacement = points[middle] - points[middle.saturating_sub(1)];
        self.nearest(points[middle])
            .is_some_and(|(position, heading)| displacement.dot(heading) * position.direction < 0.0)
    }

    /// Coordinate of a new control point between two existing ones that are still joined, by arc length.
    fn between_known(
        &self,
        ends: [usize; 2],
        slots: &[Option<[usize; 2]>],
        reversed: &[bool],
        cumulative_lengths: &[f64],
        index: usize,
    ) -> Option<f64> {
        let [[sheet, first], [other, second]] = [slots[ends[0]]?, slots[ends[1]]?];
        let [from, to] = [self.map.coordinates[sheet][first], self.map.coordinates[other][second]];
        let length = cumulative_lengths[ends[1]] - cumulative_lengths[ends[0]];
        let is_one = sheet == other && reversed[ends[0]] == reversed[ends[1]] && joined(to - from, length);
        let t = (cumulative_lengths[index] - cumulative_lengths[ends[0]]) / length.max(f64::MIN_POSITIVE);
        is_one.then(|| lerp(from, to, t))
    }

    /// Coordinate at the nearest point of the previous sheets, and the direction of the sheet there; `None` beyond the
    /// search distance.
    fn nearest(&self, point: DVec2) -> Option<(ArcPosition, DVec2)> {
        let nearest = self.near.nearest_point(point)?;
        let [sheet, index] = self.starts[nearest.segment];
        let points = &self.map.points[sheet];
        Some((self.map.interpolate(sheet, index, nearest.fraction), points[index + 1] - points[index]))
    }
}

fn points(shape: &Shape) -> Vec<Vec<DVec2>> {
    shape.sheets.iter().map(|sheet| sheet.points.clone()).collect()
}

/// Whether a coordinate step over a segment of that length is consistent with one sheet.
fn joined(step: f64, length: f64) -> bool {
    let long = length.max(SHORT_KM);
    step.abs() <= MAX_STRETCH * long && step.abs() >= length / MAX_STRETCH - SHORT_KM
}

/// End of the run from point `start`: points of one sheet with a monotonic coordinate.
fn run_end(coordinates: &[f64], cumulative_lengths: &[f64], reversed: &[bool], start: usize) -> usize {
    let mut sign = 0.0;
    for index in start + 1..coordinates.len() {
        let (step, length) =
            (coordinates[index] - coordinates[index - 1], cumulative_lengths[index] - cumulative_lengths[index - 1]);
        if !joined(step, length) || step * sign < 0.0 || reversed[index] != reversed[start] {
            return index;
        }
        if step != 0.0 {
            sign = step;
        }
    }
    coordinates.len()
}

/// Relaxes a run toward arc length about its mean; a degenerate run takes the direction of `reversed`.
fn relax_run(coordinates: &mut [f64], cumulative_lengths: &[f64], reversed: bool, fraction: f64) {
    let count = coordinates.len() as f64;
    let [middle, middle_length] = [&*coordinates, cumulative_lengths].map(|values| values.iter().sum::<f64>() / count);
    let [first, last] = [coordinates.first(), coordinates.last()];
    let forward = if first == last { !reversed } else { first < last };
    for (coordinate, length) in coordinates.iter_mut().zip(cumulative_lengths) {
        let displacement = length - middle_length;
        let target = middle + if forward { displacement } else { -displacement };
        *coordinate += fraction * (target - *coordinate);
    }
}
