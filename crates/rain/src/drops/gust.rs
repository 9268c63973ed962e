//! Displacement and velocity of drops by gusts, on top of the mean wind that carries all drops alike.

use bansho_base::{host::parallel::prelude::*, math::DVec3, world::wind::Wind};

/// Memory of a drop's horizontal displacement, s. The weight of a past gust decreases linearly to 0 over this time, in
/// which a drop falls through the visible region.
const GUST_MEMORY_S: f64 = 2.0;
/// Steps of the integral back in time.
const HISTORY_STEPS: usize = 6;
/// Fall speed with which the path is followed back, m/s. Gusts are much larger than the distances by which drops of
/// other speeds differ.
const TYPICAL_FALL_SPEED: f64 = 5.5;
/// Smallest node spacing as a fraction of the region's radius: finer gusts are smoothed out.
const MIN_SPACING_RATIO: f64 = 0.4;

/// Largest displacement in units of the node spacing: a storm must not carry drops in from far outside the region.
const MAX_DISPLACEMENT_RATIO: f64 = 1.5;

/// The gusts around the camera at one time, trilinearly interpolated between nodes that are fixed in the world.
#[derive(Clone, Debug)]
pub(crate) struct GustField {
    spacing: f64,
    first: [i64; 3],
    count: [usize; 3],
    /// Displacement (m) and velocity (m/s) at each node, x fastest, then y.
    nodes: Vec<[DVec3; 2]>,
}

impl GustField {
    /// Gusts within `radius` of `center` at time `t`; `None` where the wind has none.
    pub(crate) fn new(wind: &Wind, response: f64, center: DVec3, radius: f64, t: f64) -> Option<Self> {
        let gust_length = wind.gust_length().filter(|_| response > 0.0)?;
        let spacing = (gust_length / 3.0).max(MIN_SPACING_RATIO * radius);
        let node_index = |value: f64| (value / spacing).floor() as i64;
        let first = (center - radius).to_array().map(node_index);
        let last = (center + radius).to_array().map(|value| node_index(value) + 1);
        let count = std::array::from_fn(|axis| (last[axis] - first[axis] + 1) as usize);
        let [columns, rows, layers] = count;
        let node = |index: usize| {
            let grid_position = [index % columns, index / columns % rows, index / columns / rows];
            let point =
                DVec3::from(std::array::from_fn(|axis| (first[axis] + grid_position[axis] as i64) as f64 * spacing));
            let [displacement, velocity] = displacement_and_rate(wind, point, t).map(|vector| vector * response);
            [soft_limited(displacement, MAX_DISPLACEMENT_RATIO * spacing), velocity]
        };
        Some(Self { spacing, first, count, nodes: (0..columns * rows * layers).into_par_iter().map(node).collect() })
    }

    /// Smallest and largest displacement along each axis, m, and the largest speed, m/s.
    pub(crate) fn extremes(&self) -> ([DVec3; 2], f64) {
        let displacements = self.nodes.iter().map(|[displacement, _]| *displacement);
        let none = [DVec3::splat(f64::INFINITY), DVec3::splat(f64::NEG_INFINITY)];
        let range = displacements.fold(none, |[min, max], vector| [min.min(vector), max.max(vector)]);
        (range, self.nodes.iter().map(|[_, velocity]| velocity.length()).fold(0.0, f64::max))
    }

    /// A box that contains every point whose displaced position is in the box between two corners.
    pub(crate) fn source_bounds(&self, [low, high]: [DVec3; 2]) -> [DVec3; 2] {
        /// After this many iterations the box hardly shrinks any more.
        const ITERATIONS: usize = 8;
        // Fixed-point iteration: bounds on the displacement everywhere first, then on that within the box found so far.
        let mut bounds = [DVec3::splat(f64::NEG_INFINITY), DVec3::splat(f64::INFINITY)];
        for _ in 0..ITERATIONS {
            let [min, max] = self.displacement_range(bounds);
            bounds = [low - max, high - min];
        }
        bounds
    }

