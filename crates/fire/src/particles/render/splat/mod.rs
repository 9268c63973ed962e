//! Splatting: sums of sprites on a grid. Each band of rows is filled by one task, which adds sprites in order.
//!
//! A sprite is smooth, so that a grid of a few cells per radius represents it, and the cost hardly depends on the resolution or on
//! the size of sprites. Sprites of different sizes go to grids of different cell size; coarse grids are added to finer ones by
//! cubic interpolation.

use std::ops::Range;

use bansho_base::{
    camera::{Camera, Lens},
    host::parallel::prelude::*,
    image::Rect,
    math::simd::LANES,
};
use fearless_simd::dispatch;

use crate::particles::render::{
    buffer_pool::{BufferPool, PooledVec},
    splat::{
        cap::Cap,
        grid::{Grid, Raster},
        kernel::Profile,
        rasterize::{COLUMNS, ROWS, RasterizedSprite},
    },
};

pub(crate) mod cap;
pub(crate) mod grid;
pub(crate) mod kernel;
pub(crate) mod rasterize;
pub(crate) mod spline;

/// Minimum radius of a sprite in cells, at which splines are accurate to a few percent of a single sprite's peak.
pub(crate) const MIN_RADIUS_CELLS: f32 = 2.75;
/// Rows per task.
const ROWS_PER_TASK: usize = 32;
/// Level of the coarsest grid: cells of 4096 pixels, twelve octaves.
const MAX_LEVEL: usize = 24;

/// An ellipse in the picture: `q = a u^2 + 2 b u v + c v^2` is 1 at its edge.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ellipse {
    /// Center, pixels from the picture's top left corner.
    pub(crate) center: [f32; 2],
    /// a, b and c, 1/pixel^2.
    pub(crate) shape: [f32; 3],
    /// Half of the width and height of its bounding box, pixels.
    pub(crate) half_size: [f32; 2],
    /// Semi-minor axis, pixels.
    pub(crate) radius: f32,
    /// Line integral through the center, for a particle of 1 m^3 with an absorption coefficient of 1/m.
    pub(crate) peak: f32,
    /// The ball itself where no ellipse describes it; only the bounding box is then that of an ellipse.
    pub(crate) cap: Option<Cap>,
}

/// One sprite: `P` values, weighted by its profile, for layer `layer` and, with the weight `next_layer_weight`, the next.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sprite<const P: usize> {
    pub(crate) ellipse: Ellipse,
    pub(crate) layer: usize,
    pub(crate) next_layer_weight: f32,
    pub(crate) values: [f32; P],
}

/// Parameters of a splat.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SplatSettings {
    pub(crate) profile: Profile,
    /// Minimum radius of a sprite in cells; smaller sprites are widened to it on the finest grid.
    pub(crate) min_radius_cells: f32,
    pub(crate) layers: usize,
    /// Size of the whole picture, pixels.
    pub(crate) picture: [usize; 2],
    /// The window of it that is drawn.
    pub(crate) window: Rect,
    /// The camera whose picture it is.
    pub(crate) camera: Camera,
}

/// Result of a splat.
#[derive(Debug)]
pub(crate) enum SplatResult<'a> {
    /// No sprite is visible in the whole picture.
    Empty,
    /// Sprites are visible only outside the window.
    OutsideWindow,
    /// Sums over cells.
    Sums(Grid<'a>),
}

impl<'a> SplatResult<'a> {
    /// The sums, if any.
    pub(crate) fn sums(self) -> Option<Grid<'a>> {
        if let Self::Sums(grid) = self { Some(grid) } else { None }
    }
}

/// Sums all sprites on grids of decreasing cell size, each of which is added to the next finer one, and returns the finest as spline coefficients.
///
/// Cells coincide with those of the whole picture, so that pixels do not depend on the window.
pub(crate) fn splat<'a, const P: usize>(
    settings: &SplatSettings,
    tasks: &[PooledVec<Sprite<P>>],
    buffers: &'a BufferPool,
) -> SplatResult<'a> {
    let statistics = SpriteStatistics::new(settings, tasks);
    let Some(rect) = statistics.covered(settings.picture) else { return SplatResult::Empty };
    let finest = statistics.finest();
    let nested = statistics.counts.iter().skip(finest + 2).any(|count| *count > 0);
    let drawn = Raster::around(rect, cell_size(finest), nested).covered().intersection(&settings.window);
    if drawn.is_empty() {
        return SplatResult::OutsideWindow;
    }
    let drawn = aligned_to_lanes(drawn);
    let mut coarser: Option<Grid> = None;
    for grid_level in (finest..MAX_LEVEL + 1).step_by(2).rev() {
        let any = statistics.counts[grid_level..].iter().take(2).any(|count| *count > 0);
        if !any && grid_level != finest && coarser.is_none() {
            continue;
        }
        let whole_picture_cells = Raster::around(rect, cell_size(grid_level), nested);
        let cells = Raster::around(drawn, cell_size(grid_level), nested).intersection(&whole_picture_cells);
        let mut grid = Grid::new(cells, settings.layers * P, buffers);
        let directions = if statistics.has_caps { cap::directions(&settings.camera, &grid.cells) } else { Vec::new() };
        let levels = GridLevels { this: grid_level, finest };
        add_sprites(settings, tasks, levels, whole_picture_cells.picture_columns(), &directions, &mut grid);
        if let Some(coarser) = coarser {
            grid.add_coarser(&coarser);
        }
        coarser = Some(grid.prefiltered());
    }
    coarser.map_or(SplatResult::Empty, SplatResult::Sums)
}

