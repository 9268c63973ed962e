//! A sum of blurs, each twice as wide as the one before, by a pyramid of pictures that are halved (Burt and Adelson 1983).
//!
//! A level is made from the one before by the weights 1, 3, 3, 1 of eighths, and returned to its size by 1, 3, 3, 1 of fourths, in rows and in columns: both are the
//! refinement of quadratic B-splines, so the blur is smooth at every width. Cells are counted from the corner of the picture: cell `i` of a level covers
//! the cells `2 i` and `2 i + 1` of the one before. Levels have cells beyond the edges, where light arrives that partly returns.
//!
//! Every cell is a sum of the same terms in the same order whatever part of the picture is drawn; terms outside of it are zero.

use bansho_base::{
    host::{parallel::prelude::*, scratch_pool::ScratchPool},
    image::{Image, Rect},
};
use fearless_simd::{Level as SimdLevel, dispatch};

use super::{PointSpread, TASK_ROWS};

/// Light beyond this, relative to display white, counts as this much, so that no infinity spreads.
const MAX_LIGHT: f32 = 1e8;

/// The light of a picture.
pub(crate) struct Source<'a> {
    /// The light of the window.
    pub(super) image: &'a Image<4>,
    /// The window, in pixels of the picture.
    pub(super) window: Rect,
    /// Outside of this rectangle there is no light; in pixels of the window.
    pub(super) content: Rect,
    /// The picture's width, if it continues at its other side.
    pub(super) period: Option<usize>,
}

/// Consecutive cells along an axis, from the first to the last.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Cells {
    first: isize,
    last: isize,
}

impl Cells {
    fn of_pixels(first: usize, count: usize) -> Self {
        Self { first: first as isize, last: (first + count) as isize - 1 }
    }

    fn count(self) -> usize {
        (self.last - self.first + 1).max(0) as usize
    }

    /// The cells of half the size that light from these reaches: cell `j` has a share of the cells `2 j - 1` to `2 j + 2`.
    fn halved(self) -> Self {
        Self { first: (self.first - 1) >> 1, last: (self.last + 1) >> 1 }
    }

    fn grown(self, cells: isize) -> Self {
        Self { first: self.first - cells, last: self.last + cells }
    }

    /// The index of a cell, if it is one of these.
    fn index(self, cell: isize) -> Option<usize> {
        (self.first..=self.last).contains(&cell).then(|| (cell - self.first) as usize)
    }
}

/// A level of the pyramid.
#[derive(Default)]
struct Level {
    columns: Cells,
    rows: Cells,
    values: Vec<[f32; 4]>,
}

impl Level {
    /// The cells of a row; `None` beyond the level's edges.
    fn cells(&self, row: isize) -> Option<&[[f32; 4]]> {
        let width = self.columns.count();
        self.rows.index(row).map(|index| &self.values[index * width..][..width])
    }
}

/// Rows of cells from which a coarser level is made.
trait SourceRows {
    /// The cells of a row that may have light, and the column of the first of them.
    fn row(&self, row: isize) -> Option<(isize, &[[f32; 4]])>;

    /// Adds `weight` times the cells to the sums.
    fn accumulate(sums: &mut [[f32; 4]], cells: &[[f32; 4]], weight: f32);
}

impl SourceRows for Source<'_> {
    fn row(&self, row: isize) -> Option<(isize, &[[f32; 4]])> {
        let y = usize::try_from(row - self.window.y as isize).ok()?;
        let content = self.content.x..self.content.right();
        let is_empty = content.is_empty() || !(self.content.y..self.content.bottom()).contains(&y);
        (!is_empty).then(|| ((self.window.x + content.start) as isize, &self.image.row(y)[content]))
    }

    #[inline(always)]
    fn accumulate(sums: &mut [[f32; 4]], cells: &[[f32; 4]], weight: f32) {
        for (sum, value) in sums.as_flattened_mut().iter_mut().zip(cells.as_flattened()) {
            *sum += weight * bounded(*value);
        }
    }
}

