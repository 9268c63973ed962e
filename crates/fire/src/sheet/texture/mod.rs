//! The gas as a texture: one wrapped table whose every entry holds the four corners of a bilinear look-up.

mod fractal;
mod paper;

use std::sync::{Arc, OnceLock};

pub use paper::{PaperTexture, paper_texture};

use fearless_simd::{Level, Simd, dispatch};

use bansho_base::math::simd::{Lanes, Real, fetch, wrap_split};

pub(crate) use fractal::{FRACTAL, FractalLayers};
pub(crate) use paper::PaperLayer;

/// Columns of a table, along u.
pub(crate) const COLUMNS: usize = 256;
/// Rows of a table, along q.
pub(crate) const ROWS: usize = 512;
/// The coarsest level of a table.
pub(crate) const MAX_LEVEL: usize = 5;

/// A periodic texture of [`ROWS`] x [`COLUMNS`] texels.
///
/// An entry holds the texel, its right neighbour, the one above and the one above right, so that a look-up is one load.
#[derive(Clone, Debug)]
pub(crate) struct TextureTable {
    corners: Box<[[f32; 4]; ROWS * COLUMNS]>,
    /// Texels of ever coarser tables, made when they are needed.
    coarser: [OnceLock<Box<[f32]>>; MAX_LEVEL],
}

impl TextureTable {
    /// A table of the texels that `texel(row * COLUMNS + column)` gives.
    pub(crate) fn new(texels: &[f32]) -> Self {
        let at = |row: usize, column: usize| texels[(row % ROWS) * COLUMNS + column % COLUMNS];
        let corner = |i: usize| {
            let (row, column) = (i / COLUMNS, i % COLUMNS);
            [at(row, column), at(row, column + 1), at(row + 1, column), at(row + 1, column + 1)]
        };
        let corners: Vec<[f32; 4]> = (0..ROWS * COLUMNS).map(corner).collect();
        // The range above makes exactly the array's length.
        let corners = corners.into_boxed_slice().try_into().unwrap_or_else(|_| Box::new([[0.0; 4]; ROWS * COLUMNS]));
        Self { corners, coarser: Default::default() }
    }

    /// The texels themselves, row after row.
    pub(crate) fn texels(&self) -> Vec<f32> {
        self.corners.iter().map(|corner| corner[0]).collect()
    }

    /// Bilinear look-ups at wrapped places, in texels.
    #[inline(always)]
    pub(crate) fn sample<S: Simd>(&self, column: Lanes<S>, row: Lanes<S>) -> Lanes<S> {
        let (left, across) = wrap_split(column, COLUMNS as u32 - 1);
        let (below, up) = wrap_split(row, ROWS as u32 - 1);
        let index = below * COLUMNS as u32 + left;
        let [low_left, low_right, high_left, high_right] = fetch(column.simd, &self.corners, index);
        let low = (low_right - low_left).fma(across, low_left);
        let high = (high_right - high_left).fma(across, high_left);
        (high - low).fma(up, low)
    }

    /// A bilinear look-up at one wrapped place of at least -2^16 texels.
    fn bilinear(&self, column: f32, row: f32) -> f32 {
        let split = |coordinate: f32| (coordinate.floor() as i32 as usize, coordinate - coordinate.floor());
        let ((left, across), (below, up)) = (split(column), split(row));
        let [low_left, low_right, high_left, high_right] = self.corners[below % ROWS * COLUMNS + left % COLUMNS];
        let low = (low_right - low_left).fma(across, low_left);
        let high = (high_right - high_left).fma(across, high_left);
        (high - low).fma(up, low)
    }

    /// A table a factor 2 coarser for each whole `level`, up to [`MAX_LEVEL`], blended between, still of the same size: for small sheets.
    pub(crate) fn filtered(&self, level: f32) -> Self {
        let level = level.clamp(0.0, MAX_LEVEL as f32);
        let whole = (level as usize).min(MAX_LEVEL - 1);
        let mut texels = self.mip_level(whole).to_vec();
        filter(&mut texels, 1 << whole, level - whole as f32);
        Self::new(&texels)
    }

    /// The texels of a table `level` factors of 2 coarser, which are kept.
    fn mip_level(&self, level: usize) -> &[f32] {
        self.coarser[level].get_or_init(|| match level.checked_sub(1) {
            None => self.texels().into(),
            Some(finer) => {
                let mut texels = self.mip_level(finer).to_vec();
                filter(&mut texels, 1 << finer, 1.0);
                texels.into()
            }
        })
    }
}

/// Blends each texel by `amount` with the binomial mean (1 2 1)/4 of texels `spacing` apart, in both directions.
fn filter(texels: &mut [f32], spacing: usize, amount: f32) {
    let before = texels.to_vec();
    dispatch!(Level::new(), _simd => filter_rows(&before, texels, spacing, amount));
    let before = texels.to_vec();
    dispatch!(Level::new(), _simd => filter_columns(&before, texels, spacing, amount));
}

#[inline(always)]
fn filter_rows(before: &[f32], texels: &mut [f32], spacing: usize, amount: f32) {
    for (row, filter) in before.chunks_exact(COLUMNS).zip(texels.chunks_exact_mut(COLUMNS)) {
        let wrapped = [&row[COLUMNS - spacing..], row, &row[..spacing]].concat();
        blend(row, [&wrapped[2 * spacing..], &wrapped], amount, filter);
    }
}

