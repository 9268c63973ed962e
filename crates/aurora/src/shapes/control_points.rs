//! Tracks control points through all shapes of a sequence.

use bansho_base::{host::assets::Assets, math::DVec2};

use super::{
    Correspondence, MorphingParameters, ShapeError, ShapeErrorKind, ShapeParameters,
    correspondence::{
        links::LinkConstraints,
        sheet_matching::{SheetMatch, match_sheets},
        split_merge::{ChainLink, Transition},
        time_warping::warp_through,
    },
    geometry::polyline::{Polyline, length_fractions, line_length},
    interpolation::{ControlPointTrack, Gap, Knot},
    strokes::{DrawnSheet, ShapeContext, drawn_sheets},
};

/// Control points closer than this coincide, km.
const SAME_KM: f64 = 1e-3;

/// Maximum number of control points of all shapes, which take about 200 MB.
const MAX_POINTS: usize = 4_000_000;

/// Control-point tracks, and the tracks of each sheet.
#[derive(Clone, Debug, Default)]
pub(crate) struct TrackedControlPoints {
    pub(crate) tracks: Vec<ControlPointTrack>,
    /// Sheets of each shape of the scene.
    pub(crate) shapes: Vec<Vec<Vec<usize>>>,
    /// Strands from each shape to the next.
    pub(crate) strands: Vec<Vec<Vec<usize>>>,
    /// Gaps that open or close from each shape to the next.
    pub(crate) gaps: Vec<Vec<Gap>>,
    /// Whether the last shape equals the first.
    pub(crate) is_closed: bool,
    /// Pairs of tracks: one of the last shape, sorted, and the coincident one of the first shape.
    pub(crate) repeated: Vec<[usize; 2]>,
}

/// The sheets of all shapes as drawn.
///
/// # Errors
///
/// An invalid shape.
pub(crate) fn drawn_shapes(
    shapes: &[ShapeParameters],
    extent_km: f64,
    assets: &dyn Assets,
) -> Result<Vec<Vec<DrawnSheet>>, ShapeError> {
    let mut drawn = Vec::with_capacity(shapes.len());
    for (shape, parameters) in shapes.iter().enumerate() {
        drawn.push(drawn_sheets(parameters, ShapeContext { shape, extent_km }, assets)?);
    }
    Ok(drawn)
}

/// Tracks control points through all shapes. `evenness` weights uniform spacing against distance in the automatic
/// correspondence.
///
/// # Errors
///
/// A shape with the wrong number of sheets; too many control points.
pub(crate) fn track_control_points(
    shapes: &[ShapeParameters],
    drawn: &[Vec<DrawnSheet>],
    morphing: &MorphingParameters,
    extent_km: f64,
    evenness: f64,
) -> Result<TrackedControlPoints, ShapeError> {
    let mut count = 0;
    for (index, sheets) in drawn.iter().enumerate() {
        count += sheets.len() * morphing.point_count();
        check_count(count, index)?;
    }
    let in_order = morphing.correspondence == Correspondence::DrawingOrder;
    let mut tracked = TrackedControlPoints::default();
    tracked.begin(&drawn[0], morphing);
    let mut count = tracked.point_count(0);
    tracked.is_closed = drawn.len() > 1 && same(&drawn[0], &drawn[drawn.len() - 1], extent_km);
    if let Some(last) = shapes.last().filter(|_| in_order) {
        // In drawing order a shape is drawn before its splits and merges.
        tracked.is_closed &= last.split.is_empty() && last.merge.is_empty();
    }
    for (index, parameters) in shapes.iter().enumerate().skip(1) {
        let mut transition = Transition::new(parameters, index, &tracked.shapes[index - 1], &mut tracked.tracks)?;
        let expected = if in_order { tracked.shapes[index - 1].len() } else { transition.chains.len() };
        if drawn[index].len() != expected {
            let found = drawn[index].len();
            let kind = if in_order {
                ShapeErrorKind::UnmatchedInOrder { found, expected }
            } else {
                ShapeErrorKind::Unmatched { found, expected }
            };
            return Err(ShapeError::in_shape(index, "sheets", kind));
        }
        if in_order && !parameters.link.is_empty() {
            return Err(ShapeError::in_shape(index, "link", ShapeErrorKind::LinkInOrder));
        }
        if in_order {
            tracked.advance_in_order(&transition, &drawn[index], morphing);
        } else {
            transition.refine(morphing.point_count(), index - 1, &mut tracked.tracks);
            let before = &tracked.shapes[index - 1];
            let constraints = LinkConstraints::new(&parameters.link, index, before, &transition, &tracked.tracks)?;
            let closes = tracked.is_closed && index == shapes.len() - 1;
            tracked.advance_by_nearness(&transition, &drawn[index], &constraints, closes, evenness);
        }
        tracked.gaps.push(transition.gaps());
        tracked.strands.push(transition.strands);
        // Merged sheets keep all their points.
        count += tracked.point_count(index);
        check_count(count, index)?;
    }
    if tracked.is_closed {
        tracked.repeated = tracked.repeated_points();
    }
    Ok(tracked)
}

