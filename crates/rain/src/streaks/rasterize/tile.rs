//! The tile buffer into which streaks are composited.

use bansho_base::{image::Rect, math::MulAdd, phenomenon::strip::GrayPlanes};
use fearless_simd::{Simd, f32x8, prelude::*};

/// Rows of a tile: one SIMD vector.
pub(crate) const TILE_ROWS: usize = 8;
/// Columns of a tile: its pixels and their depths fit into the L1 cache.
pub(crate) const TILE_COLUMNS: usize = 128;

/// One `f32` for each of the eight pixels of a column.
pub(crate) type TileRows = [f32; TILE_ROWS];

/// A tile of the picture, stored column by column: the eight pixels of a column are adjacent, so that one instruction
/// composites a streak over all of them. Most streaks are steep.
pub(crate) struct TileBuffer {
    /// Its first column and row in the picture.
    origin: [usize; 2],
    columns: [PixelColumn; TILE_COLUMNS],
    /// Depth of the plate by column, m; unset without a plate.
    plate_depth: [TileRows; TILE_COLUMNS],
    has_plate: bool,
}

/// Eight pixels of a column: red, green and blue of the radiance, transmittance, and the depth of the nearest sample,
/// m.
type PixelColumn = [TileRows; 5];
const TRANSMITTANCE: usize = 3;
const DEPTH: usize = 4;

/// Light and depth of a streak.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct StreakShading {
    /// Radiance at full opacity, ACEScg, cd/m^2.
    pub(crate) light: [f32; 3],
    /// m.
    pub(crate) depth: f32,
}

impl StreakShading {
    /// Without light.
    pub(crate) fn new(depth: f32) -> Self {
        Self { light: [0.0; 3], depth }
    }

    /// Adds radiance at full opacity, ACEScg, cd/m^2.
    pub(crate) fn add_light(&mut self, light: [f32; 3]) {
        (0..3).for_each(|c| self.light[c] += light[c]);
    }
}

impl Default for TileBuffer {
    fn default() -> Self {
        Self {
            origin: [0; 2],
            columns: [[[0.0; TILE_ROWS]; 5]; TILE_COLUMNS],
            plate_depth: [[0.0; TILE_ROWS]; TILE_COLUMNS],
            has_plate: false,
        }
    }
}

impl TileBuffer {
    /// Loads the pixels of `rect` from the planes of `strip`; the others are unspecified.
    #[inline(always)]
    pub(crate) fn load<S: Simd>(&mut self, simd: S, origin: [usize; 2], rect: Rect, strip: Rect, planes: &GrayPlanes) {
        self.origin = origin;
        self.has_plate = !planes.plate_depth.is_empty();
        let [red, green, blue] = &planes.radiance;
        for block in self.blocks(rect, strip) {
            for (k, plane) in [red, green, blue, &planes.transmittance, &planes.depth].into_iter().enumerate() {
                block.load(simd, plane, &mut self.columns, |column| &mut column[k]);
            }
            if self.has_plate {
                block.load(simd, planes.plate_depth, &mut self.plate_depth, |column| column);
            }
        }
    }

    /// Stores the pixels of `rect` into the planes of `strip`.
    #[inline(always)]
    pub(crate) fn store<S: Simd>(&self, simd: S, rect: Rect, strip: Rect, planes: &mut GrayPlanes) {
        let [red, green, blue] = &mut planes.radiance;
        let mut planes = [&mut **red, &mut **green, &mut **blue, &mut *planes.transmittance, &mut *planes.depth];
        for block in self.blocks(rect, strip) {
            for (k, plane) in planes.iter_mut().enumerate() {
                block.store(simd, &self.columns, |column| &column[k], plane);
            }
        }
    }

    /// The blocks of `rect`, of up to eight columns each.
    #[inline(always)]
    fn blocks(&self, rect: Rect, strip: Rect) -> impl Iterator<Item = Block> + use<> {
        let [x, y] = self.origin;
        (rect.x..rect.right()).step_by(TILE_ROWS).map(move |column| Block {
            column: column - x,
            row: rect.y - y,
            size: [TILE_ROWS.min(rect.right() - column), rect.height],
            start: (rect.y - strip.y) * strip.width + column - strip.x,
            stride: strip.width,
        })
    }

    /// Its first column and row in the picture.
    pub(crate) fn origin(&self) -> [usize; 2] {
        self.origin
    }

    /// Clears the opacities of a column's pixels at which the plate is in front of `depth`.
    #[inline(always)]
    pub(crate) fn mask_by_plate(&self, column: usize, depth: f32, opacities: &mut TileRows) {
        if !self.has_plate {
            return;
        }
        let Some(plate) = self.plate_depth.get(column) else { return };
        for row in 0..TILE_ROWS {
            opacities[row] = if plate[row] <= depth { 0.0 } else { opacities[row] };
        }
    }