#[inline(always)]
fn filter_columns(before: &[f32], texels: &mut [f32], spacing: usize, amount: f32) {
    let row = |row: usize| &before[row % ROWS * COLUMNS..][..COLUMNS];
    for (coordinate, filter) in texels.chunks_exact_mut(COLUMNS).enumerate() {
        blend(row(coordinate), [row(coordinate + spacing), row(coordinate + ROWS - spacing)], amount, filter);
    }
}

#[inline(always)]
fn blend(row: &[f32], [next, last]: [&[f32]; 2], amount: f32, filter: &mut [f32]) {
    let (row, next, last) = (&row[..COLUMNS], &next[..COLUMNS], &last[..COLUMNS]);
    for (i, value) in filter.iter_mut().enumerate() {
        let mean = 0.25 * (next[i] + last[i]) + 0.5 * row[i];
        *value = (mean - row[i]).fma(amount, row[i]);
    }
}

/// How texture coordinates (u, w) become columns and rows of the table at one moment.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct TextureLayer {
    /// Columns a unit of u, then of w, and where they begin.
    pub(crate) columns: [f32; 3],
    /// Rows a unit of w, and where they begin.
    pub(crate) rows: [f32; 2],
}

impl TextureLayer {
    /// Looks up the layer at sixteen places.
    #[inline(always)]
    fn sample<S: Simd>(&self, table: &TextureTable, u: Lanes<S>, w: Lanes<S>) -> Lanes<S> {
        let [across, slant, first] = self.columns;
        let column = u.fma(u.broadcast(across), w.fma(w.broadcast(slant), w.broadcast(first)));
        table.sample(column, w.fma(w.broadcast(self.rows[0]), w.broadcast(self.rows[1])))
    }
}

/// A texture at one moment: T0(u, w), eq. (2).
#[derive(Clone, Debug)]
pub(crate) enum Texture {
    /// The table as it is.
    Single(Arc<TextureTable>, TextureLayer),
    /// Two layers, both evenly distributed over [0, 1], mixed so that their mixture is again.
    Mixed(Arc<TextureTable>, [TextureLayer; 2]),
}

impl Texture {
    /// Texels to a unit of u and of w, of the finer layer.
    #[inline(always)]
    pub(crate) fn texels(&self) -> [f32; 2] {
        let (Self::Single(_, fine) | Self::Mixed(_, [_, fine])) = self;
        [fine.columns[0].abs(), fine.rows[0].abs()]
    }

    /// T0 at sixteen places; in [0, 1].
    #[inline(always)]
    pub(crate) fn sample<S: Simd>(&self, u: Lanes<S>, w: Lanes<S>) -> Lanes<S> {
        match self {
            Self::Single(table, layer) => layer.sample(table, u, w),
            Self::Mixed(table, [mip_level, fine]) => {
                fractal::mix_equalized(mip_level.sample(table, u, w), fine.sample(table, u, w))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use fearless_simd::SimdBase;

    use super::*;

    fn waves() -> TextureTable {
        let texels: Vec<f32> = (0..ROWS * COLUMNS)
            .map(|i| {
                let (row, column) = ((i / COLUMNS) as f32 / ROWS as f32, (i % COLUMNS) as f32 / COLUMNS as f32);
                0.25 * (bansho_base::math::approximations::sin_turns(3.0 * column)
                    + bansho_base::math::approximations::sin_turns(2.0 * row))
                    + 0.5
            })
            .collect();
        TextureTable::new(&texels)
    }

    #[test]
    fn look_ups_give_texels_and_halves_between_and_wrap() {
        let (table, texels) = (waves(), waves().texels());
        let value = bansho_base::dispatch_baseline!(simd => {
            let column = Lanes::from_fn(simd, |i| [3.0, 3.5, 259.0, -253.0, 255.5][i % 5]);
            table.sample(column, column.broadcast(7.0)).as_slice().to_vec()
        });
        let row = &texels[7 * COLUMNS..][..COLUMNS];
        let expected = [row[3], 0.5 * (row[3] + row[4]), row[3], row[3], 0.5 * (row[255] + row[0])];
        for (got, wanted) in value.iter().zip(expected) {
            assert!((got - wanted).abs() < 1e-6, "{got} {wanted}");
        }
    }

    #[test]
    fn filtering_keeps_the_mean_and_lessens_the_contrast() {
        let table = waves();
        let spread = |table: &TextureTable| {
            let texels = table.texels();
            let mean = texels.iter().sum::<f32>() / texels.len() as f32;
            (mean, texels.iter().map(|v| (v - mean) * (v - mean)).sum::<f32>())
        };
        let (mean, contrast) = spread(&table);
        let (smooth_mean, smooth_contrast) = spread(&table.filtered(5.5));
        assert!((mean - smooth_mean).abs() < 1e-3 && smooth_contrast < 0.7 * contrast, "{smooth_contrast} {contrast}");
        assert_eq!(table.filtered(0.0).texels(), table.texels());
    }
}
