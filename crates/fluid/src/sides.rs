//! The sides of the grid: open to the air around it, or a floor.
//!
//! Air that enters comes from rest relative to the wind, far away, so that its pressure is lower by its dynamic pressure (Bernoulli); gas that leaves has the
//! pressure of the air. There is no lid and no layer that damps the flow.

use crate::{
    grid::{GHOST_LAYERS, Grid},
    momentum::Velocity,
};

/// The air around the grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ambient {
    /// Its density, kg/m^3.
    pub density: f32,
    /// The wind, m/s.
    pub velocity: [f32; 3],
}

/// A side of the grid.
#[derive(Clone, Copy)]
pub(crate) struct Side {
    pub(crate) axis: usize,
    pub(crate) is_high: bool,
}

/// A face on a side of the grid.
pub(crate) struct SideFace {
    /// The face.
    pub(crate) face: usize,
    /// The cell inside of it.
    pub(crate) cell: usize,
    /// The next face inside.
    pub(crate) inner_face: usize,
    /// The cell, counted.
    pub(crate) position: [usize; 3],
}

impl Side {
    /// The open sides of a grid.
    pub(crate) fn open(has_floor: bool) -> impl Iterator<Item = Self> {
        let all = (0..3).flat_map(|axis| [false, true].map(|is_high| Self { axis, is_high }));
        all.filter(move |side| !(has_floor && side.axis == 1 && !side.is_high))
    }

    /// 1 if the axis points out of the grid, otherwise -1.
    pub(crate) fn outward(self) -> f32 {
        if self.is_high { 1.0 } else { -1.0 }
    }

    /// Its faces.
    pub(crate) fn faces(self, grid: &Grid) -> impl Iterator<Item = SideFace> + use<> {
        let grid = *grid;
        let [first, second] = [(self.axis + 1) % 3, (self.axis + 2) % 3];
        (0..grid.size[second]).flat_map(move |j| {
            (0..grid.size[first]).map(move |i| {
                let mut position = [0; 3];
                position[first] = i;
                position[second] = j;
                position[self.axis] = if self.is_high { grid.size[self.axis] - 1 } else { 0 };
                let cell = grid.index(position);
                let stride = grid.strides()[self.axis];
                let (face, inner_face) = if self.is_high { (cell + stride, cell) } else { (cell, cell + stride) };
                SideFace { face, cell, inner_face, position }
            })
        })
    }
}

/// Pressure on an open side, Pa, where gas leaves with that speed (m/s; negative where air enters). `ambient` is the speed of the wind outward.
pub(crate) fn side_pressure(outward_speed: f32, ambient_outward_speed: f32, density: f32) -> f32 {
    if outward_speed >= 0.0 {
        return 0.0;
    }
    0.5 * density * (ambient_outward_speed * ambient_outward_speed - outward_speed * outward_speed)
}

/// Momentum that leaves through an open side moves the faces on it: the upwind difference from the next face inside. Faces at which air enters keep their speed.
pub(crate) fn advance_side_faces(grid: &Grid, has_floor: bool, velocity: &mut Velocity, seconds: f32) {
    for side in Side::open(has_floor) {
        let component = &mut velocity[side.axis];
        for SideFace { face, inner_face, .. } in side.faces(grid) {
            let speed = component[face] * side.outward();
            let courant = (speed * seconds / grid.spacing as f32).clamp(0.0, 1.0);
            component[face] += courant * (component[inner_face] - component[face]);
        }
    }
}

/// Sets the ghost values of the velocity: what enters has the velocity of the air along the side, what leaves that of the gas. A floor has no friction.
pub(crate) fn fill_velocity_ghosts(grid: &Grid, has_floor: bool, ambient: &Ambient, velocity: &mut Velocity) {
    let strides = grid.strides();
    for axis in [0, 2, 1] {
        let [first, second] = [(axis + 1) % 3, (axis + 2) % 3];
        let padded = |axis: usize| grid.size[axis] + 2 * GHOST_LAYERS;
        for j in 0..padded(second) {
            for i in 0..padded(first) {
                let line = i * strides[first] + j * strides[second];
                let at = |cell: usize| line + (cell + GHOST_LAYERS) * strides[axis];
                let (low, high) = (at(0), at(grid.size[axis]));
                let is_floor = has_floor && axis == 1;
                let enters = [!is_floor && velocity[axis][low] > 0.0, velocity[axis][high] < 0.0];
                let stride = strides[axis];
                for component in 0..3 {
                    let values = &mut velocity[component];
                    if component == axis {
                        let mirrored = if is_floor {
                            [-values[low + stride], -values[low + 2 * stride]]
                        } else {
                            [values[low]; 2]
                        };
                        (values[low - stride], values[low - 2 * stride]) = (mirrored[0], mirrored[1]);
                        values[high + stride] = values[high];
                        continue;
                    }
                    let below = if enters[0] { ambient.velocity[component] } else { values[low] };
                    (values[low - stride], values[low - 2 * stride]) = (below, below);
                    let above = if enters[1] { ambient.velocity[component] } else { values[high - stride] };
                    (values[high], values[high + stride]) = (above, above);
                }
            }
        }
    }
}
