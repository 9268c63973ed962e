//! Displacement and velocity of drops by gusts, on top of the mean wind that carries all drops alike.
//!
//! A drop is displaced by the gusts that it has met: `integral of g(s) (1 - s / memory) ds` over the past s. The integral is evaluated at nodes that drift with
//! the mean wind and fall with a drop of typical speed, so that each meets the gusts that the drops around it meet. It is limited, and interpolated
//! between nodes by quadratic B-splines. All of this is continuously differentiable in time, and the velocity is its derivative, term by term.

use std::ops::RangeInclusive;

use bansho_base::{
    host::parallel::prelude::*,
    math::{DVec2, DVec3},
    phenomenon::strip::Shutter,
    world::wind::Wind,
};

/// Memory of a drop's horizontal displacement, s. The weight of a past gust decreases linearly to 0 over this time, in
/// which a drop falls through the visible region.
const GUST_MEMORY_S: f64 = 2.0;
/// Time between two samples of a gust, s; between them it is linear. Drops follow a gust this much later, so that no sample lies in the future, where
/// a program may still change the wind.
const SAMPLE_STEP_S: f64 = 0.25;
/// Fall speed of the nodes, m/s. Gusts are much larger than the distances by which drops of other speeds differ.
const TYPICAL_FALL_SPEED: f64 = 5.5;
/// Smallest node spacing as a fraction of the region's radius: finer gusts are smoothed out.
const MIN_SPACING_RATIO: f64 = 0.4;
/// Largest displacement in units of the node spacing: a storm must not carry drops in from far outside the region.
const MAX_DISPLACEMENT_RATIO: f64 = 1.5;
/// Standard deviations that a gust in one direction hardly ever exceeds.
const MAX_GUST_DEVIATIONS: f64 = 4.0;
/// Number of control points up to which the range of displacements within a box is found from those of the splines within it; beyond, from the nodes.
const MAX_CONTROL_POINTS: usize = 216;

/// Gusts at one point while the shutter is open: horizontal (x and z).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct GustState {
    /// Displacement when the shutter opens, at its middle and when it closes, m.
    pub(crate) displacements: [DVec2; 3],
    /// Derivative of the displacement at the middle, along the drop's motion: the velocity that gusts add, m/s.
    pub(crate) velocity: DVec2,
}

/// The same in single precision: displacement when the shutter opens, when it closes and at its middle, m, and the velocity at the middle, m/s; x and z of each.
pub(super) type GustLanes = [f32; 8];

impl GustState {
    pub(super) fn lanes(&self) -> GustLanes {
        let [open, middle, close] = self.displacements.map(DVec2::as_vec2);
        let velocity = self.velocity.as_vec2();
        [open.x, open.y, close.x, close.y, middle.x, middle.y, velocity.x, velocity.y]
    }
}

/// The gusts around the camera during one exposure.
#[derive(Clone, Debug)]
pub(crate) struct GustField {
    pub(super) spacing: f64,
    /// Indices of the first node of the grid when the shutter opens, at its middle and when it closes: equal unless the nodes drift far meanwhile.
    first: [[i64; 3]; 3],
    count: [usize; 3],
    /// Position of the node with the indices 0 when the shutter opens, at its middle and when it closes, m.
    pub(super) origins: [DVec3; 3],
    /// Velocity of the nodes at the middle, m/s.
    pub(super) node_velocity: DVec3,
    /// x fastest, then y. At nodes the velocity is that of a drop that moves with the node.
    nodes: Vec<GustState>,
    /// The nodes in single precision.
    pub(super) lanes: Vec<GustLanes>,
    /// How much paths bend in the exposure.
    pub(super) bends: Bends,
    /// Smallest and largest displacement at the middle along x and z, m.
    extremes: [DVec2; 2],
    /// Largest change of the displacement from its middle to either end of the exposure, m.
    largest_travel: f64,
    /// For each span of three nodes along each axis, by the index of its first node: largest difference of displacements at the middle, x and z, m for each
    /// meter along x, y and z added up.
    pub(super) steepness: Vec<DVec2>,
    /// The largest of them anywhere.
    largest_steepness: DVec2,
}

/// Bounds of how far a drop is at the ends of an exposure from where its velocity at the middle takes it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Bends {
    /// Half the exposure, s.
    pub(super) half_s: f64,
    /// The largest for a drop that moves with a node, m; infinite in a long exposure.
    of_nodes: f64,
    /// Largest differences of the displacement, m, and of the velocity, m/s, of two nodes beside each other.
    steps: [f64; 2],
}

impl Bends {
    /// The largest for a drop that passes some nodes a second along all axes together, m: that of the nodes, and `(x . grad)^2 d / 2 + (x . grad) v t` in the
    /// time t of half an exposure. Second derivatives of a quadratic B-spline are differences of two steps between nodes.
    #[inline(always)]
    pub(super) fn largest(&self, nodes_per_s: f64) -> f64 {
        let passed = nodes_per_s * self.half_s;
        self.of_nodes + passed * passed * self.steps[0] + passed * self.half_s * self.steps[1]
    }
}

/// The paths of the nodes.
struct NodeMotion<'a> {
    wind: &'a Wind,
    /// Velocity over that of the mean wind, and of a fall with [`TYPICAL_FALL_SPEED`]. 1, or in a loop what takes the nodes to where others were.
    ratios: DVec3,
}

