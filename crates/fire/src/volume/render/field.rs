//! The gas as rays see it: the mixture fraction interpolated by cubics to a finer grid, what else belongs to it, and the blocks in which there is anything to see.

use bansho_base::{
    host::parallel::prelude::*,
    math::{DVec3, Vec3},
};
use bansho_fluid::{ActiveRows, Flow, Grid};

/// Side of a block, points of the fine grid.
pub(crate) const BLOCK: usize = 8;
/// Weights of four neighbors at a quarter of the way from the second to the third: those of the cubic B-spline, whose slope is smooth. The brightness of a sheet is
/// the inverse of the slope of the mixture fraction across it, so that splines with jumps of curvature show the cells as fine lines.
const QUARTER: [f32; 4] = [0.070_312_5, 0.611_979_2, 0.315_104_2, 0.002_604_2];

/// Largest speed of gas that is drawn, m/s.
const FASTEST: f32 = 1e3;

/// What a ray reads at a point besides the mixture fraction: velocity, m/s, and deficit of heat, K.
pub(crate) type PointData = [f32; 4];

/// What is seen in a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum BlockContents {
    Nothing,
    /// Smoke alone, which is smooth.
    Smoke,
    /// A sheet that burns.
    Sheet,
}

/// The gas of one state.
pub(crate) struct GasField {
    /// The grid of the flow, in the world.
    pub(crate) grid: Grid,
    /// Number of points of the fine grid along x, y and z.
    pub(crate) size: [usize; 3],
    /// Fine points for each cell and axis.
    pub(crate) refinement: usize,
    /// Mixture fraction at fine points, x first, then z, then y.
    mixture: Vec<f32>,
    /// Velocity and deficit in cells.
    data: Vec<PointData>,
    /// What is seen in each block or beside it.
    contents: Vec<BlockContents>,
    blocks: [usize; 3],
    /// Corners of the blocks that are seen, fine points; `None` if none is.
    pub(crate) seen_bounds: Option<[[usize; 3]; 2]>,
}

impl GasField {
    /// The gas of a flow at `position` (m). Gas with a mixture fraction of at least the first of `least` is seen, from the second on it may be in a sheet.
    pub(crate) fn new(flow: &Flow, active: &ActiveRows, position: DVec3, refinement: usize, least: [f32; 2]) -> Self {
        let grid = Grid { origin: flow.grid.origin + position, ..flow.grid };
        let size = grid.size.map(|cells| cells * refinement);
        let continued = continued_into_solids(flow);
        let [mixture, deficit] = continued.as_ref().unwrap_or(&flow.contents.quantities);
        let data = point_data(flow, active, deficit);
        let mixture = refined(&flow.grid, mixture, active, refinement);
        let blocks = size.map(|points| points.div_ceil(BLOCK));
        let mut field = Self { grid, size, refinement, mixture, data, contents: Vec::new(), blocks, seen_bounds: None };
        field.find_seen_blocks(least);
        field
    }

