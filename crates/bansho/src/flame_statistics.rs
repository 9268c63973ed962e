//! Statistics by which pictures of flames can be judged and compared, over the frames of a film: section 5 of Ohshima and Itahashi wishes for such a method.
//!
//! A pixel is lit where red is above [`LIT`]. Whatever else is bright counts as flame, so that the scene should show only the flame.
//!
//! ```
//! use bansho::{base::image::Image, flame_statistics::FlameMask};
//!
//! // A frame of 4 x 4 pixels, scene-linear: a column of flame with a gap, and a spark.
//! let orange = [0.6, 0.2, 0.02, 1.0];
//! let mut frame = Image::filled(4, 4, [0.0, 0.0, 0.0, 1.0]);
//! for index in [1, 5, 13, 8] {
//!     frame.pixels_mut()[index] = orange;
//! }
//! let mask = FlameMask::new(&frame);
//! assert_eq!(mask.area(), 0.25);
//! assert_eq!(mask.extent(0), Some([1, 1]));
//! ```

use std::{ops::Range, sync::Arc};

use bansho_base::{
    color::{encode_srgb, srgb_from_acescg},
    host::observer::Observer,
    image::Image,
};
use bansho_render::{CompiledScene, Plan, RenderError, Shot};

/// Linear red above which a pixel is lit; 1 is display white.
pub const LIT: f32 = 0.02;
/// Blue over red, as encoded for a display, above which a lit pixel is pale.
pub const PALE: f32 = 0.5;
/// Pixels of the smallest piece; smaller ones are sparks and noise.
pub const SMALLEST_PIECE: usize = 4;

/// The lit pixels of a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct FlameMask {
    width: usize,
    /// Linear sRGB, row after row from the top.
    colors: Vec<[f32; 3]>,
    lit: Vec<bool>,
}

impl FlameMask {
    /// The lit pixels of a scene-linear picture in ACEScg, exposed so that 1 is display white.
    #[must_use]
    pub fn new(picture: &Image<4>) -> Self {
        let colors: Vec<[f32; 3]> =
            picture.pixels().iter().map(|[r, g, b, _]| srgb_from_acescg([*r, *g, *b])).collect();
        let lit = colors.iter().map(|color| color[0] > LIT).collect();
        Self { width: picture.width(), colors, lit }
    }

    /// Number of rows.
    fn height(&self) -> usize {
        self.lit.len() / self.width.max(1)
    }

    /// First and last lit column of a row, counted from the top; `None` where the row is dark or outside.
    #[must_use]
    pub fn extent(&self, row: usize) -> Option<[usize; 2]> {
        let row = self.lit.get(row * self.width..(row + 1) * self.width)?;
        Some([row.iter().position(|lit| *lit)?, row.iter().rposition(|lit| *lit)?])
    }

    /// Lit area as a fraction of the picture.
    #[must_use]
    pub fn area(&self) -> f64 {
        ratio(count(&self.lit), self.lit.len())
    }

    /// The lowest lit row; `None` in a dark picture.
    fn base(&self) -> Option<usize> {
        (0..self.height()).rev().find(|row| self.extent(*row).is_some())
    }

    /// Distance from the highest to the lowest lit row as a fraction of the picture's height; 0 in a dark picture.
    #[must_use]
    pub fn lit_height(&self) -> f64 {
        let top = (0..self.height()).find(|row| self.extent(*row).is_some());
        top.zip(self.base()).map_or(0.0, |(top, base)| ratio(base + 1 - top, self.height()))
    }

    /// Width of the lowest lit row relative to the greatest width: 1 for a flame that is cut off at its base. NaN in a dark picture.
    #[must_use]
    pub fn base_width(&self) -> f64 {
        let width = |row: usize| self.extent(row).map_or(0, |[left, right]| right + 1 - left);
        let widest = (0..self.height()).map(width).max().unwrap_or(0);
        self.base().map_or(f64::NAN, |base| ratio(width(base), widest))
    }

    /// Fraction of the pixels between the first and the last lit one of each row that are lit; NaN if none is.
    #[must_use]
    pub fn filled(&self, rows: Range<usize>) -> f64 {
        let (mut lit, mut all) = (0, 0);
        for row in rows {
            if let Some([left, right]) = self.extent(row) {
                lit += count(&self.lit[row * self.width + left..=row * self.width + right]);
                all += right + 1 - left;
            }
        }
        ratio(lit, all)
    }

    /// Pixels above, below and beside a pixel.
    fn neighbors(&self, index: usize) -> impl Iterator<Item = usize> {
        let x = index % self.width;
        let sides = [(x > 0).then(|| index - 1), (x + 1 < self.width).then_some(index + 1)];
        let ends = [index.checked_sub(self.width), Some(index + self.width).filter(|below| *below < self.lit.len())];
        sides.into_iter().chain(ends).flatten()
    }

