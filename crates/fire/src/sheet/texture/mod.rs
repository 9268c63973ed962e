//! The gas as a texture: a periodic table whose entries hold the four corners of a bilinear lookup.

mod fractal;
mod paper;
mod periodic;
mod picture;

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError, Weak},
};

use bansho_base::math::{
    self,
    simd::{Lanes, Real, gather, wrap_split},
};
use fearless_simd::{Simd, dispatch};
use fractal::FRACTAL;
pub(crate) use fractal::{FractalLayers, LayerMapping, fractal_noise};
pub(crate) use paper::{PaperSum, paper_layer};
pub use paper::{PaperTexture, paper_texture};
pub(crate) use periodic::PeriodicLayer;
pub(crate) use picture::picture_texels;

/// Columns of a table, along u.
pub(crate) const COLUMNS: usize = 256;
/// Rows of a table, along q.
pub(crate) const ROWS: usize = 512;
/// The coarsest filter level.
pub(crate) const MAX_LEVEL: usize = 5;

/// A periodic texture of [`ROWS`] x [`COLUMNS`] texels.
///
/// An entry holds the texel and its neighbors to the right, above, and above right, so that a bilinear lookup is one load.
#[derive(Clone, Debug)]
pub(crate) struct TextureTable {
    corners: Box<[[f32; 4]; ROWS * COLUMNS]>,
    /// Texels of successively coarser filter levels, computed on demand.
    coarser: [OnceLock<Box<[f32]>>; MAX_LEVEL],
}

impl TextureTable {
    /// A table of the texels `texels[row * COLUMNS + column]`.
    pub(crate) fn new(texels: &[f32]) -> Self {
        let mut corners = Vec::with_capacity(ROWS * COLUMNS);
        for row in 0..ROWS {
            let (lower, upper) = (wrapped_row(texels, row), wrapped_row(texels, row + 1));
            for column in 0..COLUMNS {
                let next = (column + 1) % COLUMNS;
                corners.push([lower[column], lower[next], upper[column], upper[next]]);
            }
        }
        // The conversion never fails: the range has exactly the array's length.
        let corners = corners.into_boxed_slice().try_into().unwrap_or_else(|_| Box::new([[0.0; 4]; ROWS * COLUMNS]));
        Self { corners, coarser: Default::default() }
    }

    /// The texels, row by row.
    pub(crate) fn texels(&self) -> Vec<f32> {
        self.corners.iter().map(|corner| corner[0]).collect()
    }

    /// Bilinear lookups at wrapped coordinates, in texels.
    #[inline(always)]
    pub(crate) fn sample<S: Simd>(&self, column: Lanes<S>, row: Lanes<S>) -> Lanes<S> {
        let (left, across) = wrap_split(column, COLUMNS as u32 - 1);
        let (below, up) = wrap_split(row, ROWS as u32 - 1);
        let index = below * COLUMNS as u32 + left;
        let [low_left, low_right, high_left, high_right] = gather(column.simd, &self.corners, index);
        let low = (low_right - low_left).fma(across, low_left);
        let high = (high_right - high_left).fma(across, high_left);
        (high - low).fma(up, low)
    }

    /// One bilinear lookup at wrapped coordinates of at least -2^16 texels.
    pub(crate) fn bilinear(&self, column: f32, row: f32) -> f32 {
        // The sides are powers of two: also a negative column or row, which becomes a large number, wraps.
        let (left, below) = (column.floor() as i32 as usize, row.floor() as i32 as usize);
        let (across, up) = (column - column.floor(), row - row.floor());
        let [low_left, low_right, high_left, high_right] = self.corners[below % ROWS * COLUMNS + left % COLUMNS];
        let low = (low_right - low_left).fma(across, low_left);
        let high = (high_right - high_left).fma(across, high_left);
        (high - low).fma(up, low)
    }

    /// The table low-pass filtered by a factor of 2 per whole `level`, up to [`MAX_LEVEL`], blended between levels (trilinear); its
    /// size is unchanged. For small sheets.
    pub(crate) fn filtered(&self, level: f32) -> Self {
        let level = level.clamp(0.0, MAX_LEVEL as f32);
        let whole = (level as usize).min(MAX_LEVEL - 1);
        let mut texels = self.mip_level(whole).to_vec();
        filter(&mut texels, 1 << whole, level - whole as f32);
        Self::new(&texels)
    }

