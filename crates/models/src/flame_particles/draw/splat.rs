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
    spline,
    sprite::Ellipse,
};

/// The weights of eight cells are found at a time: about a row of a sprite,
const LANES: usize = 8;
/// and chords of sixteen rows: about all of it.
const ROWS: usize = 16;
/// How far cells and rows lie beyond the one before the first. (Without a zero, of which compilers make a special case.)
const BEYOND: [f32; ROWS] = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0, 15.0, 16.0];
/// Least radius of a sprite in cells, for which splines are exact to a few hundredths of a lone sprite's peak.
pub(crate) const COARSE: f32 = 2.75;
/// Rows of one task.
const BAND: usize = 32;
/// Where `s = 1 - b^2/d^2` is less, a sprite has less than 1e-4 of its peak, and is not added.
const FAINT: f32 = 0.045;
/// Coarsest grid: cells of 4096 pixels, twelve octaves.
const COARSEST: usize = 24;

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

/// The sums of all sprites, task by task, on the finest grid that any of them needs, sharpened for splines; `None` where none is seen.
pub(crate) fn splat<const P: usize>(sheet: &Sheet, tasks: &[Vec<Sprite<P>>]) -> Option<Grid> {
    let whole = Whole::new(sheet, tasks);
    let rect = whole.covered(sheet.window)?;
    let finest = whole.finest();
    let mut coarser: Option<Grid> = None;
    for fineness in (finest..COARSEST + 1).step_by(2).rev() {
        let any = whole.counts[fineness..].iter().take(2).any(|count| *count > 0);
        if !any && fineness != finest && coarser.is_none() {
            continue;
        }
        let mut grid = Grid::new(Cells::around(rect, cell_size(fineness)), sheet.layers * P);
        let here = |radius: f32| sheet.fineness(radius).max(finest).wrapping_sub(fineness) < 2;
        add_sprites(sheet, tasks, here, &mut grid);
        if let Some(coarser) = coarser {
            grid.add_coarser(&coarser);
        }
        coarser = Some(spline::sharpened(&grid));
    }
    coarser
}

/// Side of the cells of a fineness, pixels: two to an octave, 1, 2, 3, 4, 6, 8, 12... (There is none of 1.5.)
fn cell_size(fineness: usize) -> usize {
    if fineness.is_multiple_of(2) { 1 << (fineness / 2) } else { 3 << (fineness / 2 - 1) }
}

impl Sheet {
    /// The largest cells that are fine enough for a sprite.
    fn fineness(&self, radius: f32) -> usize {
        // The exponent of a number is its whole octaves, the first bit after it says whether it is half-way to the next.
        let octaves = ((radius / self.least_radius).max(1.0).to_bits() >> 22) as usize - (127 << 1);
        if octaves == 1 { 0 } else { octaves.min(COARSEST) }
    }
}

/// What all sprites together cover and need.
struct Whole {
    low: [f32; 2],
    high: [f32; 2],
    /// How many sprites each fineness suits.
    counts: [usize; COARSEST + 1],
}

impl Whole {
    const NOTHING: Self = Self { low: [f32::MAX; 2], high: [f32::MIN; 2], counts: [0; COARSEST + 1] };

    fn new<const P: usize>(sheet: &Sheet, tasks: &[Vec<Sprite<P>>]) -> Self {
        let of_task = |task: &Vec<Sprite<P>>| {
            let mut whole = Self::NOTHING;
            for Sprite { ellipse, .. } in task {
                for axis in 0..2 {
                    whole.low[axis] = whole.low[axis].min(ellipse.centre[axis] - ellipse.reach[axis]);
                    whole.high[axis] = whole.high[axis].max(ellipse.centre[axis] + ellipse.reach[axis]);
                }
                whole.counts[sheet.fineness(ellipse.radius)] += 1;
            }
            whole
        };
        tasks.par_iter().map(of_task).reduce(|| Self::NOTHING, Self::and)
    }

    fn and(mut self, other: Self) -> Self {
        for axis in 0..2 {
            self.low[axis] = self.low[axis].min(other.low[axis]);
            self.high[axis] = self.high[axis].max(other.high[axis]);
        }
        self.counts.iter_mut().zip(other.counts).for_each(|(own, other)| *own += other);
        self
    }

    /// The fineness that suits all but the smallest sprites; those are widened to it.
    ///
    /// A few far particles would otherwise buy a fine grid of the whole flame.
    fn finest(&self) -> usize {
        /// Share of the sprites that may be finer.
        const FINER: usize = 50;
        let total: usize = self.counts.iter().sum();
        let mut finer = 0;
        let suits = |count: &usize| {
            finer += count;
            finer * FINER > total
        };
        self.counts.iter().position(suits).unwrap_or(0)
    }

