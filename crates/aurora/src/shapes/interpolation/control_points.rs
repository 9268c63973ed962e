//! From drawn shapes to control points that are followed from shape to shape.

use bansho_base::{host::assets::Assets, math::DVec2};

use super::{
    gap::Gap,
    spline_track::{Knot, Track},
};
use crate::shapes::{
    Correspondence, MotionParameters, ShapeFault, ShapeFaultKind, ShapeParameters,
    correspondence::{
        links::Anchors,
        sheet_matching::{Match, match_sheets},
        split_merge::{Change, Link},
        time_warping::warp_through,
    },
    geometry::polyline::{Polyline, shares},
    strokes::validate::{DrawnSheet, ShapeContext, drawn_sheets},
};

/// Control points nearer than this lie at one place, km.
const SAME_KM: f64 = 1e-3;

/// Control points of all shapes together that are followed at most: some 200 MB.
const MOST_POINTS: usize = 4_000_000;

/// Tracks, and which of them make up the sheets.
#[derive(Clone, Debug, Default)]
pub(crate) struct Followed {
    pub(crate) tracks: Vec<Track>,
    /// Sheets of each shape of the scene.
    pub(crate) shapes: Vec<Vec<Vec<usize>>>,
    /// Strands from each shape to the next.
    pub(crate) strands: Vec<Vec<Vec<usize>>>,
    /// Gaps that open or close from each shape to the next.
    pub(crate) gaps: Vec<Vec<Gap>>,
    /// Whether the last shape is the first again.
    pub(crate) returns: bool,
    /// Each track of the last shape that then lies where one of the first does, and that one, in order.
    pub(crate) again: Vec<[usize; 2]>,
}

/// The sheets of all shapes as they are drawn.
///
/// # Errors
/// A shape that cannot be drawn.
pub(crate) fn drawn_shapes(
    shapes: &[ShapeParameters],
    extent_km: f64,
    assets: &dyn Assets,
) -> Result<Vec<Vec<DrawnSheet>>, ShapeFault> {
    let draw = |(shape, parameters)| drawn_sheets(parameters, ShapeContext { shape, extent_km }, assets);
    shapes.iter().enumerate().map(draw).collect()
}

/// Follows the control points through all shapes, with what is drawn of them; `evenness` weighs even spacing against nearness where
/// they are matched by place.
///
/// # Errors
/// A shape that does not come from the one before; more control points than can be followed.
pub(crate) fn follow(
    (shapes, drawn): (&[ShapeParameters], &[Vec<DrawnSheet>]),
    motion: &MotionParameters,
    extent_km: f64,
    evenness: f64,
) -> Result<Followed, ShapeFault> {
    let mut count = 0;
    for (index, sheets) in drawn.iter().enumerate() {
        count += sheets.len() * motion.point_count();
        check_count(count, index)?;
    }
    let in_order = motion.correspondence == Correspondence::DrawingOrder;
    let mut followed = Followed::default();
    followed.begin(&drawn[0], motion);
    let mut count = followed.point_count(0);
    followed.returns = drawn.len() > 1 && same(&drawn[0], &drawn[drawn.len() - 1], extent_km);
    if let Some(last) = shapes.last().filter(|_| in_order) {
        // There the drawing shows the sheets before they part or join.
        followed.returns &= last.split.is_empty() && last.merge.is_empty();
    }
    for (index, parameters) in shapes.iter().enumerate().skip(1) {
        let mut change = Change::new(parameters, index, &followed.shapes[index - 1], &mut followed.tracks)?;
        let expected = if in_order { followed.shapes[index - 1].len() } else { change.chains.len() };
        if drawn[index].len() != expected {
            let kind = ShapeFaultKind::Unmatched { found: drawn[index].len(), expected };
            return Err(ShapeFault { key: format!("shapes.{index}.sheets"), kind });
        }
        if in_order && !parameters.link.is_empty() {
            return Err(ShapeFault { key: format!("shapes.{index}.link"), kind: ShapeFaultKind::LinkInOrder });
        }
        if in_order {
            followed.go_in_order(&change, &drawn[index], motion);
        } else {
            change.refine(motion.point_count(), index - 1, &mut followed.tracks);
            let before = &followed.shapes[index - 1];
            let anchors = Anchors::new(&parameters.link, index, before, &change, &followed.tracks)?;
            let closes = followed.returns && index == shapes.len() - 1;
            followed.go_nearest(&change, &drawn[index], &anchors, closes, evenness);
        }
        followed.gaps.push(change.gaps());
        followed.strands.push(change.strands);
        // Sheets that have grown together keep all of their points.
        count += followed.point_count(index);
        check_count(count, index)?;
    }
    if followed.returns {
        followed.again = followed.meeting_again();
    }
    Ok(followed)
}