    /// The texels filtered by `level` factors of 2, which are cached.
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

/// Blends each texel by `amount` with the binomial mean (1 2 1)/4 of texels `spacing` apart, along rows and columns.
fn filter(texels: &mut [f32], spacing: usize, amount: f32) {
    let before = texels.to_vec();
    dispatch!(bansho_base::math::simd::level(), _simd => filter_rows(&before, texels, spacing, amount));
    let before = texels.to_vec();
    dispatch!(bansho_base::math::simd::level(), _simd => filter_columns(&before, texels, spacing, amount));
}

#[inline(always)]
fn filter_rows(before: &[f32], texels: &mut [f32], spacing: usize, amount: f32) {
    let mut wrapped = Vec::with_capacity(COLUMNS + 2 * spacing);
    for (row, filtered) in before.chunks_exact(COLUMNS).zip(texels.chunks_exact_mut(COLUMNS)) {
        wrapped.clear();
        [&row[COLUMNS - spacing..], row, &row[..spacing]].iter().for_each(|part| wrapped.extend_from_slice(part));
        blend(row, [&wrapped[2 * spacing..], &wrapped], amount, filtered);
    }
}

#[inline(always)]
fn filter_columns(before: &[f32], texels: &mut [f32], spacing: usize, amount: f32) {
    for (row, filtered) in texels.chunks_exact_mut(COLUMNS).enumerate() {
        let neighbors = [wrapped_row(before, row + spacing), wrapped_row(before, row + ROWS - spacing)];
        blend(wrapped_row(before, row), neighbors, amount, filtered);
    }
}

/// A row of the texels of a table, which repeats after [`ROWS`] rows.
#[inline(always)]
fn wrapped_row(texels: &[f32], row: usize) -> &[f32] {
    &texels[row % ROWS * COLUMNS..][..COLUMNS]
}

/// Blends a row by `amount` with the binomial mean of itself and the rows, or shifted copies, on both sides.
#[inline(always)]
fn blend(row: &[f32], [next, previous]: [&[f32]; 2], amount: f32, filtered: &mut [f32]) {
    let (row, next, previous) = (&row[..COLUMNS], &next[..COLUMNS], &previous[..COLUMNS]);
    for (i, value) in filtered.iter_mut().enumerate() {
        let mean = 0.25 * (next[i] + previous[i]) + 0.5 * row[i];
        *value = (mean - row[i]).fma(amount, row[i]);
    }
}

/// Mapping of texture coordinates (u, w) to columns and rows of the table at one time.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct TextureLayer {
    pub(crate) columns_per_u: f32,
    pub(crate) columns_per_w: f32,
    /// Column at u = w = 0.
    pub(crate) first_column: f32,
    pub(crate) rows_per_w: f32,
    /// Row at w = 0.
    pub(crate) first_row: f32,
}

impl TextureLayer {
    /// Looks up the layer at sixteen points.
    #[inline(always)]
    pub(crate) fn sample<S: Simd>(&self, table: &TextureTable, u: Lanes<S>, w: Lanes<S>) -> Lanes<S> {
        let (column, row) = self.texel(u, w);
        table.sample(column, row)
    }

    /// Column and row of the table at one point.
    pub(crate) fn texel_at(&self, [u, w]: [f32; 2]) -> (f32, f32) {
        let column = u * self.columns_per_u + w * self.columns_per_w + self.first_column;
        (column, w * self.rows_per_w + self.first_row)
    }

    /// Column and row of the table at sixteen points.
    #[inline(always)]
    pub(crate) fn texel<S: Simd>(&self, u: Lanes<S>, w: Lanes<S>) -> (Lanes<S>, Lanes<S>) {
        let slant = w.fma(w.broadcast(self.columns_per_w), w.broadcast(self.first_column));
        let column = u.fma(u.broadcast(self.columns_per_u), slant);
        (column, w.fma(w.broadcast(self.rows_per_w), w.broadcast(self.first_row)))
    }
}