    fn find_seen_blocks(&mut self, [least_smoke, least_sheet]: [f32; 2]) {
        let [width, height, depth] = self.size;
        let [columns, layers, rows] = self.blocks;
        let of_points: Vec<BlockContents> = (0..layers * rows)
            .into_par_iter()
            .flat_map_iter(|row| {
                let (layer, row) = (row / rows, row % rows);
                let mut seen = vec![BlockContents::Nothing; columns];
                for y in layer * BLOCK..((layer + 1) * BLOCK).min(height) {
                    for z in row * BLOCK..((row + 1) * BLOCK).min(depth) {
                        let values = &self.mixture[(y * depth + z) * width..][..width];
                        for (seen, values) in seen.iter_mut().zip(values.chunks(BLOCK)) {
                            let most = values.iter().fold(0.0, |most: f32, value| most.max(*value));
                            let contents = match most {
                                most if most >= least_sheet => BlockContents::Sheet,
                                most if most >= least_smoke => BlockContents::Smoke,
                                _ => BlockContents::Nothing,
                            };
                            *seen = (*seen).max(contents);
                        }
                    }
                }
                seen
            })
            .collect();
        // A ray that crosses a block reads points of its neighbors too.
        let mut contents = vec![BlockContents::Nothing; of_points.len()];
        let mut bounds: Option<[[usize; 3]; 2]> = None;
        for layer in 0..layers {
            for row in 0..rows {
                for column in 0..columns {
                    let near = |center: usize, count: usize| center.saturating_sub(1)..(center + 2).min(count);
                    let blocks = near(layer, layers).flat_map(|y| near(row, rows).map(move |z| (y, z)));
                    let around =
                        blocks.flat_map(|(y, z)| near(column, columns).map(move |x| (y * rows + z) * columns + x));
                    let most = around.map(|block| of_points[block]).max().unwrap_or(BlockContents::Nothing);
                    if most > BlockContents::Nothing {
                        contents[(layer * rows + row) * columns + column] = most;
                        let first = [column, layer, row].map(|block| block * BLOCK);
                        let last = first.map(|point| point + BLOCK);
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

    /// Fine points in a meter.
    pub(crate) fn points_per_meter(&self) -> f64 {
        self.refinement as f64 / self.grid.spacing
    }

    /// A point of the world in the fine grid, whose first point is at 0.
    pub(crate) fn point_in_grid(&self, point: DVec3) -> DVec3 {
        (point - self.grid.origin) * self.points_per_meter() - 0.5
    }

    /// A point of the fine grid in the world, m.
    pub(crate) fn point_in_world(&self, point: DVec3) -> DVec3 {
        self.grid.origin + (point + 0.5) / self.points_per_meter()
    }

    /// Corners of what is seen in the world, m.
    pub(crate) fn seen_corners(&self) -> Option<[DVec3; 2]> {
        self.seen_bounds
            .map(|corners| corners.map(|corner| self.point_in_world(DVec3::from(corner.map(|c| c as f64 - 0.5)))))
    }

    /// What is seen in the block of a point, and the block.
    #[inline(always)]
    pub(crate) fn block(&self, point: Vec3) -> (BlockContents, [usize; 3]) {
        let place = |value: f32, axis: usize| ((value.max(0.0) as usize) / BLOCK).min(self.blocks[axis] - 1);
        let block = [place(point.x, 0), place(point.y, 1), place(point.z, 2)];
        let index = (block[1] * self.blocks[2] + block[2]) * self.blocks[0] + block[0];
        (self.contents[index], block)
    }

    /// Mixture fraction at a point of the fine grid.
    #[inline(always)]
    pub(crate) fn mixture(&self, point: Vec3) -> f32 {
        let [width, height, depth] = self.size;
        let (x, fx) = place(point.x, width);
        let (y, fy) = place(point.y, height);
        let (z, fz) = place(point.z, depth);
        let (row, plane) = (width, width * depth);
        let at = y * plane + z * row + x;
        let values = &self.mixture[at..at + plane + row + 2];
        let along = |start: usize| values[start] + fx * (values[start + 1] - values[start]);
        let (near, far) = (along(0), along(row));
        let (near_above, far_above) = (along(plane), along(plane + row));
        let below = near + fz * (far - near);
        let above = near_above + fz * (far_above - near_above);
        below + fy * (above - below)
    }

    /// Velocity and deficit at a point of the fine grid.
    #[inline(always)]
    pub(crate) fn data(&self, point: Vec3) -> PointData {
        let [width, height, depth] = self.grid.size;
        let scale = 1.0 / self.refinement as f32;
        let offset = 0.5 * scale - 0.5;
        let (x, fx) = place(point.x * scale + offset, width);
        let (y, fy) = place(point.y * scale + offset, height);
        let (z, fz) = place(point.z * scale + offset, depth);
        let (row, plane) = (width, width * depth);
        let at = y * plane + z * row + x;
        let values = &self.data[at..at + plane + row + 2];
        let mut result = [0.0; 4];
        for c in 0..4 {
            let along = |start: usize| values[start][c] + fx * (values[start + 1][c] - values[start][c]);
            let (near, far) = (along(0), along(row));
            let (near_above, far_above) = (along(plane), along(plane + row));
            let below = near + fz * (far - near);
            let above = near_above + fz * (far_above - near_above);
            result[c] = below + fy * (above - below);
        }
        result
    }
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

/// The mixture fraction on a grid of `refinement` (1 or 2) times as many points along each axis.
fn refined(grid: &Grid, source: &[f32], active: &ActiveRows, refinement: usize) -> Vec<f32> {
    let [width, _, depth] = grid.size;
    let fine_width = width * refinement;
    let mut fine = vec![0.0; grid.cells() * refinement * refinement * refinement];
    let layer = fine_width * depth * refinement;
    fine.par_chunks_mut(layer).enumerate().for_each(|(fine_y, values)| {
        let y = fine_y / refinement;
        let mut sums = vec![0.0_f32; width + 4];
        for (fine_z, values) in values.chunks_mut(fine_width).enumerate() {
            let z = fine_z / refinement;
            // The cells around may have gas where this row has none.
            let near = |center: usize, count: usize| center.saturating_sub(2)..(center + 3).min(count);
            let rows = near(y, grid.size[1]).flat_map(|y| near(z, depth).map(move |z| active.row(y, z)));
            let range = rows.filter(|row| !row.is_empty()).reduce(|a, b| a.start.min(b.start)..a.end.max(b.end));
            let Some(range) = range else { continue };
            let range = range.start.saturating_sub(2)..(range.end + 2).min(width);
            if refinement == 1 {
                let row = grid.index([0, y, z]);
                values[range.clone()].copy_from_slice(&source[row + range.start..row + range.end]);
                continue;
            }
            let (from_y, weights_y) = taps(fine_y);
            let (from_z, weights_z) = taps(fine_z);
            let [_, plane, row] = grid.strides();
            let sums = &mut sums[..range.len() + 4];
            sums.fill(0.0);
            let corner = grid.index([0, 0, 0]) as isize + range.start as isize - 2;
            for (j, weight_y) in weights_y.iter().enumerate() {
                for (k, weight_z) in weights_z.iter().enumerate() {
                    let weight = weight_y * weight_z;
                    let start = corner + (from_y + j as isize) * plane as isize + (from_z + k as isize) * row as isize;
                    let start = start.max(0) as usize;
                    let length = sums.len();
                    sums.iter_mut().zip(&source[start..start + length]).for_each(|(sum, value)| *sum += weight * value);
                }
            }
            for (offset, pair) in values[2 * range.start..2 * range.end].chunks_exact_mut(2).enumerate() {
                let near: &[f32] = &sums[offset..offset + 5];
                // The point at 3/4 of the way from the cell before, and that at 1/4 of the way to the next one.
                let left = QUARTER[3] * near[0] + QUARTER[2] * near[1] + QUARTER[1] * near[2] + QUARTER[0] * near[3];
                let right = QUARTER[0] * near[1] + QUARTER[1] * near[2] + QUARTER[2] * near[3] + QUARTER[3] * near[4];
                pair[0] = left.clamp(0.0, 1.0);
                pair[1] = right.clamp(0.0, 1.0);
            }
        }
    });
    fine
}

/// The first of the four cells around a fine point, and their weights.
fn taps(fine: usize) -> (isize, [f32; 4]) {
    let cell = (fine / 2) as isize;
    if fine.is_multiple_of(2) {
        let [a, b, c, d] = QUARTER;
        (cell - 2, [d, c, b, a])
    } else {
        (cell - 1, QUARTER)
    }
}

/// Velocity at the centers of cells, and the deficit of heat.
fn point_data(flow: &Flow, active: &ActiveRows, deficit: &[f32]) -> Vec<PointData> {
    let grid = flow.grid;
    let [width, _, depth] = grid.size;
    let strides = grid.strides();
    let mut data = vec![[0.0; 4]; grid.cells()];
    data.par_chunks_mut(width * depth).enumerate().for_each(|(y, data)| {
        for (z, row) in grid.rows(y) {
            for x in active.row(y, z) {
                let index = row + x;
                let speed = |axis: usize| {
                    let mean = 0.5 * (flow.velocity[axis][index] + flow.velocity[axis][index + strides[axis]]);
                    if mean.abs() <= FASTEST { mean } else { 0.0 }
                };
                data[z * width + x] = [speed(0), speed(1), speed(2), deficit[index]];
            }
        }
    });
    data
}
