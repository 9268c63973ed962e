//! The gas as rays see it: the mixture fraction by cubic B-splines, what else belongs to it, and the blocks in which there is anything to see.

use std::borrow::Cow;

use bansho_base::{
    host::parallel::prelude::*,
    math::{DVec3, Vec3},
};
use bansho_fluid::{ActiveRows, Flow, GHOST_LAYERS, Grid};

/// Side of a block, cells.
pub(crate) const BLOCK: usize = 4;

/// Largest speed of gas that is drawn, m/s.
const FASTEST: f32 = 1e3;

/// Velocity, m/s, and 0.
type PaddedVelocity = [f32; 4];

/// What is seen in a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum BlockContents {
    Nothing,
    /// Smoke alone, which is smooth.
    Smoke,
    /// A sheet that burns.
    Sheet,
}

/// Mixture fractions between which gas is seen.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SeenMixtures {
    /// From here on as smoke.
    pub(crate) smoke: f32,
    /// From here on it may be in a sheet.
    pub(crate) sheet: f32,
    /// Beyond it nothing is seen.
    pub(crate) last: f32,
}

/// The gas of one state.
pub(crate) struct GasField<'a> {
    /// The grid of the flow, in the world.
    pub(crate) grid: Grid,
    /// Mixture fraction, and deficit of heat (K), with ghost cells.
    mixture: Cow<'a, [f32]>,
    deficit: Cow<'a, [f32]>,
    /// Velocity in cells.
    velocity: Vec<PaddedVelocity>,
    /// What is seen in each block or beside it.
    contents: Vec<BlockContents>,
    blocks: [usize; 3],
    /// Corners of the blocks that are seen, cells; `None` if none is.
    pub(crate) seen_bounds: Option<[[usize; 3]; 2]>,
}

impl<'a> GasField<'a> {
    /// The gas of a flow at `position` (m).
    pub(crate) fn new(flow: &'a Flow, active: &ActiveRows, position: DVec3, seen: SeenMixtures) -> Self {
        let grid = Grid { origin: flow.grid.origin + position, ..flow.grid };
        let [mixture, deficit] = match continued_into_solids(flow) {
            Some(continued) => continued.map(Cow::Owned),
            None => flow.contents.quantities.each_ref().map(|quantity| Cow::Borrowed(quantity.as_slice())),
        };
        let velocity = velocities(flow, active);
        let blocks = grid.size.map(|cells| cells.div_ceil(BLOCK));
        let mut field = Self { grid, mixture, deficit, velocity, contents: Vec::new(), blocks, seen_bounds: None };
        field.find_seen_blocks(seen);
        field
    }

    /// The least and the largest mixture fraction in each block.
    fn block_ranges(&self) -> Vec<[f32; 2]> {
        let [_, height, depth] = self.grid.size;
        let [columns, layers, rows] = self.blocks;
        let of_row = |row: usize| {
            let (layer, row) = (row / rows, row % rows);
            let mut ranges = vec![[f32::INFINITY, 0.0_f32]; columns];
            for y in layer * BLOCK..((layer + 1) * BLOCK).min(height) {
                for z in row * BLOCK..((row + 1) * BLOCK).min(depth) {
                    let first = self.grid.index([0, y, z]);
                    let values = &self.mixture[first..first + self.grid.size[0]];
                    for ([least, most], values) in ranges.iter_mut().zip(values.chunks(BLOCK)) {
                        *least = values.iter().fold(*least, |least, value| least.min(*value));
                        *most = values.iter().fold(*most, |most, value| most.max(*value));
                    }
                }
            }
            ranges
        };
        (0..layers * rows).into_par_iter().flat_map_iter(of_row).collect()
    }

