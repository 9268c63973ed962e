//! From the values of a depth to meters; scale and shift of an inverse depth from points whose distance is known.

use std::fmt;

use bansho_base::{
    host::parallel::prelude::*,
    math::simd::{self, LANES},
};
use fearless_simd::dispatch;

use super::picture::DepthKind;

/// From the values of a depth to meters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthScale {
    /// What the values measure.
    pub kind: DepthKind,
    /// Meters of a unit; negative where the values are, as z of a camera that looks toward -z. The inverse depth is `shift + value / meters`.
    pub meters: f64,
    /// Inverse distance at an inverse depth of 0, 1/m.
    pub shift: f64,
}

impl DepthScale {
    /// Distance of `value`, m; infinite where it is 0, infinite, NaN or on the other side of the camera.
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

/// What the values of a depth are.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DepthValues {
    /// Finite and above 0.
    pub positive: usize,
    /// Finite and below 0.
    pub negative: usize,
    /// 0, which means no value.
    pub zero: usize,
    /// Infinite: the sky.
    pub infinite: usize,
    /// Not a number.
    pub not_a_number: usize,
    /// Smallest and largest of those that are finite and not 0; both 0 without any.
    pub(super) range: [f32; 2],
}

impl DepthValues {
    /// Counts values, in parallel.
    pub(super) fn of(values: &[f32]) -> Self {
        const CHUNK: usize = 1 << 15;
        let chunks: Vec<Self> = values.par_chunks(CHUNK).map(Self::of_chunk).collect();
        let all = chunks.into_iter().fold(Self::NONE, |all, chunk| Self {
            positive: all.positive + chunk.positive,
            negative: all.negative + chunk.negative,
            zero: all.zero + chunk.zero,
            infinite: all.infinite + chunk.infinite,
            not_a_number: all.not_a_number + chunk.not_a_number,
            range: [all.range[0].min(chunk.range[0]), all.range[1].max(chunk.range[1])],
        });
        if all.positive + all.negative > 0 { all } else { Self { range: [0.0; 2], ..all } }
    }

    /// No values: the range contains nothing.
    const NONE: Self = Self {
        positive: 0,
        negative: 0,
        zero: 0,
        infinite: 0,
        not_a_number: 0,
        range: [f32::INFINITY, f32::NEG_INFINITY],
    };

    fn of_chunk(values: &[f32]) -> Self {
        let mut counts = LaneCounts::NONE;
        dispatch!(simd::level(), _simd => counts.add_all(values));
        let LaneCounts { positive, negative, zero, infinite, low, high } = counts;
        let [positive, negative, zero, infinite] =
            [positive, negative, zero, infinite].map(|lanes| lanes.iter().sum::<u32>() as usize);
        let not_a_number = values.len() - positive - negative - zero - infinite;
        let [lowest, highest] = Self::NONE.range;
        let range = [low.into_iter().fold(lowest, f32::min), high.into_iter().fold(highest, f32::max)];
        Self { positive, negative, zero, infinite, not_a_number, range }
    }

    /// Whether they are z in the space of a camera that looks toward -z: all that are finite are negative.
    pub(super) fn are_negative(&self) -> bool {
        self.negative > 0 && self.positive == 0
    }

    fn total(&self) -> usize {
        self.positive + self.negative + self.zero + self.infinite + self.not_a_number
    }

    /// What a depth of these values cannot be meant to do, at a camera that draws nothing nearer than `near`.
    pub(super) fn doubt(&self, scale: &DepthScale, near: f64) -> Option<DepthDoubt> {
        let ends = self.range.map(|value| scale.meters_of(value));
        let [nearest, farthest] = [ends[0].min(ends[1]), ends[0].max(ends[1])];
        match nearest {
            f64::INFINITY => Some(DepthDoubt::HidesNothing(*self)),
            _ if farthest < near => Some(DepthDoubt::TooNear { farthest, near }),
            _ if nearest > FARTHEST => Some(DepthDoubt::TooFar { nearest }),
            _ if scale.kind != DepthKind::Inverse && self.positive > 0 && self.negative > 0 => {
                Some(DepthDoubt::SomeNegative { negative: self.negative, total: self.total() })
            }
            _ => None,
        }
    }
}

