//! Change of velocity by the transport of momentum and by eddy viscosity.

use bansho_base::{
    host::parallel::prelude::*,
    math::simd::{LANES, Lanes, Real},
};
use fearless_simd::{Simd, dispatch, prelude::*};

use crate::{
    grid::{GHOST_LAYERS, Grid},
    reconstruction::{carried, load},
};

/// Velocity on faces, one field for each component, m/s.
pub type Velocity = [Vec<f32>; 3];

/// Still air.
pub(crate) fn still(grid: &Grid) -> Velocity {
    std::array::from_fn(|_| vec![0.0; grid.len()])
}

/// What transports momentum.
#[derive(Clone, Copy)]
pub(crate) struct MomentumTransport<'a> {
    pub(crate) grid: &'a Grid,
    /// Velocity by which momentum is carried, m/s.
    pub(crate) carrier: &'a Velocity,
    /// Viscosity at centers, m^2/s.
    pub(crate) viscosity: &'a [f32],
}

impl MomentumTransport<'_> {
    /// Carries the momentum of `velocity` for `seconds`. `stage` is scratch memory. Faces at the sides of the grid are left as they are.
    pub(crate) fn advance(&self, velocity: &mut Velocity, stage: &mut Velocity, seconds: f32) {
        for axis in 0..3 {
            // Ghosts and sides have the values of the beginning in both stages.
            stage[axis].copy_from_slice(&velocity[axis]);
            self.euler_step(axis, &velocity[axis], false, &mut stage[axis], seconds);
            self.euler_step(axis, &stage[axis], true, &mut velocity[axis], seconds);
        }
    }

    /// One step of Euler's method from `from`. Without `is_mean` it is written to `to`; with it, `to` becomes the mean of itself and the step.
    fn euler_step(&self, axis: usize, from: &[f32], is_mean: bool, to: &mut [f32], seconds: f32) {
        let [_, plane, _] = self.grid.strides();
        let level = bansho_base::math::simd::level();
        to.par_chunks_mut(plane).enumerate().for_each(|(padded_y, values)| {
            let is_inside = (GHOST_LAYERS..GHOST_LAYERS + self.grid.size[1]).contains(&padded_y);
            // The faces at the lower side are on the boundary.
            let is_boundary = axis == 1 && padded_y == GHOST_LAYERS;
            if is_inside && !is_boundary {
                let y = padded_y - GHOST_LAYERS;
                dispatch!(level, simd => self.layer(simd, axis, from, is_mean, values, y, seconds));
            }
        });
    }

    #[inline(always)]
    fn layer<S: Simd>(
        &self,
        simd: S,
        axis: usize,
        from: &[f32],
        is_mean: bool,
        values: &mut [f32],
        y: usize,
        seconds: f32,
    ) {
        let splat = |value: f32| Lanes::splat(simd, value);
        let strides = self.grid.strides();
        let plane_start = (y + GHOST_LAYERS) * strides[1];
        let spacing = self.grid.spacing as f32;
        let (per_spacing, per_area, half) =
            (splat(seconds / spacing), splat(seconds / (spacing * spacing)), splat(0.5));
        let zero = splat(0.0);
        for (z, row) in self.grid.rows(y).skip(usize::from(axis == 2)) {
            debug_assert!(axis != 2 || z > 0, "faces at the side are on the boundary");
            for x in (0..self.grid.size[0]).step_by(LANES) {
                let index = row + x;
                let before = load(simd, from, index);
                let (mut outflow, mut divergence, mut spread) = (zero, zero, zero);
                for direction in 0..3 {
                    let (own, stride) = (strides[axis], strides[direction]);
                    let carrier = &self.carrier[direction];
                    let low = (load(simd, carrier, index - own) + load(simd, carrier, index)) * half;
                    let high = (load(simd, carrier, index - own + stride) + load(simd, carrier, index + stride)) * half;
                    let low_value = carried(simd, from, index, stride, low.simd_ge(zero));
                    let high_value = carried(simd, from, index + stride, stride, high.simd_ge(zero));
                    outflow += high * high_value - low * low_value;
                    divergence += high - low;
                    spread += load(simd, from, index - stride) + load(simd, from, index + stride);
                }
                let viscosity =
                    (load(simd, self.viscosity, index - strides[axis]) + load(simd, self.viscosity, index)) * half;
                let laplacian = spread - before * splat(6.0);
                let change = per_spacing * (before * divergence - outflow) + per_area * viscosity * laplacian;
                let at = index - plane_start;
                let own = load(simd, values, at);
                let stepped = before + change;
                let after = if is_mean { (own + stepped) * half } else { stepped };
                if axis == 0 && x == 0 {
                    // The first face of the row is on the boundary.
                    let mut lanes = [0.0; LANES];
                    after.store_slice(&mut lanes);
                    values[at + 1..at + LANES].copy_from_slice(&lanes[1..]);
                } else {
                    after.store_slice(&mut values[at..at + LANES]);
                }
            }
        }
    }
}

