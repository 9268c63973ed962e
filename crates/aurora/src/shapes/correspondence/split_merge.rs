//! Splits and merges in the transition between two shapes (thesis, figs. 2.4 and 2.5).

use bansho_base::{math::DVec2, parameters::Auto};

use crate::shapes::{
    MergeParameters, ShapeError, ShapeErrorKind, ShapeParameters, SplitParameters,
    geometry::polyline::length_fractions,
    interpolation::{ControlPointTrack, Gap, Parents},
};

/// A strand within a chain of strands that merge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ChainLink {
    pub(super) strand: usize,
    /// Whether it is traversed backward.
    pub(super) reversed: bool,
}

/// Two new control points, coincident at the start (split) or the end (merge) of the transition, and the old points
/// next to them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CoincidentPoints {
    pub(crate) new: [usize; 2],
    pub(crate) old: [usize; 2],
}

/// A transition to the next shape: strands are the sheets, cut where they split. A strand is a list of control-point
/// tracks.
#[derive(Clone, Debug, Default)]
pub(crate) struct Transition {
    pub(crate) strands: Vec<Vec<usize>>,
    /// The strands that form each sheet of the next shape.
    pub(crate) chains: Vec<Vec<ChainLink>>,
    pub(crate) splits: Vec<CoincidentPoints>,
    pub(crate) merges: Vec<CoincidentPoints>,
}

/// A cut of a sheet.
#[derive(Clone, Copy, Debug)]
struct Cut {
    /// Index of the segment, from that control point to the next.
    segment: usize,
    /// Fraction of the segment.
    fraction: f64,
}

/// An end of a sheet or of a strand.
#[derive(Clone, Copy, Debug)]
struct LineEnd {
    /// Index of the sheet or strand.
    line: usize,
    /// 0 for the start, 1 for the end.
    end: usize,
}

impl Transition {
    /// The transition to shape `index` from the previous shape, whose sheets are `sheets`.
    ///
    /// # Errors
    ///
    /// A missing sheet or segment, a merge point that is not an end, two splits or merges at one position, or a closed ring.
    pub(crate) fn new(
        parameters: &ShapeParameters,
        index: usize,
        sheets: &[Vec<usize>],
        tracks: &mut Vec<ControlPointTrack>,
    ) -> Result<Self, ShapeError> {
        let mut transition = Self::default();
        // First and last strand of each sheet.
        let mut outer_strands = Vec::new();
        let cuts = cuts(parameters, index, sheets, tracks)?;
        for (sheet, cuts) in sheets.iter().zip(cuts) {
            let first = transition.strands.len();
            transition.cut(sheet, &cuts, index - 1, tracks);
            outer_strands.push([first, transition.strands.len() - 1]);
        }
        let mut chains = Chains::new(transition.strands.len());
        for (number, merge) in parameters.merge.iter().enumerate() {
            let strand_ends = merged_ends(merge, sheets, tracks, index - 1)
                .and_then(|sheet_ends| chains.join_sheets(sheet_ends, &outer_strands))
                .map_err(|kind| ShapeError::in_shape(index, &format!("merge.{number}"), kind))?;
            transition.add_merge_points(strand_ends, index - 1, tracks);
        }
        transition.chains = chains.collect();
        Ok(transition)
    }

    /// Cuts a sheet into strands, with two new coincident points at each cut.
    fn cut(&mut self, sheet: &[usize], cuts: &[Cut], knot: usize, tracks: &mut Vec<ControlPointTrack>) {
        let mut strand = Vec::new();
        let mut start = 0;
        for &Cut { segment, fraction } in cuts {
            let old = [sheet[segment], sheet[segment + 1]];
            let new = [0, 1].map(|_| add_track(Parents { tracks: old, fraction }, knot, tracks));
            strand.extend_from_slice(&sheet[start..=segment]);
            strand.push(new[0]);
            self.strands.push(std::mem::replace(&mut strand, vec![new[1]]));
            self.splits.push(CoincidentPoints { new, old });
            start = segment + 1;
        }
        strand.extend_from_slice(&sheet[start..]);
        self.strands.push(strand);
    }

