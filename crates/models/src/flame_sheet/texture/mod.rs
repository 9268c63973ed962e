//! The gas as a texture: one wrapped table whose every entry holds the four corners of a bilinear look-up.

mod fractal;
mod paper;

use std::sync::Arc;

pub use paper::{PaperTexture, paper_texture};

use fearless_simd::Simd;

use super::lanes::{Lanes, Real, fetch, wrap_split};

pub(crate) use fractal::{FRACTAL, FractalLayers};
pub(crate) use paper::PaperLayer;

/// Columns of a table, along u.
pub(crate) const COLUMNS: usize = 256;
/// Rows of a table, along q.
pub(crate) const ROWS: usize = 512;

/// A periodic texture of [`ROWS`] x [`COLUMNS`] texels.
///
/// An entry holds the texel, its right neighbour, the one above and the one above right, so that a look-up is one load.
#[derive(Clone, Debug)]
pub(crate) struct TextureTable {
    corners: Box<[[f32; 4]; ROWS * COLUMNS]>,
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
        Self { corners }
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
        let low = (low_right - low_left).fused(across, low_left);
        let high = (high_right - high_left).fused(across, high_left);
        (high - low).fused(up, low)
    }

    /// A bilinear look-up at one wrapped place of at least -2^16 texels.
    fn bilinear(&self, column: f32, row: f32) -> f32 {
        let split = |place: f32| (place.floor() as i32 as usize, place - place.floor());
        let ((left, across), (below, up)) = (split(column), split(row));
        let [low_left, low_right, high_left, high_right] = self.corners[below % ROWS * COLUMNS + left % COLUMNS];
        let low = (low_right - low_left).mul_add(across, low_left);
        let high = (high_right - high_left).mul_add(across, high_left);
        (high - low).mul_add(up, low)
    }

    /// A table a factor 2 coarser for each whole `level`, blended between, still of the same size: for small sheets.
    pub(crate) fn filtered(&self, level: f32) -> Self {
        let mut texels = self.texels();
        let (whole, part) = (level.floor().max(0.0), level - level.floor().max(0.0));
        for step in 0..whole as usize {
            smooth(&mut texels, 1 << step, 1.0);
        }
        smooth(&mut texels, 1 << whole as usize, part);
        Self::new(&texels)
    }
}

/// Blends each texel by `amount` with the binomial mean (1 2 1)/4 of texels `spacing` apart, in both directions.
fn smooth(texels: &mut Vec<f32>, spacing: usize, amount: f32) {
    for (count, stride) in [(COLUMNS, 1), (ROWS, COLUMNS)] {
        let blurred = |i: usize| {
            let place = (i / stride) % count;
            let base = i - place * stride;
            let at = |p: usize| texels[base + (p % count) * stride];
            let mean = 0.25 * (at(place + spacing % count) + at(place + count - spacing % count)) + 0.5 * texels[i];
            (mean - texels[i]).mul_add(amount, texels[i])
        };
        *texels = (0..texels.len()).map(blurred).collect();
    }
}

/// How texture coordinates (u, w) become columns and rows of the table at one moment.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Layer {
    /// Columns a unit of u, then of w, and where they begin.
    pub(crate) columns: [f32; 3],
    /// Rows a unit of w, and where they begin.
    pub(crate) rows: [f32; 2],
}

impl Layer {
    /// Looks up the layer at sixteen places.
    #[inline(always)]
    fn sample<S: Simd>(&self, table: &TextureTable, u: Lanes<S>, w: Lanes<S>) -> Lanes<S> {
        let [across, slant, first] = self.columns;
        let column = u.fused(u.like(across), w.fused(w.like(slant), w.like(first)));
        table.sample(column, w.fused(w.like(self.rows[0]), w.like(self.rows[1])))
    }
}

/// A texture at one moment: T0(u, w), eq. (2).
#[derive(Clone, Debug)]
pub(crate) enum Texture {
    /// The table as it is.
    Single(Arc<TextureTable>, Layer),
    /// Two layers, both evenly distributed over [0, 1], mixed so that their mixture is again.
    Mixed(Arc<TextureTable>, [Layer; 2]),
}

impl Texture {
    /// T0 at sixteen places; in [0, 1].
    #[inline(always)]
    pub(crate) fn sample<S: Simd>(&self, u: Lanes<S>, w: Lanes<S>) -> Lanes<S> {
        match self {
            Self::Single(table, layer) => layer.sample(table, u, w),
            Self::Mixed(table, [coarse, fine]) => {
                fractal::mix_evenly(coarse.sample(table, u, w), fine.sample(table, u, w))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use fearless_simd::SimdBase;

    use super::*;
    use crate::flame_sheet::lanes::plain;

    fn waves() -> TextureTable {
        let texels: Vec<f32> = (0..ROWS * COLUMNS)
            .map(|i| {
                let (row, column) = ((i / COLUMNS) as f32 / ROWS as f32, (i % COLUMNS) as f32 / COLUMNS as f32);
                0.25 * (bansho_base::math::lanes::sin_turns(3.0 * column)
                    + bansho_base::math::lanes::sin_turns(2.0 * row))
                    + 0.5
            })
            .collect();
        TextureTable::new(&texels)
    }

    #[test]
    fn look_ups_give_texels_and_halves_between_and_wrap() {
        let (table, texels) = (waves(), waves().texels());
        let value = plain!(simd => {
            let column = Lanes::from_fn(simd, |i| [3.0, 3.5, 259.0, -253.0, 255.5][i % 5]);
            table.sample(column, column.like(7.0)).as_slice().to_vec()
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
