//! Points along two lines that belong together: by length along them, and by nearness (thesis, chapter 4, asks for it).

use bansho_base::math::{DVec2, lerp};

use crate::shapes::geometry::polyline::{Polyline, shares};

/// Points that are looked at one by one: those of two sheets of the most control points that have grown together.
const MOST_POINTS: usize = 1024;
/// Places on the target between two control points where they lie evenly.
const FINE: usize = 8;
/// Fewest and most such places from one control point to the next.
const STEPS: [usize; 2] = [3, 20];
/// For each of `points` the share of `target`'s length that it goes to, from `range[0]` for the first to `range[1]` for the last: the
/// least sum of (distance / length)^2 and `evenness` (spacing - 1)^2, by dynamic programming over 8 places a point: what has
/// not moved stays, and the points stay at 3/8 to 5/2 of the even distance.
pub(super) fn warp(points: &[DVec2], target: &Polyline, range: [f64; 2], evenness: f64) -> Vec<f64> {
    let last = points.len() - 1;
    let places = last * FINE;
    let share = |place: usize| range[0] + (range[1] - range[0]) * (place as f64 / places.max(1) as f64);
    let line: Vec<DVec2> = (0..=places).map(|place| target.at(share(place))).collect();
    let scale = target.length() * (range[1] - range[0]).abs();
    if last < 2 || scale == 0.0 {
        return (0..=last).map(|index| share(index * FINE)).collect();
    }
    let nearness = |point: usize, place: usize| points[point].distance_squared(line[place]) / (scale * scale);
    let step_costs: Vec<f64> = (0..=STEPS[1])
        .map(|step| {
            let stretch = step as f64 / FINE as f64 - 1.0;
            evenness * stretch * stretch
        })
        .collect();
    let (mut costs, mut next) = (vec![f64::INFINITY; places + 1], vec![f64::INFINITY; places + 1]);
    costs[0] = 0.0;
    let mut best = vec![0.0_f64; places + 1];
    let mut steps = vec![0u8; (places + 1) * points.len()];
    for point in 1..=last {
        next.fill(f64::INFINITY);
        best.fill(0.0);
        // Places from which the rest can still be reached, and that can be reached from the start.
        let low = (point * STEPS[0]).max(places.saturating_sub((last - point) * STEPS[1]));
        let high = (point * STEPS[1]).min(places - (last - point) * STEPS[0]);
        // Step by step over all places: compilers make vector code of that.
        for step in STEPS[0]..=STEPS[1].min(high) {
            let first = low.max(step);
            let from = &costs[first - step..=high - step];
            let (step_cost, number) = (step_costs[step], step as f64);
            for ((cost, best), from) in next[first..=high].iter_mut().zip(&mut best[first..=high]).zip(from) {
                let found = from + step_cost;
                *best = if found < *cost { number } else { *best };
                *cost = if found < *cost { found } else { *cost };
            }
        }
        let row = &mut steps[point * (places + 1)..][..=places];
        for place in low..=high {
            row[place] = best[place] as u8;
            next[place] += nearness(point, place);
        }
        std::mem::swap(&mut costs, &mut next);
    }
    let mut shares = vec![range[1]; points.len()];
    let mut place = places;
    for point in (1..=last).rev() {
        shares[point] = share(place);
        place -= usize::from(steps[point * (places + 1) + place]).min(place);
    }
    shares[0] = range[0];
    shares
}

/// As [`warp`], whose cost grows with the square of the points, through no more than [`MOST_POINTS`] of them, evenly chosen; those
/// between keep their share of the way from one of these to the next.
fn warp_thinned(points: &[DVec2], target: &Polyline, range: [f64; 2], evenness: f64) -> Vec<f64> {
    let last = points.len() - 1;
    if points.len() <= MOST_POINTS {
        return warp(points, target, range, evenness);
    }
    let chosen: Vec<usize> = (0..MOST_POINTS).map(|index| index * last / (MOST_POINTS - 1)).collect();
    let few: Vec<DVec2> = chosen.iter().map(|&point| points[point]).collect();
    let found = warp(&few, target, range, evenness);
    let mut all = vec![found[0]];
    for (ends, shares_at) in chosen.windows(2).zip(found.windows(2)) {
        let between = shares(&points[ends[0]..=ends[1]]);
        all.extend(between[1..].iter().map(|&share| lerp(shares_at[0], shares_at[1], share)));
    }
    all
}