    /// Adds a new point at each of two merging ends.
    fn add_merge_points(&mut self, strand_ends: [LineEnd; 2], knot: usize, tracks: &mut Vec<ControlPointTrack>) {
        let mut pair = CoincidentPoints { new: [0; 2], old: [0; 2] };
        for (side, LineEnd { line, end }) in strand_ends.into_iter().enumerate() {
            let strand = &mut self.strands[line];
            let index = if end == 0 { 0 } else { strand.len() };
            let old = strand[index.saturating_sub(end)];
            let new = add_track(Parents { tracks: [old; 2], fraction: 0.0 }, knot, tracks);
            strand.insert(index, new);
            (pair.new[side], pair.old[side]) = (new, old);
        }
        self.merges.push(pair);
    }

    /// Subdivides the longest segments of each strand until it has at least `count` control points; the curve does not
    /// change.
    pub(crate) fn refine(&mut self, count: usize, knot: usize, tracks: &mut Vec<ControlPointTrack>) {
        for strand in &mut self.strands {
            while strand.len() < count {
                // The last one of those that are equally long.
                let (mut longest, mut longest_squared) = (0, 0.0);
                for (index, pair) in strand.windows(2).enumerate() {
                    let [from, to] = [pair[0], pair[1]].map(|track| tracks[track].knot(knot).position);
                    let squared = from.distance_squared(to);
                    if squared >= longest_squared {
                        (longest, longest_squared) = (index, squared);
                    }
                }
                let parents = Parents { tracks: [strand[longest], strand[longest + 1]], fraction: 0.5 };
                strand.insert(longest + 1, add_track(parents, knot, tracks));
            }
        }
    }

    /// The gaps that open and close.
    pub(crate) fn gaps(&self) -> Vec<Gap> {
        let opening = self.splits.iter().map(|pair| Gap { ends: pair.new, opens: true });
        let closing = self.merges.iter().map(|pair| Gap { ends: pair.new, opens: false });
        opening.chain(closing).collect()
    }

    /// The tracks of chain `chain`, along it.
    pub(crate) fn tracks_of(&self, chain: usize) -> Vec<usize> {
        self.chains[chain].iter().flat_map(|&link| self.tracks_along(link)).collect()
    }

    /// The tracks of a strand in the direction of its chain.
    pub(crate) fn tracks_along(&self, link: ChainLink) -> Vec<usize> {
        let mut tracks = self.strands[link.strand].clone();
        if link.reversed {
            tracks.reverse();
        }
        tracks
    }
}

/// Adds a control point between two others.
fn add_track(parents: Parents, knot: usize, tracks: &mut Vec<ControlPointTrack>) -> usize {
    let [first, second] = parents.tracks.map(|parent| tracks[parent].knot(knot));
    tracks.push(ControlPointTrack::new(knot, Some(parents), first.lerp(second, parents.fraction)));
    tracks.len() - 1
}

/// Index of a sheet from its one-based number.
pub(super) fn sheet_index(number: i64, count: usize) -> Result<usize, ShapeErrorKind> {
    let index = usize::try_from(number - 1).ok().filter(|&index| index < count);
    index.ok_or(ShapeErrorKind::NoSuchSheet { sheet: number, count })
}

/// Cuts of each sheet, sorted.
fn cuts(
    parameters: &ShapeParameters,
    index: usize,
    sheets: &[Vec<usize>],
    tracks: &[ControlPointTrack],
) -> Result<Vec<Vec<Cut>>, ShapeError> {
    let mut cuts: Vec<Vec<Cut>> = vec![Vec::new(); sheets.len()];
    for (number, split) in parameters.split.iter().enumerate() {
        add_cut(&mut cuts, split, sheets, tracks, index - 1)
            .map_err(|kind| ShapeError::in_shape(index, &format!("split.{number}"), kind))?;
    }
    cuts.iter_mut().for_each(|cuts| cuts.sort_by_key(|cut| cut.segment));
    Ok(cuts)
}

/// Adds the cut of a split to those of its sheet.
fn add_cut(
    cuts: &mut [Vec<Cut>],
    split: &SplitParameters,
    sheets: &[Vec<usize>],
    tracks: &[ControlPointTrack],
    knot: usize,
) -> Result<(), ShapeErrorKind> {
    let sheet = sheet_index(split.sheet, sheets.len())?;
    let positions: Vec<DVec2> = sheets[sheet].iter().map(|&track| tracks[track].knot(knot).position).collect();
    let cut = cut_of(split, sheet, &positions)?;
    if cuts[sheet].iter().any(|other| other.segment == cut.segment) {
        return Err(ShapeErrorKind::SplitTwice { sheet: sheet + 1, segment: cut.segment + 1 });
    }
    cuts[sheet].push(cut);
    Ok(())
}