/// A texture at one time: T0(u, w), eq. (2).
#[derive(Clone, Debug)]
pub(crate) enum FlameTexture {
    /// One layer.
    Single(Arc<TextureTable>, TextureLayer),
    /// A coarse and a fine layer, each uniformly distributed over [0, 1], mixed so that the result is uniformly distributed too.
    Mixed(Arc<TextureTable>, [TextureLayer; 2]),
    /// The same layers, each with its own threshold: flames one behind the other, whose soot adds.
    Overlapping(Arc<TextureTable>, [TextureLayer; 2]),
    /// Eq. (20) itself, after a scroll in sheet heights.
    Exact(PaperSum, f64),
}

impl FlameTexture {
    /// Texels per unit of u and of w, of the finer layer; 0 without a table.
    #[inline(always)]
    pub(crate) fn texels(&self) -> [f32; 2] {
        match self {
            Self::Single(_, fine) | Self::Mixed(_, [_, fine]) | Self::Overlapping(_, [_, fine]) => {
                [fine.columns_per_u.abs(), fine.rows_per_w.abs()]
            }
            Self::Exact(..) => [0.0; 2],
        }
    }

    /// T0 at sixteen points; in [0, 1].
    #[inline(always)]
    pub(crate) fn sample<S: Simd>(&self, u: Lanes<S>, w: Lanes<S>) -> Lanes<S> {
        match self {
            Self::Single(table, layer) => layer.sample(table, u, w),
            Self::Mixed(table, [coarse, fine]) | Self::Overlapping(table, [coarse, fine]) => {
                fractal::mix_equalized(coarse.sample(table, u, w), fine.sample(table, u, w))
            }
            Self::Exact(sum, scroll) => sum.sample(u, w, *scroll),
        }
    }
}

/// Source of a flame's texture.
#[derive(Clone, Debug)]
pub(crate) enum TextureSource {
    /// The layers of this flame on the common noise table.
    Fractal(FractalLayers),
    /// A table that repeats, common to all instances: the paper's, or a picture.
    Periodic(Arc<PeriodicLayer>),
    /// The paper's sum.
    Exact(PaperSum),
}

impl TextureSource {
    /// Texels of the table per sheet height; 0 without a table.
    pub(crate) fn texels_up(&self) -> f64 {
        match self {
            Self::Fractal(layers) => layers.texels_up(),
            Self::Periodic(layer) => layer.texels_up(),
            Self::Exact(_) => 0.0,
        }
    }
}

impl TextureSource {
    /// T0 after `scroll` sheet heights, at full resolution.
    pub(crate) fn texture(&self, scroll: f64) -> FlameTexture {
        match self {
            Self::Fractal(layers) => layers.at(&FRACTAL, scroll),
            Self::Periodic(layer) => layer.at(scroll),
            Self::Exact(sum) => FlameTexture::Exact(*sum, scroll),
        }
    }

    /// The table in memory that a sheet `height_pixels` tall shares with others; `None` where it uses the unfiltered one, or shares none.
    pub(crate) fn shared_table_key(&self, height_pixels: f64) -> Option<u64> {
        let level = math::log2(self.texels_up() / height_pixels.max(1.0)) as f32;
        let is_filtered = matches!(self, Self::Fractal(_)) && level > 0.0;
        is_filtered.then(|| u64::from(level.min(MAX_LEVEL as f32).to_bits()))
    }

    /// This texture with its table low-pass filtered (as a mip level) for a sheet `height_pixels` tall. Filtered fractals are taken from `cache`.
    pub(crate) fn filtered(&self, height_pixels: f64, cache: &FilterCache) -> FilteredTexture {
        let level = math::log2(self.texels_up() / height_pixels.max(1.0)) as f32;
        match self {
            Self::Fractal(layers) if level > 0.0 => FilteredTexture::Fractal(*layers, cache.filtered_fractal(level)),
            Self::Fractal(layers) => FilteredTexture::Fractal(*layers, FRACTAL.clone()),
            Self::Periodic(layer) if level > 0.0 => FilteredTexture::Periodic(Arc::new(layer.filtered(level))),
            Self::Periodic(layer) => FilteredTexture::Periodic(layer.clone()),
            Self::Exact(sum) => FilteredTexture::Exact(*sum),
        }
    }
}

