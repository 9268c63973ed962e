//! Two functions on [0, 1] as one table, so that one load fetches both.

use bansho_base::math::simd::{Lanes, Real, any_positive, gather, wrap_split};
use fearless_simd::{Simd, u32x16};

/// Linear segments of a table.
pub(crate) const SEGMENTS: usize = 512;
/// The largest float below 1, so that the argument 1 is in the last segment.
const MAX_ARGUMENT: f32 = 1.0 - f32::EPSILON / 2.0;

/// Two functions on [0, 1], piecewise linear. An entry holds value and increment of the first function in a segment, then of the second.
#[derive(Clone, Debug)]
pub(crate) struct CurvePair {
    segments: Box<[[f32; 4]; SEGMENTS]>,
}

/// Segment indices and the fractions within them.
pub(crate) struct TableIndex<S: Simd> {
    segment: u32x16<S>,
    fraction: Lanes<S>,
}

/// Segment indices of sixteen arguments, clamped to [0, 1].
#[inline(always)]
pub(crate) fn table_index<S: Simd>(x: Lanes<S>) -> TableIndex<S> {
    let scaled = x.simd_max(x.broadcast(0.0)).simd_min(x.broadcast(MAX_ARGUMENT)) * x.broadcast(SEGMENTS as f32);
    let (segment, fraction) = wrap_split(scaled, SEGMENTS as u32 - 1);
    TableIndex { segment, fraction }
}

/// Table indices of sixteen arguments. If all are equal, as the heights of a horizontal row of pixels often are, one lookup suffices.
pub(crate) enum TableLookup<S: Simd> {
    /// All arguments are equal to the first, which is also given in all lanes.
    Uniform(f32, Lanes<S>),
    /// Each lane has its own argument.
    PerLane(TableIndex<S>),
}

/// The table indices of sixteen arguments, and whether they are all equal.
#[inline(always)]
pub(crate) fn lookup_index<S: Simd>(x: Lanes<S>) -> TableLookup<S> {
    /// Largest difference that counts as equal: a twentieth of a segment.
    const UNIFORM_TOLERANCE: f32 = 0.05 / SEGMENTS as f32;
    let first = x.broadcast(x[0]);
    if any_positive((x - first).simd_abs() - x.broadcast(UNIFORM_TOLERANCE)) {
        TableLookup::PerLane(table_index(x))
    } else {
        TableLookup::Uniform(x[0], first)
    }
}

impl CurvePair {
    /// The table of the values at `SEGMENTS + 1` equidistant arguments.
    pub(crate) fn new(mut values: impl FnMut(f64) -> [f64; 2]) -> Self {
        Self::from_samples(|i| {
            let [first, second] = values(i as f64 / SEGMENTS as f64);
            [first as f32, second as f32]
        })
    }

    /// The table of samples by index, 0 to `SEGMENTS`.
    #[inline(always)]
    pub(crate) fn from_samples(mut sample: impl FnMut(usize) -> [f32; 2]) -> Self {
        let mut segments = Box::new([[0.0; 4]; SEGMENTS]);
        let mut low = sample(0);
        for (i, segment) in segments.iter_mut().enumerate() {
            let high = sample(i + 1);
            *segment = [low[0], high[0] - low[0], low[1], high[1] - low[1]];
            low = high;
        }
        Self { segments }
    }

    /// Both functions at table indices.
    #[inline(always)]
    pub(crate) fn fetch<S: Simd>(&self, at: &TableIndex<S>) -> [Lanes<S>; 2] {
        let [first, first_delta, second, second_delta] = gather(at.fraction.simd, &self.segments, at.segment);
        [first_delta.fma(at.fraction, first), second_delta.fma(at.fraction, second)]
    }

    /// Both functions at sixteen arguments.
    #[inline(always)]
    pub(crate) fn sample<S: Simd>(&self, x: Lanes<S>) -> [Lanes<S>; 2] {
        self.fetch(&table_index(x))
    }

    /// Both functions at arguments that are often all equal.
    #[inline(always)]
    pub(crate) fn lookup<S: Simd>(&self, at: &TableLookup<S>) -> [Lanes<S>; 2] {
        match at {
            TableLookup::Uniform(x, lanes) => self.at(*x).map(|value| lanes.broadcast(value)),
            TableLookup::PerLane(index) => self.fetch_per_lane(index),
        }
    }

    /// [`fetch`](Self::fetch), not inlined.
    fn fetch_per_lane<S: Simd>(&self, at: &TableIndex<S>) -> [Lanes<S>; 2] {
        at.fraction.simd.vectorize(
            #[inline(always)]
            || self.fetch(at),
        )
    }

    /// Both functions at one argument.
    #[inline(always)]
    pub(crate) fn at(&self, x: f32) -> [f32; 2] {
        let scaled = x.simd_max(0.0).simd_min(MAX_ARGUMENT) * SEGMENTS as f32;
        let segment = scaled as i32;
        let fraction = scaled - segment as f32;
        let [first, first_delta, second, second_delta] = self.segments[segment as usize & (SEGMENTS - 1)];
        [first_delta.mul_add(fraction, first), second_delta.mul_add(fraction, second)]
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::math::simd::ramp;
    use fearless_simd::SimdBase;

    use super::*;

    #[test]
    fn a_table_holds_its_ends_and_is_straight_between_samples() {
        let table = CurvePair::new(|x| [x, 1.0 - x * x]);
        assert_eq!((table.at(0.0), table.at(-3.0)), ([0.0, 1.0], [0.0, 1.0]));
        let end = table.at(7.0);
        assert!((end[0] - 1.0).abs() < 1e-6 && end[1].abs() < 1e-5);
        for i in 0..1000 {
            let x = i as f32 / 999.0;
            let [line, parabola] = table.at(x);
            assert!((line - x).abs() < 1e-6 && (parabola - (1.0 - x * x)).abs() < 2e-6);
            let batch =
                bansho_base::dispatch_baseline!(simd => table.sample(Lanes::splat(simd, x)).map(|values| values[7]));
            assert!((batch[0] - line).abs() < 1e-6 && (batch[1] - parabola).abs() < 1e-6);
            let lookup = bansho_base::dispatch_baseline!(simd => table.lookup(&lookup_index(ramp(simd, x, 1e-5))).map(|values| values[11]));
            assert!((lookup[0] - line).abs() < 2e-4 && (lookup[1] - parabola).abs() < 4e-4, "{lookup:?}");
        }
    }
}