impl<'a> NodeMotion<'a> {
    fn new(wind: &'a Wind, spacing: f64, loop_s: Option<f64>) -> Self {
        let Some(seconds) = loop_s else { return Self { wind, ratios: DVec3::ONE } };
        let travel = horizontal(wind.travel(0.0, seconds)) - DVec3::Y * (TYPICAL_FALL_SPEED * seconds);
        Self { wind, ratios: DVec3::from(travel.to_array().map(|travel| closing_ratio(travel, spacing))) }
    }

    /// Position of the node with the indices 0, m.
    fn origin(&self, t: f64) -> DVec3 {
        (horizontal(self.wind.travel(0.0, t)) - DVec3::Y * (TYPICAL_FALL_SPEED * t)) * self.ratios
    }

    /// m/s.
    fn velocity(&self, t: f64) -> DVec3 {
        (horizontal(self.wind.mean(t)) - DVec3::Y * TYPICAL_FALL_SPEED) * self.ratios
    }
}

/// The times at which gusts are sampled, and the weights of the samples.
struct GustHistory {
    /// s.
    step: f64,
    /// Number of steps in a drop's memory.
    steps: i64,
    /// Indices of the samples.
    samples: RangeInclusive<i64>,
    /// For each sample its weight in the displacement when the shutter opens, at its middle and when it closes, s; and in the derivative at the middle.
    weights: Vec<[f64; 4]>,
}

/// Ratio by which a distance that nodes travel in a loop becomes a whole number of cells; 0 for less than half a cell.
fn closing_ratio(travel: f64, spacing: f64) -> f64 {
    let cells = (travel / spacing).round();
    if cells == 0.0 { 0.0 } else { cells * spacing / travel }
}

/// Integrals from 0 to `y` between two samples, of which the gust is the linear interpolation at 0..=1: of the weight `weight + y / memory` times the parts of the
/// earlier and the later sample, and of these parts alone.
fn weights_until(y: f64, weight: f64, memory: f64) -> [f64; 4] {
    let (square, cube) = (0.5 * y * y, y * y * y / 3.0);
    let earlier = weight * y + (1.0 / memory - weight) * square - cube / memory;
    [earlier, weight * square + cube / memory, y - square, square]
}

impl GustHistory {
    fn new(shutter: Shutter, loop_s: Option<f64>) -> Self {
        // A loop has a whole number of steps.
        let step = loop_s.map_or(SAMPLE_STEP_S, |seconds| seconds / (seconds / SAMPLE_STEP_S).ceil().max(1.0));
        let steps = ((GUST_MEMORY_S / step).round() as i64).max(1);
        let [last_at_open, last_at_close] = [shutter.open, shutter.close].map(|t| (t / step - 1.0).floor() as i64 + 1);
        let samples = last_at_open - 1 - steps..=last_at_close;
        let count = (samples.end() - samples.start() + 1) as usize;
        let mut history = Self { step, steps, samples, weights: vec![[0.0; 4]; count] };
        for (column, t) in [shutter.open, shutter.middle(), shutter.close].into_iter().enumerate() {
            history.add_weights(t, column);
        }
        history
    }

    /// Adds the weights of the displacement at time `t`, and of its derivative if it is the middle of the exposure. The gust is linear between samples and its
    /// weight is linear in its age, so their product is integrated exactly.
    fn add_weights(&mut self, t: f64, column: usize) {
        let newest = t / self.step - 1.0;
        let (memory, last) = (self.steps as f64, newest.floor() as i64);
        for sample in last - self.steps..=last {
            // Between this sample and the next, from `from` to `to`, the weight begins with `weight` and rises by 1 / memory.
            let weight = 1.0 - (newest - sample as f64) / memory;
            let from = (newest - memory - sample as f64).clamp(0.0, 1.0);
            let to = (newest - sample as f64).clamp(0.0, 1.0);
            let [low, high] = [from, to].map(|y| weights_until(y, weight, memory));
            let index = (sample - self.samples.start()) as usize;
            for side in 0..2 {
                let weights = &mut self.weights[index + side];
                weights[column] += self.step * (high[side] - low[side]);
                if column == 1 {
                    weights[3] -= (high[2 + side] - low[2 + side]) / memory;
                }
            }
        }
        if column == 1 {
            let (index, fraction) = ((last - self.samples.start()) as usize, newest - last as f64);
            self.weights[index][3] += 1.0 - fraction;
            self.weights[index + 1][3] += fraction;
        }
    }
}

/// What the sums over the past of a node need at each sample of its gusts.
struct GustSamples<'a> {
    wind: &'a Wind,
    response: f64,
    /// Time, s, position of the node with the indices 0, m, and mean wind, m/s.
    times: Vec<(f64, DVec3, DVec3)>,
    weights: &'a [[f64; 4]],
}

impl<'a> GustSamples<'a> {
    fn new(wind: &'a Wind, response: f64, motion: &NodeMotion, history: &'a GustHistory) -> Self {
        let times = history.samples.clone().map(|sample| sample as f64 * history.step);
        let times = times.map(|t| (t, motion.origin(t), wind.mean(t))).collect();
        Self { wind, response, times, weights: &history.weights }
    }