/// As [`warp`], but each of `anchors`, a point and its share, arrives there; both are in order along the points.
pub(crate) fn warp_through(
    points: &[DVec2],
    target: &Polyline,
    range: [f64; 2],
    anchors: &[(usize, f64)],
    evenness: f64,
) -> Vec<f64> {
    let mut shares = vec![range[0]];
    let mut start = 0;
    for (end, share) in anchors.iter().copied().chain([(points.len() - 1, range[1])]) {
        let part = [shares[start], share];
        shares.extend(&warp_thinned(&points[start..=end], target, part, evenness)[1..]);
        start = end;
    }
    shares
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
        let shares = warp(&points, &target, [0.0, 1.0], 0.01);
        assert!(shares.iter().enumerate().all(|(i, share)| (share - i as f64 / 31.0).abs() < 1e-12));
        let back = warp(&points.iter().rev().copied().collect::<Vec<_>>(), &target, [1.0, 0.0], 0.01);
        assert!(back.iter().enumerate().all(|(i, share)| (share - (1.0 - i as f64 / 31.0)).abs() < 1e-12));
    }

    /// The line grows at its end by half: most of what was there stays, where equal shares would pull all of it along.
    #[test]
    fn what_has_not_moved_stays_where_the_line_grows() {
        let points = straight(0.0, 300.0, 31);
        let target = Polyline::new(straight(0.0, 450.0, 46)).unwrap();
        let shares = warp(&points, &target, [0.0, 1.0], 0.01);
        let moved = |i: usize| (target.at(shares[i]) - points[i]).length();
        let mean: f64 = (0..31).map(moved).sum::<f64>() / 31.0;
        let by_length: f64 = points.iter().map(|point| point.x * 0.5).sum::<f64>() / 31.0;
        assert!(mean < 0.75 * by_length, "{mean} {by_length}");
        assert!(shares.windows(2).all(|pair| pair[1] > pair[0]));
    }

    #[test]
    fn anchored_points_arrive_where_they_are_told_and_the_others_between_them() {
        let points = straight(0.0, 100.0, 11);
        let target = Polyline::new(points.clone()).unwrap();
        let shares = warp_through(&points, &target, [0.0, 1.0], &[(3, 0.5), (8, 0.75)], 0.01);
        assert_eq!((shares.len(), shares[0], shares[3], shares[8], shares[10]), (11, 0.0, 0.5, 0.75, 1.0));
        assert!(shares.windows(2).all(|pair| pair[1] > pair[0]), "{shares:?}");
        assert_eq!(warp_through(&points, &target, [0.0, 1.0], &[], 0.01), warp(&points, &target, [0.0, 1.0], 0.01));
    }

    /// Sheets that have grown together again and again: all points at once would take 80 GB.
    #[test]
    fn very_many_points_go_by_some_of_them() {
        let mut points = straight(0.0, 310.0, 100_000);
        let target = Polyline::new(straight(0.0, 310.0, 32)).unwrap();
        let whole = warp_through(&points, &target, [0.0, 1.0], &[], 0.01);
        assert!(whole.iter().enumerate().all(|(i, share)| (share - i as f64 / 99_999.0).abs() < 2e-4));
        // Those between go along: nothing is passed by.
        points.iter_mut().for_each(|point| point.x *= (point.x / 310.0) * (point.x / 310.0));
        let uneven = warp_through(&points, &target, [0.25, 0.75], &[(40_000, 0.5)], 0.01);
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
