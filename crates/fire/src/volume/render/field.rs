//! The gas as rays see it: mixture fraction and deficit of heat by cubic B-splines, and its velocity.

use bansho_base::{
    host::parallel::prelude::*,
    math::{
        DVec3, Vec3,
        simd::{FourLanes, HalfLanes, Real},
    },
};
use bansho_fluid::{ActiveRows, Flow, GHOST_LAYERS, Grid};
use fearless_simd::{Simd, prelude::*};

use super::blocks::{Blocks, SeenMixtures};

/// Largest speed of gas that is drawn, m/s.
const FASTEST: f32 = 1e3;
/// Width of the band along open sides in which gas fades out in the picture, cells.
const FADING_CELLS: f32 = 6.0;

/// Mixture fraction, and deficit of heat (K).
type Gas = [f32; 2];
/// Velocity, m/s, and 0.
type PaddedVelocity = [f32; 4];

/// The gas of one state.
pub(crate) struct GasField {
    /// The grid of the flow, in the world.
    pub(crate) grid: Grid,
    /// Mixture fraction and deficit beside each other, with ghost cells: both are looked up at the same points.
    gas: Vec<Gas>,
    /// Velocity in cells.
    velocity: Vec<PaddedVelocity>,
    pub(crate) blocks: Blocks,
}

impl GasField {
    /// The gas of a flow at `position` (m). It is seen for at most `seconds` from its state on.
    pub(crate) fn new(flow: &Flow, active: &ActiveRows, position: DVec3, seconds: f32, seen: SeenMixtures) -> Self {
        let grid = Grid { origin: flow.grid.origin + position, ..flow.grid };
        let mut gas = interleaved(flow, active);
        continue_into_solids(flow, &mut gas);
        let velocity = velocities(flow, active);
        let blocks = Blocks::new(&grid, active, &gas, &velocity, seconds, seen);
        Self { grid, gas, velocity, blocks }
    }

    /// A point of the world in cells, from the center of the first one.
    pub(crate) fn point_in_grid(&self, point: DVec3) -> DVec3 {
        self.grid.point_in_cells(point) - 0.5
    }

    /// A point in cells in the world, m.
    pub(crate) fn point_in_world(&self, point: DVec3) -> DVec3 {
        self.grid.origin + (point + 0.5) * self.grid.spacing
    }

    /// Corners of what is seen in the world, m.
    pub(crate) fn seen_corners(&self) -> Option<[DVec3; 2]> {
        self.blocks.seen_corners().map(|corners| corners.map(|corner| self.point_in_world(corner)))
    }

    /// Mixture fraction and deficit of heat (K) at a point in cells: the cubic B-spline, whose slope and curvature are smooth. The brightness of a sheet is the inverse
    /// of the slope of the mixture fraction across it, so that lookups with jumps of slope or curvature show the cells as fine lines; and the light of soot grows
    /// with more than the tenth power of its temperature.
    #[inline(always)]
    pub(crate) fn gas<S: Simd>(&self, simd: S, point: Vec3) -> Gas {
        let [width, height, depth] = self.grid.size;
        let (x, weights_x) = spline_taps(point.x, width);
        let (y, weights_y) = spline_taps(point.y, height);
        let (z, weights_z) = spline_taps(point.z, depth);
        let [_, plane, row] = self.grid.strides();
        let corner = y * plane + z * row + x;
        let values = &self.gas[corner..corner + 3 * plane + 3 * row + 4].as_flattened();
        let mut sum = HalfLanes::splat(simd, 0.0);
        for (j, weight_y) in weights_y.into_iter().enumerate() {
            let mut layer = HalfLanes::splat(simd, 0.0);
            for (k, weight_z) in weights_z.into_iter().enumerate() {
                let first = 2 * (j * plane + k * row);
                let near = HalfLanes::from_slice(simd, &values[first..first + 8]);
                layer = near.fma(near.broadcast(weight_z), layer);
            }
            sum = layer.fma(layer.broadcast(weight_y), sum);
        }
        let [a, b, c, d] = weights_x;
        let products = sum * HalfLanes::from_slice(simd, &[a, a, b, b, c, c, d, d]);
        let (low, high) = products.split();
        let pairs = low + high;
        [pairs[0] + pairs[2], pairs[1] + pairs[3]]
    }

