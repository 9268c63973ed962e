//! Crossings of sheets with themselves or one another, which are not allowed (thesis, 2.2.1), and sheets that pass
//! through each other over time.

use std::collections::BTreeSet;

use bansho_base::math::DVec2;

use crate::shapes::{SegmentId, Shape, Sheet, geometry::cell_grid::CellGrid};

#[derive(Clone, Copy)]
struct SheetSegment {
    id: SegmentId,
    ends: [DVec2; 2],
    /// Whether it continues the previous segment in the list.
    continues: bool,
}

/// Which intersections count.
#[derive(Clone, Copy, PartialEq)]
enum Meeting {
    /// Touching segments included.
    Touching,
    /// Proper crossings only.
    Proper,
}

/// The first crossing along the sheets, touching included: the first segment that meets an earlier one, and the
/// earliest of these.
///
/// A cell list makes the cost linear for typical strokes; the search ends at the first crossing.
pub fn first_crossing<S: AsRef<[DVec2]>>(sheets: &[S]) -> Option<[SegmentId; 2]> {
    let mut crossing = None;
    for_each_meeting(sheets, Meeting::Touching, |pair| {
        crossing = Some(pair);
        false
    });
    crossing
}

/// Number of properly crossing pairs of segments. In-between shapes may have some; this is not an error.
pub fn count_crossings<S: AsRef<[DVec2]>>(sheets: &[S]) -> usize {
    let mut count = 0;
    for_each_meeting(sheets, Meeting::Proper, |_| {
        count += 1;
        true
    });
    count
}

impl Shape {
    /// Number of crossing pairs of segments: 0 for key shapes, possibly more for in-between shapes.
    #[must_use]
    pub fn crossings(&self) -> usize {
        count_crossings(&self.sheets)
    }
}

/// Indices of sheets with proper crossings.
pub(crate) fn crossing_sheets<S: AsRef<[DVec2]>>(sheets: &[S]) -> BTreeSet<usize> {
    let mut crossed_sheets = BTreeSet::new();
    for_each_meeting(sheets, Meeting::Proper, |pair| {
        crossed_sheets.extend(pair.map(|segment| segment.sheet));
        true
    });
    crossed_sheets
}

/// All segments with non-zero length, in order.
fn segments<S: AsRef<[DVec2]>>(sheets: &[S]) -> Vec<SheetSegment> {
    let mut list = Vec::new();
    for (sheet, points) in sheets.iter().enumerate() {
        let mut continues = false;
        for (segment, pair) in points.as_ref().windows(2).enumerate().filter(|(_, pair)| pair[0] != pair[1]) {
            list.push(SheetSegment { id: SegmentId { sheet, segment }, ends: [pair[0], pair[1]], continues });
            continues = true;
        }
    }
    list
}

/// Cells about as long as a segment, and not many more cells than segments, since all are cleared.
fn grid(segments: &[SheetSegment]) -> CellGrid {
    let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    for end in segments.iter().flat_map(|segment| segment.ends) {
        low = low.min(end);
        high = high.max(end);
    }
    let length: f64 = segments.iter().map(|segment| segment.ends[0].distance(segment.ends[1])).sum();
    CellGrid::new(low, high, length / segments.len() as f64, (4 * segments.len()).isqrt() + 16)
}

const NONE: u32 = u32::MAX;

/// Calls `visit` with each intersecting pair, the later segment last, until it returns `false`.
fn for_each_meeting<S: AsRef<[DVec2]>>(sheets: &[S], meeting: Meeting, mut visit: impl FnMut([SegmentId; 2]) -> bool) {
    let segments = segments(sheets);
    if segments.len() < 2 {
        return;
    }
    let grid = grid(&segments);
    // Linked list of segments per cell, latest first.
    let mut heads = vec![NONE; grid.count()];
    let mut links: Vec<(u32, u32)> = Vec::with_capacity(4 * segments.len());
    let mut compared_with = vec![NONE; segments.len()];
    let mut met: Vec<u32> = Vec::new();
    for (index, segment) in segments.iter().enumerate() {
        grid.for_each_traversed(segment.ends[0], segment.ends[1], |cell| {
            let mut link = heads[cell];
            while link != NONE {
                let (other, next) = links[link as usize];
                // Two segments may share several cells, but are compared once.
                if compared_with[other as usize] != index as u32 {
                    compared_with[other as usize] = index as u32;
                    let follows = segment.continues && other as usize + 1 == index;
                    if meets(&segments[other as usize], segment, follows, meeting) {
                        met.push(other);
                    }
                }
                link = next;
            }
            links.push((index as u32, heads[cell]));
            heads[cell] = links.len() as u32 - 1;
        });
        // Cells list them in another order.
        met.sort_unstable();
        if !met.drain(..).all(|other| visit([segments[other as usize].id, segment.id])) {
            return;
        }
    }
}

