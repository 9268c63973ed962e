//! The lattice of drop cells: closed-form motion of the drops of one diameter.
//!
//! All drops of one diameter fall at the same speed, so cells of about 1 m^3 fall as a whole and their state at any
//! time needs no simulation. The lattice is fixed to the world and independent of the camera. Wind displaces it row by
//! row. The random contents of a cell are keyed by its lattice index. A cell that has passed through the ground never
//! returns: new cells with drops of their own enter from above.

use std::ops::RangeInclusive;

use bansho_base::{
    math::{DVec2, DVec3},
    world::wind::Wind,
};

/// Width of a cell, m; also its height, except in loops.
pub(crate) const CELL_SIZE: f64 = 1.0;

/// Lattice index of a cell: x, y (upward from the ground at time 0) and z.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct LatticeCell(pub(crate) [i64; 3]);

/// How the drops of a lattice fall and drift.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LatticeMotion<'a> {
    /// Terminal velocity, m/s.
    pub(crate) speed: f64,
    pub(crate) wind: &'a Wind,
    /// Response to the wind: at 1 drops drift with the air.
    pub(crate) response: f64,
    /// Height of the ground, m.
    pub(crate) ground: f64,
    /// Length of a loop, s. The height of a cell is adjusted so that a whole number of cells falls through in it.
    pub(crate) loop_s: Option<f64>,
}

/// The lattice of one diameter at one time.
///
/// The horizontal displacement of a row that reaches the ground at time t0 is `integral of v from t0 to now`, v being
/// the wind. The point where a drop lands does not depend on the wind, only the direction from which it comes. So a
/// small change of the wind moves drops by a small amount, however late in the shot; counted from time 0 it would move
/// them by the change times the elapsed time. In a loop, a row that repeats another has the same displacement.
///
/// A wind that is changed during a shot is not known in advance, and a row that is in the air must not jump. So t0 is that of the planned wind, and all
/// rows are displaced alike by the distance that the wind has deviated from it since.
#[derive(Clone, Debug)]
pub(crate) struct Lattice {
    /// Height of a cell, m.
    height: f64,
    /// Height of row 0, m.
    base: f64,
    /// The lowest row in range, and the horizontal displacement of it and those above, m: x and z.
    first: i64,
    drift: Vec<DVec2>,
    /// Number of rows after which cells repeat in a loop.
    rows: Option<i64>,
}

impl Lattice {
    /// The lattice at time `t`, for `heights` in a range, m.
    pub(crate) fn new(motion: &LatticeMotion, heights: RangeInclusive<f64>, t: f64) -> Self {
        let LatticeMotion { speed, wind, response, ground, loop_s } = *motion;
        let (height, rows) = match loop_s {
            None => (CELL_SIZE, None),
            Some(seconds) => {
                let rows = (speed * seconds / CELL_SIZE).round().max(1.0);
                (speed * seconds / rows, Some(rows as i64))
            }
        };
        let base = ground - speed * t;
        let [first, last] = [*heights.start(), *heights.end()].map(|y| ((y - base) / height).floor() as i64);
        // Bounds the time to the ground, for drops that hardly fall.
        let slowest = speed.max(1e-6);
        let unplanned = wind.unplanned_travel(t);
        let mut row_drifts = Vec::new();
        for row in first..=last {
            let planned = wind.planned_travel((row as f64 + 0.5) * height / slowest, t);
            let drift = unplanned.map_or(planned, |unplanned| planned + unplanned) * response;
            row_drifts.push(DVec2::new(drift.x, drift.z));
        }
        Self { height, base, first, drift: row_drifts, rows }
    }

    /// Volume of a cell, m^3.
    pub(crate) fn volume(&self) -> f64 {
        CELL_SIZE * CELL_SIZE * self.height
    }

    /// Height of a cell, m.
    pub(crate) fn height(&self) -> f64 {
        self.height
    }

    /// Half extents of the bounding box of a cell's drops, m; `half_width` horizontally.
    pub(crate) fn half_extents(&self, half_width: f64) -> DVec3 {
        DVec3::new(half_width, 0.5 * self.height, half_width)
    }