    /// The pixels of the window that sprites touch.
    fn covered(&self, window: Rect) -> Option<Rect> {
        let clip = |value: f32, from: usize, to: usize| (value.max(0.0) as usize).clamp(from, to);
        let [x, y] = [(0, window.x, window.right()), (1, window.y, window.bottom())]
            .map(|(axis, from, to)| clip(self.low[axis], from, to));
        let [right, bottom] = [(0, window.x, window.right()), (1, window.y, window.bottom())]
            .map(|(axis, from, to)| clip(self.high[axis] + 1.0, from, to));
        (right > x && bottom > y).then(|| Rect { x, y, width: right - x, height: bottom - y })
    }
}

/// A sprite in the coordinates of a grid.
#[derive(Clone, Copy, Debug)]
struct Placed<const P: usize> {
    centre: [f32; 2],
    /// How `s` falls along a row, for the square of the distance from its middle: a.
    fall: f32,
    /// How far the middle of a row lies to the left, for each row below the centre: b/a.
    lean: f32,
    /// How `s` falls from middle to middle, for the square of the distance from the centre: c - b^2/a.
    fading: f32,
    /// First row and one past the last.
    rows: [i32; 2],
    /// What goes to its own layer and, if anything, to the next.
    layer: usize,
    own: [f32; P],
    next: [f32; P],
    both: bool,
}

impl<const P: usize> Placed<P> {
    #[inline(always)]
    fn new(sheet: &Sheet, sprite: &Sprite<P>, cells: &Cells) -> Self {
        let ellipse = &sprite.ellipse;
        let cell = cells.size as f32;
        let growth = (sheet.least_radius * cell / ellipse.radius.max(1e-3)).max(1.0);
        let scale = cell * cell / (growth * growth);
        let centre = cells.place(ellipse.centre);
        let reach = ellipse.reach[1] * growth / cell * (1.0 - FAINT).sqrt();
        let last = cells.rows as i32;
        let rows =
            [((centre[1] - reach).ceil() as i32).clamp(0, last), ((centre[1] + reach) as i32 + 1).clamp(0, last)];
        let [a, b, c] = ellipse.shape.map(|value| value * scale);
        let lean = b / a;
        let fading = c - b * lean;
        // Sprites that had to be widened are dimmed.
        let dimmed = 1.0 / (growth * growth);
        let (mut own, mut next) = (sprite.values, sprite.values);
        for i in 0..P {
            own[i] *= dimmed * (1.0 - sprite.split);
            next[i] *= dimmed * sprite.split;
        }
        let (layer, both) = (sprite.layer, sprite.split > 0.0);
        Self { centre, fall: a, lean, fading, rows, layer, own, next, both }
    }
}

/// Adds the sprites whose radius belongs `here`, on this grid.
fn add_sprites<const P: usize>(
    sheet: &Sheet,
    tasks: &[Vec<Sprite<P>>],
    here: impl Fn(f32) -> bool + Sync,
    grid: &mut Grid,
) {
    let cells = grid.cells;
    let (row_length, level) = (grid.row_length(), Level::new());
    let bin = |task: &Vec<Sprite<P>>| dispatch!(level, _simd => Binned::new(sheet, task, &cells, &here));
    let binned: Vec<Binned<P>> = tasks.par_iter().map(bin).collect();
    grid.values_mut().par_chunks_mut(BAND * row_length).enumerate().for_each(|(index, values)| {
        let mut band = Band { first: (index * BAND) as i32, columns: cells.columns, layers: sheet.layers, values };
        for task in &binned {
            dispatch!(level, _simd => band.add(sheet.profile, task, index));
        }
    });
}

/// Rows of the grid that one thread fills.
struct Band<'a> {
    first: i32,
    columns: usize,
    layers: usize,
    values: &'a mut [f32],
}

impl Band<'_> {
    #[inline(always)]
    fn add<const P: usize>(&mut self, profile: Profile, task: &Binned<P>, index: usize) {
        let sums = self.values.as_chunks_mut::<P>().0;
        let row_length = self.columns * self.layers;
        let rows = (sums.len() / row_length) as i32;
        for &member in task.of(index) {
            let placed = &task.placed[usize::from(member)];
            let from = placed.rows[0].max(self.first);
            let to = placed.rows[1].min(self.first + rows);
            for start in (from..to).step_by(ROWS) {
                let chords = placed.chords(start, self.columns as i32);
                for y in start..to.min(start + ROWS as i32) {
                    let row = &mut sums[(y - self.first) as usize * row_length..][..row_length];
                    let index = (y - start) as usize;
                    for x in (chords.first[index]..chords.end[index]).step_by(LANES) {
                        let weights = chords.weights(profile, placed.fall, index, x);
                        placed.add(row, x as usize, self.layers, &weights);
                    }
                }
            }
        }
    }
}

