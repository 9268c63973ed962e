//! The texture T(R, D): the streaks of all drops of one diameter in a cell, seen from the side.
//!
//! Each row holds the running sum of its opacities, so that the mean over any stretch is a difference of two look-ups: a pixel
//! gets exactly what its width covers, near and far, without a pyramid of smaller textures.

use bansho_base::{
    image::Image,
    random::{Key, Purpose},
};

use crate::rain::{streak::Streak, texture::draw_streak};

/// Texels across a cell, 0.5 mm each: narrower than the drops that are seen one by one.
pub(crate) const COLUMNS: usize = 2048;
/// Numbers of a row: sums up to each texel, and of all.
const STRIDE: usize = COLUMNS + 1;
/// Texels that one bit says to be empty or not.
pub(crate) const GROUP: usize = COLUMNS / 64;
/// Most and fewest rows; streaks of a usual exposure need few, since all along them is alike.
const ROWS: [usize; 2] = [128, 512];
/// Rows that a streak should cover.
const ROWS_OF_STREAK: f64 = 8.0;

const PLACE: Purpose = Purpose::named("rain drops of a texture");

/// What a sheet shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Contents {
    /// Drops; the last one counts by the fractional part.
    pub(crate) count: f64,
    /// What each of them leaves.
    pub(crate) streak: Streak,
    /// Width and height of the cell, m.
    pub(crate) cell: [f64; 2],
}

/// A texture that repeats in both directions.
#[derive(Clone, Debug)]
pub(crate) struct Sheet {
    rows: usize,
    /// Running sums of opacity in texels, row after row.
    sums: Vec<f32>,
    /// A bit for each group of texels of each row, set where there is anything.
    occupied: Vec<u64>,
    /// Greatest opacity of any texel.
    peak: f32,
}

impl Sheet {
    /// Draws the drops `variant` of `purpose`: drop after drop, so that one with more drops has the same and others.
    pub(crate) fn new(contents: &Contents, key: Key, purpose: Purpose, variant: u64) -> Self {
        let Streak { radius, length } = contents.streak;
        let wanted = ROWS_OF_STREAK * contents.cell[1] / length.max(2.0 * radius).max(1e-9);
        let rows = (wanted.min(1e6) as usize).next_power_of_two().clamp(ROWS[0], ROWS[1]);
        let mut image = Image::filled(COLUMNS, rows, [0.0]);
        let [width, height] = contents.cell;
        let pixel = [width / COLUMNS as f64, height / rows as f64];
        let purpose = Purpose(PLACE.0 ^ purpose.0);
        for index in 0..contents.count.ceil() as u64 {
            let [x, y, ..] = key.uniforms(variant << 32 | index, 0, purpose).map(f64::from);
            let share = (contents.count - index as f64).min(1.0);
            draw_streak(&contents.streak, [x * width, y * height], pixel, share, &mut image);
        }
        Self::sum_up(&image)
    }

    /// Turns opacities into their running sums.
    fn sum_up(image: &Image<1>) -> Self {
        let rows = image.height();
        let mut sheet = Self { rows, sums: vec![0.0; rows * STRIDE], occupied: vec![0; rows], peak: 0.0 };
        for (y, (sums, occupied)) in sheet.sums.chunks_exact_mut(STRIDE).zip(&mut sheet.occupied).enumerate() {
            let mut sum = 0.0_f64;
            for (column, [opacity]) in image.row(y).iter().enumerate() {
                if *opacity > 0.0 {
                    *occupied |= 1 << (column / GROUP);
                }
                sheet.peak = sheet.peak.max(*opacity);
                sum += f64::from(*opacity);
                sums[column + 1] = sum as f32;
            }
        }
        sheet
    }

    /// Greatest opacity of any texel, and so of any pixel that shows texels.
    pub(crate) fn peak(&self) -> f32 {
        self.peak
    }

    /// The row at a height in cells, which wraps.
    #[inline(always)]
    pub(crate) fn row(&self, height: f32) -> SheetRow<'_> {
        let place = (height - height.floor()) * self.rows as f32;
        let row = (place as usize).min(self.rows - 1);
        // The slice is of that very length.
        let sums = self.sums[row * STRIDE..].first_chunk::<STRIDE>().unwrap_or(&EMPTY);
        SheetRow { sums, occupied: self.occupied[row] }
    }
}

static EMPTY: [f32; STRIDE] = [0.0; STRIDE];

/// A row of a texture.
#[derive(Clone, Copy)]
pub(crate) struct SheetRow<'a> {
    sums: &'a [f32; STRIDE],
    occupied: u64,
}