/// Extends a rectangle to whole batches of sixteen pixels.
fn aligned_to_lanes(rect: Rect) -> Rect {
    let (x, end) = (rect.x / LANES * LANES, rect.right().next_multiple_of(LANES));
    Rect { x, width: end - x, ..rect }
}

/// Cell size of a grid level, pixels: two levels per octave, 1, 2, 3, 4, 6, 8, 12... Level 1, which would be 1.5, is not used.
fn cell_size(grid_level: usize) -> usize {
    if grid_level.is_multiple_of(2) { 1 << (grid_level / 2) } else { 3 << (grid_level / 2 - 1) }
}

/// The level of a grid, and that of the finest one, on which smaller sprites are, too.
#[derive(Clone, Copy, Debug)]
struct GridLevels {
    this: usize,
    finest: usize,
}

impl SplatSettings {
    /// Whether a sprite is on a grid: those of two levels, half an octave apart, share one.
    #[inline(always)]
    fn is_on_grid(&self, radius: f32, levels: GridLevels) -> bool {
        // Sprites of finer grids are below this level: the difference wraps.
        self.grid_level(radius).max(levels.finest).wrapping_sub(levels.this) < 2
    }

    /// The level of the largest cells that are small enough for a sprite.
    #[inline(always)]
    fn grid_level(&self, radius: f32) -> usize {
        // The exponent of a float counts octaves; its first mantissa bit distinguishes the upper from the lower half of an octave.
        let half_octaves = ((radius / self.min_radius_cells).max(1.0).to_bits() >> 22) as usize - (127 << 1);
        let level = if half_octaves == 1 { 0 } else { half_octaves.min(MAX_LEVEL) };
        // Only cells of powers of two repeat where a panorama does.
        if self.camera.lens == Lens::Panorama { level / 2 * 2 } else { level }
    }
}

/// Bounds and sizes of all sprites.
struct SpriteStatistics {
    low: [f32; 2],
    high: [f32; 2],
    /// Number of sprites for each grid level.
    counts: [usize; MAX_LEVEL + 1],
    /// Whether any of them is a cap.
    has_caps: bool,
}

impl SpriteStatistics {
    const EMPTY: Self = Self { low: [f32::MAX; 2], high: [f32::MIN; 2], counts: [0; MAX_LEVEL + 1], has_caps: false };

    fn new<const P: usize>(settings: &SplatSettings, tasks: &[PooledVec<Sprite<P>>]) -> Self {
        let of_tasks = tasks.par_iter().map(|sprites| Self::of(settings, sprites));
        of_tasks.reduce_with(Self::merge).unwrap_or(Self::EMPTY)
    }

    /// Bounds and sizes of the sprites of one task.
    fn of<const P: usize>(settings: &SplatSettings, sprites: &[Sprite<P>]) -> Self {
        let mut statistics = Self::EMPTY;
        for Sprite { ellipse, .. } in sprites {
            for axis in 0..2 {
                statistics.low[axis] = statistics.low[axis].min(ellipse.center[axis] - ellipse.half_size[axis]);
                statistics.high[axis] = statistics.high[axis].max(ellipse.center[axis] + ellipse.half_size[axis]);
            }
            statistics.counts[settings.grid_level(ellipse.radius)] += 1;
            statistics.has_caps |= ellipse.cap.is_some();
        }
        statistics
    }

    fn merge(mut self, other: Self) -> Self {
        for axis in 0..2 {
            self.low[axis] = self.low[axis].min(other.low[axis]);
            self.high[axis] = self.high[axis].max(other.high[axis]);
        }
        self.has_caps |= other.has_caps;
        self.counts.iter_mut().zip(other.counts).for_each(|(own, other)| *own += other);
        self
    }