    /// The row at a height, m.
    pub(crate) fn row(&self, y: f64) -> i64 {
        ((y - self.base) / self.height).floor() as i64
    }

    /// The column of cells (x and z) of a row that contains a horizontal position in the world, m.
    pub(crate) fn column(&self, row: i64, horizontal: DVec2) -> [i64; 2] {
        ((horizontal - self.drift(row)) / CELL_SIZE).to_array().map(|coordinate| coordinate.floor() as i64)
    }

    /// World position of a point of a cell, given as fractions of its edges, m.
    pub(crate) fn point_in_world(&self, LatticeCell([x, row, z]): LatticeCell, fraction: DVec3) -> DVec3 {
        let horizontal = DVec2::new(x as f64 + fraction.x, z as f64 + fraction.z) * CELL_SIZE + self.drift(row);
        DVec3::new(horizontal.x, (row as f64 + fraction.y) * self.height + self.base, horizontal.y)
    }

    /// Horizontal displacement of a row, m: x and z. Outside the range of heights, that of the nearest row.
    fn drift(&self, row: i64) -> DVec2 {
        let last = self.drift.len().saturating_sub(1) as i64;
        let index = (row - self.first).clamp(0, last) as usize;
        self.drift.get(index).copied().unwrap_or_default()
    }

    /// Random key of a cell's contents: equal for cells that a loop repeats. It packs 21, 22 and 21 bits of the three
    /// indices.
    pub(crate) fn contents(&self, cell: LatticeCell) -> u64 {
        let [x, y, z] = cell.0;
        let y = self.rows.map_or(y, |rows| y.rem_euclid(rows));
        low_bits(x, 21) << 43 | low_bits(y, 22) << 21 | low_bits(z, 21)
    }
}

/// The lowest bits of an index in two's complement: negative indices wrap around.
fn low_bits(index: i64, bits: u32) -> u64 {
    index as u64 & ((1 << bits) - 1)
}

#[cfg(test)]
mod tests {
    use bansho_base::{math::curve::Interpolation, parameters::animated::Animated, world::wind::WindParameters};

    use super::*;

    fn wind(velocity: impl Into<Animated<[f64; 3]>>, loop_s: Option<f64>) -> Wind {
        Wind::new(WindParameters { velocity: velocity.into(), ..WindParameters::default() }, 1, loop_s)
    }

    fn lattice(speed: f64, wind: &Wind, loop_s: Option<f64>, t: f64) -> Lattice {
        Lattice::new(&LatticeMotion { speed, wind, response: 1.0, ground: 0.0, loop_s }, -20.0..=40.0, t)
    }

    /// What keys blow to x.
    fn keyed(keys: &[[f64; 2]]) -> Animated<[f64; 3]> {
        let keys = keys.iter().map(|[t, speed]| (*t, [*speed, 0.0, 0.0])).collect();
        Animated::keyed(keys, Interpolation::Linear).unwrap()
    }

    #[test]
    fn a_drop_falls_at_its_speed_and_drifts_with_the_wind() {
        let wind = wind([3.0, 0.0, -1.0], None);
        let (cell, fraction) = (LatticeCell([4, 620, -2]), DVec3::new(0.3, 0.7, 0.8));
        let at = |t: f64| lattice(6.0, &wind, None, t).point_in_world(cell, fraction);
        let displacement = at(100.5) - at(100.0);
        assert!((displacement - DVec3::new(1.5, -3.0, -0.5)).length() < 1e-9, "{displacement}");
    }

    #[test]
    fn a_drop_drifts_by_the_integral_of_a_keyed_wind() {
        let wind = wind(keyed(&[[0.0, 0.0], [4.0, 8.0]]), None);
        let at = |t: f64| lattice(6.0, &wind, None, t).point_in_world(LatticeCell([0, 12, 0]), DVec3::splat(0.5));
        // The integral of 2 t from 1 to 2.
        assert!(((at(2.0) - at(1.0)) - DVec3::new(3.0, -6.0, 0.0)).length() < 1e-9);
    }

