//! A uniform grid of square cells, and traversal of the cells along a segment.

use std::ops::Range;

use bansho_base::math::DVec2;

/// Cells in row-major order from the north-west.
#[derive(Clone, Debug)]
pub(crate) struct CellGrid {
    low: DVec2,
    cell: f64,
    size: [usize; 2],
}

impl CellGrid {
    /// Cells of side `cell` over the rectangle from `low` to `high`, or larger ones if there would be more than `max_cells` along
    /// a side.
    pub(crate) fn new(low: DVec2, high: DVec2, cell: f64, max_cells: usize) -> Self {
        let extent = (high - low).max_element();
        let cell = cell.max(extent / max_cells as f64).max(f64::MIN_POSITIVE);
        let size = ((high - low) / cell).to_array().map(|cells| (cells.floor() as usize + 1).min(max_cells + 1));
        Self { low, cell, size }
    }

    pub(crate) fn count(&self) -> usize {
        self.size[0] * self.size[1]
    }

    /// The cell of `point`, clamped to the grid.
    pub(super) fn cell_of(&self, point: DVec2) -> usize {
        self.index_along(1, point.y) * self.size[0] + self.index_along(0, point.x)
    }

    /// Center of a cell.
    pub(super) fn center(&self, cell: usize) -> DVec2 {
        let [column, row] = [cell % self.size[0], cell / self.size[0]].map(|index| index as f64 + 0.5);
        self.low + DVec2::new(column, row) * self.cell
    }

    /// Side of a cell.
    pub(super) fn side(&self) -> f64 {
        self.cell
    }

    /// Distance from the center of a cell to its corners.
    pub(super) fn half_diagonal(&self) -> f64 {
        self.cell * std::f64::consts::FRAC_1_SQRT_2
    }

    /// Column (`axis` 0) or row (1) at a coordinate.
    fn index_along(&self, axis: usize, coordinate: f64) -> usize {
        // Casts saturate, so points outside and NaN map to a border cell.
        (((coordinate - self.low[axis]) / self.cell) as usize).min(self.size[axis] - 1)
    }

    /// Visits every cell that the segment from `a` to `b` intersects, and few others. Both ends must be inside the
    /// grid.
    pub(crate) fn for_each_traversed(&self, a: DVec2, b: DVec2, mut visit: impl FnMut(usize)) {
        self.for_each_run(a, b, 0.0, |run| run.for_each(&mut visit));
    }

    /// Visits, row by row, the runs of cells within `margin` of the segment from `a` to `b`, and few others. Both ends
    /// must be inside the grid.
    pub(super) fn for_each_run(&self, a: DVec2, b: DVec2, margin: f64, mut visit: impl FnMut(Range<usize>)) {
        let (top, bottom) = if a.y <= b.y { (a, b) } else { (b, a) };
        for row in self.index_along(1, top.y - margin)..=self.index_along(1, bottom.y + margin) {
            let slab = self.low.y + row as f64 * self.cell;
            let ends = if bottom.y > top.y {
                [slab - margin, slab + self.cell + margin].map(|y| x_on_segment(top, bottom, y))
            } else {
                [top.x, bottom.x]
            };
            let left = self.index_along(0, ends[0].min(ends[1]) - margin);
            let right = self.index_along(0, ends[0].max(ends[1]) + margin);
            visit(row * self.size[0] + left..row * self.size[0] + right + 1);
        }
    }
}

/// The x at a y of the segment from `top` down to `bottom`; beyond its ends that of the end.
fn x_on_segment(top: DVec2, bottom: DVec2, y: f64) -> f64 {
    let fraction = ((y - top.y) / (bottom.y - top.y)).clamp(0.0, 1.0);
    top.x + (bottom.x - top.x) * fraction
}

#[cfg(test)]
mod tests {
    use super::*;

    fn passed(a: [f64; 2], b: [f64; 2], margin: f64) -> Vec<usize> {
        let grid = CellGrid::new(DVec2::ZERO, DVec2::splat(3.9), 1.0, 100);
        let mut cells = Vec::new();
        grid.for_each_run(a.into(), b.into(), margin, |run| cells.extend(run));
        cells.sort_unstable();
        cells
    }

    #[test]
    fn a_segment_passes_the_cells_under_it() {
        assert_eq!(passed([0.5, 0.5], [2.5, 0.5], 0.0), [0, 1, 2]);
        assert_eq!(passed([0.5, 2.5], [0.5, 0.5], 0.0), [0, 4, 8]);
        // Through (1, 0.75) and (2, 1.25) and (3, 1.75): the cells (0, 0), (1, 0), (1, 1), (2, 1).
        assert_eq!(passed([0.5, 0.5], [2.5, 1.5], 0.0), [0, 1, 5, 6]);
        assert_eq!(passed([1.5, 1.5], [1.5, 1.5], 1.0), [0, 1, 2, 4, 5, 6, 8, 9, 10]);
    }

    #[test]
    fn cells_grow_rather_than_become_too_many() {
        let grid = CellGrid::new(DVec2::ZERO, DVec2::new(1000.0, 10.0), 1e-9, 100);
        assert!(grid.count() <= 101 * 2);
        assert_eq!(grid.cell_of(DVec2::new(-5.0, f64::NAN)), 0);
        assert_eq!(grid.cell_of(DVec2::new(1e9, 0.0)), grid.size[0] - 1);
    }
}
