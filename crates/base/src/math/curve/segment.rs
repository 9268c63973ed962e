//! One segment of a curve: a cubic in the fraction of its length.

/// A segment between two points: `start + length t (slope + t (quadratic + t cubic))`, 0 <= t <= 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Segment {
    start: f64,
    end: f64,
    length: f64,
    slope: f64,
    quadratic: f64,
    cubic: f64,
}

impl Segment {
    /// A linear segment.
    pub(super) fn linear(from: [f64; 2], to: [f64; 2]) -> Self {
        let length = to[0] - from[0];
        Self { start: from[1], end: to[1], length, slope: (to[1] - from[1]) / length, quadratic: 0.0, cubic: 0.0 }
    }

    /// A constant segment with the first value.
    pub(super) fn level(from: [f64; 2], to: [f64; 2]) -> Self {
        Self { start: from[1], end: from[1], length: to[0] - from[0], slope: 0.0, quadratic: 0.0, cubic: 0.0 }
    }

    /// The cubic Hermite segment with the given slopes at its ends.
    pub(super) fn cubic(from: [f64; 2], to: [f64; 2], slope: f64, end_slope: f64) -> Self {
        let length = to[0] - from[0];
        let secant = (to[1] - from[1]) / length;
        let quadratic = 3.0 * secant - 2.0 * slope - end_slope;
        Self { start: from[1], end: to[1], length, slope, quadratic, cubic: slope + end_slope - 2.0 * secant }
    }

    /// Value at the fraction `t`, clamped to the values at the ends, so that rounding cannot overshoot them.
    pub(super) fn value(&self, t: f64) -> f64 {
        let value = self.start + self.length * t * (self.slope + t * (self.quadratic + t * self.cubic));
        value.max(self.start.min(self.end)).min(self.start.max(self.end))
    }

    /// Slope at the fraction `t`.
    pub(super) fn slope(&self, t: f64) -> f64 {
        self.slope + t * (2.0 * self.quadratic + 3.0 * t * self.cubic)
    }

    /// Integral over the first fraction `t` of the segment.
    pub(super) fn integral(&self, t: f64) -> f64 {
        let cubic = self.slope / 2.0 + t * (self.quadratic / 3.0 + t * self.cubic / 4.0);
        self.length * t * (self.start + self.length * t * cubic)
    }
}

/// Slopes at the points such that the cubic segments between them are monotone where the points are: the harmonic mean
/// of Fritsch & Butland (1984), weighted by the intervals, at inner points; a three-point slope, limited after Fritsch & Carlson (1980), at the ends.
pub(super) fn monotone_slopes(points: &[[f64; 2]]) -> Vec<f64> {
    let intervals: Vec<f64> = points.windows(2).map(|pair| pair[1][0] - pair[0][0]).collect();
    let secants: Vec<f64> =
        points.windows(2).zip(&intervals).map(|(pair, interval)| (pair[1][1] - pair[0][1]) / interval).collect();
    let count = secants.len();
    match count {
        0 => vec![0.0; points.len()],
        1 => vec![secants[0]; 2],
        _ => {
            let mut slopes = vec![end_slope([intervals[0], intervals[1]], [secants[0], secants[1]])];
            for (intervals, secants) in intervals.windows(2).zip(secants.windows(2)) {
                slopes.push(inner_slope([intervals[0], intervals[1]], [secants[0], secants[1]]));
            }
            slopes.push(end_slope(
                [intervals[count - 1], intervals[count - 2]],
                [secants[count - 1], secants[count - 2]],
            ));
            slopes
        }
    }
}

fn inner_slope(intervals: [f64; 2], secants: [f64; 2]) -> f64 {
    if secants[0] == 0.0 || secants[1] == 0.0 || (secants[0] < 0.0) != (secants[1] < 0.0) {
        return 0.0;
    }
    let weights = [2.0 * intervals[1] + intervals[0], intervals[1] + 2.0 * intervals[0]];
    (weights[0] + weights[1]) / (weights[0] / secants[0] + weights[1] / secants[1])
}

/// Slope at an end, from the nearest two segments.
fn end_slope(intervals: [f64; 2], secants: [f64; 2]) -> f64 {
    let parabola =
        ((2.0 * intervals[0] + intervals[1]) * secants[0] - intervals[0] * secants[1]) / (intervals[0] + intervals[1]);
    if parabola == 0.0 || secants[0] == 0.0 || (parabola < 0.0) != (secants[0] < 0.0) {
        0.0
    } else if (secants[0] < 0.0) != (secants[1] < 0.0) && parabola.abs() > 3.0 * secants[0].abs() {
        3.0 * secants[0]
    } else {
        parabola
    }
}