    /// The finest grid level that is used. It suits all but the smallest 2 % of the sprites, which are widened to it: otherwise a few distant particles would
    /// require a fine grid of the whole flame.
    fn finest(&self) -> usize {
        /// 1 / maximum fraction of the sprites that would need a finer level.
        const MAX_FINER_INVERSE: usize = 50;
        let total: usize = self.counts.iter().sum();
        let mut up_to_level = 0;
        for (level, count) in self.counts.iter().enumerate() {
            up_to_level += count;
            if up_to_level * MAX_FINER_INVERSE > total {
                return level;
            }
        }
        0
    }

    /// The pixels of the picture that sprites touch, extended to whole batches.
    fn covered(&self, picture: [usize; 2]) -> Option<Rect> {
        let [x, y] = [0, 1].map(|axis| (self.low[axis].max(0.0) as usize).min(picture[axis]));
        let [right, bottom] = [0, 1].map(|axis| ((self.high[axis] + 1.0).max(0.0) as usize).min(picture[axis]));
        (right > x && bottom > y).then(|| aligned_to_lanes(Rect { x, y, width: right - x, height: bottom - y }))
    }
}

/// Fills a grid with the sums of the sprites whose radius belongs to it.
fn add_sprites<'a, const P: usize>(
    settings: &SplatSettings,
    tasks: &[PooledVec<'a, Sprite<P>>],
    levels: GridLevels,
    whole_picture_columns: Range<i32>,
    directions: &[[f32; 3]],
    grid: &mut Grid,
) {
    let cells = grid.cells;
    let (row_length, level) = (grid.row_length(), bansho_base::math::simd::level());
    let binned =
        tasks.par_iter().map(|task| dispatch!(level, _simd => BinnedSprites::new(settings, task, &cells, levels)));
    let binned: Vec<BinnedSprites<P>> = binned.collect();
    grid.values_mut().par_chunks_mut(ROWS_PER_TASK * row_length).enumerate().for_each(|(index, values)| {
        let (columns, whole_picture_columns) = (cells.picture_columns(), whole_picture_columns.clone());
        let top = cells.first[1] + (index * ROWS_PER_TASK) as i32;
        values.fill(0.0);
        let directions = directions.get(index * ROWS_PER_TASK * columns.len()..).unwrap_or_default();
        let layers = settings.layers;
        let mut row_band = RowBand { first: top, columns, whole_picture_columns, layers, directions, values };
        for task in &binned {
            dispatch!(level, _simd => row_band.add(settings.profile, task, index));
        }
    });
}

/// Rows of the grid that one task fills.
struct RowBand<'a> {
    /// First row and columns, in cells of the whole picture.
    first: i32,
    columns: Range<i32>,
    /// Columns of the grid of the whole picture.
    whole_picture_columns: Range<i32>,
    layers: usize,
    /// Directions of the cells, if there are caps.
    directions: &'a [[f32; 3]],
    values: &'a mut [f32],
}

impl RowBand<'_> {
    #[inline(always)]
    fn add<const P: usize>(&mut self, profile: Profile, task: &BinnedSprites<P>, index: usize) {
        let sums = self.values.as_chunks_mut::<P>().0;
        let row_length = self.columns.len() * self.layers;
        let end = self.first + (sums.len() / row_length) as i32;
        for &member in task.members_of_band(index) {
            let sprite = &task.sprites[usize::from(member)];
            let (from, to) = (sprite.rows[0].max(self.first), sprite.rows[1].min(end));
            if let Some(cap) = &sprite.cap {
                let rows = (from - self.first) as usize..(to.max(from) - self.first) as usize;
                let cells = sums[rows.start * row_length..rows.end * row_length].chunks_exact_mut(row_length);
                let directions = self.directions[rows.start * self.columns.len()..].chunks_exact(self.columns.len());
                for (row, directions) in cells.zip(directions) {
                    add_cap(profile, sprite, cap, directions, self.layers, row);
                }
                continue;
            }
            for start in (from..to).step_by(ROWS) {
                let chords = sprite.chords(start, &self.whole_picture_columns);
                for y in start..to.min(start + ROWS as i32) {
                    let row = &mut sums[(y - self.first) as usize * row_length..][..row_length];
                    let index = (y - start) as usize;
                    // Runs of eight cells start at the same cells as for the whole picture; the last one may extend beyond the sprite.
                    let skipped = (self.columns.start - chords.first[index]).max(0) / COLUMNS as i32 * COLUMNS as i32;
                    let end = chords.end[index].min(self.columns.end);
                    for x in (chords.first[index] + skipped..end).step_by(COLUMNS) {
                        let weights = chords.weights(profile, sprite.falloff, index, x);
                        match usize::try_from(x - self.columns.start) {
                            Ok(column) => sprite.add(row, column, self.layers, &weights),
                            Err(_) => {
                                let before = (self.columns.start - x) as usize;
                                sprite.add(row, 0, self.layers, &skip_first(&weights, before));
                            }
                        }
                    }
                }
            }
        }
    }
}