impl SheetRow<'_> {
    /// Whether there is anything between two places, in texels, which wrap.
    #[inline(always)]
    pub(crate) fn is_empty_between(&self, low: f32, high: f32) -> bool {
        let (first, last) =
            ((low.floor() as i32).div_euclid(GROUP as i32), (high.floor() as i32).div_euclid(GROUP as i32));
        let count = (last - first + 1) as u32;
        if count >= 64 {
            return self.occupied == 0;
        }
        self.occupied.rotate_right(first as u32 & 63) & ((1 << count) - 1) == 0
    }

    /// Sum of the opacities of all texels left of a place, which wraps and lies within 2^21 of 0.
    #[inline(always)]
    pub(crate) fn sum_until(&self, place: f32) -> f32 {
        self.sums_until(&[place])[0]
    }

    /// [`sum_until`](Self::sum_until) for many places, in steps that become vectors but for the look-up itself.
    #[inline(always)]
    pub(crate) fn sums_until<const N: usize>(&self, places: &[f32; N]) -> [f32; N] {
        /// 3 * 2^22: adding it rounds to a whole number, which then stands in the low bits of the sum.
        const ROUND: f32 = 12_582_912.0;
        let (mut columns, mut parts, mut turns) = ([0_u32; N], [0.0_f32; N], [0.0_f32; N]);
        for lane in 0..N {
            // A whole number may come out as the one below with a part of 1, which interpolates to the same.
            let rounded = (places[lane] - 0.5) + ROUND;
            columns[lane] = rounded.to_bits() & (COLUMNS as u32 - 1);
            let whole = rounded - ROUND;
            parts[lane] = places[lane] - whole;
            turns[lane] = (whole - columns[lane] as i32 as f32) * (1.0 / COLUMNS as f32);
        }
        let (mut low, mut high) = ([0.0_f32; N], [0.0_f32; N]);
        for lane in 0..N {
            let column = columns[lane] as usize & (COLUMNS - 1);
            (low[lane], high[lane]) = (self.sums[column], self.sums[column + 1]);
        }
        let all = self.sums[COLUMNS];
        let mut result = [0.0_f32; N];
        for lane in 0..N {
            result[lane] = turns[lane].mul_add(all, (high[lane] - low[lane]).mul_add(parts[lane], low[lane]));
        }
        result
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    fn sheet(count: f64, diameter_mm: f64, length: f64) -> Sheet {
        let contents = Contents { count, streak: Streak { radius: 0.5e-3 * diameter_mm, length }, cell: [1.0, 1.0] };
        Sheet::new(&contents, Key::new(1, "rain"), Purpose::named("test"), 0)
    }

    /// Area that the sheet hides, m^2.
    fn hidden(sheet: &Sheet) -> f64 {
        let rows = (0..sheet.rows).map(|row| (row as f32 + 0.5) / sheet.rows as f32);
        let sum: f64 = rows.map(|height| f64::from(sheet.row(height).sum_until(COLUMNS as f32 - 1e-3))).sum();
        sum / (COLUMNS * sheet.rows) as f64
    }

    #[test]
    fn every_drop_hides_its_disc_whatever_the_exposure() {
        for length in [0.004, 0.03, 0.1, 0.2, 2.5] {
            let sheet = sheet(3.5, 1.6, length);
            let disc = PI * 0.64e-6;
            assert!((hidden(&sheet) / (3.5 * disc) - 1.0).abs() < 0.01, "{length}: {}", hidden(&sheet));
        }
    }

    #[test]
    fn more_rain_has_the_same_drops_and_others() {
        let (less, more) = (sheet(20.0, 1.0, 0.1), sheet(21.0, 1.0, 0.1));
        let mut differ = 0;
        for row in 0..less.rows {
            let height = (row as f32 + 0.5) / less.rows as f32;
            for column in 0..64 {
                let [low, high] = [column as f32 * 32.0, column as f32 * 32.0 + 32.0];
                let [a, b] =
                    [&less, &more].map(|sheet| sheet.row(height).sum_until(high) - sheet.row(height).sum_until(low));
                assert!(b >= a - 1e-5);
                differ += usize::from(b > a + 1e-5);
            }
        }
        assert!(differ > 0 && differ < 60, "{differ}");
    }

    #[test]
    fn rows_wrap_and_know_where_they_are_empty() {
        let sheet = sheet(2.0, 1.0, 0.5);
        for row in 0..sheet.rows {
            let row = sheet.row((row as f32 + 0.5) / sheet.rows as f32);
            let turn = COLUMNS as f32;
            assert!((row.sum_until(turn + 100.0) - row.sum_until(turn) - row.sum_until(100.0)).abs() < 1e-6);
            for column in (0..COLUMNS).step_by(8) {
                let [low, high] = [column as f32 + turn, column as f32 + turn + 7.9];
                assert!(!row.is_empty_between(low, high) || row.sum_until(high) == row.sum_until(low));
            }
        }
        assert!((0..sheet.rows).any(|row| sheet.row(row as f32 / sheet.rows as f32).is_empty_between(0.0, 500.0)));
    }
}
