//! Gusts at the corners of a cell and at the centers of a line of cells: what [`GustField::at`] gives point by point, with the sums over nodes carried out
//! along one axis after the other, so that points in a row share most of them. In single precision: a displacement of 10 m is right to 1 micrometer.

use bansho_base::math::{DVec2, DVec3};

use super::{
    cell_motion::MAX_UNSEEN_BEND,
    gust::{GustField, GustLanes, blossom, slopes},
};

/// Most nodes along an axis that the points of a cell may need: three, and those that the spans of its ends and of a moving drop are apart.
const MAX_NODES: usize = 6;

/// Weights of the nodes along one axis for `ENDS` coordinates that drops pass.
struct AxisWeights<const ENDS: usize> {
    /// Index of the first node.
    first: usize,
    count: usize,
    /// For each coordinate and node the weight when the shutter opens, when it closes and at its middle, and the derivative of the last along the motion, 1/s.
    weights: [[[f32; 4]; MAX_NODES]; ENDS],
}

/// Gusts at the nodes along z of a line of points with the same x and y.
pub(super) struct GustLine {
    /// Index of the first node.
    first: usize,
    nodes: Vec<GustLanes>,
    /// Velocity along z relative to that of the nodes, nodes a second.
    relative: f64,
    /// Whether the displacements when the shutter opens and closes are known.
    bends: bool,
}

/// Where a drop is when the shutter opens, at its middle and when it closes, m.
pub(super) type Path = [DVec3; 3];

impl GustField {
    /// Weights along an axis at coordinates (in units of the spacing, when the shutter opens, at its middle and when it closes) of drops that move with
    /// `relative` nodes a second; `None` if they need too many nodes. Without `BENDS`, only those of the middle.
    #[inline(always)]
    fn axis_weights<const ENDS: usize, const BENDS: bool>(
        &self,
        axis: usize,
        coordinates: [[f64; 3]; ENDS],
        relative: f64,
    ) -> Option<AxisWeights<ENDS>> {
        // Loops, here and below: a closure passed to `map` would not be compiled for wide vectors.
        let (mut spans, mut first, mut last) = ([[(0, 0.0); 3]; ENDS], usize::MAX, 0);
        for end in 0..ENDS {
            for time in 0..3 {
                // Without bends only the middle of the exposure is looked up, a third of the nodes and weights: its ends follow from the velocity.
                if BENDS || time == 1 {
                    spans[end][time] = self.span(time, axis, coordinates[end][time]);
                    (first, last) = (first.min(spans[end][time].0), last.max(spans[end][time].0));
                }
            }
        }
        let count = last - first + 3;
        if count > MAX_NODES {
            return None;
        }
        let mut weights = [[[0.0; 4]; MAX_NODES]; ENDS];
        for end in 0..ENDS {
            // The middle is third in the lanes, beside the velocity.
            for (lane, time) in [(0, 0), (1, 2), (2, 1)] {
                if !BENDS && time != 1 {
                    continue;
                }
                let (node, t) = spans[end][time];
                let values = blossom([t, t]);
                for offset in 0..3 {
                    weights[end][node - first + offset][lane] = values[offset] as f32;
                }
            }
            let (node, t) = spans[end][1];
            let values = slopes(t);
            for offset in 0..3 {
                weights[end][node - first + offset][3] = (values[offset] * relative) as f32;
            }
        }
        Some(AxisWeights { first, count, weights })
    }

    /// Whether the paths of drops of a steady `velocity` (m/s) bend too little to be seen in the exposure.
    #[inline(always)]
    fn is_straight(&self, velocity: DVec3) -> bool {
        let nodes_per_s = ((velocity - self.node_velocity) / self.spacing).abs().element_sum();
        self.bends.largest(nodes_per_s) < f64::from(MAX_UNSEEN_BEND)
    }