    /// Number of connected pieces of at least [`SMALLEST_PIECE`] pixels.
    #[must_use]
    pub fn pieces(&self) -> usize {
        let mut visited = vec![false; self.lit.len()];
        let mut pieces = 0;
        for start in 0..self.lit.len() {
            let (mut size, mut open) = (0, vec![start]);
            while let Some(index) = open.pop() {
                if self.lit[index] && !visited[index] {
                    visited[index] = true;
                    size += 1;
                    open.extend(self.neighbors(index));
                }
            }
            pieces += usize::from(size >= SMALLEST_PIECE);
        }
        pieces
    }

    /// Fraction of the lit pixels that are pale: with blue more than [`PALE`] times red, as encoded. NaN in a dark picture.
    #[must_use]
    pub fn pale(&self) -> f64 {
        let lit = self.colors.iter().zip(&self.lit).filter(|(_, lit)| **lit);
        let pale = lit.filter(|([red, _, blue], _)| encode_srgb(blue.max(0.0)) > PALE * encode_srgb(*red)).count();
        ratio(pale, count(&self.lit))
    }

    /// Mean of green over red, as encoded, at the edge of the pieces, relative to that at least three pixels inside: below 1 the edges are redder. NaN if no
    /// piece is as wide.
    #[must_use]
    pub fn edge_redness(&self) -> f64 {
        let once = self.eroded(&self.lit);
        let thrice = self.eroded(&self.eroded(&once));
        self.green_over_red(|index| self.lit[index] && !once[index]) / self.green_over_red(|index| thrice[index])
    }

    /// The pixels of a mask whose neighbors are in it too.
    fn eroded(&self, mask: &[bool]) -> Vec<bool> {
        (0..mask.len()).map(|index| mask[index] && self.neighbors(index).all(|next| mask[next])).collect()
    }

    fn green_over_red(&self, is_chosen: impl Fn(usize) -> bool) -> f64 {
        let chosen = (0..self.lit.len()).filter(|index| is_chosen(*index));
        let ratios = chosen.map(|index| {
            let [red, green, _] = self.colors[index];
            f64::from(encode_srgb(green.max(0.0)) / encode_srgb(red))
        });
        mean(ratios)
    }
}

/// The lit pixels of a frame of a film.
#[derive(Clone, Debug, PartialEq)]
pub struct FilmFrame {
    /// Its number.
    pub number: i64,
    /// Its lit pixels.
    pub mask: FlameMask,
}

/// Draws `count` frames of a plan, its first and others at equal distances, `height` pixels high, and finds their lit pixels. There are fewer if the plan has
/// fewer.
///
/// # Errors
/// A frame cannot be drawn.
pub fn draw_film(
    compiled: Arc<CompiledScene>,
    plan: &Plan,
    count: usize,
    height: usize,
    observer: &dyn Observer,
) -> Result<Vec<FilmFrame>, RenderError> {
    let [full_width, full_height] = plan.size();
    let width = (full_width * height).div_ceil(full_height).max(1);
    let frames = plan.frames();
    let length = (frames.end - frames.start).max(1);
    let count = i64::try_from(count).unwrap_or(i64::MAX).min(length);
    let mut shot = Shot::open(compiled, Arc::new(plan.at_size([width, height])));
    let numbers = (0..count).map(|index| frames.start + index * length / count);
    numbers
        .map(|number| {
            let frame = crate::draw(&mut shot, number, observer)?;
            Ok(FilmFrame { number, mask: FlameMask::new(&frame.beauty) })
        })
        .collect()
}

/// Means over the frames of a film.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlameStatistics {
    /// Height at which there is flame half of the time (Zukoski's flame height), above the lowest lit row of all frames, as a fraction of the picture's height.
    pub height: f64,
    /// Fraction of the outline's inside that is lit, in the lower third of that height.
    pub body: f64,
    /// Number of pieces that are apart from each other: [`FlameMask::pieces`].
    pub pieces: f64,
    /// [`FlameMask::edge_redness`].
    pub edge_redness: f64,
    /// [`FlameMask::base_width`].
    pub base_width: f64,
    /// [`FlameMask::pale`].
    pub pale: f64,
    /// [`FlameMask::area`].
    pub area: f64,
}

impl FlameStatistics {
    /// The statistics of frames of one size; `None` if all are dark. Means leave out frames in which there is nothing to measure.
    #[must_use]
    pub fn new(masks: &[FlameMask]) -> Option<Self> {
        Self::of_masks(&masks.iter().collect::<Vec<_>>())
    }

    /// The statistics of a film that was drawn; `None` if it is dark.
    #[must_use]
    pub fn of_film(frames: &[FilmFrame]) -> Option<Self> {
        Self::of_masks(&frames.iter().map(|frame| &frame.mask).collect::<Vec<_>>())
    }

