//! Curves through control points.

mod segment;

use segment::{Segment, monotone_slopes};

/// Interpolation between control points.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Interpolation {
    /// Straight lines.
    Linear,
    /// Each value holds until the next point.
    Step,
    /// A smooth curve (continuous derivative) that never overshoots its points: monotone where they are, and level at local extrema.
    Monotone,
}

/// Why points do not define a curve. Indices count from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CurveError {
    /// There are no points.
    #[error("has no points; allowed: at least 1")]
    Empty,
    /// A point does not lie after the one before it.
    #[error("point {} is not after point {index}; allowed: ascending positions or times", index + 1)]
    NotAscending {
        /// The offending point.
        index: usize,
    },
    /// A number is infinite or not a number.
    #[error("point {} has an infinite or NaN coordinate; allowed: finite numbers", index + 1)]
    NotFinite {
        /// The offending point.
        index: usize,
    },
    /// Two points are so far apart, or the curve between them is so steep, that the slope cannot be computed.
    #[error("between point {index} and point {} the curve is too steep or too long to compute", index + 1)]
    OutOfRange {
        /// The second of the two points.
        index: usize,
    },
}

/// A function of one variable through control points; constant before the first and after the last point.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    points: Vec<[f64; 2]>,
    segments: Vec<Segment>,
    /// Integral from the first point to each point.
    integrals: Vec<f64>,
    interpolation: Interpolation,
}

impl Curve {
    /// The curve through `points` (x, y), x ascending.
    ///
    /// # Errors
    /// There are no points, x is not ascending, a number is not finite, or a slope exceeds 1e100.
    pub fn new(points: Vec<[f64; 2]>, interpolation: Interpolation) -> Result<Self, CurveError> {
        check(&points)?;
        let slopes = match interpolation {
            Interpolation::Monotone => monotone_slopes(&points),
            Interpolation::Linear | Interpolation::Step => Vec::new(),
        };
        let (mut segments, mut integrals) = (Vec::new(), vec![0.0]);
        for (index, pair) in points.windows(2).enumerate() {
            let segment = match interpolation {
                Interpolation::Linear => Segment::linear(pair[0], pair[1]),
                Interpolation::Step => Segment::level(pair[0], pair[1]),
                Interpolation::Monotone => Segment::cubic(pair[0], pair[1], slopes[index], slopes[index + 1]),
            };
            integrals.push(integrals[index] + segment.integral(1.0));
            segments.push(segment);
        }
        Ok(Self { points, segments, integrals, interpolation })
    }

    /// The constant curve `value`; `None` if `value` is not finite.
    pub fn constant(value: f64) -> Option<Self> {
        Self::new(vec![[0.0, value]], Interpolation::Linear).ok()
    }

    /// Control points (x, y).
    pub fn points(&self) -> &[[f64; 2]] {
        &self.points
    }

    /// Interpolation between points.
    pub fn interpolation(&self) -> Interpolation {
        self.interpolation
    }

    /// Value at `x`, always between the values of the two adjacent points. NaN gives the first value.
    pub fn eval(&self, x: f64) -> f64 {
        match self.locate(x) {
            Location::Before => self.points[0][1],
            Location::Within(index, t) => self.segments[index].value(t),
            Location::After => self.points[self.points.len() - 1][1],
        }
    }

    /// Derivative at `x`: 0 outside the points and for step curves; at a control point that of the segment to the right.
    pub fn derivative(&self, x: f64) -> f64 {
        match self.locate(x) {
            Location::Within(index, t) => self.segments[index].slope(t),
            Location::Before | Location::After => 0.0,
        }
    }

    /// Integral from `from` to `to`, exact up to rounding; negative if `to` is less than `from`.
    pub fn integral(&self, from: f64, to: f64) -> f64 {
        self.integral_from_first(to) - self.integral_from_first(from)
    }

    /// Integral from the first point to `x`.
    fn integral_from_first(&self, x: f64) -> f64 {
        let last = self.points.len() - 1;
        match self.locate(x) {
            Location::Before => self.points[0][1] * (x - self.points[0][0]),
            Location::Within(index, t) => self.integrals[index] + self.segments[index].integral(t),
            Location::After => self.integrals[last] + self.points[last][1] * (x - self.points[last][0]),
        }
    }