    /// Distance that gusts hardly ever displace a drop by, m.
    fn largest_displacement(&self) -> f64 {
        let strongest = self.times.iter().map(|(t, ..)| self.wind.gust_deviation(*t)).fold(0.0, f64::max);
        MAX_GUST_DEVIATIONS * self.response * strongest * 0.5 * GUST_MEMORY_S
    }

    /// Adds the sums of some columns of the weights for a node at `offset` (m) from the one with the indices 0.
    fn add(&self, sums: &mut [DVec2; 4], offset: DVec3, columns: &[usize]) {
        for ((t, origin, mean), weights) in self.times.iter().zip(self.weights) {
            // In a long exposure most samples are too old or too new for one of its times.
            if columns.iter().any(|column| weights[*column] != 0.0) {
                let gust = self.response * (self.wind.at(offset + *origin, *t) - *mean);
                for &column in columns {
                    sums[column] += DVec2::new(gust.x, gust.z) * weights[column];
                }
            }
        }
    }
}

/// The grid of nodes when the shutter opens, at its middle and when it closes.
struct NodeGrid {
    /// m.
    spacing: f64,
    origins: [DVec3; 3],
    /// Indices of the first node at each of these times.
    first: [[i64; 3]; 3],
    count: [usize; 3],
}

impl NodeGrid {
    /// The nodes that act between two corners. In a short exposure it spans those of all three times. In a long one it follows the region, node by node:
    /// spanning all that passes would be as large as the distance that the wind carries the nodes.
    fn new([low, high]: [DVec3; 2], origins: [DVec3; 3], spacing: f64) -> Self {
        let firsts = origins.map(|origin| nearest_node(low - origin, spacing).map(|index| index - 1));
        let lasts = origins.map(|origin| nearest_node(high - origin, spacing).map(|index| index + 1));
        let (mut first, mut last, mut longest, mut farthest_start) = (firsts[0], lasts[0], [0; 3], firsts[0]);
        for axis in 0..3 {
            for time in 0..3 {
                first[axis] = first[axis].min(firsts[time][axis]);
                farthest_start[axis] = farthest_start[axis].max(firsts[time][axis]);
                last[axis] = last[axis].max(lasts[time][axis]);
                longest[axis] = longest[axis].max(lasts[time][axis] - firsts[time][axis]);
            }
        }
        if (0..3).all(|axis| farthest_start[axis] - first[axis] <= 1) {
            let count = [0, 1, 2].map(|axis| (last[axis] - first[axis] + 1) as usize);
            Self { spacing, origins, first: [first; 3], count }
        } else {
            Self { spacing, origins, first: firsts, count: longest.map(|extent| (extent + 1) as usize) }
        }
    }

    /// Position of a node relative to that with the indices 0 at one of the times, m.
    fn offset(&self, index: usize, time: usize) -> DVec3 {
        let [columns, rows, _] = self.count;
        let position = [index % columns, index / columns % rows, index / columns / rows];
        DVec3::from([0, 1, 2].map(|axis| (self.first[time][axis] + position[axis] as i64) as f64)) * self.spacing
    }

    /// Whether a node acts within `radius` of `center`, m, at any of the times: it does up to one and a half spacings away along each axis. In the corners of the
    /// grid that is outside of the region.
    fn acts_within(&self, index: usize, center: DVec3, radius: f64) -> bool {
        (0..3).any(|time| {
            let distance = (self.offset(index, time) + self.origins[time] - center).abs();
            (distance - 1.5 * self.spacing).max(DVec3::ZERO).length() <= radius
        })
    }

    /// The sums of a node: displacements at the three times, m, and the derivative at the middle, m/s.
    fn gusts(&self, index: usize, samples: &GustSamples) -> [DVec2; 4] {
        let mut sums = [DVec2::ZERO; 4];
        if has_same_nodes(&self.first) {
            samples.add(&mut sums, self.offset(index, 0), &[0, 1, 2, 3]);
        } else {
            samples.add(&mut sums, self.offset(index, 0), &[0]);
            samples.add(&mut sums, self.offset(index, 1), &[1, 3]);
            samples.add(&mut sums, self.offset(index, 2), &[2]);
        }
        sums
    }
}

/// Indices of the node that is nearest to a position relative to that with the indices 0, m.
fn nearest_node(position: DVec3, spacing: f64) -> [i64; 3] {
    (position / spacing).round().to_array().map(|index| index as i64)
}

/// Whether grids with these first nodes consist of the same nodes at all three times.
fn has_same_nodes(first: &[[i64; 3]; 3]) -> bool {
    first.iter().all(|at_time| *at_time == first[0])
}