/// Counts in lanes, which the compiler keeps in vectors.
struct LaneCounts {
    positive: [u32; LANES],
    negative: [u32; LANES],
    zero: [u32; LANES],
    infinite: [u32; LANES],
    /// Smallest and largest of the values that are finite and not 0.
    low: [f32; LANES],
    high: [f32; LANES],
}

impl LaneCounts {
    const NONE: Self = Self {
        positive: [0; LANES],
        negative: [0; LANES],
        zero: [0; LANES],
        infinite: [0; LANES],
        low: [f32::INFINITY; LANES],
        high: [f32::NEG_INFINITY; LANES],
    };

    /// Counts all values.
    #[inline(always)]
    fn add_all(&mut self, values: &[f32]) {
        let (batches, rest) = values.as_chunks::<LANES>();
        for batch in batches {
            for lane in 0..LANES {
                self.add(lane, batch[lane]);
            }
        }
        for (lane, value) in rest.iter().enumerate() {
            self.add(lane, *value);
        }
    }

    /// Counts a value, without branches.
    #[inline(always)]
    fn add(&mut self, lane: usize, value: f32) {
        let is_finite = value.abs() < f32::INFINITY;
        self.positive[lane] += u32::from(is_finite & (value > 0.0));
        self.negative[lane] += u32::from(is_finite & (value < 0.0));
        self.zero[lane] += u32::from(value == 0.0);
        self.infinite[lane] += u32::from(value.abs() == f32::INFINITY);
        let is_counted = is_finite & (value != 0.0);
        let low = if is_counted { value } else { f32::INFINITY };
        let high = if is_counted { value } else { f32::NEG_INFINITY };
        self.low[lane] = if low < self.low[lane] { low } else { self.low[lane] };
        self.high[lane] = if high > self.high[lane] { high } else { self.high[lane] };
    }
}

/// Distance beyond which nothing on the Earth is seen, m.
const FARTHEST: f64 = 1e7;

/// Why a depth probably is not what was meant.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum DepthDoubt {
    /// No value is a depth.
    #[error("it hides nothing, since none of its {} values is a valid depth: {}", .0.total(), listed(.0))]
    HidesNothing(DepthValues),
    /// All of it is nearer than the camera draws.
    #[error(
        "it hides everything, since all of it is nearer than {farthest:.2e} m, and nothing is drawn nearer than {near} m; `depth_scale` sets the \
         meters per unit"
    )]
    TooNear {
        /// Its largest distance, m.
        farthest: f64,
        /// The near distance of the camera, m.
        near: f64,
    },
    /// All of it is farther than anything.
    #[error(
        "it hides nothing, since all of it is farther than {nearest:.2e} m; `depth_scale` sets the meters per unit"
    )]
    TooFar {
        /// Its smallest distance, m.
        nearest: f64,
    },
    /// Some values are negative among positive ones.
    #[error("{negative} of its {total} values are negative, and hide nothing there")]
    SomeNegative {
        /// Number of negative values.
        negative: usize,
        /// Number of all values.
        total: usize,
    },
}

/// What values are that are no depth.
fn listed(values: &DepthValues) -> String {
    let kinds = [
        (values.zero, "0"),
        (values.not_a_number, "not a number"),
        (values.infinite, "infinite or not a number"),
        (values.negative, "negative"),
        (values.positive, "beyond infinity by `depth_shift`"),
    ];
    let named: Vec<String> =
        kinds.iter().filter(|(count, _)| *count > 0).map(|(count, kind)| format!("{count} {kind}")).collect();
    match &named[..] {
        [only] => format!("all are {}", only.split_once(' ').map_or("", |(_, kind)| kind)),
        _ => named.join(", "),
    }
}

/// Why scale and shift cannot be found from known depths.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub(super) enum KnownDepthError {
    /// There is no depth.
    #[error("a plate without depth cannot be fitted; allowed: with `depth`, or an image that has one")]
    NoDepth,
    /// The depth is not inverse.
    #[error("applies only to inverse depth; allowed: with `depth_kind = \"inverse\"`")]
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

