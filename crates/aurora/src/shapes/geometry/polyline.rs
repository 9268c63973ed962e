//! Polylines: arc length, resampling, and control points from strokes.

use bansho_base::math::{DVec2, lerp};

/// Strokes with fewer points are treated as sketches and smoothed.
const SKETCH_POINTS: usize = 256;

/// Points with cumulative arc length; at least one point.
#[derive(Clone, Debug)]
pub(crate) struct Polyline {
    points: Vec<DVec2>,
    /// Length up to each point.
    lengths: Vec<f64>,
}

impl Polyline {
    /// The line through `points`; `None` where there is no point.
    pub(crate) fn new(points: Vec<DVec2>) -> Option<Self> {
        let mut lengths = vec![0.0];
        for pair in points.windows(2) {
            lengths.push(lengths[lengths.len() - 1] + pair[0].distance(pair[1]));
        }
        (!points.is_empty()).then_some(Self { points, lengths })
    }

    pub(crate) fn points(&self) -> &[DVec2] {
        &self.points
    }

    pub(crate) fn length(&self) -> f64 {
        self.lengths[self.lengths.len() - 1]
    }

    /// The point at a fraction of the length, 0 at the start to 1 at the end.
    pub(crate) fn at(&self, fraction: f64) -> DVec2 {
        let distance = fraction * self.length();
        let last = self.points.len() - 1;
        let next = self.lengths.partition_point(|&length| length <= distance).clamp(1, last.max(1)).min(last);
        let before = next.saturating_sub(1);
        let step = self.lengths[next] - self.lengths[before];
        if step > 0.0 {
            self.points[before].lerp(self.points[next], ((distance - self.lengths[before]) / step).clamp(0.0, 1.0))
        } else {
            self.points[before]
        }
    }

    /// Resamples to `count` points at equal arc length, both ends included.
    pub(crate) fn resample(&self, count: usize) -> Vec<DVec2> {
        (0..count).map(|index| self.at(index as f64 / (count - 1).max(1) as f64)).collect()
    }
}

/// Length of the line through `points`.
pub(crate) fn line_length(points: &[DVec2]) -> f64 {
    points.windows(2).map(|pair| pair[0].distance(pair[1])).sum()
}

/// Length of a line up to each of its points.
pub(crate) fn cumulative_lengths(points: &[DVec2]) -> Vec<f64> {
    let mut lengths = Vec::with_capacity(points.len());
    let mut sum = 0.0;
    for (index, point) in points.iter().enumerate() {
        sum += if index > 0 { point.distance(points[index - 1]) } else { 0.0 };
        lengths.push(sum);
    }
    lengths
}

/// Fraction of the length at each point; uniform where the length is 0.
pub(crate) fn length_fractions(points: &[DVec2]) -> Vec<f64> {
    let mut fractions = cumulative_lengths(points);
    let sum = fractions.last().copied().unwrap_or(0.0);
    let last = points.len().saturating_sub(1).max(1) as f64;
    for (index, fraction) in fractions.iter_mut().enumerate() {
        *fraction = if sum > 0.0 { *fraction / sum } else { index as f64 / last };
    }
    fractions
}

/// Eq. (2.1): `count` control points P_i by linear interpolation over the recorded positions M_j. The printed index i
/// m/n cuts off the end of the stroke; i (m - 1)/(n - 1) reaches it.
pub(crate) fn resample_by_index(recorded: &[DVec2], count: usize) -> Vec<DVec2> {
    let last = recorded.len().saturating_sub(1);
    (0..count).map(|i| at_index(recorded, (i * last) as f64 / (count - 1).max(1) as f64)).collect()
}

/// Eq. (2.1) as it is printed: the index of P_i is i m/n.
pub(crate) fn resample_by_printed_index(recorded: &[DVec2], count: usize) -> Vec<DVec2> {
    (0..count).map(|i| at_index(recorded, (i * recorded.len()) as f64 / count as f64)).collect()
}

/// The position between M_q and M_(q+1) at an index from 0 to the last.
fn at_index(recorded: &[DVec2], index: f64) -> DVec2 {
    let last = recorded.len().saturating_sub(1);
    let q = index as usize;
    recorded[q.min(last)].lerp(recorded[(q + 1).min(last)], index - q as f64)
}

/// A centripetal Catmull-Rom spline through the points of a sketch, without cusps or self-intersections within a
/// segment (Yuksel, Schaefer & Keyser 2011), and its number of segments per point. Longer strokes are returned
/// unchanged.
pub(crate) fn smooth_sketch(points: Vec<DVec2>) -> (Vec<DVec2>, usize) {
    const SEGMENTS: usize = 8;
    let count = points.len();
    if !(3..SKETCH_POINTS).contains(&count) {
        return (points, 1);
    }
    // Beyond each end, the mirror image of the point next to it.
    let before = points[0] + (points[0] - points[1]);
    let after = points[count - 1] + (points[count - 1] - points[count - 2]);
    let mut line = vec![points[0]];
    for index in 0..count - 1 {
        let previous = if index == 0 { before } else { points[index - 1] };
        let next = points.get(index + 2).copied().unwrap_or(after);
        let four = [previous, points[index], points[index + 1], next];
        line.extend((1..SEGMENTS).map(|segment| centripetal(four, segment as f64 / SEGMENTS as f64)));
        line.push(points[index + 1]);
    }
    (line, SEGMENTS)
}