    /// Composites a column of opacities under the pixels of the tile, `L += T a l; T -= T a`.
    #[inline(always)]
    pub(crate) fn composite_under(&mut self, column: usize, opacities: &TileRows, shading: &StreakShading) {
        let Some(pixels) = self.columns.get_mut(column) else { return };
        let mut blocked = [0.0; TILE_ROWS];
        for row in 0..TILE_ROWS {
            blocked[row] = pixels[TRANSMITTANCE][row] * opacities[row];
        }
        for c in 0..3 {
            for row in 0..TILE_ROWS {
                pixels[c][row] = blocked[row].fma(shading.light[c], pixels[c][row]);
            }
        }
        for row in 0..TILE_ROWS {
            pixels[TRANSMITTANCE][row] -= blocked[row];
            // A streak touches few of the eight pixels; those without opacity keep their depth.
            let depth = if opacities[row] > 0.0 { shading.depth } else { f32::INFINITY };
            pixels[DEPTH][row] = if depth < pixels[DEPTH][row] { depth } else { pixels[DEPTH][row] };
        }
    }
}

/// A block of up to eight columns and rows, in the tile and in a strip's planes.
#[derive(Clone, Copy)]
struct Block {
    column: usize,
    row: usize,
    size: [usize; 2],
    /// Index of its first pixel in a plane.
    start: usize,
    /// Pixels from one row of a plane to the next.
    stride: usize,
}

impl Block {
    /// Loads it from a plane.
    #[inline(always)]
    fn load<S: Simd, C>(&self, simd: S, plane: &[f32], columns: &mut [C], rows: impl Fn(&mut C) -> &mut TileRows) {
        if self.size == [TILE_ROWS; 2] {
            return self.load_whole(simd, plane, columns, rows);
        }
        let [width, height] = self.size;
        let mut square = [[0.0; TILE_ROWS]; TILE_ROWS];
        for y in 0..height {
            copy(&plane[self.start + y * self.stride..][..width], &mut square[self.row + y][..width]);
        }
        transpose(simd, &mut square);
        for x in 0..width {
            *rows(&mut columns[self.column + x]) = square[x];
        }
    }

    /// [`load`](Self::load) of eight columns and rows, as nearly all blocks have, by loops whose lengths are known when it is compiled.
    #[inline(always)]
    fn load_whole<S: Simd, C>(
        &self,
        simd: S,
        plane: &[f32],
        columns: &mut [C],
        rows: impl Fn(&mut C) -> &mut TileRows,
    ) {
        let mut square = [[0.0; TILE_ROWS]; TILE_ROWS];
        for y in 0..TILE_ROWS {
            square[y].copy_from_slice(&plane[self.start + y * self.stride..][..TILE_ROWS]);
        }
        transpose(simd, &mut square);
        let columns = &mut columns[self.column..][..TILE_ROWS];
        for x in 0..TILE_ROWS {
            *rows(&mut columns[x]) = square[x];
        }
    }

    /// Stores it into a plane.
    #[inline(always)]
    fn store<S: Simd, C>(&self, simd: S, columns: &[C], rows: impl Fn(&C) -> &TileRows, plane: &mut [f32]) {
        if self.size == [TILE_ROWS; 2] {
            return self.store_whole(simd, columns, rows, plane);
        }
        let [width, height] = self.size;
        let mut square = [[0.0; TILE_ROWS]; TILE_ROWS];
        for x in 0..width {
            square[x] = *rows(&columns[self.column + x]);
        }
        transpose(simd, &mut square);
        for y in 0..height {
            copy(&square[self.row + y][..width], &mut plane[self.start + y * self.stride..][..width]);
        }
    }

    /// [`store`](Self::store) of eight columns and rows.
    #[inline(always)]
    fn store_whole<S: Simd, C>(&self, simd: S, columns: &[C], rows: impl Fn(&C) -> &TileRows, plane: &mut [f32]) {
        let columns = &columns[self.column..][..TILE_ROWS];
        let mut square = [[0.0; TILE_ROWS]; TILE_ROWS];
        for x in 0..TILE_ROWS {
            square[x] = *rows(&columns[x]);
        }
        transpose(simd, &mut square);
        for y in 0..TILE_ROWS {
            plane[self.start + y * self.stride..][..TILE_ROWS].copy_from_slice(&square[y]);
        }
    }
}

/// Copies up to eight numbers: nearly always eight, which is one instruction.
#[inline(always)]
fn copy(from: &[f32], to: &mut [f32]) {
    match (<&TileRows>::try_from(from), <&mut TileRows>::try_from(&mut *to)) {
        (Ok(from), Ok(to)) => *to = *from,
        _ => to.copy_from_slice(from),
    }
}

/// Transposes an 8 x 8 block by three perfect shuffles.
#[inline(always)]
fn transpose<S: Simd>(simd: S, square: &mut [TileRows; TILE_ROWS]) {
    const HALF: usize = TILE_ROWS / 2;
    let mut vectors = [f32x8::splat(simd, 0.0); TILE_ROWS];
    for y in 0..TILE_ROWS {
        vectors[y] = f32x8::from_slice(simd, &square[y]);
    }
    for _ in 0..TILE_ROWS.ilog2() {
        let before = vectors;
        for i in 0..HALF {
            vectors[2 * i] = before[i].zip_low(before[i + HALF]);
            vectors[2 * i + 1] = before[i].zip_high(before[i + HALF]);
        }
    }
    for x in 0..TILE_ROWS {
        vectors[x].store_slice(&mut square[x]);
    }
}
