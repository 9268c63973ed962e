//! Polylines: nearest point, arc length, simplification, smoothing. Points are km, x east and y south.

use bansho::base::math::{DVec2, lerp};

/// A position on a polyline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinePoint {
    /// Index of the segment, which goes from the point with that index to the next.
    pub segment: usize,
    /// The fraction of the segment.
    pub fraction: f64,
    /// The point, km.
    pub point: DVec2,
    /// Its distance from the query point, km.
    pub distance: f64,
}

/// The position on `line` that is nearest to `to`; `None` where the line has no segment.
pub fn nearest(line: &[DVec2], to: DVec2) -> Option<LinePoint> {
    let points = line.windows(2).enumerate().map(|(segment, ends)| nearest_on_segment(segment, [ends[0], ends[1]], to));
    points.min_by(|a, b| a.distance.total_cmp(&b.distance))
}

/// The nearest position on segment number `segment`, between `ends`.
fn nearest_on_segment(segment: usize, ends: [DVec2; 2], to: DVec2) -> LinePoint {
    let (from, segment_vector) = (ends[0], ends[1] - ends[0]);
    let squared = segment_vector.length_squared();
    let fraction = if squared > 0.0 { ((to - from).dot(segment_vector) / squared).clamp(0.0, 1.0) } else { 0.0 };
    let point = from + fraction * segment_vector;
    LinePoint { segment, fraction, point, distance: point.distance(to) }
}

/// The nearest of several lines, and the nearest position on it.
pub fn nearest_among(all: &[Vec<DVec2>], to: DVec2) -> Option<(usize, LinePoint)> {
    let points = all.iter().enumerate().filter_map(|(number, line)| Some((number, nearest(line, to)?)));
    points.min_by(|a, b| a.1.distance.total_cmp(&b.1.distance))
}

/// The point of `line` at a fraction of its length.
pub fn at(line: &[DVec2], fraction: f64) -> Option<DVec2> {
    range(line, [fraction, 1.0]).first().copied()
}

/// Length of `line`, km.
pub fn length(line: &[DVec2]) -> f64 {
    line.windows(2).map(|ends| ends[0].distance(ends[1])).sum()
}

/// The fraction of the total length up to `at`.
pub fn fraction_of(line: &[DVec2], at: LinePoint) -> f64 {
    let before = length(line.get(..=at.segment).unwrap_or(line));
    let here = line.get(at.segment..at.segment + 2).map_or(0.0, length);
    let total = length(line);
    if total > 0.0 { (before + at.fraction * here) / total } else { 0.5 }
}

/// The range of `line` between two fractions of its length.
pub fn range(line: &[DVec2], [from, to]: [f64; 2]) -> Vec<DVec2> {
    let total = length(line);
    let mut distance = 0.0;
    let mut points = Vec::new();
    for ends in line.windows(2) {
        let step = ends[0].distance(ends[1]);
        let segment = distance..distance + step;
        if segment.contains(&(from * total)) {
            points.push(ends[0].lerp(ends[1], (from * total - distance) / step));
        }
        if segment.contains(&(to * total)) && to < 1.0 {
            points.push(ends[0].lerp(ends[1], (to * total - distance) / step));
        }
        distance += step;
        if distance > from * total && (distance < to * total || to >= 1.0) {
            points.push(ends[1]);
        }
    }
    points
}

/// The line with as few of its points as keep it within `tolerance` (Douglas & Peucker 1973).
pub fn simplified(points: &[DVec2], tolerance: f64) -> Vec<DVec2> {
    let mut kept = vec![false; points.len()];
    let mut spans = vec![[0, points.len().saturating_sub(1)]];
    kept.iter_mut().take(1).for_each(|first| *first = true);
    while let Some([first, last]) = spans.pop() {
        kept.iter_mut().skip(last).take(1).for_each(|end| *end = true);
        let chord = [points.get(first), points.get(last)].map(|end| end.copied().unwrap_or_default());
        let distances = (first + 1..last).map(|index| (index, nearest_on_segment(0, chord, points[index]).distance));
        let farthest = distances.max_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((index, _)) = farthest.filter(|(_, distance)| *distance > tolerance) {
            spans.extend([[first, index], [index, last]]);
        }
    }
    points.iter().zip(kept).filter(|(_, kept)| *kept).map(|(point, _)| *point).collect()
}