/// Orientation predicate: twice the signed area of the triangle.
fn orient2d(a: DVec2, b: DVec2, point: DVec2) -> f64 {
    (b - a).perp_dot(point - a)
}

/// Whether one is positive and the other negative; their product could underflow to 0.
fn have_opposite_signs(x: f64, y: f64) -> bool {
    (x < 0.0 && y > 0.0) || (x > 0.0 && y < 0.0)
}

/// Whether two segments intersect; `follows` if the second continues the first.
fn meets(first: &SheetSegment, second: &SheetSegment, follows: bool, meeting: Meeting) -> bool {
    let [[a, b], [c, d]] = [first.ends, second.ends];
    if follows {
        // Consecutive segments share a point; they overlap only if the second runs backward.
        return meeting == Meeting::Touching && orient2d(a, b, d) == 0.0 && (b - a).dot(d - c) < 0.0;
    }
    let [c_side, d_side, a_side, b_side] = [orient2d(a, b, c), orient2d(a, b, d), orient2d(c, d, a), orient2d(c, d, b)];
    if have_opposite_signs(c_side, d_side) && have_opposite_signs(a_side, b_side) {
        return true;
    }
    meeting == Meeting::Touching
        && [(c_side, a, b, c), (d_side, a, b, d), (a_side, c, d, a), (b_side, c, d, b)]
            .into_iter()
            .any(|(side, from, to, point)| side == 0.0 && (point - from).dot(point - to) <= 0.0)
}

/// Maximum number of sheets for which [`passes`] is tested.
const MAX_SHEETS: usize = 40;
/// Tested points of a sheet, in quarters of its points.
const TESTED_QUARTERS: [usize; 3] = [1, 2, 3];
/// Maximum distance between the sheets, relative to their motion.
const MAX_RELATIVE_DISTANCE: f64 = 1.5;

/// Whether a sheet of `before` is on the other side of another sheet in `after`; both shapes have the same control
/// points.
pub(crate) fn passes(before: &Shape, after: &Shape) -> bool {
    let count = before.sheets.len();
    let sheets = before.sheets.iter().zip(&after.sheets);
    if count > MAX_SHEETS
        || count != after.sheets.len()
        || sheets.clone().any(|(before, after)| before.points.len() != after.points.len())
    {
        return false;
    }
    for (index, one) in sheets.clone().enumerate() {
        for (other_index, other) in sheets.clone().enumerate() {
            if other_index != index && passes_sheet([one.0, one.1], [other.0, other.1]) {
                return true;
            }
        }
    }
    false
}

/// Whether a sheet is on the other side of another at the later of two times.
fn passes_sheet(one: [&Sheet; 2], other: [&Sheet; 2]) -> bool {
    let [one, other] = [one, other].map(|sheets| sheets.map(|sheet| &sheet.points[..]));
    let max_motion = other[0].iter().zip(other[1]).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
    for quarters in TESTED_QUARTERS {
        let point = one.map(|points| points[quarters * (points.len() - 1) / 4]);
        let sides = [0, 1].map(|time| signed_distance(point[time], other[time]));
        let [Some(was), Some(is)] = sides else { continue };
        let max_distance = MAX_RELATIVE_DISTANCE * (max_motion + point[0].distance(point[1]));
        if was * is < 0.0 && was.abs() + is.abs() < max_distance {
            return true;
        }
    }
    false
}

/// Signed distance of a point from a polyline; `None` beyond its ends.
fn signed_distance(point: DVec2, line: &[DVec2]) -> Option<f64> {
    let (mut min_distance, mut nearest) = (f64::INFINITY, None);
    let last = line.len().saturating_sub(2);
    for (index, pair) in line.windows(2).enumerate() {
        let direction = pair[1] - pair[0];
        let unclamped = (point - pair[0]).dot(direction) / direction.length_squared().max(f64::MIN_POSITIVE);
        let clamped = unclamped.clamp(0.0, 1.0);
        let distance = point.distance(pair[0] + direction * clamped);
        if distance < min_distance {
            let beyond = (index == 0 && unclamped < 0.0) || (index == last && unclamped > 1.0);
            (min_distance, nearest) =
                (distance, (!beyond).then(|| distance.copysign(direction.perp_dot(point - pair[0]))));
        }
    }
    nearest
}