/// Relative deviation beyond which a point is a misfit.
const MISFIT: f64 = 0.1;
/// Largest number of misfits that a message lists.
const MAX_LISTED_MISFITS: usize = 6;

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
        for (point, known, found) in self.misfits.iter().take(MAX_LISTED_MISFITS) {
            write!(f, "; point {point} is {known} m away, and would be {found:.2} m")?;
        }
        match self.misfits.len().saturating_sub(MAX_LISTED_MISFITS) {
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
    let [mean_x, mean_y] = [0, 1].map(|axis| points.iter().map(|point| point[axis]).sum::<f64>() / count);
    let covariance: f64 = points.iter().map(|[x, y]| (x - mean_x) * (y - mean_y)).sum();
    let variance: f64 = points.iter().map(|[x, _]| (x - mean_x) * (x - mean_x)).sum();
    let slope = covariance / variance;
    (variance > 0.0 && slope.is_finite()).then_some([mean_y - slope * mean_x, slope])
}

/// A fit with its relative deviations at the known points, whose depth values are the first of `values`.
fn judged(points: &[[f64; 3]], values: &[[f64; 2]], shift: f64, slope: f64) -> DepthFit {
    let (mut squares, mut misfits) = (0.0, Vec::new());
    for (number, ([_, _, meters], [value, _])) in (1..).zip(points.iter().zip(values)) {
        let inverse = shift + slope * value;
        let fitted = if inverse > 0.0 { 1.0 / inverse } else { f64::INFINITY };
        // What lies beyond infinity deviates by its whole distance.
        let deviation: f64 = if fitted.is_finite() { (fitted - meters) / meters } else { 1.0 };
        squares += deviation * deviation;
        if deviation.abs() > MISFIT {
            misfits.push((number, *meters, fitted));
        }
    }
    DepthFit { shift, slope, residual: (squares / points.len() as f64).sqrt(), misfits }
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
    fn a_depth_without_a_usable_value_is_told_by_what_it_is() {
        let axis = DepthScale { kind: DepthKind::Axis, meters: 1.0, shift: 0.0 };
        let told = |values: &[f32], scale: &DepthScale| {
            DepthValues::of(values).doubt(scale, 0.05).map(|doubt| doubt.to_string())
        };
        for (values, words) in [
            ([0.0, 0.0, 0.0], "none of its 3 values is a valid depth: all are 0"),
            ([f32::NAN; 3], "all are not a number"),
            ([f32::INFINITY; 3], "all are infinite"),
            ([0.0, f32::NAN, 0.0], "2 0, 1 not a number"),
            ([-1.0, -2.0, -3.0], "all are negative"),
            ([1e-30, 1e-3, 0.0], "hides everything"),
            ([1e30, 1e9, 0.0], "hides nothing, since all of it is farther"),
            ([4.0, -1.0, 2.0], "1 of its 3 values are negative"),
        ] {
            let found = told(&values, &axis).unwrap_or_default();
            assert!(found.contains(words), "{values:?}: {found}");
        }
        for usable in [[0.0, 2.0, f32::NAN], [1.0, 1.0, 1.0], [100.0, f32::INFINITY, 0.01]] {
            assert_eq!(told(&usable, &axis), None, "{usable:?}");
        }
        let turned = DepthScale { meters: -1.0, ..axis };
        assert!(DepthValues::of(&[-2.0, -100.0, 0.0]).are_negative() && told(&[-2.0, -100.0, 0.0], &turned).is_none());
        assert_eq!([-2.0, 2.0, 0.0].map(|value| turned.meters_of(value)), [2.0, f64::INFINITY, f64::INFINITY]);
        assert!(!DepthValues::of(&[-2.0, 1.0]).are_negative() && !DepthValues::of(&[0.0, f32::NAN]).are_negative());
        // An inverse depth may be negative where its shift is positive.
        let inverse = DepthScale { kind: DepthKind::Inverse, meters: 1.0, shift: 3.0 };
        assert_eq!(told(&[-2.0, 1.0, 0.5], &inverse), None);
        assert!(told(&[-4.0, -5.0, -3.0], &inverse).is_some_and(|told| told.contains("all are negative")));
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