    /// Velocity at a point in cells, m/s.
    #[inline(always)]
    pub(crate) fn velocity<S: Simd>(&self, simd: S, point: Vec3) -> Vec3 {
        let [width, height, depth] = self.grid.size;
        let (x, fx) = place(point.x, width);
        let (y, fy) = place(point.y, height);
        let (z, fz) = place(point.z, depth);
        let (row, plane) = (width, width * depth);
        let at = y * plane + z * row + x;
        let values = &self.velocity[at..at + plane + row + 2];
        let mut sum = FourLanes::splat(simd, 0.0);
        for (j, weight_y) in [1.0 - fy, fy].into_iter().enumerate() {
            for (k, weight_z) in [1.0 - fz, fz].into_iter().enumerate() {
                let first = j * plane + k * row;
                let near = FourLanes::from_slice(simd, &values[first]);
                let next = FourLanes::from_slice(simd, &values[first + 1]);
                let between = (next - near).fma(near.broadcast(fx), near);
                sum = between.fma(near.broadcast(weight_y * weight_z), sum);
            }
        }
        Vec3::new(sum[0], sum[1], sum[2])
    }

    /// Factor of the extinction of gas at a point in cells: it fades out along the open sides and the top of the domain, where the gas that is simulated ends and
    /// smoke would be cut along a plane.
    #[inline(always)]
    pub(crate) fn fading(&self, point: Vec3) -> f32 {
        let [width, height, depth] = self.grid.size.map(|cells| cells as f32 - 0.5);
        let side = |place: f32, far: f32| (place + 0.5).min(far - place);
        let distance = side(point.x, width).min(side(point.z, depth)).min(height - point.y);
        (distance * (1.0 / FADING_CELLS)).simd_smoothstep()
    }
}

/// Place in memory of the first of the four cells around a place in cells along an axis, and the weights of their cubic B-splines.
#[inline(always)]
pub(crate) fn spline_taps(value: f32, count: usize) -> (usize, [f32; 4]) {
    let from_ghost = value.simd_max(-0.5).simd_min(count as f32 - 0.5) + 1.0;
    let below = from_ghost as usize;
    (below + GHOST_LAYERS - 2, spline_weights(from_ghost - below as f32))
}

/// Weights of the cubic B-splines of four points at a fraction of the way from the second to the third.
#[inline(always)]
pub(crate) fn spline_weights(t: f32) -> [f32; 4] {
    let (square, rest) = (t * t, 1.0 - t);
    [
        rest * rest * rest * (1.0 / 6.0),
        (2.0 / 3.0) - square * (1.0 - 0.5 * t),
        (1.0 / 6.0) + 0.5 * (t + square - square * t),
        square * t * (1.0 / 6.0),
    ]
}

/// The point below a place, with one above it, and the fraction of the way between.
#[inline(always)]
fn place(value: f32, count: usize) -> (usize, f32) {
    let clamped = value.simd_max(0.0).simd_min((count - 1) as f32);
    let below = (clamped as usize).min(count - 2);
    (below, clamped - below as f32)
}

