//! A flow on a grid of half the spacing: what a simulation starts from whose beginning was computed on a coarse grid.

use bansho_base::host::parallel::prelude::*;

use crate::{
    flow::Flow,
    grid::{GHOST_LAYERS, Grid},
};

impl Grid {
    /// The same box with twice as many cells along each axis.
    #[must_use]
    pub fn refined(&self) -> Self {
        Self { size: self.size.map(|cells| 2 * cells), spacing: 0.5 * self.spacing, origin: self.origin }
    }
}

impl Flow {
    /// The same gas on the [refined](Grid::refined) grid, interpolated linearly. The next projection makes its divergence right.
    #[must_use]
    pub fn refined(&self) -> Self {
        let mut fine = Self::new(self.grid.refined(), self.settings());
        let coarse = self.grid;
        for (axis, (from, to)) in self.velocity.iter().zip(&mut fine.velocity).enumerate() {
            interpolate(&coarse, from, to, Some(axis));
        }
        interpolate(&coarse, &self.pressure, &mut fine.pressure, None);
        interpolate(&coarse, &self.contents.density, &mut fine.contents.density, None);
        for (from, to) in self.contents.quantities.iter().zip(&mut fine.contents.quantities) {
            interpolate(&coarse, from, to, None);
        }
        fine.restore_stage();
        fine
    }
}

/// The two coarse places around a fine one along an axis, counted with ghost layers, and the weight of the second. Values are at faces or at centers.
fn between(fine: usize, is_face: bool) -> (usize, f32) {
    if is_face {
        (fine / 2 + GHOST_LAYERS, 0.5 * (fine % 2) as f32)
    } else if fine.is_multiple_of(2) {
        // A quarter of a coarse cell before its center.
        ((fine / 2 + GHOST_LAYERS) - 1, 0.75)
    } else {
        (fine / 2 + GHOST_LAYERS, 0.25)
    }
}

/// Interpolates the cells of a field, or the faces normal to `axis`, those on the far side included.
fn interpolate(coarse: &Grid, from: &[f32], to: &mut [f32], axis: Option<usize>) {
    let fine = coarse.refined();
    let ([_, coarse_plane, coarse_row], [_, plane, row]) = (coarse.strides(), fine.strides());
    let count = |of: usize| fine.size[of] + usize::from(axis == Some(of));
    to.par_chunks_mut(plane).enumerate().for_each(|(padded_y, values)| {
        let Some(y) = padded_y.checked_sub(GHOST_LAYERS).filter(|y| *y < count(1)) else { return };
        let (below, up) = between(y, axis == Some(1));
        for z in 0..count(2) {
            let (before, back) = between(z, axis == Some(2));
            let start = below * coarse_plane + before * coarse_row;
            let values = &mut values[(z + GHOST_LAYERS) * row + GHOST_LAYERS..][..count(0)];
            for (x, value) in values.iter_mut().enumerate() {
                let (left, right) = between(x, axis == Some(0));
                let along = |at: usize| from[at] + right * (from[at + 1] - from[at]);
                let at = start + left;
                let near = along(at) + back * (along(at + coarse_row) - along(at));
                let above = at + coarse_plane;
                let far = along(above) + back * (along(above + coarse_row) - along(above));
                *value = near + up * (far - near);
            }
        }
    });
}