impl SourceRows for Level {
    fn row(&self, row: isize) -> Option<(isize, &[[f32; 4]])> {
        self.cells(row).map(|cells| (self.columns.first, cells))
    }

    #[inline(always)]
    fn accumulate(sums: &mut [[f32; 4]], cells: &[[f32; 4]], weight: f32) {
        for (sum, value) in sums.as_flattened_mut().iter_mut().zip(cells.as_flattened()) {
            *sum += weight * value;
        }
    }
}

/// A component of light within [`MAX_LIGHT`] of 0; NaN becomes 0.
#[inline(always)]
fn bounded(light: f32) -> f32 {
    let finite = if light > -MAX_LIGHT { light } else { 0.0 };
    if finite < MAX_LIGHT { finite } else { MAX_LIGHT }
}

/// Rows of sums, for the tasks of all threads.
type ScratchRows = ScratchPool<Vec<[f32; 4]>, fn() -> Vec<[f32; 4]>>;

/// The levels of a pyramid, whose memory is used again from frame to frame.
pub(crate) struct Pyramid {
    levels: Vec<Level>,
    rows: ScratchRows,
}

impl Default for Pyramid {
    fn default() -> Self {
        Self { levels: Vec::new(), rows: ScratchPool::new(Vec::new) }
    }
}

impl Pyramid {
    /// Scatters the light of a picture: afterwards [`glare_row`](Self::glare_row) has the glare of each of its rows.
    pub(super) fn spread(&mut self, source: &Source, spread: &PointSpread) {
        let simd = bansho_base::math::simd::level();
        let weights = spread.weights();
        self.levels.resize_with(weights.len(), Level::default);
        let columns = Cells::of_pixels(source.window.x, source.window.width).halved();
        let rows = Cells::of_pixels(source.window.y, source.window.height).halved();
        // A panorama continues on both sides, as far as light is scattered.
        let margin = source.period.map_or(0, |_| spread.reach() as isize / 2);
        let [first, ..] = &mut self.levels[..] else { return };
        first.resize(columns.grown(margin), rows);
        first.reduce(simd, source, source.period, &self.rows);
        for index in 1..self.levels.len() {
            let (finer, coarser) = self.levels.split_at_mut(index);
            let (finer, coarser) = (&finer[index - 1], &mut coarser[0]);
            coarser.resize(finer.columns.halved(), finer.rows.halved());
            coarser.reduce(simd, finer, None, &self.rows);
        }
        // From the coarsest level on, each gets the light of the coarser ones besides its own share.
        for index in (0..self.levels.len()).rev() {
            let (finer, coarser) = self.levels.split_at_mut(index + 1);
            finer[index].add_coarser(simd, weights[index], coarser.first(), &self.rows);
        }
    }

    /// The glare of the pixels of row `y` of the picture from column `x` on, whose light is `own`: what arrives from others less what is lost to them.
    pub(super) fn glare_row(
        &self,
        simd: SimdLevel,
        spread: &PointSpread,
        [x, y]: [usize; 2],
        own: &[[f32; 4]],
        glare: &mut Vec<[f32; 4]>,
    ) {
        glare.clear();
        glare.resize(own.len(), [0.0; 4]);
        let Some(finest) = self.levels.first() else { return };
        let columns = Cells::of_pixels(x, own.len());
        let lost = spread.scattered();
        self.rows.with(|sums| {
            dispatch!(simd, _simd => expand_row(finest, y as isize, columns, sums, glare));
            dispatch!(simd, _simd => subtract(glare, own, lost));
        });
    }
}

impl Level {
    fn resize(&mut self, columns: Cells, rows: Cells) {
        (self.columns, self.rows) = (columns, rows);
        self.values.resize(columns.count() * rows.count(), [0.0; 4]);
    }