    /// Sets the displacements when the shutter opens and closes to those of the velocity at the middle.
    #[inline(always)]
    fn set_straight_ends(&self, gusts: &mut GustLanes) {
        let half_s = self.bends.half_s as f32;
        for side in 0..2 {
            let travel = gusts[6 + side] * half_s;
            (gusts[side], gusts[2 + side]) = (gusts[4 + side] - travel, gusts[4 + side] + travel);
        }
    }

    /// The coordinates of a path along an axis, in units of the spacing.
    #[inline(always)]
    fn coordinates(&self, axis: usize, path: Path) -> [f64; 3] {
        let mut coordinates = [0.0; 3];
        for time in 0..3 {
            coordinates[time] = (path[time][axis] - self.origins[time][axis]) / self.spacing;
        }
        coordinates
    }

    /// Weights of the nodes along an axis for paths whose velocity relative to the nodes is `relative`, in units of the spacing.
    #[inline(always)]
    fn path_weights<const PATHS: usize, const BENDS: bool>(
        &self,
        axis: usize,
        paths: [Path; PATHS],
        relative: DVec3,
    ) -> Option<AxisWeights<PATHS>> {
        let mut coordinates = [[0.0; 3]; PATHS];
        for index in 0..PATHS {
            coordinates[index] = self.coordinates(axis, paths[index]);
        }
        self.axis_weights::<PATHS, BENDS>(axis, coordinates, relative[axis])
    }

    /// Gusts at the corners of a box, x fastest, then y; all of it moves with `velocity` (m/s). `None` if it is larger than a few nodes.
    #[inline(always)]
    pub(super) fn at_corners(&self, low: Path, high: Path, velocity: DVec3) -> Option<[GustLanes; 8]> {
        if !self.is_straight(velocity) {
            return self.corners::<true>(low, high, velocity);
        }
        let mut corners = self.corners::<false>(low, high, velocity)?;
        for corner in &mut corners {
            self.set_straight_ends(corner);
        }
        Some(corners)
    }

    #[inline(always)]
    fn corners<const BENDS: bool>(&self, low: Path, high: Path, velocity: DVec3) -> Option<[GustLanes; 8]> {
        let relative = (velocity - self.node_velocity) / self.spacing;
        let x = self.path_weights::<2, BENDS>(0, [low, high], relative)?;
        let y = self.path_weights::<2, BENDS>(1, [low, high], relative)?;
        let z = self.path_weights::<2, BENDS>(2, [low, high], relative)?;
        let mut corners = [[0.0; 8]; 8];
        // First along y, then z, then x: the nodes are read once, and each sum is over what the one before has left.
        for i in 0..x.count {
            let mut edges = [[0.0; 8]; 4];
            for k in 0..z.count {
                let mut levels = [[0.0; 8]; 2];
                for j in 0..y.count {
                    let node = &self.lanes[self.node_index([x.first + i, y.first + j, z.first + k])];
                    for level in 0..2 {
                        add_weighted::<BENDS>(&mut levels[level], node, y.weights[level][j]);
                    }
                }
                for edge in 0..4 {
                    add_weighted::<BENDS>(&mut edges[edge], &levels[edge & 1], z.weights[edge >> 1][k]);
                }
            }
            for corner in 0..8 {
                add_weighted::<BENDS>(&mut corners[corner], &edges[corner >> 1], x.weights[corner & 1][i]);
            }
        }
        Some(corners)
    }

    /// Gusts on a drop of a steady `velocity` (m/s).
    pub(super) fn at_point(&self, path: Path, velocity: DVec3) -> Option<GustLanes> {
        if !self.is_straight(velocity) {
            return self.point::<true>(path, velocity);
        }
        let mut gusts = self.point::<false>(path, velocity)?;
        self.set_straight_ends(&mut gusts);
        Some(gusts)
    }

