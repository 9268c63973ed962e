//! Segments of lines of sight within the medium, sixteen at a time: where they begin and end, and their optical depths.

use bansho_base::{
    camera::{Camera, directions::Directions},
    math::{
        approximations,
        simd::{LANES, Real},
    },
    phenomenon::strip::DepthInterval,
};

use crate::lanes::{LaneArray, ZERO_LANES};

/// Optical depth beyond which light of lamps is neglected: the transmittance is below 1e-17.
const MAX_OPTICAL_DEPTH: f32 = 40.0;

/// Optical depth by distance from the camera, linear between stored distances.
pub(super) struct OpticalDepthTable {
    /// Stored distances, ascending from 0, m.
    distances: Vec<f32>,
    /// For each interval between them: its start (m), the inverse of its width, the optical depth at its start, and its increase.
    intervals: Vec<[f32; 4]>,
    /// For each bucket of distances how many stored distances are not above its least one.
    stored_up_to: Vec<u32>,
    /// Number of intervals that lamps light.
    lit_intervals: usize,
}

/// Buckets of distances: eight in an octave, by exponent and leading bits, from 2^-10 to 2^20 m. The first and the last also hold what is beyond them.
const BUCKET_SHIFT: u32 = 20;
const FIRST_BUCKET: u32 = (127 - 10) << 3;
const BUCKETS: u32 = 30 << 3;

/// The bucket of a distance; the first for NaN and below 0.
#[inline(always)]
fn bucket(distance: f32) -> usize {
    let distance = if distance > 0.0 { distance } else { 0.0 };
    (distance.to_bits() >> BUCKET_SHIFT).saturating_sub(FIRST_BUCKET).min(BUCKETS - 1) as usize
}

impl OpticalDepthTable {
    /// From distances (m) and the optical depths up to them. Lamps light the first `lit_intervals`.
    pub(super) fn new(distances: &[f64], depths: &[f32], lit_intervals: usize) -> Self {
        let mut intervals = Vec::with_capacity(distances.len());
        for (ends, depths) in distances.windows(2).zip(depths.windows(2)) {
            let width = (ends[1] - ends[0]).max(f64::MIN_POSITIVE);
            intervals.push([ends[0] as f32, (1.0 / width) as f32, depths[0], depths[1] - depths[0]]);
        }
        let distances: Vec<f32> = distances.iter().map(|distance| *distance as f32).collect();
        let stored_up_to = (0..BUCKETS).map(|bucket| {
            let least = if bucket == 0 { 0.0 } else { f32::from_bits((bucket + FIRST_BUCKET) << BUCKET_SHIFT) };
            distances.partition_point(|stored| *stored <= least) as u32
        });
        Self { stored_up_to: stored_up_to.collect(), distances, intervals, lit_intervals }
    }

    /// Distances at which the light of lamps is stored.
    pub(super) fn lit_distances(&self) -> usize {
        self.lit_intervals + 1
    }

    /// Index of the interval that contains a distance (m); that of the last one beyond it.
    #[inline(always)]
    pub(super) fn interval(&self, distance: f32) -> usize {
        // From what is stored up to its bucket one or two steps lead to it, fewer than a search takes.
        let mut next = self.stored_up_to[bucket(distance)] as usize;
        while self.distances.get(next).is_some_and(|stored| *stored <= distance) {
            next += 1;
        }
        next.clamp(1, self.intervals.len()) - 1
    }

    /// Sixteen distances (m) in the table.
    #[inline(always)]
    fn locate(&self, distances: &LaneArray) -> TablePositions {
        let [low, high] = extremes(distances);
        // Before the first stored distance but 0, where most lines of sight begin, nothing is searched for.
        let first = if low < self.distances[1] { 0 } else { self.interval(low) };
        let is_in_one = first + 1 == self.intervals.len() || high < self.distances[first + 1];
        let last = if is_in_one { first } else { self.interval(high) };
        let mut positions = TablePositions { index: [first as u32; LANES], fraction: ZERO_LANES, depth: ZERO_LANES };
        // Neighboring pixels are mostly in the same interval.
        for start in &self.distances[first + 1..=last] {
            for i in 0..LANES {
                positions.index[i] += u32::from(distances[i] >= *start);
            }
        }
        let mut columns = [ZERO_LANES; 4];
        if first == last {
            let interval = self.intervals[first];
            for c in 0..4 {
                columns[c] = [interval[c]; LANES];
            }
        } else {
            for i in 0..LANES {
                // One load of four neighboring numbers for each lane, instead of four gathers; the arithmetic after it is vectorized.
                let interval = self.intervals[positions.index[i] as usize];
                for c in 0..4 {
                    columns[c][i] = interval[c];
                }
            }
        }
        let [start, inverse_width, depth, increase] = &columns;
        for i in 0..LANES {
            positions.fraction[i] = ((distances[i] - start[i]) * inverse_width[i]).simd_clamp01();
            positions.depth[i] = increase[i].fma(positions.fraction[i], depth[i]);
        }
        positions
    }

