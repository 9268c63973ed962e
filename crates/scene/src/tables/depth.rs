//! From the values of a depth to meters; scale and shift of an inverse depth from points whose distance is known.

use std::fmt;

use super::picture::DepthKind;

/// From the values of a depth to meters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthScale {
    /// What the values measure.
    pub kind: DepthKind,
    /// Meters of a unit. The inverse depth is `shift + value / meters`.
    pub meters: f64,
    /// Inverse distance at an inverse depth of 0, 1/m.
    pub shift: f64,
}

impl DepthScale {
    /// Distance of `value`, m; infinite where it is 0, negative, infinite or NaN.
    pub fn meters_of(&self, value: f32) -> f64 {
        if !value.is_finite() || value == 0.0 {
            return f64::INFINITY;
        }
        let meters = match self.kind {
            DepthKind::Inverse => 1.0 / (self.shift + f64::from(value) / self.meters),
            DepthKind::Axis | DepthKind::Distance => self.meters * f64::from(value),
        };
        if meters > 0.0 { meters } else { f64::INFINITY }
    }
}

/// Why scale and shift cannot be found from known depths.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub(super) enum KnownDepthError {
    /// There is no depth.
    #[error("a plate without depth has no scale to find; allowed: with `depth`, or an image that has one")]
    NoDepth,
    /// The depth is not inverse.
    #[error("finds scale and shift of an inverse depth alone; allowed: with `depth_kind = \"inverse\"`")]
    NotInverse,
    /// There is a single point.
    #[error("has a single point; allowed: 2 or more")]
    TooFew,
    /// A point is outside the image.
    #[error("point {point} is at [{x}, {y}]; allowed: within the image of {width} x {height} pixels")]
    Outside {
        /// Number of the point, from 1.
        point: usize,
        /// Its position, pixels.
        x: f64,
        /// Its position, pixels.
        y: f64,
        /// Width of the image.
        width: usize,
        /// Height of the image.
        height: usize,
    },
    /// A distance that is not positive.
    #[error("point {point} is {meters} m away; allowed: above 0")]
    Distance {
        /// Number of the point, from 1.
        point: usize,
        /// Its distance, m.
        meters: f64,
    },
    /// The depth has no value at a point.
    #[error(
        "the depth has no value at point {point} (it is 0, infinite or not a number); allowed: points where it has one"
    )]
    NoValue {
        /// Number of the point, from 1.
        point: usize,
    },
    /// Two points are in the same pixel.
    #[error("points {first} and {second} are in the same pixel; allowed: one distance for a pixel")]
    SamePixel {
        /// Number of a point, from 1.
        first: usize,
        /// Number of the other.
        second: usize,
    },
    /// The depth has the same value at all points.
    #[error("the depth has the same value at all points; allowed: at least two different values")]
    SameValue,
    /// Larger values are farther.
    #[error(
        "the points say that larger values are farther, so the depth is not inverse; allowed: `depth_kind` \"axis\", or points that agree"
    )]
    Rising,
}

/// Scale and shift by least squares.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthFit {
    /// Inverse distance at 0, 1/m.
    pub shift: f64,
    /// Inverse distance for each unit, 1/m.
    pub slope: f64,
    /// Root mean square of (found - known) / known over the points.
    pub residual: f64,
    /// Points that deviate by more than a tenth: number from 1, known and found distance, m.
    pub misfits: Vec<(usize, f64, f64)>,
}

/// Relative deviation beyond which a point is told.
const MISFIT: f64 = 0.1;
/// Most points that are told.
const TOLD_POINTS: usize = 6;

impl DepthFit {
    /// The scale that was found.
    pub fn scale(&self) -> DepthScale {
        DepthScale { kind: DepthKind::Inverse, meters: 1.0 / self.slope, shift: self.shift }
    }
}

impl fmt::Display for DepthFit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let scale = self.scale();
        write!(
            f,
            "`depth_scale = {:.6}` and `depth_shift = {:.6}` fit best; the distances deviate by {:.1} %",
            scale.meters,
            scale.shift,
            100.0 * self.residual
        )?;
        for (point, known, found) in self.misfits.iter().take(TOLD_POINTS) {
            write!(f, "; point {point} is {known} m away, and would be {found:.2} m")?;
        }
        match self.misfits.len().saturating_sub(TOLD_POINTS) {
            0 => Ok(()),
            more => write!(f, "; {more} more points do not fit"),
        }
    }
}

/// Fits `1 / distance = shift + slope value` to points `[x, y, meters]` of an image of `size` pixels.
pub(super) fn fit(
    points: &[[f64; 3]],
    kind: DepthKind,
    size: [usize; 2],
    value_at: impl Fn([f64; 2]) -> f32,
) -> Result<DepthFit, KnownDepthError> {
    if kind != DepthKind::Inverse {
        return Err(KnownDepthError::NotInverse);
    }
    check_points(points, size)?;
    let mut values = Vec::with_capacity(points.len());
    for (index, [x, y, meters]) in points.iter().enumerate() {
        let value = value_at([*x, *y]);
        if !value.is_finite() || value == 0.0 {
            return Err(KnownDepthError::NoValue { point: index + 1 });
        }
        values.push([f64::from(value), 1.0 / meters]);
    }
    let [shift, slope] = least_squares(&values).ok_or(KnownDepthError::SameValue)?;
    if slope <= 0.0 {
        return Err(KnownDepthError::Rising);
    }
    Ok(judged(points, &values, shift, slope))
}

