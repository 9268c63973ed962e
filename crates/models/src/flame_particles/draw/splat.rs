//! Sums of sprites on a grid: each row belongs to one task, and each task adds its sprites in their own order.
//!
//! A sprite is smooth, so that a grid of a few cells a radius holds all there is to know of it: pictures of any size cost the same,
//! and so do sprites that fill the picture. Sprites of different sizes go to grids of different fineness; coarse grids are added to finer
//! ones by cubic interpolation.

use bansho_base::image::Rect;
use fearless_simd::{Level, dispatch};
use rayon::prelude::*;

use super::{
    grid::{Cells, Grid},
    kernel::Profile,
    sprite::Ellipse,
};

/// The weights of eight cells are found at a time: about a row of a sprite.
const LANES: usize = 8;
/// How far the cells of a run, or the rows of a band, lie beyond the one before the first. (Without a zero, of which compilers make a
/// special case.)
const BEYOND: [f32; LANES] = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0];
/// Least radius of a sprite in cells for sums, for which cubic interpolation is exact to a few hundredths of a lone sprite's peak.
pub(crate) const COARSE: f32 = 3.25;
/// Least radius of a sprite in cells for slopes, which are as exact as that only on a finer grid.
pub(crate) const FINE: f32 = 6.5;
/// Rows of one task.
const BAND: usize = LANES;
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
        /// The exponent's bits of a number between one and two.
        const ONE: u32 = 127;
        // The exponent of a number is its whole octaves.
        (((radius / self.least_radius).max(1.0).to_bits() >> 23) - ONE).min(COARSEST)
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
    /// How far the middle of a row lies to the left, for each row below the centre: b/a.
    lean: f32,
    /// Square of half the width of a row: this much at the centre, 1/a,
    widest: f32,
    /// and less for the square of each row's distance, (c - b^2/a) / a.
    narrowing: f32,
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
        let [a, b, c] = ellipse.shape.map(|value| value * scale);
        let (lean, widest) = (b / a, 1.0 / a);
        let narrowing = (c - b * lean) * widest;
        Self { centre, shape: [a, b, c], lean, widest, narrowing, rows, dimmed: 1.0 / (growth * growth) }
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
    let depth = sheet.layers * P;
    let row_length = values.len() / band.rows;
    let columns = row_length / depth;
    for &member in band.members {
        let (placed, sprite) = (&placed[member as usize], &sprites[members[member as usize] as usize]);
        let from = placed.rows[0].max(band.first);
        let to = placed.rows[1].min(band.first + band.rows as i32);
        let share = Share::new(sprite, placed.dimmed);
        let [first, end] = placed.columns(band.first, columns as i32);
        for y in from..to {
            let index = (y - band.first) as usize;
            let row = &mut values[index * row_length..][..row_length];
            let below = y as f32 - placed.centre[1];
            for x in (first[index]..end[index]).step_by(LANES) {
                let weights = placed.weights(sheet.profile, x, below);
                share.add(row, [x, end[index]].map(|column| column as usize), depth, &weights);
            }
        }
    }
}

impl Placed {
    /// The first cell that the sprite covers in each row of a band, where a u^2 + 2 b u v + c v^2 = 1, and one past the last.
    #[inline(always)]
    fn columns(&self, first_row: i32, columns: i32) -> [[i32; BAND]; 2] {
        let start = (first_row - 1) as f32 - self.centre[1];
        let (mut first, mut end) = ([0; BAND], [0; BAND]);
        for row in 0..BAND {
            let v = start + BEYOND[row];
            let middle = self.centre[0] - self.lean * v;
            let half = (self.widest - self.narrowing * v * v).max(0.0).sqrt();
            first[row] = whole((middle - half).ceil(), columns);
            end[row] = whole((middle + half).floor() + 1.0, columns);
        }
        [first, end]
    }

    /// Weights of the cells from column `x` on, in the row `v` below the centre.
    #[inline(always)]
    fn weights(&self, profile: Profile, x: i32, v: f32) -> [f32; LANES] {
        let [a, b, c] = self.shape;
        let (linear, constant) = (2.0 * b * v, 1.0 - c * v * v);
        let start = (x - 1) as f32 - self.centre[0];
        let mut weights = [0.0; LANES];
        for lane in 0..LANES {
            let u = start + BEYOND[lane];
            let s = constant - u * a.mul_add(u, linear);
            let s = if s > 0.0 { s } else { 0.0 };
            weights[lane] = profile.at(s);
        }
        weights
    }
}

/// A whole number, clamped from 0 to `most`: the last bits of its sum with 2^23. (A cast checks each lane of a vector by itself.)
#[inline(always)]
fn whole(value: f32, most: i32) -> i32 {
    const SHIFT: f32 = 8_388_608.0;
    let clamped = value.max(0.0).min(most as f32);
    (clamped + SHIFT).to_bits() as i32 - SHIFT.to_bits() as i32
}

/// What a sprite gives to its own layer and to the next.
struct Share<const P: usize> {
    first: usize,
    own: [f32; P],
    next: [f32; P],
    both: bool,
}

impl<const P: usize> Share<P> {
    #[inline(always)]
    fn new(sprite: &Sprite<P>, dimmed: f32) -> Self {
        let (mut own, mut next) = (sprite.values, sprite.values);
        for i in 0..P {
            own[i] *= dimmed * (1.0 - sprite.split);
            next[i] *= dimmed * sprite.split;
        }
        Self { first: sprite.layer * P, own, next, both: sprite.split > 0.0 }
    }

    /// Adds to a run of a row's cells, `depth` values each, that begins at column `from`, and ends before `end`.
    #[inline(always)]
    fn add(&self, row: &mut [f32], [from, end]: [usize; 2], depth: usize, weights: &[f32; LANES]) {
        if depth == 1 {
            return self.add_lone(&mut row[from..], weights);
        }
        let (own, next) = (self.own, self.next);
        let mut rest = &mut row[from * depth + self.first..];
        for weight in &weights[..(end - from).min(LANES)] {
            let Some((sums, beyond)) = rest.split_first_chunk_mut::<P>() else { return };
            for i in 0..P {
                sums[i] = own[i].mul_add(*weight, sums[i]);
            }
            if self.both
                && let Some(sums) = beyond.first_chunk_mut::<P>()
            {
                for i in 0..P {
                    sums[i] = next[i].mul_add(*weight, sums[i]);
                }
            }
            let Some(after) = rest.get_mut(depth..) else { return };
            rest = after;
        }
    }

    /// The same where a cell holds one value: the cells themselves fill the vector. (Beyond the sprite weights are zero.)
    #[inline(always)]
    fn add_lone(&self, cells: &mut [f32], weights: &[f32; LANES]) {
        let value = self.own[0];
        let add = |(cell, weight): (&mut f32, &f32)| *cell = value.mul_add(*weight, *cell);
        match cells.first_chunk_mut::<LANES>() {
            Some(cells) => cells.iter_mut().zip(weights).for_each(add),
            None => cells.iter_mut().zip(weights).for_each(add),
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