/// The cut of a split sheet with these positions of its control points.
fn cut_of(split: &SplitParameters, sheet: usize, positions: &[DVec2]) -> Result<Cut, ShapeErrorKind> {
    let segments = positions.len() - 1;
    match (split.segment, split.length_fraction) {
        (Some(_), Some(_)) => Err(ShapeErrorKind::SegmentAndPosition),
        (Some(segment), None) => {
            let index = usize::try_from(segment - 1).ok().filter(|&index| index < segments);
            let missing = ShapeErrorKind::NoSuchSegment { sheet: sheet + 1, segment, count: segments };
            index.map(|segment| Cut { segment, fraction: 0.5 }).ok_or(missing)
        }
        (None, at) => {
            let (at, fractions) = (at.unwrap_or(0.5), length_fractions(positions));
            let segment = fractions.partition_point(|&fraction| fraction <= at).clamp(1, segments) - 1;
            let length = fractions[segment + 1] - fractions[segment];
            let fraction = if length > 0.0 { (at - fractions[segment]) / length } else { 0.5 };
            Ok(Cut { segment, fraction: fraction.clamp(0.0, 1.0) })
        }
    }
}

/// The two ends of sheets that a merge joins.
fn merged_ends(
    merge: &MergeParameters,
    sheets: &[Vec<usize>],
    tracks: &[ControlPointTrack],
    knot: usize,
) -> Result<[LineEnd; 2], ShapeErrorKind> {
    let [first, second] = merge.sheets;
    let pair = [sheet_index(first, sheets.len())?, sheet_index(second, sheets.len())?];
    if pair[0] == pair[1] {
        return Err(ShapeErrorKind::Ring { sheet: pair[0] + 1 });
    }
    let Auto::Set(at) = merge.ends else { return Ok(nearest_ends(pair, sheets, tracks, knot)) };
    Ok([end_at(pair[0], at[0])?, end_at(pair[1], at[1])?])
}

/// The end of a sheet at a fraction of its length, which must be 0 or 1.
fn end_at(sheet: usize, length_fraction: f64) -> Result<LineEnd, ShapeErrorKind> {
    match length_fraction {
        0.0 => Ok(LineEnd { line: sheet, end: 0 }),
        1.0 => Ok(LineEnd { line: sheet, end: 1 }),
        _ => Err(ShapeErrorKind::NotAnEnd { sheet: sheet + 1, length_fraction }),
    }
}

/// The ends of two sheets that are nearest to each other.
fn nearest_ends(pair: [usize; 2], sheets: &[Vec<usize>], tracks: &[ControlPointTrack], knot: usize) -> [LineEnd; 2] {
    let [first, second] = pair.map(|line| {
        let sheet = &sheets[line];
        [sheet[0], sheet[sheet.len() - 1]].map(|track| tracks[track].knot(knot).position)
    });
    // At equal distance the first of these pairs.
    let (mut nearest, mut min_squared) = ([1, 0], f64::INFINITY);
    for ends in [[1, 0], [0, 1], [0, 0], [1, 1]] {
        let squared = first[ends[0]].distance_squared(second[ends[1]]);
        if squared < min_squared {
            (nearest, min_squared) = (ends, squared);
        }
    }
    [0, 1].map(|side| LineEnd { line: pair[side], end: nearest[side] })
}

/// Strands joined at their ends.
struct Chains {
    /// The end that each end of each strand is joined to.
    links: Vec<[Option<LineEnd>; 2]>,
    /// Chain id of each strand (union by relabeling).
    chain: Vec<usize>,
}

impl Chains {
    fn new(count: usize) -> Self {
        Self { links: vec![[None; 2]; count], chain: (0..count).collect() }
    }

    /// Joins the strands at two ends of sheets, whose first and last strands are `outer_strands`; returns the strands' ends.
    fn join_sheets(
        &mut self,
        sheet_ends: [LineEnd; 2],
        outer_strands: &[[usize; 2]],
    ) -> Result<[LineEnd; 2], ShapeErrorKind> {
        let strand_ends = sheet_ends.map(|LineEnd { line, end }| LineEnd { line: outer_strands[line][end], end });
        for (strand_end, sheet_end) in strand_ends.iter().zip(sheet_ends) {
            if self.links[strand_end.line][strand_end.end].is_some() {
                return Err(ShapeErrorKind::MergedTwice { sheet: sheet_end.line + 1, is_end: sheet_end.end == 1 });
            }
        }
        if self.join(strand_ends) {
            Ok(strand_ends)
        } else {
            Err(ShapeErrorKind::Ring { sheet: sheet_ends[0].line + 1 })
        }
    }

