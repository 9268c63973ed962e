//! The blocks of the grid in which gas is seen, so that rays skip all others.

use bansho_base::{
    host::parallel::prelude::*,
    math::{DVec3, Vec3},
};
use bansho_fluid::{ActiveRows, Grid};

/// Side of a block, cells.
pub(crate) const BLOCK: usize = 2;
/// Cells that a lookup reaches beyond the one that it is in.
const REACH: f32 = 2.0;
/// Longest way of gas that moves during the exposure after which it is still looked for, cells.
const LONGEST_WAY: f32 = 12.0;

/// What is seen in a block.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum BlockContents {
    #[default]
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

/// What is seen in each block.
pub(crate) struct Blocks {
    contents: Vec<BlockContents>,
    /// Number of blocks along x, y and z.
    size: [usize; 3],
    /// Corners of the blocks that are seen, cells; `None` if none is.
    pub(crate) seen_bounds: Option<[[usize; 3]; 2]>,
}

/// A block with gas in it.
struct FilledBlock {
    block: [usize; 3],
    contents: BlockContents,
    /// Blocks around it that its gas is seen from.
    reach: usize,
}

impl Blocks {
    /// The blocks of a grid whose gas is `gas` (mixture fraction and deficit, with ghost cells), which moves along `velocity` (at centers of cells, m/s) for at most
    /// `seconds` from its state on.
    pub(crate) fn new(
        grid: &Grid,
        active: &ActiveRows,
        gas: &[[f32; 2]],
        velocity: &[[f32; 4]],
        seconds: f32,
        seen: SeenMixtures,
    ) -> Self {
        let size = grid.size.map(|cells| cells.div_ceil(BLOCK));
        let mut blocks =
            Self { contents: vec![BlockContents::Nothing; size.iter().product()], size, seen_bounds: None };
        let cells_per_speed = seconds / grid.spacing as f32;
        let filled: Vec<FilledBlock> = (0..size[1] * size[2])
            .into_par_iter()
            .flat_map_iter(|row| filled_blocks(grid, active, gas, velocity, cells_per_speed, seen, row))
            .collect();
        filled.iter().for_each(|filled| blocks.fill(filled));
        blocks
    }

    /// Marks the blocks around one with gas.
    fn fill(&mut self, filled: &FilledBlock) {
        let FilledBlock { block, contents, reach } = *filled;
        let low = block.map(|place| place.saturating_sub(reach));
        let high: [usize; 3] = std::array::from_fn(|axis| (block[axis] + reach + 1).min(self.size[axis]));
        for y in low[1]..high[1] {
            for z in low[2]..high[2] {
                let row = (y * self.size[2] + z) * self.size[0];
                for seen in &mut self.contents[row + low[0]..row + high[0]] {
                    *seen = contents.max(*seen);
                }
            }
        }
        let [low, high] = [low, high].map(|corner| corner.map(|place| place * BLOCK));
        self.seen_bounds = Some(self.seen_bounds.map_or([low, high], |[first, last]| {
            [
                std::array::from_fn(|axis| first[axis].min(low[axis])),
                std::array::from_fn(|axis| last[axis].max(high[axis])),
            ]
        }));
    }

    /// What is seen at a point in cells, from the center of the first one.
    #[inline(always)]
    pub(crate) fn at(&self, point: Vec3) -> BlockContents {
        let place = (point + 0.5) * (1.0 / BLOCK as f32);
        let [width, height, depth] = self.size;
        // Places before the first block are not in any.
        if place.min_element() < 0.0 {
            return BlockContents::Nothing;
        }
        let [x, y, z] = [place.x as usize, place.y as usize, place.z as usize];
        if x >= width || y >= height || z >= depth {
            return BlockContents::Nothing;
        }
        self.contents[(y * depth + z) * width + x]
    }

    /// Corners of what is seen, in cells from the center of the first one.
    pub(crate) fn seen_corners(&self) -> Option<[DVec3; 2]> {
        self.seen_bounds.map(|corners| corners.map(|corner| DVec3::from(corner.map(|cell| cell as f64 - 0.5))))
    }
}