/// Refuses more control points of all shapes up to shape `index` than can be held.
fn check_count(found: usize, index: usize) -> Result<(), ShapeFault> {
    let kind = ShapeFaultKind::TooManyPoints { found, most: MOST_POINTS };
    let fault = || ShapeFault { key: format!("shapes.{index}.sheets"), kind };
    if found > MOST_POINTS { Err(fault()) } else { Ok(()) }
}

/// Where a chain of strands goes.
struct Goal<'a> {
    drawn: &'a DrawnSheet,
    of: Match,
    /// The tracks of that sheet in the first shape, if it shall be reached again point by point.
    first: Option<Vec<usize>>,
    evenness: f64,
    anchors: &'a Anchors,
}

/// Whether two drawn shapes are the same, sheet by sheet: where they lie, and their flux and energy along them.
fn same(first: &[DrawnSheet], last: &[DrawnSheet], extent_km: f64) -> bool {
    const SAMPLES: usize = 64;
    let near = |a: &DVec2, b: &DVec2| a.distance(*b) < 1e-6 * extent_km;
    let same_sheet = |(a, b): (&DrawnSheet, &DrawnSheet)| {
        let [first, last] = [a, b].map(|sheet| sheet.line.evenly(SAMPLES));
        first.iter().zip(&last).all(|(a, b)| near(a, b)) && a.factors.are_those_of(&b.factors)
    };
    first.len() == last.len() && first.iter().zip(last).all(same_sheet)
}

/// Control points of a sheet with flux and energy there.
fn control_knots(sheet: &DrawnSheet, count: usize, motion: &MotionParameters) -> Vec<Knot> {
    let points = sheet.control_points(count, motion.spacing);
    let shares = shares(&points);
    let knot = |(position, share): (DVec2, f64)| Knot { position, values: sheet.factors.at(share) };
    points.into_iter().zip(shares).map(knot).collect()
}

impl Followed {
    /// Control points of a shape.
    fn point_count(&self, shape: usize) -> usize {
        self.shapes[shape].iter().map(Vec::len).sum()
    }

    /// Each track of the last shape that lies where one of the first does, point by point of the sheets as they are drawn.
    fn meeting_again(&self) -> Vec<[usize; 2]> {
        let last = self.shapes.len() - 1;
        let same_count = |(first, last): &(&Vec<usize>, &Vec<usize>)| first.len() == last.len();
        let sheets = self.shapes[0].iter().zip(&self.shapes[last]).filter(same_count);
        let pairs = sheets.flat_map(|(firsts, lasts)| lasts.iter().zip(firsts).map(|(&last, &first)| [last, first]));
        let meets = |pair: &[usize; 2]| {
            let [there, here] = [self.tracks[pair[0]].knot(last), self.tracks[pair[1]].knot(0)];
            there.position.distance(here.position) < SAME_KM
        };
        let mut pairs: Vec<[usize; 2]> = pairs.filter(meets).collect();
        pairs.sort_unstable();
        pairs
    }

    /// The first shape.
    fn begin(&mut self, drawn: &[DrawnSheet], motion: &MotionParameters) {
        let mut sheets = Vec::new();
        for sheet in drawn {
            let first = self.tracks.len();
            let knots = control_knots(sheet, motion.point_count(), motion);
            self.tracks.extend(knots.into_iter().map(|knot| Track::new(0, None, knot)));
            sheets.push((first..self.tracks.len()).collect());
        }
        self.shapes.push(sheets);
    }

    /// The thesis's way: sheet by sheet and point by point. Where a sheet splits, the segment between the parts shrinks away; where
    /// two ends merge, a segment grows between them.
    fn go_in_order(&mut self, change: &Change, drawn: &[DrawnSheet], motion: &MotionParameters) {
        let sheets = self.shapes[self.shapes.len() - 1].clone();
        let next = self.shapes.len();
        for (sheet, drawn) in sheets.iter().zip(drawn) {
            for (&track, knot) in sheet.iter().zip(control_knots(drawn, sheet.len(), motion)) {
                self.tracks[track].knots.push(knot);
            }
        }
        for pair in &change.splits {
            for (&new, &old) in pair.new.iter().zip(&pair.old) {
                let knot = self.tracks[old].knot(next);
                self.tracks[new].knots.push(knot);
            }
        }
        for pair in &change.merges {
            let [first, second] = pair.old.map(|old| self.tracks[old].knot(next));
            pair.new.iter().for_each(|&new| self.tracks[new].knots.push(first.lerp(second, 0.5)));
        }
        // Coincident points are dropped: both of a split, one of a merge.
        let dropped: Vec<usize> = change
            .splits
            .iter()
            .flat_map(|pair| pair.new)
            .chain(change.merges.iter().map(|pair| pair.new[1]))
            .collect();
        let sheet = |chain: &Vec<Link>| -> Vec<usize> {
            let tracks = chain.iter().flat_map(|&link| change.along(link));
            tracks.filter(|track| !dropped.contains(track)).collect()
        };
        self.shapes.push(change.chains.iter().map(sheet).collect());
    }