/// Checks the number of control points up to shape `index`.
fn check_count(found: usize, index: usize) -> Result<(), ShapeError> {
    if found > MAX_POINTS {
        let kind = ShapeErrorKind::TooManyPoints { found, max: MAX_POINTS };
        return Err(ShapeError::in_shape(index, "sheets", kind));
    }
    Ok(())
}

/// The target of a chain of strands.
struct ChainTarget<'a> {
    drawn: &'a DrawnSheet,
    matched: SheetMatch,
    /// Tracks of that sheet in the first shape, if this is the last shape of a closed sequence.
    first_shape: Option<Vec<usize>>,
    evenness: f64,
    constraints: &'a LinkConstraints,
}

/// Whether two drawn shapes have equal positions, flux and energy.
fn same(first: &[DrawnSheet], last: &[DrawnSheet], extent_km: f64) -> bool {
    first.len() == last.len() && first.iter().zip(last).all(|(a, b)| same_sheet(a, b, 1e-6 * extent_km))
}

/// Whether two drawn sheets have equal flux and energy, and positions that differ by less than `tolerance_km`.
fn same_sheet(a: &DrawnSheet, b: &DrawnSheet, tolerance_km: f64) -> bool {
    const SAMPLES: usize = 64;
    let [a_points, b_points] = [a, b].map(|sheet| sheet.line.resample(SAMPLES));
    let is_near = a_points.iter().zip(&b_points).all(|(a, b)| a.distance(*b) < tolerance_km);
    is_near && a.factors.approximately_equals(&b.factors)
}

/// Control points of a sheet with flux and energy factors.
fn control_knots(sheet: &DrawnSheet, count: usize, morphing: &MorphingParameters) -> Vec<Knot> {
    let points = sheet.control_points(count, morphing.control_point_spacing);
    let fractions = length_fractions(&points);
    let positions = points.into_iter().zip(fractions);
    positions.map(|(position, fraction)| Knot { position, factors: sheet.factors.at(fraction) }).collect()
}

impl TrackedControlPoints {
    /// Control points of a shape.
    fn point_count(&self, shape: usize) -> usize {
        self.shapes[shape].iter().map(Vec::len).sum()
    }

    /// Positions of tracks at shape `knot`, km.
    fn positions(&self, tracks: &[usize], knot: usize) -> Vec<DVec2> {
        tracks.iter().map(|&track| self.tracks[track].knot(knot).position).collect()
    }

    /// Pairs of coincident tracks of the last and the first shape.
    fn repeated_points(&self) -> Vec<[usize; 2]> {
        let last = self.shapes.len() - 1;
        let mut pairs = Vec::new();
        for (firsts, lasts) in self.shapes[0].iter().zip(&self.shapes[last]) {
            if firsts.len() != lasts.len() {
                continue;
            }
            for (&first_track, &last_track) in firsts.iter().zip(lasts) {
                let [first_knot, last_knot] = [self.tracks[first_track].knot(0), self.tracks[last_track].knot(last)];
                if last_knot.position.distance(first_knot.position) < SAME_KM {
                    pairs.push([last_track, first_track]);
                }
            }
        }
        pairs.sort_unstable();
        pairs
    }

    /// Adds the first shape.
    fn begin(&mut self, drawn: &[DrawnSheet], morphing: &MorphingParameters) {
        let mut sheets = Vec::new();
        for sheet in drawn {
            let first = self.tracks.len();
            let knots = control_knots(sheet, morphing.point_count(), morphing);
            self.tracks.extend(knots.into_iter().map(|knot| ControlPointTrack::new(0, None, knot)));
            sheets.push((first..self.tracks.len()).collect());
        }
        self.shapes.push(sheets);
    }

    /// Correspondence by drawing order, as in the thesis. Where a sheet splits, the segment between its strands is removed;
    /// where two ends merge, a segment is inserted between them.
    fn advance_in_order(&mut self, transition: &Transition, drawn: &[DrawnSheet], morphing: &MorphingParameters) {
        let sheets = self.shapes[self.shapes.len() - 1].clone();
        let next = self.shapes.len();
        for (sheet, drawn) in sheets.iter().zip(drawn) {
            for (&track, knot) in sheet.iter().zip(control_knots(drawn, sheet.len(), morphing)) {
                self.tracks[track].knots.push(knot);
            }
        }
        for pair in &transition.splits {
            for (&new, &old) in pair.new.iter().zip(&pair.old) {
                let knot = self.tracks[old].knot(next);
                self.tracks[new].knots.push(knot);
            }
        }
        for pair in &transition.merges {
            let [first, second] = pair.old.map(|old| self.tracks[old].knot(next));
            pair.new.iter().for_each(|&new| self.tracks[new].knots.push(first.lerp(second, 0.5)));
        }
        // Coincident points are dropped: both of a split, one of a merge.
        let dropped: Vec<usize> = transition
            .splits
            .iter()
            .flat_map(|pair| pair.new)
            .chain(transition.merges.iter().map(|pair| pair.new[1]))
            .collect();
        let mut next_sheets = Vec::with_capacity(transition.chains.len());
        for chain in 0..transition.chains.len() {
            let mut tracks = transition.tracks_of(chain);
            tracks.retain(|track| !dropped.contains(track));
            next_sheets.push(tracks);
        }
        self.shapes.push(next_sheets);
    }