    /// Minimum and maximum displacement along each axis within a box. The interpolant is linear along each axis, so
    /// extrema are at nodes and on the faces of the box.
    fn displacement_range(&self, [low, high]: [DVec3; 2]) -> [DVec3; 2] {
        let ends = |axis: usize| {
            let node = |index: usize| (self.first[axis] + index as i64) as f64 * self.spacing;
            let inside = (0..self.count[axis])
                .map(node)
                .filter(move |coordinate| *coordinate > low[axis] && *coordinate < high[axis]);
            let border =
                [low[axis], high[axis]].map(|coordinate| coordinate.clamp(node(0), node(self.count[axis] - 1)));
            inside.chain(border).collect::<Vec<f64>>()
        };
        let [xs, ys, zs] = [0, 1, 2].map(ends);
        let mut range = [DVec3::splat(f64::INFINITY), DVec3::splat(f64::NEG_INFINITY)];
        for point in xs.iter().flat_map(|x| ys.iter().flat_map(|y| zs.iter().map(|z| DVec3::new(*x, *y, *z)))) {
            let [displacement, _] = self.at(point);
            range = [range[0].min(displacement), range[1].max(displacement)];
        }
        range
    }

    /// Displacement (m) and velocity (m/s) at a point.
    pub(crate) fn at(&self, point: DVec3) -> [DVec3; 2] {
        let grid_position = point / self.spacing;
        let mut low = [0; 3];
        let mut fraction = [0.0; 3];
        for axis in 0..3 {
            let within = (grid_position[axis] - self.first[axis] as f64).clamp(0.0, (self.count[axis] - 1) as f64);
            low[axis] = (within as usize).min(self.count[axis] - 2);
            fraction[axis] = within - low[axis] as f64;
        }
        let mut sum = [DVec3::ZERO; 2];
        for corner in 0..8_usize {
            let step = [corner & 1, corner >> 1 & 1, corner >> 2];
            let weight: f64 =
                (0..3).map(|axis| if step[axis] == 1 { fraction[axis] } else { 1.0 - fraction[axis] }).product();
            let [x, y, z] = std::array::from_fn(|axis| low[axis] + step[axis]);
            let node = &self.nodes[(z * self.count[1] + y) * self.count[0] + x];
            sum = [sum[0] + node[0] * weight, sum[1] + node[1] * weight];
        }
        sum
    }
}

/// Displacement of a drop at `point` by the gusts along its path, and its derivative along that path: the velocity that
/// gusts add.
fn displacement_and_rate(wind: &Wind, point: DVec3, t: f64) -> [DVec3; 2] {
    /// Half the interval of the central difference, s: about an exposure.
    const HALF: f64 = 0.01;
    let mean = horizontal(wind.mean(t));
    let path = (mean - DVec3::Y * TYPICAL_FALL_SPEED) * HALF;
    let [before, after] = [(point - path, t - HALF), (point + path, t + HALF)].map(|(p, t)| displacement(wind, p, t));
    [0.5 * (before + after), (after - before) / (2.0 * HALF)]
}

/// Horizontal displacement `integral of g(s) (1 - s / memory) ds` over the past s along a drop's path, m.
fn displacement(wind: &Wind, point: DVec3, t: f64) -> DVec3 {
    let mean = horizontal(wind.mean(t));
    let step = GUST_MEMORY_S / HISTORY_STEPS as f64;
    let contribution = |index: usize| {
        let age = (index as f64 + 0.5) * step;
        let gust = wind.at(point + (DVec3::Y * TYPICAL_FALL_SPEED - mean) * age, t - age) - wind.mean(t - age);
        horizontal(gust) * (step * (1.0 - age / GUST_MEMORY_S))
    };
    (0..HISTORY_STEPS).map(contribution).sum()
}

/// Limits a vector's length to less than `limit`, smoothly (C1); unchanged up to half of it.
fn soft_limited(vector: DVec3, limit: f64) -> DVec3 {
    let (length, half) = (vector.length(), 0.5 * limit);
    if length <= half { vector } else { vector * ((limit - half * half / length) / length) }
}