/// Eddy viscosity of Smagorinsky (1963) at centers, m^2/s: `(c h)^2 |S|` with the strain rate S, whose off-diagonal parts are means of those at the edges. Also
/// returns nothing larger than `limit`.
pub(crate) fn eddy_viscosity(grid: &Grid, velocity: &Velocity, coefficient: f32, limit: f32, viscosity: &mut [f32]) {
    let [_, plane, _] = grid.strides();
    let level = bansho_base::math::simd::level();
    viscosity.par_chunks_mut(plane).enumerate().for_each(|(padded_y, values)| {
        if (GHOST_LAYERS..GHOST_LAYERS + grid.size[1]).contains(&padded_y) {
            let y = padded_y - GHOST_LAYERS;
            dispatch!(level, simd => viscosity_layer(simd, grid, velocity, coefficient, limit, values, y));
        }
    });
}

#[inline(always)]
fn viscosity_layer<S: Simd>(
    simd: S,
    grid: &Grid,
    velocity: &Velocity,
    coefficient: f32,
    limit: f32,
    values: &mut [f32],
    y: usize,
) {
    let strides = grid.strides();
    let plane_start = (y + GHOST_LAYERS) * strides[1];
    let splat = |value: f32| Lanes::splat(simd, value);
    // |S| = sqrt(2 S_ij S_ij) from differences over a cell: (c h)^2 / h.
    let scale = splat(coefficient * coefficient * grid.spacing as f32);
    let (two, quarter) = (splat(2.0), splat(0.25));
    for (_, row) in grid.rows(y) {
        for x in (0..grid.size[0]).step_by(LANES) {
            let index = row + x;
            let mut square = splat(0.0);
            for a in 0..3 {
                let difference = load(simd, &velocity[a], index + strides[a]) - load(simd, &velocity[a], index);
                square += two * difference * difference;
                for b in a + 1..3 {
                    // Twice the differences across the center, of means of both faces.
                    let difference = difference_across(simd, &velocity[a], index, strides[a], strides[b])
                        + difference_across(simd, &velocity[b], index, strides[b], strides[a]);
                    let shear = difference * quarter;
                    square += shear * shear;
                }
            }
            let viscosity = (scale * square.simd_sqrt()).simd_min(splat(limit));
            viscosity.store_slice(&mut values[index - plane_start..index - plane_start + LANES]);
        }
    }
}

/// Twice the mean of both faces of a cell along `own` of the difference between the neighbors along `across`.
#[inline(always)]
fn difference_across<S: Simd>(simd: S, field: &[f32], index: usize, own: usize, across: usize) -> Lanes<S> {
    let after = load(simd, field, index + across) + load(simd, field, index + own + across);
    let before = load(simd, field, index - across) + load(simd, field, index + own - across);
    after - before
}