    #[test]
    fn a_little_more_wind_moves_drops_by_a_little_however_late() {
        for t in [1.0, 100.0, 5000.0] {
            let row = (6.0 * t) as i64 + 3;
            let at = |speed: f64| {
                lattice(6.0, &wind([speed, 0.0, 0.0], None), None, t)
                    .point_in_world(LatticeCell([0, row, 0]), DVec3::splat(0.5))
            };
            let displacement = at(2.1) - at(2.0);
            // 3.5 m above the ground, which it comes to in 3.5 / 6 s.
            assert!((displacement.x + 0.1 * 3.5 / 6.0).abs() < 1e-6 && displacement.y == 0.0, "{t}: {displacement}");
        }
    }

    #[test]
    fn a_drop_in_the_air_does_not_jump_when_the_wind_changes_but_drifts_with_the_new_wind() {
        let mut wind = wind([2.0, 0.0, 0.0], None);
        let at = |wind: &Wind, t: f64| {
            lattice(6.0, wind, None, t).point_in_world(LatticeCell([0, 361, 0]), DVec3::splat(0.5))
        };
        let before = [at(&wind, 59.5), at(&wind, 60.0)];
        wind.change(60.0, DVec3::new(5.0, 0.0, -3.0), 0.3, 0.0).unwrap();
        assert_eq!([at(&wind, 59.5), at(&wind, 60.0)], before);
        let displacement = at(&wind, 60.5) - before[1];
        assert!((displacement - DVec3::new(2.5, -3.0, -1.5)).length() < 1e-9, "{displacement}");
    }

    #[test]
    fn what_blew_before_a_drop_was_near_does_not_matter() {
        let [calm, storm] =
            [keyed(&[[0.0, 0.0], [50.0, 0.0], [51.0, 2.0]]), keyed(&[[0.0, 40.0], [50.0, 0.0], [51.0, 2.0]])];
        let at = |velocity: Animated<[f64; 3]>| {
            lattice(6.0, &wind(velocity, None), None, 60.0).point_in_world(LatticeCell([1, 361, 0]), DVec3::ZERO)
        };
        assert!((at(calm) - at(storm)).length() < 1e-9);
    }

    #[test]
    fn every_point_lies_in_the_cell_that_is_found_for_it() {
        let wind = wind([3.0, 0.0, -1.0], None);
        for loop_s in [None, Some(2.0)] {
            let lattice = lattice(4.03, &wind, loop_s, 1.3);
            let point = DVec3::new(-7.3, 2.2, 11.8);
            let row = lattice.row(point.y);
            let [x, z] = lattice.column(row, DVec2::new(point.x, point.z));
            let fraction = point - lattice.point_in_world(LatticeCell([x, row, z]), DVec3::ZERO);
            let edges = DVec3::new(CELL_SIZE, lattice.height(), CELL_SIZE);
            assert!(fraction.cmpge(DVec3::ZERO).all() && fraction.cmplt(edges).all(), "{fraction}");
        }
    }

    #[test]
    fn after_a_loop_the_same_contents_are_where_they_were() {
        let steady = wind([3.0, 0.0, -1.0], Some(2.0));
        let changing = wind(keyed(&[[0.0, 1.0], [0.7, 5.0], [2.0, 1.0]]), Some(2.0));
        for wind in [steady, changing] {
            let [first, last] = [0.4, 2.4].map(|t| lattice(4.03, &wind, Some(2.0), t));
            assert!((first.height() - 1.0).abs() < 0.1);
            for cell in [[0, 0, 0], [3, 5, -2], [-4, -1, 7]] {
                let point = first.point_in_world(LatticeCell(cell), DVec3::splat(0.5));
                let row = last.row(point.y);
                let [x, z] = last.column(row, DVec2::new(point.x, point.z));
                let found = LatticeCell([x, row, z]);
                assert!((last.point_in_world(found, DVec3::splat(0.5)) - point).length() < 1e-9);
                assert_eq!(last.contents(found), first.contents(LatticeCell(cell)));
            }
        }
    }
}