impl GustField {
    /// Gusts while the shutter is open, within `radius` of `center` above the `ground` (m); `None` where the wind has none.
    pub(crate) fn new(
        wind: &Wind,
        response: f64,
        center: DVec3,
        radius: f64,
        ground: f64,
        shutter: Shutter,
        loop_s: Option<f64>,
    ) -> Option<Self> {
        let gust_length = wind.gust_length().filter(|_| response > 0.0)?;
        let spacing = (gust_length / 3.0).max(MIN_SPACING_RATIO * radius);
        let motion = NodeMotion::new(wind, spacing, loop_s);
        let origins = [shutter.open, shutter.middle(), shutter.close].map(|t| motion.origin(t));
        let history = GustHistory::new(shutter, loop_s);
        let samples = GustSamples::new(wind, response, &motion, &history);
        // Drops come from as far outside of the region as gusts displace them, but not from below the ground.
        let displacement = samples.largest_displacement().min(MAX_DISPLACEMENT_RATIO * spacing);
        let reach = DVec3::new(1.0, 0.0, 1.0) * displacement + radius;
        let low = (center - reach).max(DVec3::new(f64::NEG_INFINITY, ground - 1.0, f64::NEG_INFINITY));
        let grid = NodeGrid::new([low.min(center), center + reach], origins, spacing);
        let nodes: Vec<Option<GustState>> = (0..grid.count.iter().product::<usize>())
            .into_par_iter()
            .map(|index| {
                // The sphere fills half of the grid. The history of a node, a sample of the wind for each step of the memory of the gusts, is by far
                // the dearest part.
                grid.acts_within(index, center, radius + displacement)
                    .then(|| limited(grid.gusts(index, &samples), MAX_DISPLACEMENT_RATIO * spacing))
            })
            .collect();
        let NodeGrid { first, count, .. } = grid;
        let mut field = Self {
            spacing,
            first,
            count,
            origins,
            node_velocity: motion.velocity(shutter.middle()),
            lanes: Vec::new(),
            nodes: Vec::new(),
            bends: Bends { half_s: 0.5 * shutter.duration(), ..Bends::default() },
            extremes: [DVec2::INFINITY, DVec2::NEG_INFINITY],
            largest_travel: 0.0,
            steepness: Vec::new(),
            largest_steepness: DVec2::ZERO,
        };
        field.measure(&nodes);
        field.steepness = (0..nodes.len()).map(|index| field.steepness_of_span(&nodes, index)).collect();
        field.nodes = nodes.into_iter().map(Option::unwrap_or_default).collect();
        field.lanes = field.nodes.iter().map(GustState::lanes).collect();
        Some(field)
    }

    /// Displacement in the middle of the exposure of the node with these indices along x, y and z. `None` outside of the grid, and of nodes that do not act
    /// within the region, which have no displacement to compare.
    fn node_displacement(&self, nodes: &[Option<GustState>], node: [usize; 3]) -> Option<DVec2> {
        let is_inside = (0..3).all(|axis| node[axis] < self.count[axis]);
        is_inside.then(|| nodes[self.node_index(node)]).flatten().map(|gust| gust.displacements[1])
    }

    /// The [steepness](Self::steepness) of the span of three nodes along each axis that begins with a node. The derivative of a quadratic B-spline lies between
    /// the differences of nodes beside each other.
    fn steepness_of_span(&self, nodes: &[Option<GustState>], index: usize) -> DVec2 {
        let [columns, rows, _] = self.count;
        let first = [index % columns, index / columns % rows, index / columns / rows];
        let mut largest = [DVec2::ZERO; 3];
        for steps in (0..27).map(|node| [node % 3, node / 3 % 3, node / 9]) {
            let node = std::array::from_fn(|axis| first[axis] + steps[axis]);
            let Some(here) = self.node_displacement(nodes, node) else { continue };
            for axis in (0..3).filter(|axis| steps[*axis] < 2) {
                let mut next = node;
                next[axis] += 1;
                if let Some(next) = self.node_displacement(nodes, next) {
                    largest[axis] = largest[axis].max((next - here).abs());
                }
            }
        }
        (largest[0] + largest[1] + largest[2]) / self.spacing
    }

    /// Finds the bounds that are kept, of the nodes that act within the region.
    fn measure(&mut self, nodes: &[Option<GustState>]) {
        let [columns, rows, _] = self.count;
        let mut largest = [DVec2::ZERO; 3];
        let mut range = [DVec2::INFINITY, DVec2::NEG_INFINITY];
        for (index, node) in nodes.iter().enumerate() {
            let Some(node) = node else { continue };
            let [open, middle, close] = node.displacements;
            self.extremes = [self.extremes[0].min(middle), self.extremes[1].max(middle)];
            range = [range[0].min(open).min(close), range[1].max(open).max(close)];
            self.largest_travel = self.largest_travel.max((open - middle).length()).max((close - middle).length());
            let travel = node.velocity * self.bends.half_s;
            let bend = (open - middle + travel).length().max((close - middle - travel).length());
            self.bends.of_nodes = self.bends.of_nodes.max(bend);
            let position = [index % columns, index / columns % rows, index / columns / rows];
            for (axis, stride) in [1, columns, columns * rows].into_iter().enumerate() {
                if position[axis] + 1 < self.count[axis]
                    && let Some(next) = &nodes[index + stride]
                {
                    let step = next.displacements[1] - middle;
                    largest[axis] = largest[axis].max(step.abs());
                    let steps = [step.length(), (next.velocity - node.velocity).length()];
                    self.bends.steps = [0, 1].map(|order| self.bends.steps[order].max(steps[order]));
                }
            }
        }
        self.largest_steepness = (largest[0] + largest[1] + largest[2]) / self.spacing;
        if !has_same_nodes(&self.first) {
            // The displacements of a node are those of different points of the wind, so only their range bounds how they change.
            self.bends.of_nodes = f64::INFINITY;
            self.largest_travel = (range[1].max(self.extremes[1]) - range[0].min(self.extremes[0])).length();
        }
    }