    /// Makes this level from the finer one, which may continue at its other side after a period.
    fn reduce<S: SourceRows + Sync>(
        &mut self,
        simd: SimdLevel,
        finer: &S,
        period: Option<usize>,
        scratch: &ScratchRows,
    ) {
        let (columns, first_row, width) = (self.columns, self.rows.first, self.columns.count());
        self.values.par_chunks_mut(TASK_ROWS * width).enumerate().for_each(|(task, rows)| {
            scratch.with(|sums| {
                for (index, out) in rows.chunks_mut(width).enumerate() {
                    let row = first_row + (task * TASK_ROWS + index) as isize;
                    dispatch!(simd, _simd => reduce_row(finer, row, columns, period, sums, out));
                }
            });
        });
    }

    /// Multiplies this level by its weight, and adds the coarser one.
    fn add_coarser(&mut self, simd: SimdLevel, weight: f32, coarser: Option<&Self>, scratch: &ScratchRows) {
        let (columns, first_row, width) = (self.columns, self.rows.first, self.columns.count());
        self.values.par_chunks_mut(TASK_ROWS * width).enumerate().for_each(|(task, rows)| {
            scratch.with(|sums| {
                for (index, out) in rows.chunks_mut(width).enumerate() {
                    let row = first_row + (task * TASK_ROWS + index) as isize;
                    dispatch!(simd, _simd => scale(out, weight));
                    if let Some(coarser) = coarser {
                        dispatch!(simd, _simd => expand_row(coarser, row, columns, sums, out));
                    }
                }
            });
        });
    }
}

#[inline(always)]
fn scale(cells: &mut [[f32; 4]], weight: f32) {
    for value in cells.as_flattened_mut() {
        *value *= weight;
    }
}

/// Subtracts the fraction `lost` of the light. Alpha has no glare.
#[inline(always)]
fn subtract(glare: &mut [[f32; 4]], light: &[[f32; 4]], lost: f32) {
    for (glare, light) in glare.iter_mut().zip(light) {
        for c in 0..3 {
            glare[c] -= lost * bounded(light[c]);
        }
        glare[3] = 0.0;
    }
}

/// Computes a row of cells from four rows of the finer level.
#[inline(always)]
fn reduce_row<S: SourceRows>(
    finer: &S,
    row: isize,
    columns: Cells,
    period: Option<usize>,
    sums: &mut Vec<[f32; 4]>,
    out: &mut [[f32; 4]],
) {
    // Two cells for each of this row, and one more on either side.
    let first = 2 * columns.first - 1;
    sums.clear();
    sums.resize(2 * columns.count() + 2, [0.0; 4]);
    for (offset, weight) in [(-1, 0.125), (0, 0.375), (1, 0.375), (2, 0.125)] {
        let Some((start, cells)) = finer.row(2 * row + offset) else { continue };
        let (skipped, begin) = ((first - start).max(0) as usize, (start - first).max(0) as usize);
        if let (Some(cells), Some(sums)) = (cells.get(skipped..), sums.get_mut(begin..)) {
            S::accumulate(sums, cells, weight);
        }
    }
    if let Some(period) = period {
        for index in 0..sums.len() {
            let column = first + index as isize;
            sums[index] = sums[(column.rem_euclid(period as isize) - first) as usize];
        }
    }
    let (pairs, next_pairs) = (sums.as_chunks::<2>().0, sums[2..].as_chunks::<2>().0);
    for (out, ([a, b], [c, d])) in out.iter_mut().zip(pairs.iter().zip(next_pairs)) {
        for channel in 0..4 {
            out[channel] = 0.125 * (a[channel] + d[channel]) + 0.375 * (b[channel] + c[channel]);
        }
    }
}

