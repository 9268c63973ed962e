//! Transport of mass and of what a kilogram of gas holds, in finite volumes: what leaves a cell enters its neighbor, so that both are conserved.
//!
//! The mass flux through a face is the volume flux times the density there, and the flux of a quantity is the mass flux times the quantity there, with the values
//! of [`carried`](crate::reconstruction). A quantity that is the same everywhere so stays the same to rounding, and none leaves the range that it had.
//! Time steps are of the second order (Heun's method as Shu and Osher 1988 write it).

use std::ops::Range;

use bansho_base::{
    host::parallel::prelude::*,
    math::simd::{LANES, Lanes, Real},
};
use fearless_simd::{Simd, dispatch, prelude::*};

use crate::{
    grid::{GHOST_LAYERS, Grid},
    reconstruction::{carried, load},
};

/// Number of quantities that the gas carries.
pub const QUANTITIES: usize = 2;

/// Density, and what a kilogram of gas holds of each quantity.
#[derive(Clone, Debug)]
pub struct Contents {
    /// Density, kg/m^3.
    pub density: Vec<f32>,
    /// Quantities per kilogram.
    pub quantities: [Vec<f32>; QUANTITIES],
}

impl Contents {
    /// Uniform gas.
    #[must_use]
    pub fn uniform(grid: &Grid, density: f32) -> Self {
        Self { density: vec![density; grid.len()], quantities: std::array::from_fn(|_| vec![0.0; grid.len()]) }
    }

    /// The gas below a floor is that above it.
    fn mirror_at_floor(&mut self, grid: &Grid) {
        let [_, plane, _] = grid.strides();
        for field in std::iter::once(&mut self.density).chain(&mut self.quantities) {
            field.copy_within(2 * plane..3 * plane, plane);
            field.copy_within(3 * plane..4 * plane, 0);
        }
    }
}

/// What transports the contents.
#[derive(Clone, Copy)]
pub struct Carrier<'a> {
    /// The grid.
    pub grid: &'a Grid,
    /// Velocity on faces, m/s.
    pub velocity: [&'a [f32]; 3],
    /// Diffusivity at centers, m^2/s; 0 in solids, through whose faces nothing diffuses.
    pub diffusivity: &'a [f32],
    /// Whether the bottom of the grid is a floor.
    pub has_floor: bool,
    /// The cells of each row, by layer and row, in which something is carried; all others keep their contents.
    pub active: &'a ActiveRows,
}

/// For each row of cells along x the range of cells in which the contents may change, in multiples of [`LANES`].
#[derive(Clone, Debug, PartialEq)]
pub struct ActiveRows {
    rows: Vec<Range<u32>>,
    depth: usize,
}

impl ActiveRows {
    /// All cells of a grid.
    #[must_use]
    pub fn all(grid: &Grid) -> Self {
        let [width, height, depth] = grid.size;
        Self { rows: vec![0..width as u32; height * depth], depth }
    }

    /// Those cells for which `is_active` says so of a cell or of one within `margin` cells of it.
    #[must_use]
    pub fn around(grid: &Grid, margin: usize, is_active: impl Fn(usize) -> bool + Sync) -> Self {
        let [width, height, depth] = grid.size;
        let extents = (0..height * depth).into_par_iter().map(|row| {
            let first = grid.index([0, row / depth, row % depth]);
            let low = (0..width).find(|x| is_active(first + x));
            let Some(low) = low else { return 0..0 };
            let high = (0..width).rev().find(|x| is_active(first + x)).unwrap_or(low);
            low.saturating_sub(margin)..(high + 1 + margin).min(width)
        });
        let extents: Vec<Range<usize>> = extents.collect();
        let join = |a: Range<usize>, b: &Range<usize>| match (a.is_empty(), b.is_empty()) {
            (_, true) => a,
            (true, false) => b.clone(),
            (false, false) => a.start.min(b.start)..a.end.max(b.end),
        };
        // First along z, then along y.
        let across: Vec<Range<usize>> = (0..height * depth)
            .into_par_iter()
            .map(|row| {
                let (y, z) = (row / depth, row % depth);
                let near = z.saturating_sub(margin)..(z + margin + 1).min(depth);
                near.fold(0..0, |sum, z| join(sum, &extents[y * depth + z]))
            })
            .collect();
        let rows = (0..height * depth).into_par_iter().map(|row| {
            let (y, z) = (row / depth, row % depth);
            let near = y.saturating_sub(margin)..(y + margin + 1).min(height);
            let Range { start, end } = near.fold(0..0, |sum, y| join(sum, &across[y * depth + z]));
            if start >= end { 0..0 } else { (start / LANES * LANES) as u32..end.next_multiple_of(LANES) as u32 }
        });
        Self { rows: rows.collect(), depth }
    }

    /// The cells of the row at that height and depth.
    #[inline]
    #[must_use]
    pub fn row(&self, y: usize, z: usize) -> Range<usize> {
        let Range { start, end } = self.rows[y * self.depth + z];
        start as usize..end as usize
    }

    /// Number of active cells.
    #[must_use]
    pub fn cells(&self) -> usize {
        self.rows.iter().map(|row| row.len()).sum()
    }