    fn point<const BENDS: bool>(&self, path: Path, velocity: DVec3) -> Option<GustLanes> {
        let relative = (velocity - self.node_velocity) / self.spacing;
        let x = self.path_weights::<1, BENDS>(0, [path], relative)?;
        let y = self.path_weights::<1, BENDS>(1, [path], relative)?;
        let z = self.path_weights::<1, BENDS>(2, [path], relative)?;
        let mut sum = [0.0; 8];
        for k in 0..z.count {
            let mut plane = [0.0; 8];
            for j in 0..y.count {
                let mut row = [0.0; 8];
                let nodes = self.node_index([x.first, y.first + j, z.first + k]);
                for i in 0..x.count {
                    add_weighted::<BENDS>(&mut row, &self.lanes[nodes + i], x.weights[0][i]);
                }
                add_weighted::<BENDS>(&mut plane, &row, y.weights[0][j]);
            }
            add_weighted::<BENDS>(&mut sum, &plane, z.weights[0][k]);
        }
        Some(sum)
    }

    /// Gusts along a line from one path to another that differ only in z; all of it moves with `velocity` (m/s).
    pub(super) fn along_z(&self, from: Path, to: Path, velocity: DVec3) -> Option<GustLine> {
        if self.is_straight(velocity) {
            self.line::<false>(from, to, velocity)
        } else {
            self.line::<true>(from, to, velocity)
        }
    }

    /// Largest differences of the displacements at a point and at points up to `distance` (m) away along each axis, m.
    pub(super) fn difference_around(&self, point: DVec3, distance: f64) -> DVec3 {
        let [x, y, z] = [0, 1, 2].map(|axis| {
            let [first, last] = [-distance, distance]
                .map(|offset| self.span(1, axis, (point[axis] + offset - self.origins[1][axis]) / self.spacing).0);
            first..=last
        });
        let mut steepness = DVec2::ZERO;
        for k in z {
            for j in y.clone() {
                for i in x.clone() {
                    steepness = steepness.max(self.steepness[self.node_index([i, j, k])]);
                }
            }
        }
        DVec3::new(steepness.x, 0.0, steepness.y) * distance
    }

    fn line<const BENDS: bool>(&self, from: Path, to: Path, velocity: DVec3) -> Option<GustLine> {
        let relative = (velocity - self.node_velocity) / self.spacing;
        let x = self.path_weights::<1, BENDS>(0, [from], relative)?;
        let y = self.path_weights::<1, BENDS>(1, [from], relative)?;
        let [starts, ends] = [from, to].map(|path| self.coordinates(2, path));
        let first = (0..3).map(|time| self.span(time, 2, starts[time]).0).fold(usize::MAX, usize::min);
        let last = (0..3).map(|time| self.span(time, 2, ends[time]).0).fold(0, usize::max) + 2;
        let mut nodes = Vec::with_capacity((last + 1).saturating_sub(first));
        for k in first..=last {
            let mut sum = [0.0; 8];
            for i in 0..x.count {
                let mut column = [0.0; 8];
                for j in 0..y.count {
                    let node = &self.lanes[self.node_index([x.first + i, y.first + j, k])];
                    add_weighted::<BENDS>(&mut column, node, y.weights[0][j]);
                }
                add_weighted::<BENDS>(&mut sum, &column, x.weights[0][i]);
            }
            nodes.push(sum);
        }
        Some(GustLine { first, nodes, relative: relative.z, bends: BENDS })
    }

    /// Gusts at a point of a line.
    pub(super) fn at_line(&self, line: &GustLine, path: Path) -> Option<GustLanes> {
        if line.bends {
            return self.point_of_line::<true>(line, path);
        }
        let mut gusts = self.point_of_line::<false>(line, path)?;
        self.set_straight_ends(&mut gusts);
        Some(gusts)
    }

    fn point_of_line<const BENDS: bool>(&self, line: &GustLine, path: Path) -> Option<GustLanes> {
        let z = self.axis_weights::<1, BENDS>(2, [self.coordinates(2, path)], line.relative)?;
        let mut sum = [0.0; 8];
        for k in 0..z.count {
            add_weighted::<BENDS>(&mut sum, line.nodes.get(z.first + k - line.first)?, z.weights[0][k]);
        }
        Some(sum)
    }
}