/// Adds to a row of cells what the coarser level contributes to them.
#[inline(always)]
fn expand_row(coarser: &Level, row: isize, columns: Cells, sums: &mut Vec<[f32; 4]>, out: &mut [[f32; 4]]) {
    let cells = columns.halved();
    sums.clear();
    sums.resize(cells.count() + 2, [0.0; 4]);
    // An odd cell is in the second half of a coarser one, whose next neighbor has a share in it; an even one in the first half.
    let near = row >> 1;
    let far = near - 1 + 2 * (row & 1);
    for (row, weight) in [(near, 0.75), (far, 0.25)] {
        let Some(values) = coarser.cells(row) else { continue };
        let start = coarser.columns.first;
        let (skipped, begin) = ((cells.first - start).max(0) as usize, (start - cells.first).max(0) as usize);
        if let (Some(values), Some(sums)) = (values.get(skipped..), sums.get_mut(begin..)) {
            Level::accumulate(sums, values, weight);
        }
    }
    // The first pair begins with an even column.
    let is_odd = columns.first & 1 == 1;
    let first_near = ((columns.first >> 1) - cells.first) as usize;
    if let (true, Some(out)) = (is_odd, out.first_mut()) {
        add_mix(out, sums[first_near], sums[first_near + 1]);
    }
    let out = &mut out[usize::from(is_odd).min(columns.count())..];
    let before_first_pair = first_near + usize::from(is_odd) - 1;
    let neighbors = &sums[before_first_pair..];
    let (pairs, last) = out.as_chunks_mut::<2>();
    for ([even, odd], [left, near, right]) in pairs.iter_mut().zip(neighbors.array_windows()) {
        add_mix(even, *near, *left);
        add_mix(odd, *near, *right);
    }
    if let ([even], [left, near, ..]) = (last, &neighbors[pairs.len()..]) {
        add_mix(even, *near, *left);
    }
}

