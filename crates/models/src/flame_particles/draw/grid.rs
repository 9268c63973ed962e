//! A grid of cells over a part of the picture, several values a cell.

use bansho_base::image::Rect;
use rayon::prelude::*;

/// Cells around what is covered that interpolation looks at.
const MARGIN: i32 = 3;

/// Where the cells of a grid lie: cell (i, j) of a level has its middle at `(i + 1/2) 2^level` pixels of the whole picture, whatever
/// part of it is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Cells {
    pub(crate) level: u32,
    /// The first column and row of cells, counted from the picture's corner.
    pub(crate) first: [i32; 2],
    pub(crate) columns: usize,
    pub(crate) rows: usize,
}

impl Cells {
    /// The cells of a level that hold `rect` with a margin.
    pub(crate) fn around(rect: Rect, level: u32) -> Self {
        let low = [rect.x, rect.y].map(|value| (value >> level) as i32 - MARGIN);
        let high = [rect.right(), rect.bottom()].map(|value| (value >> level) as i32 + 1 + MARGIN);
        Self { level, first: low, columns: (high[0] - low[0]) as usize, rows: (high[1] - low[1]) as usize }
    }

    /// Side of a cell, pixels.
    pub(crate) fn size(&self) -> usize {
        1 << self.level
    }

    /// A place of the picture, counted in cells from the middle of the first.
    #[inline(always)]
    pub(crate) fn place(&self, pixel: [f32; 2]) -> [f32; 2] {
        let scale = 1.0 / self.size() as f32;
        [0, 1].map(|axis| pixel[axis].mul_add(scale, -0.5 - self.first[axis] as f32))
    }

    /// The cell before the middle of pixel `pixel` of an axis, and the pixel's phase between that cell and the next.
    #[inline(always)]
    pub(crate) fn before(&self, axis: usize, pixel: usize) -> (i32, usize) {
        // In halves of a pixel, so that the whole part is the cell whose middle comes before.
        let halves = 2 * pixel as i32 + 1 - (1 << self.level);
        let phase = halves & ((2 << self.level) - 1);
        ((halves >> (self.level + 1)) - self.first[axis], (phase >> 1) as usize)
    }

    /// Weights of the four cells around, for every phase: cubic interpolation (Catmull & Rom 1974).
    pub(crate) fn weights(&self) -> Vec<[f32; 4]> {
        let size = self.size();
        // A pixel of an even cell lies half a pixel off the middle of the cell before.
        let half = if size == 1 { 0.0 } else { 0.5 };
        (0..size).map(|phase| catmull_rom((phase as f32 + half) / size as f32)).collect()
    }

    /// The same for the slope, a pixel.
    pub(crate) fn slope_weights(&self) -> Vec<[f32; 4]> {
        let size = self.size();
        let half = if size == 1 { 0.0 } else { 0.5 };
        let slope = |phase: usize| catmull_rom_slope((phase as f32 + half) / size as f32);
        (0..size).map(|phase| slope(phase).map(|weight| weight / size as f32)).collect()
    }
}

/// Weights of the cells at -1, 0, 1 and 2 for the place `t` between 0 and 1.
pub(crate) fn catmull_rom(t: f32) -> [f32; 4] {
    let (t2, t3) = (t * t, t * t * t);
    [0.5 * (2.0 * t2 - t3 - t), 0.5 * (3.0 * t3 - 5.0 * t2 + 2.0), 0.5 * (4.0 * t2 - 3.0 * t3 + t), 0.5 * (t3 - t2)]
}

/// Derivatives of [`catmull_rom`] by `t`.
fn catmull_rom_slope(t: f32) -> [f32; 4] {
    let t2 = t * t;
    [
        0.5 * (4.0 * t - 3.0 * t2 - 1.0),
        0.5 * (9.0 * t2 - 10.0 * t),
        0.5 * (8.0 * t - 9.0 * t2 + 1.0),
        0.5 * (3.0 * t2 - 2.0 * t),
    ]
}

/// Values over cells: those of a cell lie side by side, so that one vector adds all of a sprite to it.
#[derive(Clone, Debug)]
pub(crate) struct Grid {
    pub(crate) cells: Cells,
    /// Values of a cell.
    pub(crate) depth: usize,
    pub(crate) values: Vec<f32>,
}

impl Grid {
    pub(crate) fn new(cells: Cells, depth: usize) -> Self {
        Self { cells, depth, values: vec![0.0; cells.columns * cells.rows * depth] }
    }

    /// Values from a row to the next.
    pub(crate) fn row_length(&self) -> usize {
        self.cells.columns * self.depth
    }

    /// The pixels of the picture that the cells cover.
    pub(crate) fn covered(&self) -> Rect {
        let side = |axis: usize, count: usize| {
            let pixel = |cell: i64| (cell.max(0) as usize) << self.cells.level;
            let first = i64::from(self.cells.first[axis]);
            (pixel(first), pixel(first + count as i64))
        };
        let ((x, right), (y, bottom)) = (side(0, self.cells.columns), side(1, self.cells.rows));
        Rect { x, y, width: right - x, height: bottom - y }
    }

    /// A row of cells; rows beyond the grid are those at its edge, which hold nothing.
    pub(crate) fn row(&self, row: i32) -> &[f32] {
        let row = row.clamp(0, self.cells.rows as i32 - 1) as usize;
        &self.values[row * self.row_length()..][..self.row_length()]
    }

    /// The first of the four columns around a place whose cell before is `cell`.
    #[inline(always)]
    pub(crate) fn first_of_four(&self, cell: i32) -> usize {
        (cell - 1).clamp(0, self.cells.columns as i32 - 4) as usize
    }

    /// Adds a grid of cells twice as large, interpolated.
    pub(crate) fn add_coarser(&mut self, coarser: &Self) {
        let (cells, depth) = (self.cells, self.depth);
        // Middles of fine cells lie a quarter before and behind those of coarse ones.
        let quarters = [catmull_rom(0.75), catmull_rom(0.25)];
        let row_length = self.row_length();
        self.values.par_chunks_mut(row_length).enumerate().for_each(|(row, values)| {
            let fine = cells.first[1] + row as i32;
            let first = (fine - 1).div_euclid(2) - coarser.cells.first[1];
            let rows = [-1, 0, 1, 2].map(|k| coarser.row(first + k));
            let mut column = vec![0.0; coarser.row_length()];
            weigh(&mut column, rows, &quarters[fine.rem_euclid(2) as usize]);
            for (index, sums) in values.chunks_exact_mut(depth).enumerate() {
                let cell = cells.first[0] + index as i32;
                let first = coarser.first_of_four((cell - 1).div_euclid(2) - coarser.cells.first[0]);
                let four = [0, 1, 2, 3].map(|k| &column[(first + k) * depth..][..depth]);
                let weights = &quarters[cell.rem_euclid(2) as usize];
                for (i, sum) in sums.iter_mut().enumerate() {
                    *sum += (0..4).map(|k| weights[k] * four[k][i]).sum::<f32>();
                }
            }
        });
    }
}

/// `out = sum of weights times rows`.
#[inline(always)]
pub(crate) fn weigh(out: &mut [f32], rows: [&[f32]; 4], weights: &[f32; 4]) {
    let count = out.len();
    let (a, b, c, d) = (&rows[0][..count], &rows[1][..count], &rows[2][..count], &rows[3][..count]);
    for i in 0..count {
        let sum = weights[0].mul_add(a[i], weights[1] * b[i]);
        out[i] = weights[3].mul_add(d[i], weights[2].mul_add(c[i], sum));
    }
}