/// Adds values times weights along one axis. The velocity also gains by the motion through the displacements. Without `BENDS`, the displacements when the
/// shutter opens and closes are left out.
#[inline(always)]
fn add_weighted<const BENDS: bool>(sum: &mut GustLanes, values: &GustLanes, [open, close, middle, slope]: [f32; 4]) {
    if BENDS {
        let weights = [open, open, close, close];
        for lane in 0..4 {
            sum[lane] += values[lane] * weights[lane];
        }
    }
    // All four lanes at once: a wide load after a store to only two of them would stall.
    let displacements = [0.0, 0.0, values[4], values[5]];
    for lane in 0..4 {
        sum[4 + lane] += values[4 + lane] * middle + displacements[lane] * slope;
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::{
        parameters::animated::Animated,
        phenomenon::strip::Shutter,
        world::wind::{Wind, WindParameters},
    };

    use super::*;

    /// What is found at once, and what [`GustField::at`] gives at each point.
    fn assert_same(found: &GustLanes, gusts: &GustField, path: Path, velocity: DVec3) {
        let expected = gusts.at(path, velocity).lanes();
        for lane in 0..8 {
            // What bends too little to be seen is left out.
            let tolerance = if lane < 4 && gusts.is_straight(velocity) { MAX_UNSEEN_BEND } else { 2e-5 };
            assert!((found[lane] - expected[lane]).abs() < tolerance, "{path:?}: {found:?} {expected:?}");
        }
    }

    #[test]
    fn corners_lines_and_points_are_those_found_one_by_one() {
        for (gust_length, radius, exposure) in [(6.0, 7.0, 0.02), (0.5, 2.0, 0.04), (2.0, 30.0, 0.3), (6.0, 7.0, 0.9)] {
            let velocity = Animated::from([8.0, 0.0, -3.0]);
            let wind =
                Wind::new(WindParameters { velocity, gust: 0.4, gust_length, ..WindParameters::default() }, 3, None);
            let shutter = Shutter { open: 2.0, close: 2.0 + exposure };
            let gusts = GustField::new(&wind, 1.0, DVec3::ZERO, radius, -10.0, shutter, None).expect("gusts");
            let velocity = DVec3::new(8.0, -6.3, -3.0);
            let path = |point: DVec3| [-0.5, 0.0, 0.5].map(|share| point + velocity * (share * exposure));
            for step in 0..40 {
                let low = DVec3::new(0.37, -0.21, 0.13) * f64::from(step - 20) * (0.1 * radius);
                let high = low + DVec3::new(1.0, 1.1, 1.0);
                let corners = gusts.at_corners(path(low), path(high), velocity).expect("few nodes");
                for (index, found) in corners.iter().enumerate() {
                    let corner =
                        DVec3::from([0, 1, 2].map(|axis| if index >> axis & 1 == 1 { high } else { low }[axis]));
                    assert_same(found, &gusts, path(corner), velocity);
                    let alone = gusts.at_point(path(corner), velocity).expect("few nodes");
                    assert_same(&alone, &gusts, path(corner), velocity);
                }
                let end = low + DVec3::Z * 9.0;
                let line = gusts.along_z(path(low), path(end), velocity).expect("few nodes");
                for cell in 0..=9 {
                    let place = path(low + DVec3::Z * f64::from(cell));
                    assert_same(&gusts.at_line(&line, place).expect("few nodes"), &gusts, place, velocity);
                }
            }
        }
    }

    #[test]
    fn boxes_of_many_nodes_are_left_to_single_points() {
        let velocity = Animated::from([8.0, 0.0, 0.0]);
        let wind = Wind::new(WindParameters { velocity, gust: 0.4, ..WindParameters::default() }, 3, None);
        let shutter = Shutter { open: 2.0, close: 2.0 };
        let gusts = GustField::new(&wind, 1.0, DVec3::ZERO, 20.0, -10.0, shutter, None).expect("gusts");
        assert!(gusts.at_corners([DVec3::splat(-18.0); 3], [DVec3::splat(18.0); 3], DVec3::ZERO).is_none());
    }
}
