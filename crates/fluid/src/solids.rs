//! Solids in the gas: cells that are not gas, and faces through which none flows.

use bansho_base::{host::parallel::prelude::*, math::DVec3, phenomenon::surroundings::Occluder};

use crate::{
    grid::{GHOST_LAYERS, Grid},
    sides::Side,
};

/// The cells of a grid whose centers are in solids, and those from which solids cut all ways out, in which nothing can flow. Gas slides along them without
/// friction.
#[derive(Clone, Debug, Default)]
pub struct Solids {
    occluders: Vec<Occluder>,
    /// Whether each cell is solid, with ghost cells, which are not; empty without solids in the grid.
    is_solid: Vec<bool>,
    /// For each axis 0 for faces of solid cells and 1 for all others; empty without solids in the grid.
    open_faces: [Vec<f32>; 3],
    count: usize,
}

impl Solids {
    /// Whether any cell is solid.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Number of solid cells.
    #[must_use]
    pub fn cells(&self) -> usize {
        self.count
    }

    /// Whether a cell is solid.
    #[must_use]
    #[inline]
    pub fn contains(&self, index: usize) -> bool {
        self.count > 0 && self.is_solid[index]
    }

    /// 1 for faces through which gas may flow, 0 for all others; `None` without solids.
    pub(crate) fn open_faces(&self, axis: usize) -> Option<&[f32]> {
        (self.count > 0).then_some(self.open_faces[axis].as_slice())
    }

    /// Makes these the solids, in a grid whose bottom is a floor or open. Returns whether they are others than before.
    pub fn set(&mut self, grid: &Grid, has_floor: bool, occluders: &[Occluder]) -> bool {
        if Occluder::are_same(&self.occluders, occluders) {
            return false;
        }
        self.occluders = occluders.to_vec();
        let near: Vec<&Occluder> = occluders.iter().filter(|occluder| reaches(grid, occluder)).collect();
        if near.is_empty() {
            *self = Self { occluders: std::mem::take(&mut self.occluders), ..Self::default() };
            return true;
        }
        let [_, plane, _] = grid.strides();
        self.is_solid = vec![false; grid.len()];
        self.is_solid.par_chunks_mut(plane).enumerate().for_each(|(padded_y, values)| {
            let Some(y) = padded_y.checked_sub(GHOST_LAYERS).filter(|y| *y < grid.size[1]) else { return };
            for (z, row) in grid.rows(y) {
                for x in 0..grid.size[0] {
                    let center = grid.center([x, y, z]);
                    let is_solid = near.iter().any(|occluder| occluder.signed_distance(center) < 0.0);
                    values[row + x - padded_y * plane] = is_solid;
                }
            }
        });
        self.fill_cavities(grid, has_floor);
        self.count = self.is_solid.iter().filter(|is_solid| **is_solid).count();
        for (axis, faces) in self.open_faces.iter_mut().enumerate() {
            let stride = grid.strides()[axis];
            *faces = vec![1.0; grid.len()];
            for (index, face) in faces.iter_mut().enumerate().skip(stride) {
                if self.is_solid[index] || self.is_solid[index - stride] {
                    *face = 0.0;
                }
            }
        }
        true
    }

    /// Makes cells solid that no way connects with an open side: what expands there could go nowhere.
    fn fill_cavities(&mut self, grid: &Grid, has_floor: bool) {
        let mut is_reached = self.is_solid.clone();
        let sides = Side::open(has_floor).flat_map(|side| side.faces(grid)).map(|face| face.position);
        let mut reached: Vec<[usize; 3]> = sides.collect();
        while let Some(cell) = reached.pop() {
            if !std::mem::replace(&mut is_reached[grid.index(cell)], true) {
                reached.extend(grid.neighbors(cell).filter(|near| !is_reached[grid.index(*near)]));
            }
        }
        for y in 0..grid.size[1] {
            for (_, row) in grid.rows(y) {
                let width = grid.size[0];
                let cells = self.is_solid[row..row + width].iter_mut().zip(&is_reached[row..row + width]);
                cells.for_each(|(is_solid, is_reached)| *is_solid |= !is_reached);
            }
        }
    }
}

/// Whether a solid may contain the center of a cell.
fn reaches(grid: &Grid, occluder: &Occluder) -> bool {
    let (low, high) = (grid.origin, grid.far_corner());
    match (occluder.bounding_sphere(), occluder) {
        (Some((center, radius)), _) => (center.clamp(low, high) - center).length() <= radius,
        (None, Occluder::HalfSpace { point, normal }) => {
            // The corner that is deepest in the solid, by half a cell.
            let deepest = DVec3::select(normal.cmpgt(DVec3::ZERO), low, high) + normal.signum() * (0.5 * grid.spacing);
            (deepest - *point).dot(*normal) < 0.0
        }
        (None, _) => true,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Four walls and a lid of a box without a bottom, 0.1 m thick.
    fn cup() -> Vec<Occluder> {
        let wall = |center: [f64; 3], size: [f64; 3]| Occluder::Cuboid {
            center: DVec3::from(center),
            half_extents: DVec3::from(size) / 2.0,
            rotation: bansho_base::math::DQuat::IDENTITY,
        };
        vec![
            wall([-0.35, 0.4, 0.0], [0.1, 0.8, 0.8]),
            wall([0.35, 0.4, 0.0], [0.1, 0.8, 0.8]),
            wall([0.0, 0.4, -0.35], [0.8, 0.8, 0.1]),
            wall([0.0, 0.4, 0.35], [0.8, 0.8, 0.1]),
            wall([0.0, 0.75, 0.0], [0.8, 0.1, 0.8]),
        ]
    }

    #[test]
    fn what_no_gas_can_leave_is_solid() {
        let grid = Grid::new([32, 24, 32], 0.05, DVec3::new(-0.8, 0.0, -0.8));
        let middle = grid.index([16, 4, 16]);
        let mut solids = Solids::default();
        solids.set(&grid, false, &cup());
        assert!(!solids.contains(middle), "open below");
        let mut solids = Solids::default();
        solids.set(&grid, true, &cup());
        assert!(solids.contains(middle), "on the floor");
        let mut solids = Solids::default();
        solids.set(&grid, true, &cup()[..4]);
        assert!(!solids.contains(middle), "open above");
    }
}
