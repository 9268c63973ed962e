//! A coordinate along the sheets that stays with them while they move, split and merge: rays and folds hang on it.

use std::collections::BTreeMap;

use bansho_base::math::{DVec2, lerp};

use crate::shapes::{Listing, Neighbourhood, Shape, Sheet, lengths};

/// Distance in the coordinate from one sheet of the first shape to the next, km: no two show the same rays.
const SHEET_KM: f64 = 40_000.0;
/// Time in which the coordinate comes back to the length along the sheet where this has stretched, s.
const RELAXATION_S: f64 = 2.0;
/// Where the coordinate changes this many times faster than the length, or slower, two sheets have grown together.
const BREAK: f64 = 6.0;
/// Segments shorter than this join whatever is beside them, km.
const SHORT_KM: f64 = 0.5;

/// From farther than this an added control point takes no coordinate, km.
const REACH_KM: f64 = 30.0;

/// The coordinate of each control point of a shape, km.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Along {
    pub(crate) sheets: Vec<Vec<f64>>,
    /// Whether the sheet passes each control point against the way on which the coordinate grew at first: left and right are those of that
    /// way, whichever way a sheet is listed.
    pub(crate) turned: Vec<Vec<bool>>,
    /// Where the control points were.
    pub(crate) points: Vec<Vec<DVec2>>,
    /// Who they are, and the turn of the loop in which they are these.
    tracks: Vec<Vec<usize>>,
    turn: i64,
}

/// The coordinate at a place, km, and 1 or -1 where the sheet runs with or against the way along which it has grown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Mark {
    pub(super) along: f64,
    pub(super) direction: f64,
}

impl Along {
    /// The length along each sheet.
    pub(crate) fn begin(shape: &Shape, listing: &Listing) -> Self {
        let sheet = |(index, sheet): (usize, &Sheet)| {
            lengths(&sheet.points).into_iter().map(|length| length + SHEET_KM * index as f64).collect()
        };
        let points = points(shape);
        Self {
            sheets: shape.sheets.iter().enumerate().map(sheet).collect(),
            turned: points.iter().map(|points| vec![false; points.len()]).collect(),
            points,
            tracks: listing.sheets.to_vec(),
            turn: listing.turn,
        }
    }

    /// The same for a shape without a sequence.
    #[cfg(test)]
    pub(crate) fn alone(shape: &Shape) -> Self {
        let mut numbers = 0..;
        let number = |sheet: &Sheet| numbers.by_ref().take(sheet.points.len()).collect();
        Self::begin(shape, &Listing::alone(&shape.sheets.iter().map(number).collect::<Vec<_>>()))
    }

    /// The coordinate on `shape`, which this has become, and whose control points are those of `listing`: each keeps its own, in whichever
    /// order and direction its sheet is listed now; those that are new have that of the place where they are born.
    pub(crate) fn follow(&self, shape: &Shape, listing: &Listing) -> Self {
        let points = points(shape);
        if listing.turn == self.turn && listing.sheets == self.tracks {
            let (tracks, turned) = (self.tracks.clone(), self.turned.clone());
            return Self { sheets: self.sheets.clone(), turned, points, tracks, turn: self.turn };
        }
        let before = Before::new(self, listing);
        let mut next = Self { tracks: listing.sheets.to_vec(), turn: listing.turn, ..Self::default() };
        for (index, (tracks, points)) in listing.sheets.iter().zip(&points).enumerate() {
            let (coordinates, turned) = before.carried(tracks, points, SHEET_KM * index as f64);
            next.sheets.push(coordinates);
            next.turned.push(turned);
        }
        Self { points, ..next }
    }

    /// Takes the control points of `listing` for its own, as after it has been read; `false` if they are not as many.
    pub(crate) fn take_listing(&mut self, listing: &Listing) -> bool {
        self.tracks = listing.sheets.to_vec();
        self.turn = listing.turn;
        self.sheets.iter().map(Vec::len).eq(self.tracks.iter().map(Vec::len))
    }

    /// Lets `seconds` pass in which stretches are taken back.
    pub(crate) fn relax(&mut self, seconds: f64) {
        let share = (seconds / RELAXATION_S).min(1.0);
        for ((coordinates, turned), points) in self.sheets.iter_mut().zip(&self.turned).zip(&self.points) {
            let lengths = lengths(points);
            let mut start = 0;
            while start < points.len() {
                let end = run_end(coordinates, &lengths, turned, start);
                relax_run(&mut coordinates[start..end], &lengths[start..end], turned[start], share);
                start = end;
            }
        }
    }