    fn find_seen_blocks(&mut self, seen: SeenMixtures) {
        let [columns, layers, rows] = self.blocks;
        let ranges = self.block_ranges();
        // A ray that crosses a block reads cells of its neighbors too.
        let mut contents = vec![BlockContents::Nothing; ranges.len()];
        let mut bounds: Option<[[usize; 3]; 2]> = None;
        for layer in 0..layers {
            for row in 0..rows {
                for column in 0..columns {
                    let near = |center: usize, count: usize| center.saturating_sub(1)..(center + 2).min(count);
                    let blocks = near(layer, layers).flat_map(|y| near(row, rows).map(move |z| (y, z)));
                    let around =
                        blocks.flat_map(|(y, z)| near(column, columns).map(move |x| (y * rows + z) * columns + x));
                    let range = around.fold([f32::INFINITY, 0.0_f32], |[least, most], block| {
                        [least.min(ranges[block][0]), most.max(ranges[block][1])]
                    });
                    let found = seen.contents(range);
                    if found > BlockContents::Nothing {
                        contents[(layer * rows + row) * columns + column] = found;
                        let first = [column, layer, row].map(|block| block * BLOCK);
                        let last = first.map(|cell| cell + BLOCK);
                        bounds = Some(bounds.map_or([first, last], |[low, high]| {
                            [
                                std::array::from_fn(|axis| low[axis].min(first[axis])),
                                std::array::from_fn(|axis| high[axis].max(last[axis])),
                            ]
                        }));
                    }
                }
            }
        }
        self.contents = contents;
        self.seen_bounds = bounds;
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
        self.seen_bounds
            .map(|corners| corners.map(|corner| self.point_in_world(DVec3::from(corner.map(|c| c as f64 - 0.5)))))
    }

    /// What is seen in the block of a point, and the block.
    #[inline(always)]
    pub(crate) fn block(&self, point: Vec3) -> (BlockContents, [usize; 3]) {
        let place = |value: f32, axis: usize| (((value + 0.5).max(0.0) as usize) / BLOCK).min(self.blocks[axis] - 1);
        let block = [place(point.x, 0), place(point.y, 1), place(point.z, 2)];
        let index = (block[1] * self.blocks[2] + block[2]) * self.blocks[0] + block[0];
        (self.contents[index], block)
    }

    /// Mixture fraction at a point in cells: the cubic B-spline, whose slope and curvature are smooth. The brightness of a sheet is the inverse of the slope of
    /// the mixture fraction across it, so that lookups with jumps of slope or curvature show the cells as fine lines.
    #[inline(always)]
    pub(crate) fn mixture(&self, point: Vec3) -> f32 {
        self.spline(&self.mixture, point)
    }

    /// Deficit of heat at a point in cells, K. It must be smooth as well: the light of soot grows with more than the tenth power of its temperature.
    #[inline(always)]
    pub(crate) fn deficit(&self, point: Vec3) -> f32 {
        self.spline(&self.deficit, point)
    }

    #[inline(always)]
    fn spline(&self, values: &[f32], point: Vec3) -> f32 {
        let [width, height, depth] = self.grid.size;
        let (x, weights_x) = spline_taps(point.x, width);
        let (y, weights_y) = spline_taps(point.y, height);
        let (z, weights_z) = spline_taps(point.z, depth);
        let [_, plane, row] = self.grid.strides();
        let corner = y * plane + z * row + x;
        let values = &values[corner..corner + 3 * plane + 3 * row + 4];
        let mut sums = [0.0; 4];
        for (j, weight_y) in weights_y.into_iter().enumerate() {
            let mut layer = [0.0; 4];
            for (k, weight_z) in weights_z.into_iter().enumerate() {
                let near = &values[j * plane + k * row..][..4];
                for i in 0..4 {
                    layer[i] += weight_z * near[i];
                }
            }
            for i in 0..4 {
                sums[i] += weight_y * layer[i];
            }
        }
        sums[0] * weights_x[0] + sums[1] * weights_x[1] + (sums[2] * weights_x[2] + sums[3] * weights_x[3])
    }