    /// Smallest and largest displacement along each axis, m.
    pub(crate) fn extremes(&self) -> [DVec3; 2] {
        self.extremes.map(|displacement| DVec3::new(displacement.x, 0.0, displacement.y))
    }

    /// Largest difference of the displacements of two points up to `distance` (m) apart along each axis, m.
    fn largest_difference(&self, distance: f64) -> DVec3 {
        let difference = (self.largest_steepness * distance).min(self.extremes[1] - self.extremes[0]);
        DVec3::new(difference.x, 0.0, difference.y)
    }

    /// Largest change of the displacement of a drop of some `velocity` (m/s) within half an exposure of `half_s`, m.
    pub(crate) fn largest_travel(&self, velocity: DVec3, half_s: f64) -> f64 {
        self.largest_travel + self.largest_difference((velocity - self.node_velocity).length() * half_s).length()
    }

    /// A box that contains every point whose displaced position is in the box between two corners.
    pub(crate) fn source_bounds(&self, [low, high]: [DVec3; 2]) -> [DVec3; 2] {
        /// After this many iterations the box hardly shrinks any more.
        const ITERATIONS: usize = 7;
        // Fixed-point iteration: bounds on the displacement everywhere first, then on that within the box found so far.
        let [min, max] = self.extremes();
        let mut bounds = [low - max, high - min];
        for _ in 0..ITERATIONS {
            let [min, max] = self.displacement_range(bounds);
            bounds = [low - max, high - min];
        }
        bounds
    }

    /// Bounds of the displacement along each axis within a box. A spline lies within the hull of its control points; those of its part within the box are
    /// found by blossoming.
    fn displacement_range(&self, [low, high]: [DVec3; 2]) -> [DVec3; 2] {
        let (low, high) = ((low - self.origins[1]) / self.spacing, (high - self.origins[1]) / self.spacing);
        let parts: [Vec<(usize, [f64; 3])>; 3] =
            std::array::from_fn(|axis| self.control_points(axis, low[axis], high[axis]));
        let mut range = [DVec2::INFINITY, DVec2::NEG_INFINITY];
        if parts.iter().map(Vec::len).product::<usize>() <= MAX_CONTROL_POINTS {
            for (z, along_z) in &parts[2] {
                for (y, along_y) in &parts[1] {
                    for (x, along_x) in &parts[0] {
                        let displacement = self.weighted_displacement([*x, *y, *z], [along_x, along_y, along_z]);
                        range = [range[0].min(displacement), range[1].max(displacement)];
                    }
                }
            }
        } else {
            // Too many control points: the nodes themselves bound the spline less tightly.
            let [x, y, z] = parts.each_ref().map(|spans| {
                let first = spans.iter().map(|(low, _)| *low).min().unwrap_or(0);
                let last = spans.iter().map(|(low, _)| *low + 2).max().unwrap_or(0);
                first..=last
            });
            let [columns, rows, _] = self.count;
            for k in z {
                for j in y.clone() {
                    for i in x.clone() {
                        let displacement = self.nodes[(k * rows + j) * columns + i].displacements[1];
                        range = [range[0].min(displacement), range[1].max(displacement)];
                    }
                }
            }
        }
        range.map(|displacement| DVec3::new(displacement.x, 0.0, displacement.y))
    }

    /// The control points of the splines between two positions along an axis, in units of the spacing: their first nodes, and the weights of three nodes.
    fn control_points(&self, axis: usize, low: f64, high: f64) -> Vec<(usize, [f64; 3])> {
        let [(first, from), (last, to)] = [low, high].map(|position| self.span(1, axis, position));
        let spans = first..=last;
        let mut control_points = Vec::new();
        for span in spans {
            let (u, v) = (if span == first { from } else { 0.0 }, if span == last { to } else { 1.0 });
            control_points.extend([[u, u], [u, v], [v, v]].map(|arguments| (span, blossom(arguments))));
        }
        control_points
    }

    /// The first of the three nodes around a position along an axis, in units of the spacing, in the grid at one of the three times; and the position within the
    /// middle one's span, 0 to 1.
    #[inline(always)]
    pub(super) fn span(&self, time: usize, axis: usize, position: f64) -> (usize, f64) {
        let within = (position - self.first[time][axis] as f64).clamp(0.5, self.count[axis] as f64 - 1.5);
        let middle = (within.round() as usize).clamp(1, self.count[axis] - 2);
        (middle - 1, within - middle as f64 + 0.5)
    }

