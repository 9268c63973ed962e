//! Sums of sprites on a grid: each row belongs to one task, and each task adds its sprites in their own order.
//!
//! A sprite is smooth, so that a grid of a few cells a radius holds all there is to know of it: pictures of any size cost the same,
//! and so do sprites that fill the picture. Sprites of different sizes go to grids of different fineness; coarse grids are added to finer
//! ones by cubic interpolation.

use bansho_base::{image::Rect, math::lanes};
use fearless_simd::{Level, dispatch};
use rayon::prelude::*;

use super::{
    grid::{Cells, Grid},
    kernel::Profile,
    sprite::Ellipse,
};

/// The weights of sixteen cells are found at a time; a round sprite is never wider.
const LANES: usize = 16;
/// Least radius of a sprite in cells for sums, for which cubic interpolation is exact to a few hundredths of a lone sprite's peak.
pub(crate) const COARSE: f32 = 3.25;
/// Least radius of a sprite in cells for slopes, which are as exact as that only on a finer grid.
pub(crate) const FINE: f32 = 6.5;
/// Rows of one task.
const BAND: usize = 8;
/// Coarsest grid: cells of 4096 pixels.
const COARSEST: u32 = 12;

/// One sprite: `P` values, weighted by its profile, go to layer `layer` and, with the share `split`, to the next.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sprite<const P: usize> {
    pub(crate) ellipse: Ellipse,
    pub(crate) layer: usize,
    pub(crate) split: f32,
    pub(crate) values: [f32; P],
}

/// What a grid of sprites holds.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sheet {
    pub(crate) profile: Profile,
    /// Least radius of a sprite in cells; smaller sprites are widened to it on the finest grid.
    pub(crate) least_radius: f32,
    pub(crate) layers: usize,
    /// The part of the picture that is drawn.
    pub(crate) window: Rect,
}

/// The sums of all sprites, on the finest grid that any of them needs; `None` where none is seen.
pub(crate) fn splat<const P: usize>(sheet: &Sheet, sprites: &[Sprite<P>]) -> Option<Grid> {
    let rect = covered(sprites, sheet.window)?;
    let finest = finest_level(sheet, sprites);
    let mut by_level: Vec<Vec<u32>> = vec![Vec::new(); COARSEST as usize + 1];
    for (index, sprite) in sprites.iter().enumerate() {
        by_level[sheet.level_of(sprite.ellipse.radius).max(finest) as usize].push(index as u32);
    }
    let mut coarser: Option<Grid> = None;
    for level in (finest..=COARSEST).rev() {
        let members = &by_level[level as usize];
        if members.is_empty() && coarser.is_none() {
            continue;
        }
        let mut grid = Grid::new(Cells::around(rect, level), sheet.layers * P);
        add_sprites(sheet, sprites, members, &mut grid);
        if let Some(coarser) = coarser {
            grid.add_coarser(&coarser);
        }
        coarser = Some(grid);
    }
    coarser
}

impl Sheet {
    /// The level whose cells are just fine enough.
    fn level_of(&self, radius: f32) -> u32 {
        let octaves = lanes::log2((radius / self.least_radius).max(1.0));
        (octaves as u32).min(COARSEST)
    }
}

/// The level that suits all but the smallest sprites; those are widened to it.
///
/// A few far particles would otherwise buy a fine grid of the whole flame.
fn finest_level<const P: usize>(sheet: &Sheet, sprites: &[Sprite<P>]) -> u32 {
    /// Share of the sprites that may be finer.
    const FINER: usize = 50;
    let mut counts = [0_usize; COARSEST as usize + 1];
    sprites.iter().for_each(|sprite| counts[sheet.level_of(sprite.ellipse.radius) as usize] += 1);
    let mut finer = 0;
    for (level, count) in counts.iter().enumerate() {
        finer += count;
        if finer * FINER > sprites.len() {
            return level as u32;
        }
    }
    0
}

/// The pixels of the window that sprites touch.
fn covered<const P: usize>(sprites: &[Sprite<P>], window: Rect) -> Option<Rect> {
    let (mut low, mut high) = ([f32::MAX; 2], [f32::MIN; 2]);
    for Sprite { ellipse, .. } in sprites {
        for axis in 0..2 {
            low[axis] = low[axis].min(ellipse.centre[axis] - ellipse.reach[axis]);
            high[axis] = high[axis].max(ellipse.centre[axis] + ellipse.reach[axis]);
        }
    }
    let clip = |value: f32, from: usize, to: usize| (value.max(0.0) as usize).clamp(from, to);
    let (x, y) = (clip(low[0], window.x, window.right()), clip(low[1], window.y, window.bottom()));
    let right = clip(high[0] + 1.0, window.x, window.right());
    let bottom = clip(high[1] + 1.0, window.y, window.bottom());
    (right > x && bottom > y).then(|| Rect { x, y, width: right - x, height: bottom - y })
}

/// A sprite in the coordinates of a grid.
#[derive(Clone, Copy, Debug)]
struct Placed {
    centre: [f32; 2],
    shape: [f32; 3],
    /// First row and one past the last.
    rows: [i32; 2],
    /// By how much the values are dimmed where the sprite had to be widened.
    dimmed: f32,
}

impl Placed {
    #[inline(always)]
    fn new(sheet: &Sheet, ellipse: &Ellipse, cells: &Cells) -> Self {
        let cell = cells.size() as f32;
        let growth = (sheet.least_radius * cell / ellipse.radius.max(1e-3)).max(1.0);
        let scale = cell * cell / (growth * growth);
        let centre = cells.place(ellipse.centre);
        let reach = ellipse.reach[1] * growth / cell;
        let last = cells.rows as i32;
        let rows =
            [((centre[1] - reach).ceil() as i32).clamp(0, last), ((centre[1] + reach) as i32 + 1).clamp(0, last)];
        Self { centre, shape: ellipse.shape.map(|value| value * scale), rows, dimmed: 1.0 / (growth * growth) }
    }
}