/// Laplacian smoothing within `radius` of `around`, weighted by distance; end points stay.
pub fn smoothed(points: &[DVec2], around: DVec2, radius: f64) -> Vec<DVec2> {
    let mut smooth = points.to_vec();
    for (index, three) in points.windows(3).enumerate() {
        let weight = 0.5 * (1.0 - three[1].distance(around) / radius).max(0.0);
        smooth[index + 1] = three[1].lerp(three[0].midpoint(three[2]), weight);
    }
    smooth
}

/// Factors along a sheet, as [fraction, factor], increased by `by` at the fraction `at`, and linearly less up to the distance `radius`.
pub fn brushed(factors: &[[f64; 2]], at: f64, by: f64, radius: f64) -> Vec<[f64; 2]> {
    let brushed = factors.iter().map(|&[fraction, factor]| {
        let weight = (1.0 - (fraction - at).abs() / radius).max(0.0);
        [fraction, lerp(factor, factor + by, weight)]
    });
    brushed.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(points: &[[f64; 2]]) -> Vec<DVec2> {
        points.iter().map(|&point| DVec2::from(point)).collect()
    }

    #[test]
    fn the_nearest_point_is_on_a_segment_or_at_an_end() {
        let corner = line(&[[0.0, 0.0], [3.0, 0.0], [3.0, 1.0]]);
        let on = nearest(&corner, DVec2::new(1.0, -2.0)).unwrap();
        assert_eq!((on.segment, on.point, on.distance), (0, DVec2::new(1.0, 0.0), 2.0));
        assert_eq!(fraction_of(&corner, on), 0.25);
        let end = nearest(&corner, DVec2::new(4.0, 1.0)).unwrap();
        assert_eq!((end.segment, end.fraction, fraction_of(&corner, end)), (1, 1.0, 1.0));
        assert_eq!(nearest(&corner[..1], DVec2::ZERO), None);
    }

    #[test]
    fn ranges_begin_and_end_at_fractions_of_the_length() {
        let corner = line(&[[0.0, 0.0], [3.0, 0.0], [3.0, 1.0]]);
        assert_eq!(range(&corner, [0.25, 0.5]), line(&[[1.0, 0.0], [2.0, 0.0]]));
        assert_eq!(range(&corner, [0.5, 1.0]), line(&[[2.0, 0.0], [3.0, 0.0], [3.0, 1.0]]));
        assert_eq!(range(&corner, [0.0, 0.875]), line(&[[0.0, 0.0], [3.0, 0.0], [3.0, 0.5]]));
        assert_eq!(range(&corner, [0.0, 1.0]), corner);
    }

    #[test]
    fn a_line_keeps_only_the_points_that_shape_it() {
        let wavering = line(&[[0.0, 0.0], [1.0, 0.01], [2.0, -0.01], [3.0, 0.0], [3.0, 1.0]]);
        assert_eq!(simplified(&wavering, 0.1), line(&[[0.0, 0.0], [3.0, 0.0], [3.0, 1.0]]));
        assert_eq!(simplified(&wavering, 0.001), wavering);
        assert_eq!(simplified(&[], 0.1), []);
    }

    #[test]
    fn smoothing_reduces_a_kink_and_leaves_the_rest() {
        let kink = line(&[[0.0, 0.0], [1.0, 2.0], [2.0, 0.0], [9.0, 0.0], [10.0, 1.0]]);
        let smooth = smoothed(&kink, DVec2::new(1.0, 2.0), 2.0);
        assert_eq!(smooth, line(&[[0.0, 0.0], [1.0, 1.0], [2.0, 0.0], [9.0, 0.0], [10.0, 1.0]]));
    }

    #[test]
    fn a_brush_raises_most_in_its_middle() {
        assert_eq!(brushed(&[[0.0, 1.0], [0.5, 1.0], [1.0, 1.0]], 0.5, 0.4, 1.0), [[0.0, 1.2], [0.5, 1.4], [1.0, 1.2]]);
    }
}