/// The blocks of a row along x in which there is gas. A block counts the cells beside its far sides too, so that a sheet between two blocks is in one of them.
fn filled_blocks(
    grid: &Grid,
    active: &ActiveRows,
    gas: &[[f32; 2]],
    velocity: &[[f32; 4]],
    cells_per_speed: f32,
    seen: SeenMixtures,
    row: usize,
) -> Vec<FilledBlock> {
    let [width, height, depth] = grid.size;
    let columns = width.div_ceil(BLOCK);
    let [layer, row] = [row / depth.div_ceil(BLOCK), row % depth.div_ceil(BLOCK)];
    let cells = || {
        let layers = layer * BLOCK..((layer + 1) * BLOCK + 1).min(height);
        layers.flat_map(move |y| (row * BLOCK..((row + 1) * BLOCK + 1).min(depth)).map(move |z| (y, z)))
    };
    if cells().all(|(y, z)| active.row(y, z).is_empty()) {
        return Vec::new();
    }
    let mut ranges = vec![[f32::INFINITY, 0.0_f32]; columns];
    let mut speeds_squared = vec![0.0_f32; columns];
    for (y, z) in cells() {
        let values = &gas[grid.index([0, y, z])..][..width];
        let speeds = &velocity[(y * depth + z) * width..][..width];
        for (column, (range, speed_squared)) in ranges.iter_mut().zip(&mut speeds_squared).enumerate() {
            for x in column * BLOCK..((column + 1) * BLOCK + 1).min(width) {
                *range = [range[0].min(values[x][0]), range[1].max(values[x][0])];
                let [u, v, w, _] = speeds[x];
                *speed_squared = speed_squared.max(u * u + v * v + w * w);
            }
        }
    }
    let mut filled = Vec::new();
    for (column, range) in ranges.into_iter().enumerate() {
        let contents = seen.contents(range);
        let way = (speeds_squared[column].sqrt() * cells_per_speed).min(LONGEST_WAY);
        let reach = ((REACH + way) / BLOCK as f32).ceil() as usize;
        if contents > BlockContents::Nothing {
            // Smoke is drawn where it is at the time of the state.
            let reach = if contents == BlockContents::Sheet { reach } else { 1 };
            filled.push(FilledBlock { block: [column, layer, row], contents, reach });
        }
    }
    filled
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gas_is_seen_as_far_as_lookups_and_motion_reach() {
        let grid = Grid::new([32, 24, 24], 0.1, DVec3::ZERO);
        let active = ActiveRows::all(&grid);
        let seen = SeenMixtures { smoke: 0.001, sheet: 0.1, last: 0.3 };
        let mut gas = vec![[0.0; 2]; grid.len()];
        let mut velocity = vec![[0.0; 4]; grid.cells()];
        let blocks = |gas: &[[f32; 2]], velocity: &[[f32; 4]]| Blocks::new(&grid, &active, gas, velocity, 0.01, seen);
        assert!(blocks(&gas, &velocity).seen_corners().is_none());
        gas[grid.index([16, 12, 12])][0] = 0.2;
        let at_rest = blocks(&gas, &velocity);
        let center = Vec3::new(16.0, 12.0, 12.0);
        for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
            for side in [-1.0, 1.0] {
                assert_eq!(at_rest.at(center + 1.99 * side * axis), BlockContents::Sheet);
                assert_eq!(at_rest.at(center + 7.0 * side * axis), BlockContents::Nothing);
            }
        }
        // 4 cells in 0.01 s.
        velocity.fill([0.0, 40.0, 0.0, 0.0]);
        let moving = blocks(&gas, &velocity);
        assert_eq!(moving.at(center + 5.9 * Vec3::Y), BlockContents::Sheet);
        assert_eq!(moving.at(Vec3::splat(-1.0)), BlockContents::Nothing);
        // Fuel alone does not burn; what burns is where it meets air.
        gas.fill([0.9, 0.0]);
        assert!(blocks(&gas, &velocity).seen_corners().is_none());
        gas[grid.index([16, 12, 12])][0] = 0.0;
        assert_eq!(blocks(&gas, &velocity).at(center), BlockContents::Sheet);
    }
}