    /// Restricts positions to the distances at which the light of lamps is stored.
    #[inline(always)]
    fn clamp_to_lit(&self, positions: &mut TablePositions) {
        let last = self.lit_intervals as u32 - 1;
        for i in 0..LANES {
            let is_beyond = positions.index[i] > last;
            positions.index[i] = if is_beyond { last } else { positions.index[i] };
            positions.fraction[i] = if is_beyond { 1.0 } else { positions.fraction[i] };
        }
    }
}

/// The smallest and the largest of sixteen numbers, by halves, so that the comparisons do not wait for each other.
#[inline(always)]
fn extremes(values: &LaneArray) -> [f32; 2] {
    let (mut low, mut high) = (*values, *values);
    let mut half = LANES / 2;
    while half > 0 {
        for i in 0..half {
            low[i] = low[i].simd_min(low[i + half]);
            high[i] = high[i].simd_max(high[i + half]);
        }
        half /= 2;
    }
    [low[0], high[0]]
}

/// Sixteen positions between stored distances.
struct TablePositions {
    index: [u32; LANES],
    /// Interpolation fraction toward the next distance.
    fraction: LaneArray,
    /// Optical depth.
    depth: LaneArray,
}

/// The distances between which lines of sight are in the medium.
#[derive(Clone, Copy)]
pub(super) struct MediumBounds<'a> {
    pub(super) camera: &'a Camera,
    /// Height of the camera over the ground, m. In a mirrored view it is negative, and the rain begins at the ground.
    pub(super) height: f32,
    /// End of the medium, m.
    pub(super) end: f32,
}

impl MediumBounds<'_> {
    /// Start and end of sixteen lines of sight within a depth interval and in front of a `plate` (depths, m); both alike where there is none.
    #[inline(always)]
    pub(super) fn ranges(
        &self,
        directions: &mut Directions,
        slice: &DepthInterval,
        plate: &LaneArray,
    ) -> [LaneArray; 2] {
        let lengths = directions.normalize();
        let (slice_near, slice_far) = (slice.near as f32, slice.far as f32);
        let is_beneath = self.height < 0.0;
        let [mut nears, mut fars] = [ZERO_LANES; 2];
        for i in 0..LANES {
            // Level lines of sight divide by 0: infinity, or NaN at height 0, which the comparison below makes infinite.
            let ground = self.height / -directions.components[1][i];
            let ground = if ground > 0.0 { ground } else { f32::INFINITY };
            let near = slice_near * lengths[i];
            let far = plate[i].simd_min(slice_far) * lengths[i];
            let near = if is_beneath { ground.simd_max(near) } else { near };
            let far = if is_beneath { far } else { ground.simd_min(far) };
            let near = near.simd_min(self.end);
            let far = far.simd_min(self.end).simd_max(near);
            nears[i] = if directions.visible[i] { near } else { 0.0 };
            fars[i] = if directions.visible[i] { far } else { 0.0 };
        }
        [nears, fars]
    }
}

/// Whether any range is longer than 0.
#[inline(always)]
pub(super) fn any_range([near, far]: &[LaneArray; 2]) -> bool {
    let mut any = false;
    for i in 0..LANES {
        any |= far[i] > near[i];
    }
    any
}

/// Sixteen segments of lines of sight.
pub(super) struct RaySegments {
    /// Their ends among the distances at which the light of lamps is stored.
    index: [[u32; LANES]; 2],
    fraction: [LaneArray; 2],
    /// Optical depths of their ends.
    depths: [LaneArray; 2],
    /// Whether lamps light them: not beyond their range and where nothing is transmitted.
    is_lit: [bool; LANES],
}

impl RaySegments {
    /// The segments between two distances each (m). Lamps light the rain up to `lit_end` (m).
    #[inline(always)]
    pub(super) fn new(table: &OpticalDepthTable, [near, far]: &[LaneArray; 2], lit_end: f32) -> Self {
        let [mut from, mut to] = [table.locate(near), table.locate(far)];
        let mut is_lit = [false; LANES];
        for i in 0..LANES {
            // Beyond the maximum optical depth nothing is visible, and the gain would overflow.
            is_lit[i] = (near[i] < lit_end) & (from.depth[i] < MAX_OPTICAL_DEPTH) & (far[i] > near[i]);
        }
        let depths = [from.depth, to.depth];
        table.clamp_to_lit(&mut from);
        table.clamp_to_lit(&mut to);
        Self { index: [from.index, to.index], fraction: [from.fraction, to.fraction], depths, is_lit }
    }

    /// Whether lamps light any of them.
    #[inline(always)]
    pub(super) fn any_lit(&self) -> bool {
        let mut any = false;
        for i in 0..LANES {
            any |= self.is_lit[i];
        }
        any
    }

