//! Solids in the gas: cells that are not gas, and faces through which none flows.

use bansho_base::{host::parallel::prelude::*, math::DVec3, phenomenon::surroundings::Occluder};

use crate::grid::{GHOST_LAYERS, Grid};

/// The cells of a grid whose centers are in solids. Gas slides along them without friction.
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

    /// Makes these the solids. Returns whether they are others than before.
    pub fn set(&mut self, grid: &Grid, occluders: &[Occluder]) -> bool {
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