    /// Automatic correspondence: chains by sheet matching, points by time warping.
    fn advance_by_nearness(
        &mut self,
        transition: &Transition,
        drawn: &[DrawnSheet],
        constraints: &LinkConstraints,
        closes: bool,
        evenness: f64,
    ) {
        let knot = self.shapes.len() - 1;
        let mut sources = Vec::with_capacity(transition.chains.len());
        for chain in 0..transition.chains.len() {
            // A strand has at least two points, so the polyline exists.
            sources.extend(Polyline::new(self.positions(&transition.tracks_of(chain), knot)));
        }
        let targets: Vec<&Polyline> = drawn.iter().map(|sheet| &sheet.line).collect();
        let matches = match_sheets(&sources, &targets, &constraints.chain_constraints);
        let mut sheets = vec![Vec::new(); drawn.len()];
        for (chain, matched) in transition.chains.iter().zip(matches) {
            let first_shape = closes.then(|| self.shapes[0][matched.target].clone());
            let target = ChainTarget { drawn: &drawn[matched.target], matched, first_shape, evenness, constraints };
            let mut sheet = self.advance_chain(transition, chain, &target);
            if matched.reversed {
                sheet.reverse();
            }
            sheets[matched.target] = sheet;
        }
        self.shapes.push(sheets);
    }

    /// Moves the strands of a chain to their ranges of a sheet; returns the sheet's tracks along the chain.
    fn advance_chain(&mut self, transition: &Transition, chain: &[ChainLink], target: &ChainTarget) -> Vec<usize> {
        let ChainTarget { drawn, matched, first_shape, evenness, constraints } = target;
        let knot = self.shapes.len() - 1;
        let strands: Vec<Vec<usize>> = chain.iter().map(|&link| transition.tracks_along(link)).collect();
        let points: Vec<Vec<DVec2>> = strands.iter().map(|strand| self.positions(strand, knot)).collect();
        let mut sheet: Vec<usize> = Vec::new();
        for ((strand, points), range) in strands.iter().zip(&points).zip(strand_ranges(&points)) {
            let range = if matched.reversed { range.map(|fraction| 1.0 - fraction) } else { range };
            let anchors = constraints.anchors(strand, range);
            let repeated = first_shape.as_ref().filter(|first| chain.len() == 1 && first.len() == strand.len());
            let repeated = repeated.filter(|_| anchors.is_empty());
            let knots: Vec<Knot> = match repeated {
                Some(first) => first.iter().map(|&track| self.tracks[track].knot(0)).collect(),
                None => {
                    let fractions = warp_through(points, &drawn.line, range, &anchors, *evenness).into_iter();
                    fractions
                        .map(|fraction| Knot { position: drawn.line.at(fraction), factors: drawn.factors.at(fraction) })
                        .collect()
                }
            };
            let is_backward = repeated.is_some() && matched.reversed;
            for (index, &track) in strand.iter().enumerate() {
                let index = if is_backward { knots.len() - 1 - index } else { index };
                self.tracks[track].knots.push(knots[index]);
            }
            // Where two strands merge, one of the two coincident points is kept.
            sheet.extend(&strand[usize::from(!sheet.is_empty())..]);
        }
        sheet
    }
}

/// Range of a sheet's length for each strand of a chain, in proportion to the strand's length plus half of the adjacent
/// gaps.
fn strand_ranges(strands: &[Vec<DVec2>]) -> Vec<[f64; 2]> {
    let mut ends = vec![0.0];
    let mut gap_before = 0.0;
    for (index, points) in strands.iter().enumerate() {
        let gap_after = match (points.last(), strands.get(index + 1).and_then(|next| next.first())) {
            (Some(end), Some(start)) => end.distance(*start),
            _ => 0.0,
        };
        ends.push(ends[index] + line_length(points) + (gap_before + gap_after) / 2.0);
        gap_before = gap_after;
    }
    let total = ends[strands.len()];
    for (index, end) in ends.iter_mut().enumerate() {
        *end = if total > 0.0 { *end / total } else { index as f64 / strands.len() as f64 };
    }
    ends.windows(2).map(|pair| [pair[0], pair[1]]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strands_share_a_sheet_by_length_and_half_of_the_gap() {
        let strand = |from: f64, to: f64| vec![DVec2::new(from, 0.0), DVec2::new(to, 0.0)];
        // Lengths 4 and 2, a gap of 2: 5 and 3 of 8.
        assert_eq!(strand_ranges(&[strand(0.0, 4.0), strand(6.0, 8.0)]), [[0.0, 0.625], [0.625, 1.0]]);
        assert_eq!(strand_ranges(&[strand(1.0, 1.0), strand(1.0, 1.0)]), [[0.0, 0.5], [0.5, 1.0]]);
        assert_eq!(strand_ranges(&[strand(0.0, 3.0)]), [[0.0, 1.0]]);
    }
}