    fn of_masks(masks: &[&FlameMask]) -> Option<Self> {
        let base = masks.iter().filter_map(|mask| mask.base()).max()?;
        let frames_with_flame = |row: usize| masks.iter().filter(|mask| mask.extent(row).is_some()).count();
        let top = (0..=base).find(|row| 2 * frames_with_flame(*row) >= masks.len()).unwrap_or(base);
        let lower_third = base - (base - top) / 3..base;
        let rows = masks.iter().map(|mask| mask.height()).max().unwrap_or(0);
        Some(Self {
            height: ratio(base - top, rows),
            body: mean(masks.iter().map(|mask| mask.filled(lower_third.clone()))),
            pieces: mean(masks.iter().map(|mask| mask.pieces() as f64)),
            edge_redness: mean(masks.iter().map(|mask| mask.edge_redness())),
            base_width: mean(masks.iter().map(|mask| mask.base_width())),
            pale: mean(masks.iter().map(|mask| mask.pale())),
            area: mean(masks.iter().map(|mask| mask.area())),
        })
    }
}

fn count(mask: &[bool]) -> usize {
    mask.iter().filter(|lit| **lit).count()
}

fn ratio(part: usize, whole: usize) -> f64 {
    part as f64 / whole as f64
}

/// Mean of the numbers among `values`; NaN if there are none.
fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for value in values.filter(|value| !value.is_nan()) {
        sum += value;
        count += 1.0;
    }
    sum / count
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A picture of characters: `#` is orange, `o` pale, `r` red; everything else is dark.
    fn mask(rows: &[&str]) -> FlameMask {
        let pixels = rows.iter().flat_map(|row| row.chars()).map(|character| match character {
            '#' => [0.6, 0.25, 0.02, 1.0],
            'o' => [0.9, 0.85, 0.8, 1.0],
            'r' => [0.4, 0.05, 0.01, 1.0],
            _ => [0.0, 0.0, 0.0, 1.0],
        });
        FlameMask::new(&Image::from_pixels(rows[0].len(), rows.len(), pixels.collect()).unwrap())
    }

    #[test]
    fn pieces_of_four_pixels_count_and_touch_by_sides() {
        let flame = mask(&["##..#", "##..#", "..#..", ".####"]);
        // A square, two pixels, and five pixels that touch the square by a corner only.
        assert_eq!((flame.pieces(), flame.area()), (2, 11.0 / 20.0));
        assert_eq!(mask(&["....", "...."]).pieces(), 0);
    }

    #[test]
    fn shape_is_measured_from_the_lowest_lit_row() {
        let flame = mask(&["......", "..#...", "#.##.#", "..##..", "......"]);
        assert_eq!((flame.extent(2), flame.extent(4), flame.extent(9)), (Some([0, 5]), None, None));
        assert_eq!((flame.lit_height(), flame.base_width()), (3.0 / 5.0, 2.0 / 6.0));
        // 4 of 6 and 2 of 2.
        assert_eq!(flame.filled(2..4), 6.0 / 8.0);
        let dark = mask(&["...", "..."]);
        assert_eq!((dark.lit_height(), dark.area()), (0.0, 0.0));
        assert!(dark.base_width().is_nan() && dark.pale().is_nan() && dark.edge_redness().is_nan());
    }

    #[test]
    fn red_edges_and_pale_pixels_are_told() {
        assert_eq!(mask(&["##o", "o#."]).pale(), 2.0 / 5.0);
        let rim: Vec<String> = (0..9)
            .map(|y| (0..9).map(|x| if [x, y].iter().any(|side| [0, 8].contains(side)) { 'r' } else { '#' }).collect())
            .collect();
        let rows: Vec<&str> = rim.iter().map(String::as_str).collect();
        // The border of the picture is no edge of the flame: nothing is dark beyond it, as far as is known.
        assert!(mask(&rows).edge_redness().is_nan());
        let framed: Vec<String> = [".".repeat(11)]
            .into_iter()
            .chain(rim.iter().map(|row| format!(".{row}.")))
            .chain([".".repeat(11)])
            .collect();
        let rows: Vec<&str> = framed.iter().map(String::as_str).collect();
        let redness = mask(&rows).edge_redness();
        assert!(redness < 0.5, "{redness}");
    }

    #[test]
    fn a_film_has_the_height_that_burns_half_of_the_time() {
        let low = mask(&["...", "...", ".#.", "###"]);
        let high = mask(&["...", ".#.", ".#.", "###"]);
        let highest = mask(&[".#.", ".#.", ".#.", "###"]);
        let film = FlameStatistics::new(&[low.clone(), low.clone(), high, highest]).unwrap();
        // Row 1 is lit in two of four frames.
        assert_eq!((film.height, film.pieces, film.base_width), (2.0 / 4.0, 1.0, 1.0));
        let dark = mask(&["...", "...", "...", "..."]);
        assert_eq!(FlameStatistics::new(std::slice::from_ref(&dark)), None);
        let flickering = FlameStatistics::new(&[low, dark]).unwrap();
        assert_eq!((flickering.base_width, flickering.area), (1.0, 4.0 / 24.0));
    }
}