    /// What there is at the share `part` of the way from control point `index` of a sheet to the next. Where two sheets have grown together
    /// there, each half is as its own end, so that nothing depends on the direction.
    pub(super) fn between(&self, sheet: usize, index: usize, part: f64) -> Mark {
        let (coordinates, points) = (&self.sheets[sheet], &self.points[sheet]);
        let length = points[index].distance(points[index + 1]);
        let step = coordinates[index + 1] - coordinates[index];
        let [direction, next] = [index, index + 1].map(|point| if self.turned[sheet][point] { -1.0 } else { 1.0 });
        if direction == next && joined(step, length) {
            Mark { along: coordinates[index] + part * step, direction }
        } else if part < 0.5 {
            Mark { along: coordinates[index] + direction * part * length, direction }
        } else {
            Mark { along: coordinates[index + 1] - next * (1.0 - part) * length, direction: next }
        }
    }
}

/// What there was before the control points changed.
struct Before<'a> {
    along: &'a Along,
    /// The control points by number, with their sheet and place in it.
    places: Vec<(usize, [usize; 2])>,
    /// The sheet and place at which each segment began.
    starts: Vec<[usize; 2]>,
    near: Neighbourhood,
}

impl<'a> Before<'a> {
    fn new(along: &'a Along, listing: &Listing) -> Self {
        let same_turn = listing.turn == along.turn;
        let (mut places, mut starts) = (Vec::new(), Vec::new());
        for (sheet, tracks) in along.tracks.iter().enumerate() {
            starts.extend((1..tracks.len()).map(|point| [sheet, point - 1]));
            for (place, &track) in tracks.iter().enumerate() {
                let track = if same_turn { Some(track) } else { listing.after_turn(track) };
                places.extend(track.map(|track| (track, [sheet, place])));
            }
        }
        places.sort_unstable();
        let sheet = |points: &Vec<DVec2>| Sheet { points: points.clone(), ..Sheet::default() };
        let shape = Shape { sheets: along.points.iter().map(sheet).collect() };
        Self { along, places, starts, near: Neighbourhood::new(&shape, REACH_KM) }
    }

    fn place(&self, track: usize) -> Option<[usize; 2]> {
        let index = self.places.binary_search_by_key(&track, |(own, _)| *own).ok()?;
        Some(self.places[index].1)
    }

    /// Coordinates along a sheet of these control points, and whether it passes each against its first way; `begin` km at the start of a
    /// sheet that comes from nowhere.
    fn carried(&self, tracks: &[usize], points: &[DVec2], begin: f64) -> (Vec<f64>, Vec<bool>) {
        let known: Vec<Option<[usize; 2]>> = tracks.iter().map(|&track| self.place(track)).collect();
        let (turned, lengths) = (self.turned(&known, points), lengths(points));
        let mut coordinates: Vec<f64> = Vec::with_capacity(points.len());
        let (mut before, mut after) = (None, 0);
        for (index, place) in known.iter().enumerate() {
            let found = match place {
                Some([sheet, place]) => {
                    before = Some(index);
                    Some(self.along.sheets[*sheet][*place])
                }
                None => {
                    while after < known.len() && (after < index || known[after].is_none()) {
                        after += 1;
                    }
                    let between = before.filter(|_| after < known.len()).map(|before| [before, after]);
                    let within = between.and_then(|ends| self.within(ends, &known, &turned, (&lengths, index)));
                    within.or_else(|| Some(self.nearest(points[index])?.0.along))
                }
            };
            // Farther from all than a sheet moves in a step: on from the point before.
            let beyond = match index.checked_sub(1) {
                Some(last) if turned[index] => coordinates[last] - (lengths[index] - lengths[last]),
                Some(last) => coordinates[last] + (lengths[index] - lengths[last]),
                None => begin,
            };
            coordinates.push(found.unwrap_or(beyond));
        }
        (coordinates, turned)
    }