/// Fractal tables that were filtered for recent frames: while the camera stands still, the level is the same in every frame.
#[derive(Debug, Default)]
pub(crate) struct FilterCache {
    /// Levels and tables, the newest last.
    recent: Mutex<Vec<(f32, Arc<TextureTable>)>>,
    /// Number of tables kept.
    capacity: usize,
}

impl FilterCache {
    /// Largest number of tables kept: those of a few instances, in the picture and in a mirror.
    const MAX_CAPACITY: usize = 4;

    /// The cache of a sheet of some flames.
    pub(crate) fn new(flames: usize) -> Self {
        Self { recent: Mutex::default(), capacity: (2 * flames).clamp(1, Self::MAX_CAPACITY) }
    }

    fn filtered_fractal(&self, level: f32) -> Arc<TextureTable> {
        let cached_table =
            lock(&self.recent).iter().find(|(of_level, _)| *of_level == level).map(|(_, table)| table.clone());
        if let Some(table) = cached_table {
            return table;
        }
        // Computed without the lock, so that no thread waits.
        let table = shared_filtered_fractal(level);
        let mut recent = lock(&self.recent);
        while recent.len() >= self.capacity.max(1) {
            recent.remove(0);
        }
        recent.push((level, table.clone()));
        table
    }
}

/// Memory of a table, bytes.
pub(crate) const TABLE_BYTES: f64 = (ROWS * COLUMNS * size_of::<[f32; 4]>()) as f64;

/// The fractal table at a level, which all sheets of the process share while any of them holds it: a scene may have hundreds of equal flames.
fn shared_filtered_fractal(level: f32) -> Arc<TextureTable> {
    static SHARED: Mutex<BTreeMap<u32, Weak<TextureTable>>> = Mutex::new(BTreeMap::new());
    let key = level.clamp(0.0, MAX_LEVEL as f32).to_bits();
    let table_in_use = lock(&SHARED).get(&key).and_then(Weak::upgrade);
    if let Some(table) = table_in_use {
        return table;
    }
    // Computed without the lock: two threads may compute the same table.
    let table = Arc::new(FRACTAL.filtered(level));
    let mut shared = lock(&SHARED);
    shared.retain(|_, table| table.strong_count() > 0);
    shared.insert(key, Arc::downgrade(&table));
    table
}

/// Locks a cache, also after a panic of another thread: every change leaves it valid.
fn lock<T>(cache: &Mutex<T>) -> MutexGuard<'_, T> {
    cache.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Clone for FilterCache {
    /// An empty cache.
    fn clone(&self) -> Self {
        Self { recent: Mutex::default(), capacity: self.capacity }
    }
}

/// A flame's texture, filtered for one frame.
pub(crate) enum FilteredTexture {
    /// Layers and their filtered table.
    Fractal(FractalLayers, Arc<TextureTable>),
    /// A table that repeats.
    Periodic(Arc<PeriodicLayer>),
    /// The paper's sum, which is not filtered.
    Exact(PaperSum),
}

impl FilteredTexture {
    /// Fractal layers filtered for a sheet `height_pixels` tall.
    pub(crate) fn fractal(layers: FractalLayers, height_pixels: f64, cache: &FilterCache) -> Self {
        TextureSource::Fractal(layers).filtered(height_pixels, cache)
    }

    /// T0 after `scroll` sheet heights.
    pub(crate) fn texture(&self, scroll: f64) -> FlameTexture {
        match self {
            Self::Fractal(layers, table) => layers.at(table, scroll),
            Self::Periodic(layer) => layer.at(scroll),
            Self::Exact(sum) => FlameTexture::Exact(*sum, scroll),
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
    fn sheets_share_a_table_while_one_of_them_holds_it() {
        let (first, second) = (FilterCache::new(1), FilterCache::new(1));
        let table = first.filtered_fractal(1.25);
        assert!(Arc::ptr_eq(&table, &second.filtered_fractal(1.25)));
        assert_eq!(table.texels(), FRACTAL.filtered(1.25).texels());
        // A sheet of one flame keeps two tables: one of the picture and one of a mirror.
        [1.5, 1.75, 2.0].iter().for_each(|level| drop(first.filtered_fractal(*level)));
        assert_eq!(first.recent.lock().unwrap().len(), 2);
        assert_eq!(FilterCache::new(9).capacity, FilterCache::MAX_CAPACITY);
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