    /// Joins two ends; `false` if that would close a ring.
    fn join(&mut self, [a, b]: [LineEnd; 2]) -> bool {
        let [one, other] = [self.chain[a.line], self.chain[b.line]];
        if one == other {
            return false;
        }
        self.links[a.line][a.end] = Some(b);
        self.links[b.line][b.end] = Some(a);
        self.chain.iter_mut().filter(|chain| **chain == other).for_each(|chain| *chain = one);
        true
    }

    /// The chains, each starting with its lowest-numbered strand in forward direction.
    fn collect(&self) -> Vec<Vec<ChainLink>> {
        let mut in_chain = vec![false; self.links.len()];
        let mut chains = Vec::new();
        for strand in 0..self.links.len() {
            if in_chain[strand] {
                continue;
            }
            let mut chain = vec![ChainLink { strand, reversed: false }];
            for end in [0, 1] {
                let mut next = self.links[strand][end];
                while let Some(entered) = next {
                    // Toward the start, a strand entered at its end has the direction of the chain.
                    let link = ChainLink { strand: entered.line, reversed: entered.end == end };
                    if end == 0 {
                        chain.insert(0, link);
                    } else {
                        chain.push(link);
                    }
                    next = self.links[entered.line][1 - entered.end];
                }
            }
            chain.iter().for_each(|link| in_chain[link.strand] = true);
            chains.push(chain);
        }
        chains
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::interpolation::Knot;

    /// Sheets of 4 points along x, 1 km apart, at z = 0, 10, ...
    fn setting(count: usize) -> (Vec<Vec<usize>>, Vec<ControlPointTrack>) {
        let position = |index: usize| DVec2::new((index % 4) as f64, 10.0 * (index / 4) as f64);
        let track =
            |index: usize| ControlPointTrack::new(0, None, Knot { position: position(index), factors: [1.0; 2] });
        let sheets = (0..count).map(|sheet| (4 * sheet..4 * sheet + 4).collect()).collect();
        (sheets, (0..4 * count).map(track).collect())
    }

    fn transition(
        parameters: &ShapeParameters,
        sheets: usize,
    ) -> Result<(Transition, Vec<ControlPointTrack>), ShapeError> {
        let (sheets, mut tracks) = setting(sheets);
        Transition::new(parameters, 1, &sheets, &mut tracks).map(|transition| (transition, tracks))
    }

    fn split(sheet: i64, segment: Option<i64>, at: Option<f64>) -> ShapeParameters {
        ShapeParameters {
            split: vec![SplitParameters { sheet, segment, length_fraction: at }],
            ..ShapeParameters::default()
        }
    }

    fn merge(merges: &[([i64; 2], Auto<[f64; 2]>)]) -> ShapeParameters {
        let merge = merges.iter().map(|&(sheets, at)| MergeParameters { sheets, ends: at }).collect();
        ShapeParameters { merge, ..ShapeParameters::default() }
    }

    #[test]
    fn a_split_segment_lets_go_and_takes_two_points_in_its_middle() {
        let (transition, tracks) = transition(&split(1, Some(2), None), 1).unwrap();
        assert_eq!(transition.strands, [vec![0, 1, 4], vec![5, 2, 3]]);
        assert_eq!(transition.chains.len(), 2);
        assert_eq!((transition.splits[0].new, transition.splits[0].old), ([4, 5], [1, 2]));
        let new_points = tracks.len() as f64 - 4.0;
        bansho_base::assert_measured!("figure 2.4: new points", new_points, 2.0, 0.0);
        assert!([4, 5].iter().all(|&new| tracks[new].knot(0).position == DVec2::new(1.5, 0.0)));
    }

    #[test]
    fn a_split_at_a_share_opens_exactly_there() {
        let (_, tracks) = transition(&split(1, None, Some(0.25)), 1).unwrap();
        assert_eq!(tracks[4].knot(0).position, DVec2::new(0.75, 0.0));
        let (middle, tracks) = transition(&split(1, None, None), 1).unwrap();
        assert_eq!(tracks[4].knot(0).position, DVec2::new(1.5, 0.0));
        assert_eq!(middle.strands.len(), 2);
        for at in [0.0, 1.0] {
            let (transition, _) = transition(&split(1, None, Some(at)), 1).unwrap();
            assert!(transition.strands.iter().all(|strand| strand.len() >= 2));
        }
    }

    #[test]
    fn merged_ends_take_a_point_each() {
        let (transition, tracks) = transition(&merge(&[([1, 2], Auto::Set([1.0, 1.0]))]), 2).unwrap();
        assert_eq!(transition.strands, [vec![0, 1, 2, 3, 8], vec![4, 5, 6, 7, 9]]);
        let new_points = transition.strands[0].iter().filter(|point| **point >= 8).count();
        bansho_base::assert_measured!("figure 2.5: new points of an end", new_points as f64, 1.0, 0.0);
        let links = [ChainLink { strand: 0, reversed: false }, ChainLink { strand: 1, reversed: true }];
        assert_eq!(transition.chains, [links]);
        assert_eq!(transition.tracks_along(links[1]), [9, 7, 6, 5, 4]);
        assert_eq!(tracks[9].knot(0).position, DVec2::new(3.0, 10.0));
    }

    #[test]
    fn three_sheets_become_one_whichever_is_named_first() {
        let start_to_end = Auto::Set([0.0, 1.0]);
        let (transition, _) = transition(&merge(&[([1, 2], start_to_end), ([2, 3], start_to_end)]), 3).unwrap();
        let order: Vec<(usize, bool)> = transition.chains[0].iter().map(|link| (link.strand, link.reversed)).collect();
        assert_eq!(order, [(2, false), (1, false), (0, false)]);
        assert_eq!(transition.strands[1].len(), 6);
    }

    #[test]
    fn the_nearest_ends_merge_unless_told() {
        let (transition, _) = transition(&merge(&[([1, 2], Auto::Auto)]), 2).unwrap();
        let ends: Vec<usize> = transition.merges[0].old.to_vec();
        assert!(ends == [3, 7] || ends == [0, 4], "{ends:?}");
    }

    #[test]
    fn refining_halves_the_longest_segments() {
        let (mut transition, mut tracks) = transition(&split(1, Some(2), None), 1).unwrap();
        transition.refine(4, 0, &mut tracks);
        assert!(transition.strands.iter().all(|strand| strand.len() == 4));
        let xs: Vec<f64> = transition.strands[0].iter().map(|&track| tracks[track].knot(0).position.x).collect();
        assert_eq!(xs, [0.0, 0.5, 1.0, 1.5]);
    }

    #[test]
    fn faults_name_sheet_and_segment() {
        let kind = |parameters: &ShapeParameters| transition(parameters, 2).unwrap_err();
        for (parameters, expected) in [
            (split(3, None, None), "shapes.1.split.0: there is no sheet 3 in the previous shape; allowed: 1 to 2"),
            (split(2, Some(4), None), "shapes.1.split.0: sheet 2 has no segment 4; allowed: 1 to 3"),
            (split(2, Some(1), Some(0.5)), "has both `segment` and `length_fraction`"),
            (merge(&[([1, 5], Auto::Auto)]), "shapes.1.merge.0: there is no sheet 5"),
            (merge(&[([1, 2], Auto::Set([1.0, 0.4]))]), "the point at 0.4 of sheet 2 is not an end"),
            (merge(&[([2, 2], Auto::Set([0.0, 1.0]))]), "would close sheet 2 into a ring"),
            (
                merge(&[([1, 2], Auto::Set([1.0, 0.0])), ([1, 2], Auto::Set([0.0, 1.0]))]),
                "shapes.1.merge.1: this merge would close",
            ),
            (
                merge(&[([1, 2], Auto::Set([1.0, 0.0])), ([1, 2], Auto::Set([1.0, 1.0]))]),
                "the end of sheet 1 is merged already",
            ),
        ] {
            let shown = kind(&parameters).to_string();
            assert!(shown.contains(expected), "{shown}");
        }
        let twice = ShapeParameters { split: vec![SplitParameters::default(); 2], ..ShapeParameters::default() };
        assert!(kind(&twice).to_string().contains("segment 2 of sheet 1 is split already"));
    }
}