#[cfg(test)]
mod tests {
    use bansho_base::math::random::{Key, Purpose};

    use super::*;

    fn points(list: &[[f64; 2]]) -> Vec<DVec2> {
        list.iter().map(|&point| point.into()).collect()
    }

    fn pair(first: [usize; 2], second: [usize; 2]) -> Option<[SegmentId; 2]> {
        Some([first, second].map(|[sheet, segment]| SegmentId { sheet, segment }))
    }

    #[test]
    fn a_loop_crosses_itself_and_a_bend_does_not() {
        let bend = points(&[[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]]);
        assert_eq!(first_crossing(&[&bend]), None);
        let knot = points(&[[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, -1.0]]);
        assert_eq!(first_crossing(&[&knot]), pair([0, 0], [0, 3]));
        assert_eq!(count_crossings(&[&knot]), 1);
    }

    #[test]
    fn touching_and_running_back_count_for_drawn_shapes_only() {
        let closed = points(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.0, 0.0]]);
        assert_eq!(first_crossing(&[&closed]), pair([0, 0], [0, 2]));
        assert_eq!(count_crossings(&[&closed]), 0);
        let back = points(&[[0.0, 0.0], [2.0, 0.0], [1.0, 0.0]]);
        assert_eq!(first_crossing(&[&back]), pair([0, 0], [0, 1]));
        let branch = [points(&[[0.0, 0.0], [2.0, 0.0]]), points(&[[1.0, 0.0], [1.0, 1.0]])];
        assert_eq!(first_crossing(&branch), pair([0, 0], [1, 0]));
        assert_eq!(count_crossings(&branch), 0);
    }

    #[test]
    fn coincident_points_are_no_crossing() {
        let still = points(&[[0.0, 0.0], [1.0, 0.0], [1.0, 0.0], [2.0, 0.0]]);
        assert_eq!(first_crossing(&[&still]), None);
        assert_eq!(first_crossing(&[points(&[[1.0, 1.0]])]), None);
    }

    /// Against every pair compared with every other.
    #[test]
    fn the_cell_list_finds_what_comparing_all_pairs_finds() {
        let key = Key::new(4, "strokes");
        for stroke in 0..2_000 {
            let count = 3 + (stroke % 12) as usize;
            let mut at = DVec2::ZERO;
            let walk: Vec<DVec2> = (0..count as u64)
                .map(|step| {
                    let [x, y, ..] = key.uniforms(stroke, step as u32, Purpose::named("step"));
                    at += DVec2::new(f64::from(x) - 0.2, f64::from(y) - 0.5);
                    at
                })
                .collect();
            let all = segments(&[&walk]);
            let mut every = Vec::new();
            for (j, second) in all.iter().enumerate() {
                for (i, first) in all[..j].iter().enumerate() {
                    if meets(first, second, i + 1 == j, Meeting::Proper) {
                        every.push([first.id, second.id]);
                    }
                }
            }
            assert_eq!(first_crossing(&[&walk]), every.first().copied(), "stroke {stroke}");
            assert_eq!(count_crossings(&[&walk]), every.len());
        }
    }
}

#[cfg(test)]
mod passing_tests {
    use super::*;

    fn row(y: f64, from: f64) -> Sheet {
        Sheet {
            points: (0..9).map(|index| DVec2::new(from + 10.0 * f64::from(index), y)).collect(),
            ..Sheet::default()
        }
    }

    #[test]
    fn a_sheet_that_is_beyond_another_has_passed_it() {
        let shape = |a: Sheet, b: Sheet| Shape { sheets: vec![a, b] };
        let before = shape(row(0.0, 0.0), row(2.0, 0.0));
        assert!(passes(&before, &shape(row(3.0, 0.0), row(1.0, 0.0))));
        assert!(!passes(&before, &shape(row(1.0, 0.0), row(3.0, 0.0))), "it comes nearer");
        // Beside its end there is nothing to pass through.
        let beside = shape(row(0.0, 0.0), row(2.0, 100.0));
        assert!(!passes(&beside, &shape(row(3.0, 0.0), row(1.0, 100.0))));
        assert!(!passes(&before, &Shape { sheets: vec![row(0.0, 0.0)] }));
    }
}