fn add_sprites<const P: usize>(sheet: &Sheet, sprites: &[Sprite<P>], members: &[u32], grid: &mut Grid) {
    let cells = grid.cells;
    let bands = cells.rows.div_ceil(BAND);
    let placed: Vec<Placed> = members
        .par_iter()
        .with_min_len(4096)
        .map(|&i| Placed::new(sheet, &sprites[i as usize].ellipse, &cells))
        .collect();
    let bins = Bins::new(bands, placed.iter().map(|placed| placed.rows));
    let row = grid.row_length();
    let level = Level::new();
    grid.values.par_chunks_mut(BAND * row).enumerate().for_each(|(band, values)| {
        let band = Band { first: (band * BAND) as i32, rows: values.len() / row, members: bins.of(band) };
        dispatch!(level, _simd => add_band(sheet, sprites, members, &placed, &band, values));
    });
}

/// Rows of the grid that one task fills.
struct Band<'a> {
    first: i32,
    rows: usize,
    members: &'a [u32],
}

#[inline(always)]
fn add_band<const P: usize>(
    sheet: &Sheet,
    sprites: &[Sprite<P>],
    members: &[u32],
    placed: &[Placed],
    band: &Band,
    values: &mut [f32],
) {
    let row_length = values.len() / band.rows;
    for &member in band.members {
        let (placed, sprite) = (&placed[member as usize], &sprites[members[member as usize] as usize]);
        let from = placed.rows[0].max(band.first);
        let to = placed.rows[1].min(band.first + band.rows as i32);
        for y in from..to {
            let row = &mut values[(y - band.first) as usize * row_length..][..row_length];
            add_row(sheet, placed, sprite, y, row);
        }
    }
}

#[inline(always)]
fn add_row<const P: usize>(sheet: &Sheet, placed: &Placed, sprite: &Sprite<P>, y: i32, row: &mut [f32]) {
    let depth = sheet.layers * P;
    let [a, b, c] = placed.shape;
    let v = y as f32 - placed.centre[1];
    // Where a u^2 + 2 b u v + c v^2 = 1.
    let middle = placed.centre[0] - b / a * v;
    let half = ((1.0 - (c - b * b / a) * v * v) / a).max(0.0).sqrt();
    let first = ((middle - half).ceil() as i32).max(0) as usize;
    let end = ((middle + half).floor() as i32 + 1).clamp(0, (row.len() / depth) as i32) as usize;
    let mut x = first;
    while x < end {
        let mut weights = [0.0; LANES];
        for lane in 0..LANES {
            let u = (x + lane) as f32 - placed.centre[0];
            let q = (a * u).mul_add(u, (2.0 * b * v).mul_add(u, c * v * v));
            let s = 1.0 - q;
            let s = if s > 0.0 { s } else { 0.0 };
            weights[lane] = sheet.profile.at(s) * placed.dimmed;
        }
        let cells = &mut row[x * depth..(x + LANES).min(end) * depth];
        add_cells(cells, depth, sprite, &weights);
        x += LANES;
    }
}

/// Adds a sprite to a run of cells with their weights.
#[inline(always)]
fn add_cells<const P: usize>(cells: &mut [f32], depth: usize, sprite: &Sprite<P>, weights: &[f32; LANES]) {
    if depth == 1 {
        // One value a cell: the cells themselves fill the vector.
        for (cell, weight) in cells.iter_mut().zip(weights) {
            *cell = sprite.values[0].mul_add(*weight, *cell);
        }
        return;
    }
    let (mut own, mut next) = (sprite.values, sprite.values);
    for i in 0..P {
        own[i] *= 1.0 - sprite.split;
        next[i] *= sprite.split;
    }
    for (cell, weight) in cells.chunks_exact_mut(depth).zip(weights) {
        let Some(sums) = cell[sprite.layer * P..].first_chunk_mut::<P>() else { continue };
        for i in 0..P {
            sums[i] = own[i].mul_add(*weight, sums[i]);
        }
        if sprite.split > 0.0
            && let Some(sums) = cell[(sprite.layer + 1) * P..].first_chunk_mut::<P>()
        {
            for i in 0..P {
                sums[i] = next[i].mul_add(*weight, sums[i]);
            }
        }
    }
}

/// Which sprites touch which band: a counting sort that keeps their order.
struct Bins {
    starts: Vec<u32>,
    members: Vec<u32>,
}

impl Bins {
    fn new(bands: usize, rows: impl Iterator<Item = [i32; 2]> + Clone) -> Self {
        let bands_of = |[from, to]: [i32; 2]| {
            let first = from as usize / BAND;
            if from < to { first..(to as usize).div_ceil(BAND) } else { first..first }
        };
        let mut starts = vec![0_u32; bands + 1];
        for band in rows.clone().flat_map(bands_of) {
            starts[band + 1] += 1;
        }
        for band in 0..bands {
            starts[band + 1] += starts[band];
        }
        let mut ends = starts.clone();
        let mut members = vec![0; starts[bands] as usize];
        for (index, rows) in rows.enumerate() {
            for band in bands_of(rows) {
                members[ends[band] as usize] = index as u32;
                ends[band] += 1;
            }
        }
        Self { starts, members }
    }

    fn of(&self, band: usize) -> &[u32] {
        &self.members[self.starts[band] as usize..self.starts[band + 1] as usize]
    }
}