    /// By place: each chain of strands to the sheet that it is matched with, each point to one by length and nearness.
    fn go_nearest(&mut self, change: &Change, drawn: &[DrawnSheet], anchors: &Anchors, closes: bool, evenness: f64) {
        let knot = self.shapes.len() - 1;
        let position = |track: &usize| self.tracks[*track].knot(knot).position;
        let line = |chain: &Vec<Link>| -> Vec<DVec2> {
            chain.iter().flat_map(|&link| change.along(link)).map(|track| position(&track)).collect()
        };
        // A strand has at least two points, so that no line is left out.
        let sources: Vec<Polyline> = change.chains.iter().filter_map(|chain| Polyline::new(line(chain))).collect();
        let targets: Vec<&Polyline> = drawn.iter().map(|sheet| &sheet.line).collect();
        let matches = match_sheets(&sources, &targets, &anchors.wanted);
        let mut sheets = vec![Vec::new(); drawn.len()];
        for (chain, of) in change.chains.iter().zip(matches) {
            let first = closes.then(|| self.shapes[0][of.target].clone());
            let goal = Goal { drawn: &drawn[of.target], of, first, evenness, anchors };
            let mut sheet = self.go_along(change, chain, &goal);
            if of.reversed {
                sheet.reverse();
            }
            sheets[of.target] = sheet;
        }
        self.shapes.push(sheets);
    }

    /// Moves the strands of a chain to their parts of a sheet; the sheet's tracks, along the chain.
    fn go_along(&mut self, change: &Change, chain: &[Link], goal: &Goal) -> Vec<usize> {
        let Goal { drawn, of, first, evenness, anchors } = goal;
        let knot = self.shapes.len() - 1;
        let strands: Vec<Vec<usize>> = chain.iter().map(|&link| change.along(link)).collect();
        let points: Vec<Vec<DVec2>> = strands
            .iter()
            .map(|strand| strand.iter().map(|&track| self.tracks[track].knot(knot).position).collect())
            .collect();
        let mut sheet: Vec<usize> = Vec::new();
        for ((strand, points), range) in strands.iter().zip(&points).zip(parts(&points)) {
            let range = if of.reversed { range.map(|share| 1.0 - share) } else { range };
            let linked = anchors.along(strand, range);
            let again = first.as_ref().filter(|first| chain.len() == 1 && first.len() == strand.len());
            let again = again.filter(|_| linked.is_empty());
            let knots: Vec<Knot> = match again {
                Some(first) => first.iter().map(|&track| self.tracks[track].knot(0)).collect(),
                None => {
                    let knot = |share: f64| Knot { position: drawn.line.at(share), values: drawn.factors.at(share) };
                    warp_through(points, &drawn.line, range, &linked, *evenness).into_iter().map(knot).collect()
                }
            };
            let turned = again.is_some() && of.reversed;
            for (index, &track) in strand.iter().enumerate() {
                let place = if turned { knots.len() - 1 - index } else { index };
                self.tracks[track].knots.push(knots[place]);
            }
            // Where two strands have met, two points coincide; one of them goes on.
            sheet.extend(&strand[usize::from(!sheet.is_empty())..]);
        }
        sheet
    }
}

/// The share of a sheet's length that each strand of a chain takes: as its length, and half of the gap on each side.
fn parts(strands: &[Vec<DVec2>]) -> Vec<[f64; 2]> {
    let length = |points: &[DVec2]| points.windows(2).map(|pair| pair[0].distance(pair[1])).sum::<f64>();
    let gap = |place: usize| match (
        strands.get(place).and_then(|s| s.last()),
        strands.get(place + 1).and_then(|s| s.first()),
    ) {
        (Some(end), Some(start)) => end.distance(*start),
        _ => 0.0,
    };
    let mut ends = vec![0.0];
    for (place, points) in strands.iter().enumerate() {
        let before = if place > 0 { gap(place - 1) } else { 0.0 };
        ends.push(ends[place] + length(points) + (before + gap(place)) / 2.0);
    }
    let total = ends[strands.len()];
    let share = |place: usize| if total > 0.0 { ends[place] / total } else { place as f64 / strands.len() as f64 };
    (0..strands.len()).map(|place| [share(place), share(place + 1)]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strands_share_a_sheet_by_length_and_half_of_the_gap() {
        let strand = |from: f64, to: f64| vec![DVec2::new(from, 0.0), DVec2::new(to, 0.0)];
        // Lengths 4 and 2, a gap of 2: 5 and 3 of 8.
        assert_eq!(parts(&[strand(0.0, 4.0), strand(6.0, 8.0)]), [[0.0, 0.625], [0.625, 1.0]]);
        assert_eq!(parts(&[strand(1.0, 1.0), strand(1.0, 1.0)]), [[0.0, 0.5], [0.5, 1.0]]);
        assert_eq!(parts(&[strand(0.0, 3.0)]), [[0.0, 1.0]]);
    }
}