    /// Inverse transmittance from the camera to their near ends; 0 where no lamp lights them.
    #[inline(always)]
    pub(super) fn gains(&self) -> LaneArray {
        let mut gains = ZERO_LANES;
        for i in 0..LANES {
            gains[i] = if self.is_lit[i] { approximations::exp(self.depths[0][i]) } else { 0.0 };
        }
        gains
    }

    /// Light of lamps scattered within segment `i`, as seen from its near end, with its `gain`: interpolated by `t` between two corners, whose accumulated
    /// light begins at two indices of `sums`.
    #[inline(always)]
    pub(super) fn in_scattered(&self, i: usize, gain: f32, sums: &[[f32; 4]], corners: [usize; 2], t: f32) -> [f32; 4] {
        let [left, right] = [self.difference(i, sums, corners[0]), self.difference(i, sums, corners[1])];
        let mut light = [0.0; 4];
        for c in 0..4 {
            light[c] = (right[c] - left[c]).fma(t, left[c]) * gain;
        }
        light
    }

    /// The increase of accumulated light over a segment.
    #[inline(always)]
    fn difference(&self, i: usize, sums: &[[f32; 4]], corner: usize) -> [f32; 4] {
        let mut ends = [[0.0; 4]; 2];
        for end in 0..2 {
            let first = corner + self.index[end][i] as usize;
            let [from, to] = [sums[first], sums[first + 1]];
            for c in 0..4 {
                ends[end][c] = (to[c] - from[c]).fma(self.fraction[end][i], from[c]);
            }
        }
        let mut difference = [0.0; 4];
        for c in 0..4 {
            difference[c] = (ends[1][c] - ends[0][c]).simd_max(0.0);
        }
        difference
    }

    /// Opacity of the segments.
    #[inline(always)]
    pub(super) fn opacities(&self) -> LaneArray {
        let mut opacities = ZERO_LANES;
        for i in 0..LANES {
            opacities[i] = 1.0 - approximations::exp(self.depths[0][i] - self.depths[1][i]);
        }
        opacities
    }

    /// Sum of the opacities of the medium up to both ends.
    #[inline(always)]
    pub(super) fn opacities_up_to_ends(&self) -> LaneArray {
        let mut sums = ZERO_LANES;
        for i in 0..LANES {
            sums[i] = 2.0 - approximations::exp(-self.depths[0][i]) - approximations::exp(-self.depths[1][i]);
        }
        sums
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::math::{self, random::Key, random::Purpose};

    use super::*;

    #[test]
    fn every_distance_is_found_in_its_interval() {
        let mut distances = vec![0.0, 1e-5, 0.4, 0.5];
        while distances[distances.len() - 1] < 3e6 {
            distances.push(1.25 * distances[distances.len() - 1]);
        }
        let depths: Vec<f32> = (0..distances.len()).map(|index| index as f32).collect();
        let table = OpticalDepthTable::new(&distances, &depths, 5);
        let stored: Vec<f32> = distances.iter().map(|distance| *distance as f32).collect();
        let between = (0..4000).map(|step| 1e-6 * math::exp(f64::from(step) * 0.008) as f32);
        let beside = stored.iter().flat_map(|stored| [stored.next_down().max(0.0), *stored, stored.next_up()]);
        for distance in between.chain(beside).chain([0.0, -0.0, -1.0, f32::NAN, f32::INFINITY, f32::MAX]) {
            let next = stored.partition_point(|stored| *stored <= distance);
            assert_eq!(table.interval(distance), next.clamp(1, stored.len() - 1) - 1, "{distance}");
        }
    }

    #[test]
    fn sixteen_distances_are_located_as_each_one_alone() {
        let distances = [0.0, 0.5, 1.0, 4.0, 9.0, 20.0];
        let depths = [0.0, 0.1, 0.15, 0.7, 1.0, 3.0];
        let table = OpticalDepthTable::new(&distances, &depths, 5);
        let numbers: Vec<f32> = (0..40).flat_map(|step| Key::new(5, "table").uniforms(0, step, Purpose(0))).collect();
        // Within one interval, over several, before the first and beyond the last.
        for (start, range) in [(0.1, 0.3), (0.5, 0.49), (4.0, 5.0), (0.0, 25.0), (3.0, 2.0), (19.0, 9.0), (21.0, 2.0)] {
            for sixteen in numbers.as_chunks::<LANES>().0 {
                let located = sixteen.map(|number| start + range * number);
                let positions = table.locate(&located);
                for i in 0..LANES {
                    let next = distances.iter().position(|stored| *stored > f64::from(located[i])).unwrap_or(5).max(1);
                    let [from, to] = [distances[next - 1] as f32, distances[next] as f32];
                    let fraction = ((located[i] - from) / (to - from)).clamp(0.0, 1.0);
                    let depth = depths[next - 1] + fraction * (depths[next] - depths[next - 1]);
                    assert_eq!(positions.index[i] as usize, next - 1, "{}", located[i]);
                    assert!(
                        (positions.fraction[i] - fraction).abs() < 1e-6 && (positions.depth[i] - depth).abs() < 1e-6
                    );
                }
            }
        }
    }
}