    /// Velocity at a point in cells, m/s.
    #[inline(always)]
    pub(crate) fn velocity(&self, point: Vec3) -> Vec3 {
        let [width, height, depth] = self.grid.size;
        let (x, fx) = place(point.x, width);
        let (y, fy) = place(point.y, height);
        let (z, fz) = place(point.z, depth);
        let (row, plane) = (width, width * depth);
        let at = y * plane + z * row + x;
        let values = &self.velocity[at..at + plane + row + 2];
        let mut result = [0.0; 4];
        for (j, weight_y) in [1.0 - fy, fy].into_iter().enumerate() {
            for (k, weight_z) in [1.0 - fz, fz].into_iter().enumerate() {
                let [near, next] = [values[j * plane + k * row], values[j * plane + k * row + 1]];
                let weight = weight_y * weight_z;
                for c in 0..4 {
                    result[c] += weight * (near[c] + fx * (next[c] - near[c]));
                }
            }
        }
        Vec3::new(result[0], result[1], result[2])
    }
}

impl SeenMixtures {
    /// What is seen where the mixture fraction is in a range.
    fn contents(&self, [least, most]: [f32; 2]) -> BlockContents {
        if least > self.last || most < self.smoke.min(self.sheet) {
            BlockContents::Nothing
        } else if most >= self.sheet {
            BlockContents::Sheet
        } else {
            BlockContents::Smoke
        }
    }
}

/// Place in memory of the first of the four cells around a place in cells along an axis, and the weights of their cubic B-splines.
#[inline(always)]
fn spline_taps(value: f32, count: usize) -> (usize, [f32; 4]) {
    let from_ghost = value.clamp(-0.5, count as f32 - 0.5) + 1.0;
    let below = from_ghost as usize;
    let t = from_ghost - below as f32;
    let (square, rest) = (t * t, 1.0 - t);
    let weights = [
        rest * rest * rest * (1.0 / 6.0),
        (2.0 / 3.0) - square * (1.0 - 0.5 * t),
        (1.0 / 6.0) + 0.5 * (t + square - square * t),
        square * t * (1.0 / 6.0),
    ];
    (below + GHOST_LAYERS - 2, weights)
}

/// The point below a place, with one above it, and the fraction of the way between.
#[inline(always)]
fn place(value: f32, count: usize) -> (usize, f32) {
    let clamped = value.clamp(0.0, (count - 1) as f32);
    let below = (clamped as usize).min(count - 2);
    (below, clamped - below as f32)
}

/// Mixture fraction and deficit, continued into solids from the gas beside them: the splines around a point at the surface of a solid read cells inside of it, and
/// a sheet would follow their steps if these held air. `None` without solids.
fn continued_into_solids(flow: &Flow) -> Option<[Vec<f32>; 2]> {
    /// Cells that splines and the lookups of rays reach into a solid.
    const LAYERS: usize = 3;
    if flow.solids.is_empty() {
        return None;
    }
    let [right, above, behind] = flow.grid.strides();
    let mut fields = flow.contents.quantities.clone();
    let mut is_known: Vec<bool> = (0..flow.grid.len()).map(|index| !flow.solids.contains(index)).collect();
    let mut unknown: Vec<usize> = (0..is_known.len()).filter(|index| !is_known[*index]).collect();
    for _ in 0..LAYERS {
        let mut reached = Vec::new();
        for &index in &unknown {
            let neighbors =
                [index - right, index + right, index - above, index + above, index - behind, index + behind];
            let (mut sums, mut count) = ([0.0; 2], 0.0);
            for neighbor in neighbors.into_iter().filter(|neighbor| is_known[*neighbor]) {
                (0..2).for_each(|field| sums[field] += fields[field][neighbor]);
                count += 1.0;
            }
            if count > 0.0 {
                reached.push((index, sums.map(|sum| sum / count)));
            }
        }
        for (index, values) in reached {
            (0..2).for_each(|field| fields[field][index] = values[field]);
            is_known[index] = true;
        }
        unknown.retain(|index| !is_known[*index]);
    }
    Some(fields)
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
