//! Dynamic time warping: matches control points to positions on a target line by arc length and distance (requested in
//! chapter 4 of the thesis).

use bansho_base::math::{DVec2, lerp};

use crate::shapes::geometry::polyline::{Polyline, length_fractions};

/// Maximum number of points for the exact algorithm: two merged sheets with the maximum number of control points.
const MAX_POINTS: usize = 1024;
/// Candidate slots on the target per control point.
const SLOTS_PER_POINT: usize = 8;
/// Minimum and maximum number of slots between successive control points.
const STEP_RANGE: [usize; 2] = [3, 20];

/// A point with a given position on the target line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Anchor {
    /// Index of the point.
    pub(super) point: usize,
    /// Fraction of the target's length at which it must arrive.
    pub(super) fraction: f64,
}

/// Target length fractions for `points`, from `range[0]` for the first to `range[1]` for the last. Minimizes the sum of
/// (distance / length)^2 and `evenness` (spacing - 1)^2 by dynamic programming with 8 slots per point. Sections
/// that do not move keep their positions. The spacing is 3/8 to 5/2 of the uniform one.
pub(super) fn warp(points: &[DVec2], target: &Polyline, range: [f64; 2], evenness: f64) -> Vec<f64> {
    let last = points.len() - 1;
    let slots = last * SLOTS_PER_POINT;
    let mut slot_fractions = Vec::with_capacity(slots + 1);
    for slot in 0..=slots {
        slot_fractions.push(range[0] + (range[1] - range[0]) * (slot as f64 / slots.max(1) as f64));
    }
    let scale = target.length() * (range[1] - range[0]).abs();
    if last < 2 || scale == 0.0 {
        return slot_fractions.into_iter().step_by(SLOTS_PER_POINT).collect();
    }
    let line: Vec<DVec2> = slot_fractions.iter().map(|&fraction| target.at(fraction)).collect();
    let mut step_costs = [0.0; STEP_RANGE[1] + 1];
    for (step, cost) in step_costs.iter_mut().enumerate() {
        let deviation = step as f64 / SLOTS_PER_POINT as f64 - 1.0;
        *cost = evenness * deviation * deviation;
    }
    let (mut costs, mut next) = (vec![f64::INFINITY; slots + 1], vec![f64::INFINITY; slots + 1]);
    costs[0] = 0.0;
    let mut best = vec![0.0_f64; slots + 1];
    let mut steps = vec![0_u8; (slots + 1) * points.len()];
    for point in 1..=last {
        next.fill(f64::INFINITY);
        best.fill(0.0);
        // Slots that are reachable from the start and from which the end is reachable.
        let low = (point * STEP_RANGE[0]).max(slots.saturating_sub((last - point) * STEP_RANGE[1]));
        let high = (point * STEP_RANGE[1]).min(slots - (last - point) * STEP_RANGE[0]);
        // The loop over slots is innermost so that it is vectorized.
        for step in STEP_RANGE[0]..=STEP_RANGE[1].min(high) {
            let first = low.max(step);
            let from = &costs[first - step..=high - step];
            let (step_cost, number) = (step_costs[step], step as f64);
            for ((cost, best), from) in next[first..=high].iter_mut().zip(&mut best[first..=high]).zip(from) {
                let cost_by_way_of = from + step_cost;
                *best = if cost_by_way_of < *cost { number } else { *best };
                *cost = if cost_by_way_of < *cost { cost_by_way_of } else { *cost };
            }
        }
        let row = &mut steps[point * (slots + 1)..][..=slots];
        for slot in low..=high {
            row[slot] = best[slot] as u8;
            next[slot] += points[point].distance_squared(line[slot]) / (scale * scale);
        }
        std::mem::swap(&mut costs, &mut next);
    }
    let mut fractions = vec![range[1]; points.len()];
    let mut slot = slots;
    for point in (1..=last).rev() {
        fractions[point] = slot_fractions[slot];
        slot -= usize::from(steps[point * (slots + 1) + slot]).min(slot);
    }
    fractions[0] = range[0];
    fractions
}

/// [`warp`] for at most [`MAX_POINTS`] evenly chosen points, since its cost is quadratic; the others are interpolated
/// by arc length.
fn warp_thinned(points: &[DVec2], target: &Polyline, range: [f64; 2], evenness: f64) -> Vec<f64> {
    let last = points.len() - 1;
    if points.len() <= MAX_POINTS {
        return warp(points, target, range, evenness);
    }
    let chosen: Vec<usize> = (0..MAX_POINTS).map(|index| index * last / (MAX_POINTS - 1)).collect();
    let thinned: Vec<DVec2> = chosen.iter().map(|&point| points[point]).collect();
    let thinned_fractions = warp(&thinned, target, range, evenness);
    let mut all = vec![thinned_fractions[0]];
    for (ends, end_fractions) in chosen.windows(2).zip(thinned_fractions.windows(2)) {
        let between = length_fractions(&points[ends[0]..=ends[1]]);
        all.extend(between[1..].iter().map(|&fraction| lerp(end_fractions[0], end_fractions[1], fraction)));
    }
    all
}