    /// The first active cell and the one after the last, along each axis; `None` if there are none.
    #[must_use]
    pub fn bounds(&self) -> Option<[[usize; 3]; 2]> {
        let mut bounds: Option<[[usize; 3]; 2]> = None;
        for (number, row) in self.rows.iter().enumerate().filter(|(_, row)| !row.is_empty()) {
            let (y, z) = (number / self.depth, number % self.depth);
            let own = [[row.start as usize, y, z], [row.end as usize, y + 1, z + 1]];
            let joined = bounds.map_or(own, |[low, high]| {
                [
                    std::array::from_fn(|axis| low[axis].min(own[0][axis])),
                    std::array::from_fn(|axis| high[axis].max(own[1][axis])),
                ]
            });
            bounds = Some(joined);
        }
        bounds
    }
}

impl Carrier<'_> {
    /// Carries the contents for `seconds`. `stage` is scratch memory of the same size, whose values where nothing is carried are those of `contents`.
    ///
    /// No cell may lose more than half of its gas in a step: the sum of the Courant numbers of the three axes is at most about 0.9.
    pub fn advance(&self, contents: &mut Contents, stage: &mut Contents, seconds: f32) {
        if self.has_floor {
            contents.mirror_at_floor(self.grid);
        }
        self.euler_step(contents, false, stage, seconds);
        if self.has_floor {
            stage.mirror_at_floor(self.grid);
        }
        // The second step starts from the first, and the result is the mean of its end and the beginning.
        let begin = contents;
        let predicted = stage;
        let mut end = Contents {
            density: std::mem::take(&mut begin.density),
            quantities: begin.quantities.each_mut().map(std::mem::take),
        };
        self.euler_step(predicted, true, &mut end, seconds);
        *begin = end;
    }

    /// One step of Euler's method from `from`. Without `is_mean` it is written to `to`; with it, `to` becomes the mean of itself and the step.
    fn euler_step(&self, from: &Contents, is_mean: bool, to: &mut Contents, seconds: f32) {
        let [_, plane, _] = self.grid.strides();
        let level = bansho_base::math::simd::level();
        let [first, second] = &mut to.quantities;
        let planes =
            to.density.par_chunks_mut(plane).zip(first.par_chunks_mut(plane)).zip(second.par_chunks_mut(plane));
        planes.enumerate().for_each(|(padded_y, ((density, first), second))| {
            let is_inside = (GHOST_LAYERS..GHOST_LAYERS + self.grid.size[1]).contains(&padded_y);
            if is_inside {
                let quantities = [first, second];
                let y = padded_y - GHOST_LAYERS;
                dispatch!(level, simd => self.layer(simd, from, is_mean, density, quantities, y, seconds));
            }
        });
    }

    #[inline(always)]
    fn layer<S: Simd>(
        &self,
        simd: S,
        from: &Contents,
        is_mean: bool,
        density: &mut [f32],
        mut quantities: [&mut [f32]; QUANTITIES],
        y: usize,
        seconds: f32,
    ) {
        let splat = |value: f32| Lanes::splat(simd, value);
        let per_spacing = splat(seconds / self.grid.spacing as f32);
        let half = splat(0.5);
        let plane_start = (y + GHOST_LAYERS) * self.grid.strides()[1];
        for (z, row) in self.grid.rows(y) {
            for x in self.active.row(y, z).step_by(LANES) {
                let index = row + x;
                let mut gained = [splat(0.0); 1 + QUANTITIES];
                for axis in 0..3 {
                    let stride = self.grid.strides()[axis];
                    let low = self.fluxes(simd, from, axis, index);
                    let high = self.fluxes(simd, from, axis, index + stride);
                    for part in 0..1 + QUANTITIES {
                        gained[part] += low[part] - high[part];
                    }
                }
                let before = load(simd, &from.density, index);
                let mut mass = before + per_spacing * gained[0];
                let at = index - plane_start;
                let own = load(simd, density, at);
                if is_mean {
                    mass = (own + mass) * half;
                }
                for (part, values) in quantities.iter_mut().enumerate() {
                    let stepped = before * load(simd, &from.quantities[part], index) + per_spacing * gained[1 + part];
                    let held = if is_mean { (own * load(simd, values, at) + stepped) * half } else { stepped };
                    (held / mass).store_slice(&mut values[at..at + LANES]);
                }
                mass.store_slice(&mut density[at..at + LANES]);
            }
        }
    }

    /// Flux of mass and of the quantities through the lower faces of the cells from `index` on, in the direction of the axis.
    #[inline(always)]
    fn fluxes<S: Simd>(&self, simd: S, from: &Contents, axis: usize, index: usize) -> [Lanes<S>; 1 + QUANTITIES] {
        let stride = self.grid.strides()[axis];
        let velocity = load(simd, self.velocity[axis], index);
        let is_positive = velocity.simd_ge(Lanes::splat(simd, 0.0));
        let density = carried(simd, &from.density, index, stride, is_positive);
        let mass = velocity * density;
        let low = load(simd, self.diffusivity, index - stride);
        let high = load(simd, self.diffusivity, index);
        let diffusion = density * low.simd_min(high) * Lanes::splat(simd, 1.0 / self.grid.spacing as f32);
        let mut fluxes = [mass; 1 + QUANTITIES];
        for part in 0..QUANTITIES {
            let values = &from.quantities[part];
            let difference = load(simd, values, index) - load(simd, values, index - stride);
            fluxes[1 + part] = mass * carried(simd, values, index, stride, is_positive) - diffusion * difference;
        }
        fluxes
    }
}