    /// Whether a sheet passes its control points against their first way: turned round since where it passes those of a sheet the other
    /// way. New ones do as those beside them, and a sheet of new ones as what was there.
    fn turned(&self, known: &[Option<[usize; 2]>], points: &[DVec2]) -> Vec<bool> {
        let mut ends: BTreeMap<usize, [usize; 2]> = BTreeMap::new();
        for [sheet, place] in known.iter().flatten() {
            ends.entry(*sheet).or_insert([*place; 2])[1] = *place;
        }
        let turned = |[sheet, place]: &[usize; 2]| {
            let now = ends.get(sheet).is_some_and(|[first, last]| first > last);
            self.along.turned[*sheet][*place] != now
        };
        let mut last = known.iter().flatten().next().map_or_else(|| self.turned_by_place(points), turned);
        let mut all = Vec::with_capacity(known.len());
        for place in known {
            last = place.as_ref().map_or(last, turned);
            all.push(last);
        }
        all
    }

    /// Whether the middle of a sheet of new control points runs against what is nearest to it.
    fn turned_by_place(&self, points: &[DVec2]) -> bool {
        let middle = points.len() / 2;
        let way = points[middle] - points[middle.saturating_sub(1)];
        self.nearest(points[middle]).is_some_and(|(mark, heading)| way.dot(heading) * mark.direction < 0.0)
    }

    /// The coordinate of a new control point between two that were there, if these are still joined: as far from one to the other.
    fn within(
        &self,
        ends: [usize; 2],
        known: &[Option<[usize; 2]>],
        turned: &[bool],
        (lengths, index): (&[f64], usize),
    ) -> Option<f64> {
        let [[sheet, first], [other, second]] = [known[ends[0]]?, known[ends[1]]?];
        let [from, to] = [self.along.sheets[sheet][first], self.along.sheets[other][second]];
        let length = lengths[ends[1]] - lengths[ends[0]];
        let is_one = sheet == other && turned[ends[0]] == turned[ends[1]] && joined(to - from, length);
        let part = (lengths[index] - lengths[ends[0]]) / length.max(f64::MIN_POSITIVE);
        is_one.then(|| lerp(from, to, part))
    }

    /// What there was at the place nearest to `point`, and the way along the sheet there; none beyond the reach.
    fn nearest(&self, point: DVec2) -> Option<(Mark, DVec2)> {
        let nearest = self.near.nearest_place(point)?;
        let [sheet, index] = self.starts[nearest.segment];
        let points = &self.along.points[sheet];
        Some((self.along.between(sheet, index, nearest.share), points[index + 1] - points[index]))
    }
}

fn points(shape: &Shape) -> Vec<Vec<DVec2>> {
    shape.sheets.iter().map(|sheet| sheet.points.clone()).collect()
}

/// Whether a step of the coordinate over a segment of that length may be one sheet's.
fn joined(step: f64, length: f64) -> bool {
    let long = length.max(SHORT_KM);
    step.abs() <= BREAK * long && step.abs() >= length / BREAK - SHORT_KM
}

/// Where the run that begins at point `start` ends: the points that have kept together, with the coordinate in one direction.
fn run_end(coordinates: &[f64], lengths: &[f64], turned: &[bool], start: usize) -> usize {
    let mut sign = 0.0;
    for index in start + 1..coordinates.len() {
        let (step, length) = (coordinates[index] - coordinates[index - 1], lengths[index] - lengths[index - 1]);
        if !joined(step, length) || step * sign < 0.0 || turned[index] != turned[start] {
            return index;
        }
        if step != 0.0 {
            sign = step;
        }
    }
    coordinates.len()
}

/// Moves a run toward the length along it, its middle fixed; a run without extent grows by the way in which it is `turned`.
fn relax_run(coordinates: &mut [f64], lengths: &[f64], turned: bool, share: f64) {
    let count = coordinates.len() as f64;
    let mean = |values: &[f64]| values.iter().sum::<f64>() / count;
    let (middle, middle_length) = (mean(coordinates), mean(lengths));
    let [first, last] = [coordinates.first(), coordinates.last()];
    let forward = if first == last { !turned } else { first < last };
    for (coordinate, length) in coordinates.iter_mut().zip(lengths) {
        let way = length - middle_length;
        let wanted = middle + if forward { way } else { -way };
        *coordinate += share * (wanted - *coordinate);
    }
}