/// The horizontal component: near the ground wind is horizontal.
fn horizontal(vector: DVec3) -> DVec3 {
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

    fn wind(gust: f64) -> Wind {
        let velocity = Animated::from([5.0, 0.0, 0.0]);
        Wind::new(WindParameters { velocity, gust, ..WindParameters::default() }, 3, None)
    }

    impl GustField {
        /// The furthest displacement at any node, m.
        fn reach(&self) -> f64 {
            self.nodes.iter().map(|[displacement, _]| displacement.length()).fold(0.0, f64::max)
        }
    }

    #[test]
    fn displacements_are_held_smoothly() {
        let along = |length: f64| soft_limited(DVec3::X * length, 3.0).x;
        assert_eq!((along(0.0), along(1.5)), (0.0, 1.5));
        // 3 - 1.5^2 / 3 at twice the half, with the slope 1 where it begins to bend.
        assert!((along(3.0) - 2.25).abs() < 1e-12 && (along(1.5 + 1e-6) - 1.5 - 1e-6).abs() < 1e-11);
        assert!(along(1e6) < 3.0 && along(1e6) > 2.99);
    }

    #[test]
    fn origins_hold_all_that_is_displaced_into_a_box_and_little_else() {
        let (low, high) = (DVec3::splat(-2.0), DVec3::splat(2.0));
        for (gust_length, slack) in [(6.0, 3.0), (900.0, 0.1)] {
            let velocity = Animated::from([60.0, 0.0, 20.0]);
            let storm =
                Wind::new(WindParameters { velocity, gust: 0.9, gust_length, ..WindParameters::default() }, 3, None);
            let gusts = GustField::new(&storm, 1.0, DVec3::ZERO, 7.0, 1.0).expect("gusts");
            let [first, last] = gusts.source_bounds([low, high]);
            assert!((last - first - (high - low)).max_element() < slack * gusts.reach(), "{first} {last}");
            let mut hits = 0;
            for i in 0..20_000 {
                let u = Key::new(5, "gust").uniforms(i, 0, Purpose(0)).map(f64::from);
                let share = 2.0 * DVec3::new(u[0], u[1], u[2]) - 0.5;
                let point = first + (last - first) * share;
                let moved = point + gusts.at(point)[0];
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
        let velocity = Animated::from([90.0, 0.0, 40.0]);
        let storm = Wind::new(WindParameters { velocity, gust: 0.9, ..WindParameters::default() }, 3, None);
        let gusts = GustField::new(&storm, 1.0, DVec3::ZERO, 7.0, 1.0).expect("gusts");
        assert!(
            gusts.reach() < MAX_DISPLACEMENT_RATIO * gusts.spacing
                && gusts.reach() > 0.5 * MAX_DISPLACEMENT_RATIO * gusts.spacing
        );
        let fastest = gusts.nodes.iter().map(|[_, velocity]| velocity.length()).fold(0.0, f64::max);
        assert!(fastest > 20.0, "{fastest}");
    }

    #[test]
    fn calm_and_steady_winds_have_no_gusts() {
        assert!(GustField::new(&wind(0.0), 1.0, DVec3::ZERO, 5.0, 1.0).is_none());
        assert!(GustField::new(&wind(0.3), 0.0, DVec3::ZERO, 5.0, 1.0).is_none());
    }

    #[test]
    fn from_frame_to_frame_drops_move_as_their_velocity_says() {
        let wind = wind(0.4);
        let frame = 1.0 / 30.0;
        let (mut missed, mut moved) = (0.0, 0.0);
        for i in 0..50 {
            let (t, point) = (0.37 * f64::from(i), DVec3::new(0.4, 3.0, -1.0));
            let [here, velocity] = displacement_and_rate(&wind, point, t);
            let next = point + (DVec3::X * 5.0 - DVec3::Y * TYPICAL_FALL_SPEED) * frame;
            let [there, later] = displacement_and_rate(&wind, next, t + frame);
            missed += (there - here - 0.5 * (velocity + later) * frame).length();
            moved += (there - here).length();
        }
        assert!(missed < 0.05 * moved && moved > 0.0, "{missed} {moved}");
    }

    #[test]
    fn nodes_are_fixed_in_the_world_so_that_a_moving_camera_sees_the_same_gusts() {
        let wind = wind(0.3);
        let point = DVec3::new(0.7, 1.3, 0.2);
        let here = GustField::new(&wind, 1.0, DVec3::ZERO, 5.0, 1.0).unwrap().at(point);
        let there = GustField::new(&wind, 1.0, DVec3::new(1.9, 0.4, -1.1), 5.0, 1.0).unwrap().at(point);
        assert!((here[0] - there[0]).length() < 1e-9 && here[0].length() > 0.0);
    }
}
