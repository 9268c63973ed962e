//! How the drops of one diameter fall: a lattice of cells that moves as a whole, so that any moment is known by itself.
//!
//! Cells are about one metre high and wide. They are anchored in the world, whatever the camera does; wind carries them along,
//! and their contents are keyed by their place in the lattice. A cell that leaves through the ground never returns:
//! the next one comes from above with drops of its own.

use bansho_base::{
    math::{DVec2, DVec3},
    wind::Wind,
};

/// Width of a cell, m, and about its height.
pub(crate) const CELL: f64 = 1.0;

/// A cell of the lattice: x, y (counted from the ground up at time 0) and z.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct Cell(pub(crate) [i64; 3]);

/// The lattice of one diameter at one time.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lattice {
    /// Height of a cell, m.
    height: f64,
    /// How far the lattice has fallen, m.
    fallen: f64,
    /// How far the wind has carried it, m: x and z.
    carried: DVec2,
    /// How far each row of cells lies from the row below, m: x and z. In a loop the wind must bring every row to where
    /// the row that it repeats has been; elsewhere it is 0.
    shear: DVec2,
    /// Rows after which cells repeat in a loop.
    rows: Option<i64>,
}

impl Lattice {
    /// Drops of terminal velocity `speed` (m/s) at time `t`; `response` is how much of the wind they follow. In a loop
    /// the height of a cell gives way so that whole cells fall through in `loop_s` seconds.
    pub(crate) fn new(speed: f64, wind: &Wind, response: f64, loop_s: Option<f64>, t: f64) -> Self {
        let level = |way: DVec3| DVec2::new(way.x, way.z) * response;
        let carried = level(wind.travel(0.0, t));
        let fallen = speed * t;
        match loop_s {
            None => Self { height: CELL, fallen, carried, shear: DVec2::ZERO, rows: None },
            Some(seconds) => {
                let rows = (speed * seconds / CELL).round().max(1.0);
                Self {
                    height: speed * seconds / rows,
                    fallen,
                    carried,
                    shear: level(wind.travel(0.0, seconds)) / rows,
                    rows: Some(rows as i64),
                }
            }
        }
    }

    /// Volume of a cell, m^3.
    pub(crate) fn volume(&self) -> f64 {
        CELL * CELL * self.height
    }

    /// Height of a cell, m.
    pub(crate) fn height(&self) -> f64 {
        self.height
    }

    /// How far a cell's drops are from its middle along the world's axes, m: up to `aside` level, and with its rows.
    pub(crate) fn half_extents(&self, aside: f64) -> DVec3 {
        let [x, z] = self.shear.to_array().map(|shear| aside + 0.5 * shear.abs());
        DVec3::new(x, 0.5 * self.height, z)
    }

    /// The place of a point within the lattice, in cells.
    pub(crate) fn place(&self, point: DVec3) -> DVec3 {
        let row = (point.y + self.fallen) / self.height;
        let level = (DVec2::new(point.x, point.z) - self.carried + self.shear * row) / CELL;
        DVec3::new(level.x, row, level.y)
    }

    /// The point of the world at a place within the lattice, m.
    pub(crate) fn world(&self, place: DVec3) -> DVec3 {
        let level = DVec2::new(place.x, place.z) * CELL + self.carried - self.shear * place.y;
        DVec3::new(level.x, place.y * self.height - self.fallen, level.y)
    }

    /// Which contents a cell has: cells that a loop repeats have the same. Keys hold 21, 22 and 21 bits of the three counts.
    pub(crate) fn contents(&self, cell: Cell) -> u64 {
        let [x, y, z] = cell.0;
        let y = self.rows.map_or(y, |rows| y.rem_euclid(rows));
        let bits = |count: i64, bits: u32| count as u64 & ((1 << bits) - 1);
        bits(x, 21) << 43 | bits(y, 22) << 21 | bits(z, 21)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bansho_base::{animation::Animated, wind::WindParameters};

    fn wind(velocity: [f64; 3]) -> Wind {
        Wind::new(WindParameters { velocity: Animated::from(velocity), ..WindParameters::default() }, 1, None)
    }

    #[test]
    fn a_drop_falls_at_its_speed_and_drifts_with_the_wind() {
        let wind = wind([3.0, 0.0, -1.0]);
        let at = |t: f64| Lattice::new(6.0, &wind, 1.0, None, t).world(DVec3::new(4.3, 20.7, -1.2));
        let moved = at(100.5) - at(100.0);
        assert!((moved - DVec3::new(1.5, -3.0, -0.5)).length() < 1e-9, "{moved}");
    }

    #[test]
    fn world_and_lattice_are_inverse() {
        let wind = wind([3.0, 0.0, -1.0]);
        for loop_s in [None, Some(2.0)] {
            let lattice = Lattice::new(4.03, &wind, 1.0, loop_s, 1.3);
            let point = DVec3::new(-7.3, 2.2, 11.8);
            assert!((lattice.world(lattice.place(point)) - point).length() < 1e-9);
        }
    }

    #[test]
    fn after_a_loop_the_same_contents_are_where_they_were() {
        let wind = wind([3.0, 0.0, -1.0]);
        let (first, last) =
            (Lattice::new(4.03, &wind, 1.0, Some(2.0), 0.4), Lattice::new(4.03, &wind, 1.0, Some(2.0), 2.4));
        assert!((first.height() - 1.0).abs() < 0.1);
        for cell in [[0, 0, 0], [3, 5, -2], [-4, -1, 7]] {
            let place = DVec3::from(cell.map(|count| count as f64 + 0.5));
            let later = last.place(first.world(place));
            let found = Cell([later.x, later.y, later.z].map(|count| count.floor() as i64));
            assert!((later - later.floor() - 0.5).length() < 1e-9);
            assert_eq!(last.contents(found), first.contents(Cell(cell)));
        }
    }
}