#[inline(always)]
fn add_mix(sum: &mut [f32; 4], near: [f32; 4], far: [f32; 4]) {
    for c in 0..4 {
        sum[c] += 0.75 * near[c] + 0.25 * far[c];
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::math::simd::{self, VectorLevel};

    use super::{super::grown, *};

    const SIZE: [usize; 2] = [220, 150];

    /// A picture with single bright pixels.
    fn picture(bright: &[[usize; 2]]) -> Image<4> {
        let mut image = Image::filled(SIZE[0], SIZE[1], [0.0; 4]);
        for [x, y] in bright {
            image.pixels_mut()[y * SIZE[0] + x] = [1.0, 2.0, 4.0, 1.0];
        }
        image
    }

    fn spread() -> PointSpread {
        // 4.4 pixels for a degree.
        PointSpread::new(0.1, 250.0).unwrap()
    }

    /// The part `window` of the glare of a picture, of which only that window is drawn.
    fn glare_of(image: &Image<4>, drawn: Rect, window: Rect, period: Option<usize>) -> Vec<[f32; 4]> {
        let part = image.crop(drawn).unwrap();
        let content = Rect::from_size(drawn.width, drawn.height);
        let mut pyramid = Pyramid::default();
        pyramid.spread(&Source { image: &part, window: drawn, content, period }, &spread());
        let (mut glare, mut row) = (Vec::new(), Vec::new());
        for y in window.y..window.bottom() {
            let own = &image.row(y)[window.x..window.right()];
            pyramid.glare_row(simd::level(), &spread(), [window.x, y], own, &mut row);
            glare.extend_from_slice(&row);
        }
        glare
    }

    fn whole() -> Rect {
        Rect::from_size(SIZE[0], SIZE[1])
    }

    #[test]
    fn what_a_pixel_loses_its_surroundings_gain_as_far_as_the_spread_says() {
        for [x, y] in [[110, 75], [111, 75], [116, 70]] {
            let glare = glare_of(&picture(&[[x, y]]), whole(), whole(), None);
            let (mut sum, mut moment) = (0.0, 0.0);
            for (index, pixel) in glare.iter().enumerate() {
                let [dx, dy] = [index % SIZE[0], index / SIZE[0]];
                let (across, down) = (dx as f64 - x as f64, dy as f64 - y as f64);
                let squared = across * across + down * down;
                sum += f64::from(pixel[2]);
                moment += f64::from(pixel[2]) * squared;
                assert_eq!(pixel[3], 0.0, "alpha");
                let reach = spread().reach() as f64;
                assert!(squared <= 2.0 * reach * reach || *pixel == [0.0; 4], "{pixel:?} beyond {reach} pixels");
            }
            assert!(sum.abs() < 1e-5, "{sum} of light has come or gone");
            // Twice the variance of one axis: sum of w_k (4^k - 1), here of light 4.
            let weights = spread().weights().to_vec();
            let variances = weights
                .iter()
                .enumerate()
                .map(|(index, weight)| f64::from(*weight) * (f64::from(4_u32.pow(index as u32 + 1)) - 1.0));
            let expected: f64 = 4.0 * variances.sum::<f64>();
            assert!((moment / expected - 1.0).abs() < 0.02, "({x}, {y}): {moment} is not {expected}");
        }
    }

    #[test]
    fn a_part_of_the_picture_has_the_same_bits_as_the_whole() {
        let image = picture(&[[110, 75], [3, 2], [219, 149], [60, 100], [61, 100]]);
        for window in [
            Rect { x: 100, y: 70, width: 30, height: 17 },
            Rect { x: 0, y: 0, width: 11, height: 5 },
            Rect { x: 209, y: 140, width: 11, height: 10 },
        ] {
            let [x, end_x] = grown(window.x..window.right(), SIZE[0], &spread());
            let [y, end_y] = grown(window.y..window.bottom(), SIZE[1], &spread());
            let drawn = Rect { x, y, width: end_x - x, height: end_y - y };
            let part = glare_of(&image, drawn, window, None);
            let expected = glare_of(&image, whole(), window, None);
            let bits =
                |glare: &[[f32; 4]]| glare.as_flattened().iter().map(|v| (v + 0.0).to_bits()).collect::<Vec<_>>();
            assert_eq!(bits(&part), bits(&expected), "{window:?}");
        }
    }

    #[test]
    fn a_panorama_continues_at_its_other_side() {
        let [seam, middle] =
            [[1, 75], [111, 75]].map(|bright| glare_of(&picture(&[bright]), whole(), whole(), Some(SIZE[0])));
        // Turned by 110 pixels, which is no multiple of all blocks: the blur is nearly the same at every phase.
        for y in 0..SIZE[1] {
            for x in 0..SIZE[0] {
                let turned = middle[y * SIZE[0] + (x + 110) % SIZE[0]][1];
                let value = seam[y * SIZE[0] + x][1];
                assert!((value - turned).abs() < 2e-4, "({x}, {y}): {value} is not {turned}");
            }
        }
    }

    #[test]
    fn empty_pixels_and_infinite_light_do_not_spoil_others() {
        let mut image = picture(&[]);
        image.pixels_mut()[75 * SIZE[0] + 20] = [f32::INFINITY, f32::NAN, f32::NEG_INFINITY, 1.0];
        let glare = glare_of(&image, whole(), whole(), None);
        assert!(glare.as_flattened().iter().all(|value| value.is_finite()));
        assert_eq!(glare[75 * SIZE[0] + 219], [0.0; 4], "far away there is nothing");
    }

    #[test]
    fn every_vector_level_gives_the_same_bits() {
        let image = picture(&[[110, 75], [30, 20], [31, 20]]);
        let source = Source { image: &image, window: whole(), content: whole(), period: None };
        let mut pyramid = Pyramid::default();
        pyramid.spread(&source, &spread());
        let mut rows = VectorLevel::available().into_iter().filter_map(VectorLevel::level).map(|level| {
            let mut row = Vec::new();
            pyramid.glare_row(level, &spread(), [0, 60], image.row(60), &mut row);
            row
        });
        let first = rows.next().unwrap();
        assert!(rows.all(|row| row == first));
    }
}