/// Accumulates a row of a cap.
#[inline(always)]
fn add_cap<const P: usize>(
    profile: Profile,
    sprite: &RasterizedSprite<P>,
    cap: &Cap,
    directions: &[[f32; 3]],
    layers: usize,
    row: &mut [[f32; P]],
) {
    for (run, directions) in directions.chunks(COLUMNS).enumerate() {
        let mut weights = [0.0; COLUMNS];
        let mut sum = 0.0;
        for (weight, direction) in weights.iter_mut().zip(directions) {
            *weight = cap.weight(profile, direction);
            sum += *weight;
        }
        if sum > 0.0 {
            sprite.add(row, run * COLUMNS, layers, &weights);
        }
    }
}

/// The weights without the first `count`, padded with zeros.
fn skip_first(weights: &[f32; COLUMNS], count: usize) -> [f32; COLUMNS] {
    std::array::from_fn(|lane| weights.get(lane + count).copied().unwrap_or(0.0))
}

/// The sprites of a task, binned by row band with a counting sort that keeps their order.
struct BinnedSprites<'a, const P: usize> {
    sprites: PooledVec<'a, RasterizedSprite<P>>,
    starts: Vec<u32>,
    members: Vec<u16>,
}

impl<'a, const P: usize> BinnedSprites<'a, P> {
    #[inline(always)]
    fn new(settings: &SplatSettings, task: &PooledVec<'a, Sprite<P>>, cells: &Raster, levels: GridLevels) -> Self {
        let mut sprites = task.pool().take(task.len());
        sprites.clear();
        for sprite in task.iter() {
            if settings.is_on_grid(sprite.ellipse.radius, levels) {
                sprites.push(RasterizedSprite::new(settings, sprite, cells));
            }
        }
        let bands = cells.rows.div_ceil(ROWS_PER_TASK);
        let mut starts = vec![0_u32; bands + 1];
        for sprite in sprites.iter() {
            for row_band in row_bands(sprite, cells) {
                starts[row_band + 1] += 1;
            }
        }
        for row_band in 0..bands {
            starts[row_band + 1] += starts[row_band];
        }
        let mut ends = starts.clone();
        let mut members = vec![0; starts[bands] as usize];
        for (index, sprite) in sprites.iter().enumerate() {
            for row_band in row_bands(sprite, cells) {
                members[ends[row_band] as usize] = index as u16;
                ends[row_band] += 1;
            }
        }
        Self { sprites, starts, members }
    }

    /// Indices of the sprites that touch a row band.
    fn members_of_band(&self, row_band: usize) -> &[u16] {
        &self.members[self.starts[row_band] as usize..self.starts[row_band + 1] as usize]
    }
}

/// The row bands that a sprite touches.
#[inline(always)]
fn row_bands<const P: usize>(sprite: &RasterizedSprite<P>, cells: &Raster) -> Range<usize> {
    let [from, to] = [sprite.rows[0] - cells.first[1], sprite.rows[1] - cells.first[1]];
    if from < to { from as usize / ROWS_PER_TASK..(to as usize).div_ceil(ROWS_PER_TASK) } else { 0..0 }
}

#[cfg(test)]
mod tests {
    use bansho_base::camera::CameraParameters;

    use super::*;

    #[test]
    fn cells_are_the_coarsest_that_are_fine_enough() {
        let settings = SplatSettings {
            profile: Profile::LINE,
            min_radius_cells: 2.75,
            layers: 1,
            picture: [0; 2],
            window: Rect::default(),
            camera: CameraParameters::default().at(0.0, [8, 8]),
        };
        let sizes: Vec<usize> = (2..10).map(cell_size).collect();
        assert_eq!((cell_size(0), sizes), (1, vec![2, 3, 4, 6, 8, 12, 16, 24]));
        for step in 0..4000 {
            let radius = 0.5 + 0.25 * step as f32;
            let size = cell_size(settings.grid_level(radius));
            let next =
                [1, 2, 3, 4].into_iter().chain((1..).flat_map(|k| [6 << (k - 1), 8 << (k - 1)])).find(|s| *s > size);
            assert!(size == 1 || size as f32 * 2.75 <= radius, "{radius} {size}");
            assert!(next.is_none_or(|next| radius < 2.75 * next as f32), "{radius} {size} {next:?}");
        }
    }
}