    /// Index of a node in the arrays.
    #[inline(always)]
    pub(super) fn node_index(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.count[1] + y) * self.count[0] + x
    }

    /// Displacement at the middle, of 27 nodes by their weights.
    fn weighted_displacement(&self, [x, y, z]: [usize; 3], [along_x, along_y, along_z]: [&[f64; 3]; 3]) -> DVec2 {
        let mut sum = DVec2::ZERO;
        for (k, weight_z) in along_z.iter().enumerate() {
            for (j, weight_y) in along_y.iter().enumerate() {
                let row = self.node_index([x, y + j, z + k]);
                for (node, weight_x) in self.nodes[row..row + 3].iter().zip(along_x) {
                    sum += node.displacements[1] * (weight_x * weight_y * weight_z);
                }
            }
        }
        sum
    }

    /// Gusts on a drop of a steady `velocity` (m/s) that without them is at `points` when the shutter opens, at its middle and when it closes.
    pub(crate) fn at(&self, points: [DVec3; 3], velocity: DVec3) -> GustState {
        let relative = (velocity - self.node_velocity) / self.spacing;
        let mut state = GustState { displacements: [DVec2::ZERO; 3], velocity: DVec2::ZERO };
        for (time, point) in points.into_iter().enumerate() {
            let position = (point - self.origins[time]) / self.spacing;
            let [x, y, z] = [0, 1, 2].map(|axis| self.span(time, axis, position[axis]));
            let [along_x, along_y, along_z] = [x.1, y.1, z.1].map(|t| blossom([t, t]));
            let [slope_x, slope_y, slope_z] = [x.1, y.1, z.1].map(slopes);
            for k in 0..3 {
                for j in 0..3 {
                    let row = self.node_index([x.0, y.0 + j, z.0 + k]);
                    let weight = along_y[j] * along_z[k];
                    let across = relative.y * slope_y[j] * along_z[k] + relative.z * along_y[j] * slope_z[k];
                    for (i, node) in self.nodes[row..row + 3].iter().enumerate() {
                        state.displacements[time] += node.displacements[time] * (along_x[i] * weight);
                        if time == 1 {
                            let moving = relative.x * slope_x[i] * weight + along_x[i] * across;
                            state.velocity += node.velocity * (along_x[i] * weight) + node.displacements[1] * moving;
                        }
                    }
                }
            }
        }
        state
    }
}

/// Weights of three nodes in the blossom of a quadratic B-spline; with equal arguments, in the spline itself.
#[inline(always)]
pub(super) fn blossom([u, v]: [f64; 2]) -> [f64; 3] {
    let (first, last) = (0.5 * (1.0 - u) * (1.0 - v), 0.5 * u * v);
    [first, 1.0 - first - last, last]
}

/// Derivatives of these weights for equal arguments.
#[inline(always)]
pub(super) fn slopes(t: f64) -> [f64; 3] {
    [t - 1.0, 1.0 - 2.0 * t, t]
}

/// Limits displacements to lengths of less than `limit`, smoothly (C1); unchanged up to half of it. The fourth of `sums` is the derivative of the second, and is
/// limited by the chain rule.
fn limited(sums: [DVec2; 4], limit: f64) -> GustState {
    let (half, [open, middle, close, velocity]) = (0.5 * limit, sums);
    let displacements =
        [open, middle, close].map(|displacement| displacement * limit_factor(displacement.length(), limit));
    let length = middle.length();
    if length <= half {
        return GustState { displacements, velocity };
    }
    let slope = (2.0 * half * half / length - limit) / (length * length);
    let velocity = velocity * limit_factor(length, limit) + middle * (slope * middle.dot(velocity) / length);
    GustState { displacements, velocity }
}

/// Factor by which [`limited`] shortens a displacement of a length.
fn limit_factor(length: f64, limit: f64) -> f64 {
    let half = 0.5 * limit;
    if length <= half { 1.0 } else { (limit - half * half / length) / length }
}

/// The horizontal component: near the ground wind is horizontal.
pub(super) fn horizontal(vector: DVec3) -> DVec3 {
    DVec3::new(vector.x, 0.0, vector.z)
}

#[cfg(test)]
mod tests {
    use bansho_base::{
        math::random::{Key, Purpose},
        parameters::animated::Animated,
        world::wind::WindParameters,
    };

    use super::*;

    fn wind_of(velocity: [f64; 3], gust: f64, gust_length: f64, loop_s: Option<f64>) -> Wind {
        let velocity = Animated::from(velocity);
        Wind::new(WindParameters { velocity, gust, gust_length, ..WindParameters::default() }, 3, loop_s)
    }

    fn wind(gust: f64) -> Wind {
        wind_of([5.0, 0.0, 0.0], gust, 6.0, None)
    }

    fn field(wind: &Wind, response: f64, center: DVec3, shutter: Shutter, loop_s: Option<f64>) -> Option<GustField> {
        GustField::new(wind, response, center, 7.0, -10.0, shutter, loop_s)
    }

    /// A shutter that is open only at one time.
    fn instant(t: f64) -> Shutter {
        Shutter { open: t, close: t }
    }

    impl GustField {
        /// The furthest displacement at any node, m.
        fn reach(&self) -> f64 {
            self.nodes.iter().map(|node| node.displacements[1].length()).fold(0.0, f64::max)
        }
    }