/// Mixture fraction and deficit of the rows with gas, with ghost cells; all others hold air.
fn interleaved(flow: &Flow, active: &ActiveRows) -> Vec<Gas> {
    let [width, height, depth] = flow.grid.size;
    let [_, plane, row] = flow.grid.strides();
    let [mixture, deficit] = &flow.contents.quantities;
    let mut gas = vec![[0.0; 2]; flow.grid.len()];
    gas.par_chunks_mut(plane).enumerate().for_each(|(padded_y, gas)| {
        let y = padded_y.saturating_sub(GHOST_LAYERS).min(height - 1);
        for padded_z in 0..depth + 2 * GHOST_LAYERS {
            let z = padded_z.saturating_sub(GHOST_LAYERS).min(depth - 1);
            let cells = active.row(y, z);
            if cells.is_empty() {
                continue;
            }
            let first = if cells.start == 0 { 0 } else { cells.start + GHOST_LAYERS };
            let end = cells.end + if cells.end == width { 2 * GHOST_LAYERS } else { GHOST_LAYERS };
            let values = padded_y * plane + padded_z * row;
            for x in first..end {
                gas[padded_z * row + x] = [mixture[values + x], deficit[values + x]];
            }
        }
    });
    gas
}

/// Continues gas into solids from the cells beside them: the splines around a point at the surface of a solid read cells inside of it, and a sheet would follow
/// their steps if these held air.
fn continue_into_solids(flow: &Flow, gas: &mut [Gas]) {
    /// Cells that splines and the lookups of rays reach into a solid.
    const LAYERS: usize = 3;
    if flow.solids.is_empty() {
        return;
    }
    let [right, above, behind] = flow.grid.strides();
    let mut is_known: Vec<bool> = (0..flow.grid.len()).map(|index| !flow.solids.contains(index)).collect();
    let mut unknown: Vec<usize> = (0..is_known.len()).filter(|index| !is_known[*index]).collect();
    for _ in 0..LAYERS {
        let mut reached = Vec::new();
        for &index in &unknown {
            let neighbors =
                [index - right, index + right, index - above, index + above, index - behind, index + behind];
            let (mut sums, mut count) = ([0.0; 2], 0.0);
            for neighbor in neighbors.into_iter().filter(|neighbor| is_known[*neighbor]) {
                (0..2).for_each(|field| sums[field] += gas[neighbor][field]);
                count += 1.0;
            }
            if count > 0.0 {
                reached.push((index, sums.map(|sum| sum / count)));
            }
        }
        for (index, values) in reached {
            gas[index] = values;
            is_known[index] = true;
        }
        unknown.retain(|index| !is_known[*index]);
    }
}

/// Velocity at the centers of cells.
fn velocities(flow: &Flow, active: &ActiveRows) -> Vec<PaddedVelocity> {
    let grid = flow.grid;
    let [width, _, depth] = grid.size;
    let strides = grid.strides();
    let mut velocities = vec![[0.0; 4]; grid.cells()];
    velocities.par_chunks_mut(width * depth).enumerate().for_each(|(y, velocities)| {
        for (z, row) in grid.rows(y) {
            for x in active.row(y, z) {
                let index = row + x;
                let speed = |axis: usize| {
                    let mean = 0.5 * (flow.velocity[axis][index] + flow.velocity[axis][index + strides[axis]]);
                    if mean.abs() <= FASTEST { mean } else { 0.0 }
                };
                velocities[z * width + x] = [speed(0), speed(1), speed(2), 0.0];
            }
        }
    });
    velocities
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn splines_keep_sums_and_what_is_linear() {
        for value in [-0.7_f32, -0.5, 0.0, 0.3, 2.9, 6.5, 7.4, 9.0] {
            let (first, weights) = spline_taps(value, 8);
            let inside = value.clamp(-0.5, 7.5);
            assert!((weights.iter().sum::<f32>() - 1.0).abs() < 1e-6);
            let place: f32 = weights.iter().enumerate().map(|(i, weight)| weight * (first + i) as f32).sum();
            assert!((place - GHOST_LAYERS as f32 - inside).abs() < 1e-5, "{value}: {place}");
            assert!(first + 4 <= 8 + 2 * GHOST_LAYERS, "{value}: {first}");
        }
    }
}