/// [`warp`] with anchors, in the order of the points.
pub(crate) fn warp_through(
    points: &[DVec2],
    target: &Polyline,
    range: [f64; 2],
    anchors: &[Anchor],
    evenness: f64,
) -> Vec<f64> {
    let mut fractions = vec![range[0]];
    let mut start = 0;
    let end = Anchor { point: points.len() - 1, fraction: range[1] };
    for Anchor { point: end, fraction } in anchors.iter().copied().chain([end]) {
        let sub_range = [fractions[start], fraction];
        fractions.extend(&warp_thinned(&points[start..=end], target, sub_range, evenness)[1..]);
        start = end;
    }
    fractions
}

#[cfg(test)]
mod tests {
    use super::*;

    fn straight(from: f64, to: f64, count: usize) -> Vec<DVec2> {
        (0..count).map(|i| DVec2::new(from + (to - from) * i as f64 / (count - 1) as f64, 0.0)).collect()
    }

    #[test]
    fn a_line_that_has_not_moved_goes_to_itself() {
        let points = straight(0.0, 310.0, 32);
        let target = Polyline::new(points.clone()).unwrap();
        let fractions = warp(&points, &target, [0.0, 1.0], 0.01);
        assert!(fractions.iter().enumerate().all(|(i, fraction)| (fraction - i as f64 / 31.0).abs() < 1e-12));
        let back = warp(&points.iter().rev().copied().collect::<Vec<_>>(), &target, [1.0, 0.0], 0.01);
        assert!(back.iter().enumerate().all(|(i, fraction)| (fraction - (1.0 - i as f64 / 31.0)).abs() < 1e-12));
    }

    /// The line grows at its end by half: most of what was there stays, where equal fractions would pull all of it along.
    #[test]
    fn what_has_not_moved_stays_where_the_line_grows() {
        let points = straight(0.0, 300.0, 31);
        let target = Polyline::new(straight(0.0, 450.0, 46)).unwrap();
        let fractions = warp(&points, &target, [0.0, 1.0], 0.01);
        let moved = |i: usize| (target.at(fractions[i]) - points[i]).length();
        let mean: f64 = (0..31).map(moved).sum::<f64>() / 31.0;
        let by_length: f64 = points.iter().map(|point| point.x * 0.5).sum::<f64>() / 31.0;
        assert!(mean < 0.75 * by_length, "{mean} {by_length}");
        bansho_base::assert_measured!(
            "future work: correspondence: way of points, of that at equal fractions, %",
            100.0 * mean / by_length,
            26.0,
            0.5
        );
        assert!(fractions.windows(2).all(|pair| pair[1] > pair[0]));
    }

    #[test]
    fn anchored_points_arrive_where_they_are_told_and_the_others_between_them() {
        let points = straight(0.0, 100.0, 11);
        let target = Polyline::new(points.clone()).unwrap();
        let anchors = [Anchor { point: 3, fraction: 0.5 }, Anchor { point: 8, fraction: 0.75 }];
        let fractions = warp_through(&points, &target, [0.0, 1.0], &anchors, 0.01);
        assert_eq!(
            (fractions.len(), fractions[0], fractions[3], fractions[8], fractions[10]),
            (11, 0.0, 0.5, 0.75, 1.0)
        );
        assert!(fractions.windows(2).all(|pair| pair[1] > pair[0]), "{fractions:?}");
        assert_eq!(warp_through(&points, &target, [0.0, 1.0], &[], 0.01), warp(&points, &target, [0.0, 1.0], 0.01));
    }

    /// Sheets that have grown together again and again: all points at once would take 80 GB.
    #[test]
    fn very_many_points_go_by_some_of_them() {
        let mut points = straight(0.0, 310.0, 100_000);
        let target = Polyline::new(straight(0.0, 310.0, 32)).unwrap();
        let whole = warp_through(&points, &target, [0.0, 1.0], &[], 0.01);
        assert!(whole.iter().enumerate().all(|(i, fraction)| (fraction - i as f64 / 99_999.0).abs() < 2e-4));
        // Those between go along: nothing is passed by.
        points.iter_mut().for_each(|point| point.x *= (point.x / 310.0) * (point.x / 310.0));
        let uneven = warp_through(&points, &target, [0.25, 0.75], &[Anchor { point: 40_000, fraction: 0.5 }], 0.01);
        assert_eq!((uneven.len(), uneven[0], uneven[40_000], uneven[99_999]), (100_000, 0.25, 0.5, 0.75));
        assert!(uneven.windows(2).all(|pair| pair[1] >= pair[0]));
    }

    #[test]
    fn few_points_and_lines_without_length_are_shared_evenly() {
        let spot = Polyline::new(vec![DVec2::ZERO; 3]).unwrap();
        assert_eq!(warp(&straight(0.0, 1.0, 3), &spot, [0.0, 1.0], 0.01), [0.0, 0.5, 1.0]);
        let line = Polyline::new(straight(0.0, 1.0, 3)).unwrap();
        assert_eq!(warp(&straight(5.0, 6.0, 2), &line, [0.25, 0.5], 0.01), [0.25, 0.5]);
    }
}