fn check_points(points: &[[f64; 3]], [width, height]: [usize; 2]) -> Result<(), KnownDepthError> {
    if points.len() < 2 {
        return Err(KnownDepthError::TooFew);
    }
    let mut pixels = std::collections::BTreeMap::new();
    for (point, &[x, y, meters]) in (1..).zip(points) {
        if x >= width as f64 || y >= height as f64 {
            return Err(KnownDepthError::Outside { point, x, y, width, height });
        }
        if meters <= 0.0 {
            return Err(KnownDepthError::Distance { point, meters });
        }
        if let Some(first) = pixels.insert([x as usize, y as usize], point) {
            return Err(KnownDepthError::SamePixel { first, second: point });
        }
    }
    Ok(())
}

/// Intercept and slope of the line of least squares through points [x, y]; `None` if all have the same x.
fn least_squares(points: &[[f64; 2]]) -> Option<[f64; 2]> {
    let count = points.len() as f64;
    let mean = |axis: usize| points.iter().map(|point| point[axis]).sum::<f64>() / count;
    let (mean_x, mean_y) = (mean(0), mean(1));
    let covariance: f64 = points.iter().map(|[x, y]| (x - mean_x) * (y - mean_y)).sum();
    let variance: f64 = points.iter().map(|[x, _]| (x - mean_x) * (x - mean_x)).sum();
    let slope = covariance / variance;
    (variance > 0.0 && slope.is_finite()).then_some([mean_y - slope * mean_x, slope])
}

fn judged(points: &[[f64; 3]], values: &[[f64; 2]], shift: f64, slope: f64) -> DepthFit {
    let found = |value: f64| {
        let inverse = shift + slope * value;
        if inverse > 0.0 { 1.0 / inverse } else { f64::INFINITY }
    };
    let deviations = || points.iter().zip(values).map(|([_, _, known], [value, _])| (*known, found(*value)));
    // What lies beyond infinity deviates by its whole distance.
    let relative = |(known, found): (f64, f64)| if found.is_finite() { (found - known) / known } else { 1.0 };
    let squares: f64 = deviations().map(|pair| relative(pair) * relative(pair)).sum();
    let misfits = (1..).zip(deviations()).filter(|(_, pair)| relative(*pair).abs() > MISFIT);
    DepthFit {
        shift,
        slope,
        residual: (squares / points.len() as f64).sqrt(),
        misfits: misfits.map(|(point, (known, found))| (point, known, found)).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The depth of these tests: the value is the column.
    fn column([x, _]: [f64; 2]) -> f32 {
        x as f32
    }

    fn fitted(points: &[[f64; 3]]) -> Result<DepthFit, KnownDepthError> {
        fit(points, DepthKind::Inverse, [100, 50], column)
    }

    #[test]
    fn two_points_are_met_and_more_are_fitted() {
        // 1/d = 0.05 + 0.01 x: 6.667 m at 10, 1 m at 95.
        let exact = fitted(&[[10.0, 3.0, 1.0 / 0.15], [95.0, 7.0, 1.0]]).unwrap();
        assert!((exact.shift - 0.05).abs() < 1e-12 && (exact.slope - 0.01).abs() < 1e-12 && exact.residual < 1e-12);
        assert!((exact.scale().meters_of(45.0) - 2.0).abs() < 1e-9);
        assert!(exact.misfits.is_empty());
        let contradicting = fitted(&[[10.0, 3.0, 1.0 / 0.15], [95.0, 7.0, 1.0], [50.0, 1.0, 9.0]]).unwrap();
        // By hand: x 10, 95, 50; y 0.15, 1, 1/9.
        assert!((contradicting.slope - 0.010_202_25).abs() < 1e-7, "{}", contradicting.slope);
        assert!(contradicting.residual > 0.1 && contradicting.misfits.iter().any(|misfit| misfit.0 == 3));
        assert!(contradicting.to_string().contains("point 3 is 9 m away, and would be"));
    }

    #[test]
    fn points_that_say_nothing_are_refused() {
        use KnownDepthError::*;
        let near = [10.0, 3.0, 2.0];
        assert_eq!(fitted(&[near]), Err(TooFew));
        assert_eq!(fitted(&[near, [10.6, 3.2, 4.0]]), Err(SamePixel { first: 1, second: 2 }));
        assert_eq!(fitted(&[near, [10.0, 5.0, 4.0]]), Err(SameValue));
        assert_eq!(fitted(&[near, [20.0, 5.0, 4.0]]), Err(Rising));
        assert_eq!(fitted(&[near, [0.0, 5.0, 4.0]]), Err(NoValue { point: 2 }));
        assert_eq!(fitted(&[near, [20.0, 5.0, 0.0]]), Err(Distance { point: 2, meters: 0.0 }));
        let outside = Outside { point: 2, x: 100.0, y: 0.0, width: 100, height: 50 };
        assert_eq!(fitted(&[near, [100.0, 0.0, 1.0]]), Err(outside));
        assert_eq!(fit(&[near, near], DepthKind::Axis, [100, 50], column), Err(NotInverse));
    }

    #[test]
    fn zero_infinity_and_nan_are_far_and_negative_too() {
        for kind in [DepthKind::Axis, DepthKind::Distance, DepthKind::Inverse] {
            let scale = DepthScale { kind, meters: 2.0, shift: 0.0 };
            for far in [0.0, f32::INFINITY, f32::NEG_INFINITY, f32::NAN, -1.0] {
                assert_eq!(scale.meters_of(far), f64::INFINITY, "{kind:?} {far}");
            }
            assert_eq!(scale.meters_of(4.0), if kind == DepthKind::Inverse { 0.5 } else { 8.0 });
        }
        let shifted = DepthScale { kind: DepthKind::Inverse, meters: 2.0, shift: 0.5 };
        assert_eq!(shifted.meters_of(1.0), 1.0);
    }
}
