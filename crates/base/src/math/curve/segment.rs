//! One piece of a curve as a cubic in the fraction of its length.

/// A piece between two points: `start + length t (slope + t (bend + t twist))`, 0 <= t <= 1.
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
    /// A straight line.
    pub(super) fn linear(from: [f64; 2], to: [f64; 2]) -> Self {
        let length = to[0] - from[0];
        Self { start: from[1], end: to[1], length, slope: (to[1] - from[1]) / length, quadratic: 0.0, cubic: 0.0 }
    }

    /// The first value all the way.
    pub(super) fn level(from: [f64; 2], to: [f64; 2]) -> Self {
        Self { start: from[1], end: from[1], length: to[0] - from[0], slope: 0.0, quadratic: 0.0, cubic: 0.0 }
    }

    /// The cubic Hermite piece with the given slopes at its ends.
    pub(super) fn cubic(from: [f64; 2], to: [f64; 2], slope: f64, end_slope: f64) -> Self {
        let length = to[0] - from[0];
        let secant = (to[1] - from[1]) / length;
        let quadratic = 3.0 * secant - 2.0 * slope - end_slope;
        Self { start: from[1], end: to[1], length, slope, quadratic, cubic: slope + end_slope - 2.0 * secant }
    }

    /// Value at the fraction `t`, held between the ends so that rounding cannot overshoot either.
    pub(super) fn value(&self, t: f64) -> f64 {
        let value = self.start + self.length * t * (self.slope + t * (self.quadratic + t * self.cubic));
        value.max(self.start.min(self.end)).min(self.start.max(self.end))
    }

    /// Slope at the fraction `t`.
    pub(super) fn slope(&self, t: f64) -> f64 {
        self.slope + t * (2.0 * self.quadratic + 3.0 * t * self.cubic)
    }

    /// Integral over the first fraction `t` of the piece.
    pub(super) fn integral(&self, t: f64) -> f64 {
        let cubic = self.slope / 2.0 + t * (self.quadratic / 3.0 + t * self.cubic / 4.0);
        self.length * t * (self.start + self.length * t * cubic)
    }
}

/// Slopes at the points such that the cubic pieces between them are monotone where the points are: the harmonic mean
/// of Fritsch & Butland (1984), weighted by the gaps, inside; a three-point slope, limited after Fritsch & Carlson (1980), at the ends.
pub(super) fn monotone_slopes(points: &[[f64; 2]]) -> Vec<f64> {
    let gaps: Vec<f64> = points.windows(2).map(|pair| pair[1][0] - pair[0][0]).collect();
    let secants: Vec<f64> = points.windows(2).zip(&gaps).map(|(pair, gap)| (pair[1][1] - pair[0][1]) / gap).collect();
    let count = secants.len();
    match count {
        0 => vec![0.0; points.len()],
        1 => vec![secants[0]; 2],
        _ => {
            let inside = |i: usize| inner_slope([gaps[i - 1], gaps[i]], [secants[i - 1], secants[i]]);
            let first = end_slope([gaps[0], gaps[1]], [secants[0], secants[1]]);
            let last = end_slope([gaps[count - 1], gaps[count - 2]], [secants[count - 1], secants[count - 2]]);
            std::iter::once(first).chain((1..count).map(inside)).chain(std::iter::once(last)).collect()
        }
    }
}

fn inner_slope(gaps: [f64; 2], secants: [f64; 2]) -> f64 {
    if secants[0] == 0.0 || secants[1] == 0.0 || (secants[0] < 0.0) != (secants[1] < 0.0) {
        return 0.0;
    }
    let weights = [2.0 * gaps[1] + gaps[0], gaps[1] + 2.0 * gaps[0]];
    (weights[0] + weights[1]) / (weights[0] / secants[0] + weights[1] / secants[1])
}

/// Slope at an end, from the nearest piece and the next one.
fn end_slope(gaps: [f64; 2], secants: [f64; 2]) -> f64 {
    let parabola = ((2.0 * gaps[0] + gaps[1]) * secants[0] - gaps[0] * secants[1]) / (gaps[0] + gaps[1]);
    if parabola == 0.0 || secants[0] == 0.0 || (parabola < 0.0) != (secants[0] < 0.0) {
        0.0
    } else if (secants[0] < 0.0) != (secants[1] < 0.0) && parabola.abs() > 3.0 * secants[0].abs() {
        3.0 * secants[0]
    } else {
        parabola
    }
}