    #[test]
    fn displacements_are_limited_smoothly_and_velocities_are_their_derivatives() {
        let along = |length: f64| limited([DVec2::X * length; 4], 3.0).displacements[1].x;
        assert_eq!((along(0.0), along(1.5)), (0.0, 1.5));
        // 3 - 1.5^2 / 3 at twice the half, with the slope 1 where it begins to bend.
        assert!((along(3.0) - 2.25).abs() < 1e-12 && (along(1.5 + 1e-6) - 1.5 - 1e-6).abs() < 1e-11);
        assert!(along(1e6) < 3.0 && along(1e6) > 2.99);
        let (velocity, step) = (DVec2::new(-0.7, 2.0), 1e-6);
        for displacement in [DVec2::new(0.3, -0.8), DVec2::new(2.0, 1.0), DVec2::new(-9.0, 4.0)] {
            let at = |t: f64| {
                limited([displacement + velocity * t, displacement + velocity * t, DVec2::ZERO, velocity], 3.0)
            };
            let expected = (at(step).displacements[1] - at(-step).displacements[1]) / (2.0 * step);
            assert!((at(0.0).velocity - expected).length() < 1e-8, "{displacement}: {expected}");
        }
    }

    #[test]
    fn the_history_weighs_gusts_by_their_age() {
        // Of a gust that always blows with 1 m/s the displacement is half the memory; it does not change.
        let history = GustHistory::new(Shutter { open: 0.71, close: 0.93 }, None);
        for column in 0..3 {
            let sum: f64 = history.weights.iter().map(|weights| weights[column]).sum();
            assert!((sum - 0.5 * GUST_MEMORY_S).abs() < 1e-12, "{sum}");
        }
        assert!(history.weights.iter().map(|weights| weights[3]).sum::<f64>().abs() < 1e-12);
        // One that grows by 1 m/s each second: its integral over the memory, a step ago, is t (M / 2) - M^2 / 6.
        let times = history.samples.clone().map(|sample| sample as f64 * history.step);
        let middle: f64 = times.clone().zip(&history.weights).map(|(t, weights)| t * weights[1]).sum();
        let expected = (0.82 - SAMPLE_STEP_S) * 0.5 * GUST_MEMORY_S - GUST_MEMORY_S * GUST_MEMORY_S / 6.0;
        assert!((middle - expected).abs() < 1e-12, "{middle} {expected}");
        assert!(times.clone().all(|t| t < 0.93), "no gust of the future");
        let rate: f64 = times.zip(&history.weights).map(|(t, weights)| t * weights[3]).sum();
        assert!((rate - 0.5 * GUST_MEMORY_S).abs() < 1e-12, "{rate}");
    }

    #[test]
    fn origins_hold_all_that_is_displaced_into_a_box_and_little_else() {
        let (low, high) = (DVec3::splat(-2.0), DVec3::splat(2.0));
        for (gust_length, slack) in [(6.0, 3.0), (900.0, 0.1)] {
            let storm = wind_of([60.0, 0.0, 20.0], 0.9, gust_length, None);
            let gusts = field(&storm, 1.0, DVec3::ZERO, instant(1.0), None).expect("gusts");
            let [first, last] = gusts.source_bounds([low, high]);
            assert!((last - first - (high - low)).max_element() < slack * gusts.reach(), "{first} {last}");
            let mut hits = 0;
            for i in 0..20_000 {
                let u = Key::new(5, "gust").uniforms(i, 0, Purpose(0)).map(f64::from);
                let share = 2.0 * DVec3::new(u[0], u[1], u[2]) - 0.5;
                let point = first + (last - first) * share;
                let displacement = gusts.at([point; 3], DVec3::ZERO).displacements[1];
                let moved = point + DVec3::new(displacement.x, 0.0, displacement.y);
                if moved.cmpge(low).all() && moved.cmple(high).all() {
                    hits += 1;
                    assert!(point.cmpge(first).all() && point.cmple(last).all(), "{point}");
                }
            }
            assert!(hits > 20, "{hits}");
        }
    }

    #[test]
    fn storms_fetch_no_rain_from_far_away() {
        let storm = wind_of([90.0, 0.0, 40.0], 0.9, 6.0, None);
        let gusts = field(&storm, 1.0, DVec3::ZERO, instant(1.0), None).expect("gusts");
        assert!(
            gusts.reach() < MAX_DISPLACEMENT_RATIO * gusts.spacing
                && gusts.reach() > 0.5 * MAX_DISPLACEMENT_RATIO * gusts.spacing
        );
    }

    #[test]
    fn calm_and_steady_winds_have_no_gusts() {
        assert!(field(&wind(0.0), 1.0, DVec3::ZERO, instant(1.0), None).is_none());
        assert!(field(&wind(0.3), 0.0, DVec3::ZERO, instant(1.0), None).is_none());
    }

    /// Displacement and velocity of a drop that is at a point at 3 s, at another time.
    fn gusts_on_drop(wind: &Wind, response: f64, steady: DVec3, t: f64) -> GustState {
        let point = DVec3::new(0.4, 3.0, -1.0) + steady * (t - 3.0);
        field(wind, response, DVec3::ZERO, instant(t), None).expect("gusts").at([point; 3], steady)
    }