    /// `count` values at equal distances from `low` to `high`, both included (only `low` if `count` is 1).
    pub fn sample_table(&self, count: usize, low: f64, high: f64) -> Vec<f32> {
        let last = count.saturating_sub(1).max(1) as f64;
        (0..count).map(|index| self.eval(crate::math::lerp(low, high, index as f64 / last)) as f32).collect()
    }

    /// Smallest and largest value.
    pub fn range(&self) -> [f64; 2] {
        self.points
            .iter()
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], point| [low.min(point[1]), high.max(point[1])])
    }

    fn locate(&self, x: f64) -> Location {
        let after = self.points.partition_point(|point| point[0] <= x);
        if after == 0 {
            Location::Before
        } else if after == self.points.len() {
            Location::After
        } else {
            let (start, end) = (self.points[after - 1][0], self.points[after][0]);
            Location::Within(after - 1, (x - start) / (end - start))
        }
    }
}

/// Position of an x relative to the control points.
enum Location {
    Before,
    /// In the segment with that index, at a fraction of its length.
    Within(usize, f64),
    After,
}

/// Slopes and lengths up to this magnitude do not overflow in the products of the cubic.
const MAX_MAGNITUDE: f64 = 1e100;

fn check(points: &[[f64; 2]]) -> Result<(), CurveError> {
    if points.is_empty() {
        return Err(CurveError::Empty);
    }
    if let Some(index) = points.iter().position(|point| !point.iter().all(|number| number.is_finite())) {
        return Err(CurveError::NotFinite { index });
    }
    for (index, pair) in points.windows(2).enumerate() {
        let (length, rise) = (pair[1][0] - pair[0][0], pair[1][1] - pair[0][1]);
        if pair[1][0] <= pair[0][0] {
            return Err(CurveError::NotAscending { index: index + 1 });
        }
        if length > MAX_MAGNITUDE || rise.abs() > MAX_MAGNITUDE || (rise / length).abs() > MAX_MAGNITUDE {
            return Err(CurveError::OutOfRange { index: index + 1 });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(points: &[[f64; 2]], interpolation: Interpolation) -> Curve {
        Curve::new(points.to_vec(), interpolation).unwrap()
    }

    /// Random points with gaps and rises of several sizes.
    fn random_points(trial: u64) -> Vec<[f64; 2]> {
        let key = crate::math::random::Key::new(trial, "curve");
        let mut x = -1.0;
        let point = |index: u64| {
            let [a, b, c, _] = key.uniforms(index, 0, crate::math::random::Purpose(0)).map(f64::from);
            x += 0.01 + a * a * a;
            [x, if c < 0.2 { 0.5 } else { 4.0 * b - 2.0 }]
        };
        (0..2 + trial % 9).map(point).collect()
    }

    #[test]
    fn linear_and_step_have_hand_worked_values() {
        let points = [[0.0, 1.0], [2.0, 3.0], [3.0, -1.0]];
        let linear = curve(&points, Interpolation::Linear);
        assert_eq!(
            [-5.0, 0.0, 0.5, 2.0, 2.25, 3.0, 9.0].map(|x| linear.eval(x)),
            [1.0, 1.0, 1.5, 3.0, 2.0, -1.0, -1.0]
        );
        assert_eq!([-1.0, 1.0, 2.0, 2.5, 3.5].map(|x| linear.derivative(x)), [0.0, 1.0, -4.0, -4.0, 0.0]);
        let step = curve(&points, Interpolation::Step);
        assert_eq!([-5.0, 0.0, 1.999, 2.0, 2.999, 3.0].map(|x| step.eval(x)), [1.0, 1.0, 1.0, 3.0, 3.0, -1.0]);
        assert_eq!(step.derivative(1.0), 0.0);
        assert_eq!(
            (linear.eval(f64::NAN), linear.eval(f64::INFINITY), linear.eval(f64::NEG_INFINITY)),
            (1.0, -1.0, 1.0)
        );
    }

    #[test]
    fn monotone_has_hand_worked_values() {
        // Equal gaps, secants 1 and 3: harmonic mean 2 * 1 * 3 / (1 + 3) = 1.5 in the middle;
        // ends (3 * 1 - 3) / 2 = 0 and (3 * 3 - 1) / 2 = 4.
        let rising = curve(&[[0.0, 0.0], [1.0, 1.0], [2.0, 4.0]], Interpolation::Monotone);
        assert_eq!([0.0, 1.0].map(|x| rising.derivative(x)), [0.0, 1.5]);
        // Hermite at 1/2: (y0 + y1) / 2 + h (d0 - d1) / 8.
        assert_eq!(rising.eval(0.5), 0.5 - 1.5 / 8.0);
        assert_eq!(rising.eval(1.5), 2.5 + (1.5 - 4.0) / 8.0);
        // A turning point is level.
        let peak = curve(&[[0.0, 0.0], [1.0, 2.0], [3.0, 1.0]], Interpolation::Monotone);
        assert_eq!(peak.derivative(1.0), 0.0);
        // Two points make a straight line, one a constant.
        assert_eq!(curve(&[[0.0, 1.0], [4.0, 3.0]], Interpolation::Monotone).eval(1.0), 1.5);
        assert_eq!(curve(&[[7.0, 2.0]], Interpolation::Monotone).eval(-3.0), 2.0);
    }

    #[test]
    fn unequal_gaps_weigh_the_harmonic_mean() {
        // Gaps 1 and 2, secants 2 and 1: weights 2*2+1 = 5 and 2+2*1 = 4, slope 9 / (5/2 + 4/1) = 18/13.
        let curve = curve(&[[0.0, 0.0], [1.0, 2.0], [3.0, 4.0]], Interpolation::Monotone);
        assert!((curve.derivative(1.0) - 18.0 / 13.0).abs() < 1e-15);
        // Left end: ((2*1 + 2) * 2 - 1 * 1) / (1 + 2) = 7/3.
        assert!((curve.derivative(0.0) - 7.0 / 3.0).abs() < 1e-15);
    }

    #[test]
    fn every_interpolation_passes_through_its_points_and_stays_between_neighbors() {
        for trial in 0..300 {
            let points = random_points(trial);
            for interpolation in [Interpolation::Linear, Interpolation::Step, Interpolation::Monotone] {
                let curve = curve(&points, interpolation);
                assert!(points.iter().all(|point| curve.eval(point[0]) == point[1]));
                for pair in points.windows(2) {
                    let values: Vec<f64> = (0..50)
                        .map(|i| curve.eval(crate::math::lerp(pair[0][0], pair[1][0], i as f64 / 49.0)))
                        .collect();
                    let (low, high) = (pair[0][1].min(pair[1][1]), pair[0][1].max(pair[1][1]));
                    assert!(values.iter().all(|y| (low..=high).contains(y)));
                    // Rounding of the cubic may swap neighbors that differ by a few units in the last place.
                    let rising = if pair[1][1] >= pair[0][1] { 1.0 } else { -1.0 };
                    assert!(values.windows(2).all(|y| (y[1] - y[0]) * rising >= -1e-14));
                }
            }
        }
    }

    #[test]
    fn monotone_curves_have_continuous_slopes_that_match_differences() {
        for trial in 0..100 {
            let points = random_points(trial);
            let curve = curve(&points, Interpolation::Monotone);
            for point in &points[1..points.len() - 1] {
                let (left, right) = (curve.derivative(point[0] - 1e-9), curve.derivative(point[0] + 1e-9));
                // Second derivatives reach 1e6 where a gap is 0.01.
                assert!((left - right).abs() < 4e-3, "{left} {right}");
            }
            let (low, high) = (points[0][0], points[points.len() - 1][0]);
            for i in 1..40 {
                let x = crate::math::lerp(low, high, i as f64 / 40.0);
                let difference = (curve.eval(x + 1e-6) - curve.eval(x - 1e-6)) / 2e-6;
                assert!((curve.derivative(x) - difference).abs() < 1e-2 * (1.0 + difference.abs()), "{x}");
            }
        }
    }

    #[test]
    fn integrals_are_exact() {
        let points = [[0.0, 1.0], [2.0, 3.0], [3.0, -1.0]];
        let linear = curve(&points, Interpolation::Linear);
        assert_eq!(linear.integral(0.0, 3.0), 4.0 + 1.0);
        assert_eq!(linear.integral(-2.0, 5.0), 2.0 + 5.0 - 2.0);
        assert_eq!(linear.integral(0.5, 1.5), 2.0);
        assert_eq!(linear.integral(1.5, 0.5), -2.0);
        assert_eq!(curve(&points, Interpolation::Step).integral(1.0, 3.5), 1.0 + 3.0 - 0.5);
        // Cubic with slopes 0 and 3/2 from 0 to 1: 1/2 + (0 - 3/2) / 12.
        let rising = curve(&[[0.0, 0.0], [1.0, 1.0], [2.0, 4.0]], Interpolation::Monotone);
        assert_eq!(rising.integral(0.0, 1.0), 0.5 - 1.5 / 12.0);
    }

    #[test]
    fn integrals_agree_with_gauss_quadrature_and_add_up() {
        for trial in 0..100 {
            let points = random_points(trial);
            let curve = curve(&points, Interpolation::Monotone);
            let mut sum = 0.0;
            for pair in points.windows(2) {
                // Two Gauss points are exact for a cubic.
                let (middle, half) = (0.5 * (pair[0][0] + pair[1][0]), 0.5 * (pair[1][0] - pair[0][0]));
                sum +=
                    half * [-1.0, 1.0].map(|side| curve.eval(middle + side * half / 3_f64.sqrt())).iter().sum::<f64>();
            }
            let (low, high) = (points[0][0], points[points.len() - 1][0]);
            assert!((curve.integral(low, high) - sum).abs() < 1e-12);
            let middle = low + 0.37 * (high - low);
            let parts = curve.integral(low - 1.0, middle) + curve.integral(middle, high + 1.0);
            assert!((curve.integral(low - 1.0, high + 1.0) - parts).abs() < 1e-12);
        }
    }

    #[test]
    fn tables_hold_both_ends() {
        let curve = curve(&[[0.0, 0.0], [1.0, 2.0]], Interpolation::Linear);
        assert_eq!(curve.sample_table(5, 0.0, 1.0), [0.0, 0.5, 1.0, 1.5, 2.0]);
        assert_eq!(curve.sample_table(1, 0.25, 1.0), [0.5]);
        assert!(curve.sample_table(0, 0.0, 1.0).is_empty());
    }

    #[test]
    fn range_and_rising_follow_the_points() {
        let humped = curve(&[[0.0, 1.0], [1.0, 5.0], [2.0, 5.0], [3.0, -2.0]], Interpolation::Monotone);
        assert_eq!(humped.range(), [-2.0, 5.0]);
        assert_eq!(Curve::constant(3.0).unwrap().range(), [3.0, 3.0]);
    }

    #[test]
    fn faulty_points_are_named() {
        let error = |points: &[[f64; 2]]| Curve::new(points.to_vec(), Interpolation::Monotone).unwrap_err();
        assert_eq!(error(&[]), CurveError::Empty);
        assert_eq!(error(&[[0.0, 0.0], [1.0, 0.0], [1.0, 2.0]]), CurveError::NotAscending { index: 2 });
        assert_eq!(error(&[[0.0, 0.0], [1.0, f64::NAN]]), CurveError::NotFinite { index: 1 });
        assert_eq!(error(&[[0.0, 0.0], [1e-300, 1.0]]), CurveError::OutOfRange { index: 1 });
        assert_eq!(error(&[[-1e308, 0.0], [1e308, 1.0]]), CurveError::OutOfRange { index: 1 });
        assert_eq!(
            error(&[[1.0, 0.0], [0.0, 0.0]]).to_string(),
            "point 2 is not after point 1; allowed: ascending positions or times"
        );
    }

    #[test]
    fn extreme_but_allowed_curves_stay_finite() {
        let wild = curve(&[[0.0, -5e99], [1.0, 5e99], [1e99, 0.0]], Interpolation::Monotone);
        for x in [0.1, 0.5, 0.999, 2.0, 1e50, 9e98] {
            assert!(wild.eval(x).is_finite() && wild.derivative(x).is_finite());
        }
    }
}