impl<const P: usize> Placed<P> {
    /// The sprite in the rows from `first` on, where `s = 1 - (a u^2 + 2 b u v + c v^2)`.
    #[inline(always)]
    fn chords(&self, first: i32, columns: i32) -> Chords {
        let start = (first - 1) as f32 - self.centre[1];
        let widest = 1.0 / self.fall;
        let mut chords = Chords { middle: [0.0; ROWS], most: [0.0; ROWS], first: [0; ROWS], end: [0; ROWS] };
        for row in 0..ROWS {
            let v = start + BEYOND[row];
            let middle = self.centre[0] - self.lean * v;
            let most = 1.0 - self.fading * v * v;
            let half = ((most - FAINT).max(0.0) * widest).sqrt();
            chords.middle[row] = middle;
            chords.most[row] = most;
            chords.first[row] = whole((middle - half).ceil(), columns);
            chords.end[row] = whole((middle + half).floor() + 1.0, columns);
        }
        chords
    }

    /// Adds to a run of a row's cells that begins at column `x`. (Beyond the sprite weights are zero.)
    #[inline(always)]
    fn add(&self, row: &mut [[f32; P]], x: usize, layers: usize, weights: &[f32; LANES]) {
        match (P == 1 && layers == 1, self.both) {
            (true, _) => self.add_lone(&mut row.as_flattened_mut()[x..], weights),
            (_, true) => self.add_run::<true>(&mut row[x * layers + self.layer..], layers, weights),
            (_, false) => self.add_run::<false>(&mut row[x * layers + self.layer..], layers, weights),
        }
    }

    #[inline(always)]
    fn add_run<const BOTH: bool>(&self, run: &mut [[f32; P]], layers: usize, weights: &[f32; LANES]) {
        let mut rest = run;
        for weight in weights {
            let Some((own, next)) = rest.split_first_mut() else { return };
            for i in 0..P {
                own[i] = self.own[i].mul_add(*weight, own[i]);
            }
            if BOTH && let Some(next) = next.first_mut() {
                for i in 0..P {
                    next[i] = self.next[i].mul_add(*weight, next[i]);
                }
            }
            let Some((_, after)) = rest.split_at_mut_checked(layers) else { return };
            rest = after;
        }
    }

    /// The same where a cell holds one value: the cells themselves fill the vector.
    #[inline(always)]
    fn add_lone(&self, cells: &mut [f32], weights: &[f32; LANES]) {
        let value = self.own[0];
        match cells.first_chunk_mut::<LANES>() {
            Some(cells) => {
                for lane in 0..LANES {
                    cells[lane] = value.mul_add(weights[lane], cells[lane]);
                }
            }
            None => {
                for (cell, weight) in cells.iter_mut().zip(weights) {
                    *cell = value.mul_add(*weight, *cell);
                }
            }
        }
    }
}

/// What a sprite is in each of sixteen rows.
struct Chords {
    /// The column where it is strongest, and its `s` there.
    middle: [f32; ROWS],
    most: [f32; ROWS],
    /// The first cell that it covers, and one past the last.
    first: [i32; ROWS],
    end: [i32; ROWS],
}

impl Chords {
    /// Weights of the cells of a row from column `x` on, where `s` falls by `fall` for the square of each column's distance.
    #[inline(always)]
    fn weights(&self, profile: Profile, fall: f32, row: usize, x: i32) -> [f32; LANES] {
        let (start, most) = ((x - 1) as f32 - self.middle[row], self.most[row]);
        let mut weights = [0.0; LANES];
        for lane in 0..LANES {
            let u = start + BEYOND[lane];
            let s = (-fall * u).mul_add(u, most);
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

/// The sprites of a task on a grid, and which of them touch which band: a counting sort that keeps their order.
struct Binned<const P: usize> {
    placed: Vec<Placed<P>>,
    starts: Vec<u32>,
    members: Vec<u16>,
}

impl<const P: usize> Binned<P> {
    #[inline(always)]
    fn new(sheet: &Sheet, task: &[Sprite<P>], cells: &Cells, here: impl Fn(f32) -> bool) -> Self {
        let mut placed = Vec::with_capacity(task.len());
        for sprite in task {
            if here(sprite.ellipse.radius) {
                placed.push(Placed::new(sheet, sprite, cells));
            }
        }
        let bands_of = |placed: &Placed<P>| {
            let [from, to] = placed.rows.map(|row| row as usize);
            if from < to { from / BAND..to.div_ceil(BAND) } else { 0..0 }
        };
        let bands = cells.rows.div_ceil(BAND);
        let mut starts = vec![0_u32; bands + 1];
        for placed in &placed {
            for band in bands_of(placed) {
                starts[band + 1] += 1;
            }
        }
        for band in 0..bands {
            starts[band + 1] += starts[band];
        }
        let mut ends = starts.clone();
        let mut members = vec![0; starts[bands] as usize];
        for (index, placed) in placed.iter().enumerate() {
            for band in bands_of(placed) {
                members[ends[band] as usize] = index as u16;
                ends[band] += 1;
            }
        }
        Self { placed, starts, members }
    }

    fn of(&self, band: usize) -> &[u16] {
        &self.members[self.starts[band] as usize..self.starts[band + 1] as usize]
    }
}