    #[test]
    fn drops_move_as_their_velocity_says() {
        for (velocity, gust, gust_length, response, speed) in [
            ([4.0, 0.0, 0.0], 0.4, 6.0, 1.0, 5.17),
            ([2.0, 0.0, 0.0], 0.3, 6.0, 1.0, 4.0),
            ([10.0, 0.0, -3.0], 0.5, 6.0, 1.0, 9.0),
            ([10.0, 0.0, -3.0], 0.5, 2.0, 2.0, 6.5),
            ([60.0, 0.0, 20.0], 0.9, 6.0, 1.0, 4.0),
        ] {
            let wind = wind_of(velocity, gust, gust_length, None);
            let steady = DVec3::from(velocity) * response - DVec3::Y * speed;
            let mut fastest = 0.0_f64;
            for frame in 0..60 {
                let (t, step) = (2.95 + 0.0017 * f64::from(frame), 1e-5);
                let [before, here, after] = [-step, 0.0, step].map(|dt| gusts_on_drop(&wind, response, steady, t + dt));
                let expected = (after.displacements[1] - before.displacements[1]) / (2.0 * step);
                assert!((here.velocity - expected).length() < 1e-3, "{velocity:?} {t}: {here:?} {expected}");
                fastest = fastest.max(here.velocity.length());
            }
            assert!(fastest > 0.2, "{velocity:?}: {fastest}");
        }
    }

    #[test]
    fn an_exposure_begins_and_ends_where_instants_then_find_a_drop() {
        let wind = wind(0.4);
        let steady = DVec3::new(5.0, -7.0, 0.0);
        for shutter in [Shutter { open: 2.9, close: 3.2 }, Shutter { open: 2.4, close: 3.6 }] {
            let times = [shutter.open, shutter.middle(), shutter.close];
            let points = times.map(|t| DVec3::new(0.4, 3.0, -1.0) + steady * (t - 3.0));
            let exposed = field(&wind, 1.0, DVec3::ZERO, shutter, None).expect("gusts").at(points, steady);
            for (t, displacement) in times.into_iter().zip(exposed.displacements) {
                let alone = gusts_on_drop(&wind, 1.0, steady, t).displacements[1];
                assert!((displacement - alone).length() < 1e-6, "{t}: {displacement} {alone}");
            }
            assert!((exposed.displacements[2] - exposed.displacements[0]).length() > 0.05);
        }
    }

    #[test]
    fn the_grid_of_a_long_exposure_is_no_larger_than_that_of_a_short_one() {
        let wind = wind(0.4);
        let nodes =
            |close: f64| field(&wind, 1.0, DVec3::ZERO, Shutter { open: 2.0, close }, None).expect("gusts").nodes.len();
        assert!(nodes(2000.0) <= 2 * nodes(2.01), "{} {}", nodes(2000.0), nodes(2.01));
    }

    #[test]
    fn a_wind_that_changes_suddenly_moves_no_drop_at_once() {
        let mut wind = wind(0.4);
        let steady = DVec3::new(5.0, -5.5, 0.0);
        let before = gusts_on_drop(&wind, 1.0, steady, 3.1);
        wind.change(3.1, DVec3::new(-9.0, 0.0, 4.0), 0.9, 0.0).unwrap();
        let after = gusts_on_drop(&wind, 1.0, steady, 3.1);
        assert!((before.displacements[1] - after.displacements[1]).length() < 1e-6, "{before:?} {after:?}");
        for step in 0..200 {
            let [earlier, later] = [0.0, 1e-3].map(|dt| {
                let t = 3.1 + 1e-3 * f64::from(step) + dt;
                let wind_now = DVec3::new(-9.0, 0.0, 4.0);
                let point = DVec3::new(0.9, 2.45, -1.0) + (wind_now - DVec3::Y * 5.5) * (t - 3.1);
                let field = field(&wind, 1.0, DVec3::ZERO, instant(t), None).expect("gusts");
                field.at([point; 3], wind_now - DVec3::Y * 5.5)
            });
            let predicted = earlier.displacements[1] + 0.5e-3 * (earlier.velocity + later.velocity);
            assert!((later.displacements[1] - predicted).length() < 1e-5, "{step}: {earlier:?} {later:?}");
        }
    }

    #[test]
    fn a_loop_closes() {
        for seconds in [0.7, 4.0] {
            let wind = wind_of([5.0, 0.0, -0.3], 0.4, 6.0, Some(seconds));
            let at = |t: f64| {
                let field = field(&wind, 1.0, DVec3::ZERO, instant(t), Some(seconds)).expect("gusts");
                field.at([DVec3::new(0.3, 2.0, -1.0); 3], DVec3::new(5.0, -4.0, -0.3))
            };
            let [first, last, other] = [0.2, 0.2 + seconds, 0.2 + 0.5 * seconds].map(at);
            assert!((first.displacements[1] - last.displacements[1]).length() < 1e-4, "{first:?} {last:?}");
            assert!((first.velocity - last.velocity).length() < 1e-3, "{first:?} {last:?}");
            assert!((first.displacements[1] - other.displacements[1]).length() > 1e-3);
        }
    }

    #[test]
    fn a_moving_camera_sees_the_same_gusts() {
        let wind = wind(0.3);
        let point = DVec3::new(0.7, 1.3, 0.2);
        let from = |center: DVec3| {
            field(&wind, 1.0, center, instant(1.0), None).expect("gusts").at([point; 3], DVec3::new(5.0, -5.0, 0.0))
        };
        let (here, there) = (from(DVec3::ZERO), from(DVec3::new(1.9, 0.4, -1.1)));
        assert!((here.displacements[1] - there.displacements[1]).length() < 1e-9);
        assert!((here.velocity - there.velocity).length() < 1e-9 && here.displacements[1].length() > 0.0);
    }
}