/// The segment between the two inner points, by the pyramid of Barry & Goldman (1988).
fn centripetal([a, b, c, d]: [DVec2; 4], fraction: f64) -> DVec2 {
    let [ta, tb] = [0.0, knot_interval(a, b)];
    let tc = tb + knot_interval(b, c);
    let td = tc + knot_interval(c, d);
    let t = lerp(tb, tc, fraction);
    let ab = a.lerp(b, (t - ta) / (tb - ta));
    let bc = b.lerp(c, (t - tb) / (tc - tb));
    let cd = c.lerp(d, (t - tc) / (td - tc));
    let abc = ab.lerp(bc, (t - ta) / (tc - ta));
    let bcd = bc.lerp(cd, (t - tb) / (td - tb));
    abc.lerp(bcd, (t - tb) / (tc - tb))
}

/// Centripetal interval of the spline's parameter between two points: the square root of their distance, and not 0 if
/// they coincide.
fn knot_interval(from: DVec2, to: DVec2) -> f64 {
    from.distance(to).sqrt().max(1e-9)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corner() -> Vec<DVec2> {
        vec![DVec2::new(0.0, 0.0), DVec2::new(3.0, 0.0), DVec2::new(3.0, 1.0)]
    }

    #[test]
    fn shares_of_the_length_are_points() {
        let line = Polyline::new(corner()).unwrap();
        assert_eq!(line.length(), 4.0);
        assert_eq!(
            line.resample(5).iter().map(|p| p.to_array()).collect::<Vec<_>>(),
            [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0], [3.0, 1.0]]
        );
        assert_eq!(length_fractions(&corner()), [0.0, 0.75, 1.0]);
        assert_eq!(line.at(-1.0), DVec2::ZERO);
        assert_eq!(line.at(7.0), DVec2::new(3.0, 1.0));
        let spot = Polyline::new(vec![DVec2::ONE]).unwrap();
        assert_eq!((spot.at(0.3), spot.length()), (DVec2::ONE, 0.0));
        assert_eq!(length_fractions(&[DVec2::ONE; 3]), [0.0, 0.5, 1.0]);
        assert!(Polyline::new(Vec::new()).is_none());
    }

    /// m = 3 recorded points, n = 5 control points: positions 0, 1/2, 1, 3/2, 2.
    #[test]
    fn control_points_reach_the_end_of_the_stroke() {
        let points = resample_by_index(&corner(), 5);
        let expected = [[0.0, 0.0], [1.5, 0.0], [3.0, 0.0], [3.0, 0.5], [3.0, 1.0]];
        assert_eq!(points.iter().map(|p| p.to_array()).collect::<Vec<_>>(), expected);
    }

    /// m = 3, n = 5: positions 0, 3/5, 6/5, 9/5, and 12/5 beyond the last point.
    #[test]
    fn printed_control_points_stop_before_the_end_of_a_long_stroke() {
        let points = resample_by_printed_index(&corner(), 5);
        let expected = [[0.0, 0.0], [1.8, 0.0], [3.0, 0.2], [3.0, 0.8], [3.0, 1.0]];
        for (point, expected) in points.iter().zip(expected) {
            assert!((*point - DVec2::from(expected)).length() < 1e-12, "{point} {expected:?}");
        }
        let stroke: Vec<DVec2> = (0..320).map(|i| DVec2::new(f64::from(i), 0.0)).collect();
        // Counted from 1.
        let last_point = resample_by_printed_index(&stroke, 32)[31].x + 1.0;
        bansho_base::assert_measured!("equation (2.1): last recorded point as printed", last_point, 311.0, 0.0);
        assert_eq!(resample_by_index(&stroke, 32)[31].x, 319.0);
    }

    #[test]
    fn a_smoothed_sketch_passes_its_points_and_stays_straight_where_they_are() {
        let (line, pieces) = smooth_sketch(corner());
        assert_eq!((line.len(), pieces), (17, 8));
        assert!(corner().iter().all(|point| line.contains(point)));
        let straight: Vec<DVec2> = (0..4).map(|i| DVec2::new(f64::from(i), 0.0)).collect();
        let (line, _) = smooth_sketch(straight);
        assert!(line.iter().all(|point| point.y.abs() < 1e-12));
        assert!(line.windows(2).all(|pair| pair[0].x < pair[1].x));
        assert_eq!(smooth_sketch(corner()[..2].to_vec()), (corner()[..2].to_vec(), 1));
    }
}
