//! The texture T(R, D): the streaks of all drops of one diameter in a cell, seen from the side.
//!
//! Each row holds the running sum of its opacities, so that the mean over any stretch is a difference of two look-ups: a pixel
//! gets exactly what its width covers, near and far, without a pyramid of smaller textures.

use std::f64::consts::PI;

use bansho_base::random::{Key, Purpose};

use crate::rain::stroke::disc_share;

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
    /// Their diameter, m.
    pub(crate) diameter: f64,
    /// How far they fall while the shutter is open, m.
    pub(crate) length: f64,
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
        let wanted = ROWS_OF_STREAK * contents.cell[1] / contents.length.max(contents.diameter).max(1e-9);
        let rows = (wanted.min(1e6) as usize).next_power_of_two().clamp(ROWS[0], ROWS[1]);
        let mut clear = vec![1.0_f32; rows * STRIDE];
        let purpose = Purpose(PLACE.0 ^ purpose.0);
        for index in 0..contents.count.ceil() as u64 {
            let uniforms = key.uniforms(variant << 32 | index, 0, purpose);
            let there = (contents.count - index as f64).min(1.0);
            add_drop(contents, [uniforms[0], uniforms[1]], there as f32, rows, &mut clear);
        }
        let peak = 1.0 - clear.iter().fold(1.0, |least: f32, value| least.min(*value));
        let mut sheet = Self { rows, sums: clear, occupied: vec![0; rows], peak };
        sheet.sum_up();
        sheet
    }

    /// Turns transparencies into running sums of opacity.
    fn sum_up(&mut self) {
        for (row, occupied) in self.sums.chunks_exact_mut(STRIDE).zip(&mut self.occupied) {
            let mut sum = 0.0_f64;
            for (column, value) in row.iter_mut().enumerate() {
                let opacity = 1.0 - *value;
                *value = sum as f32;
                if opacity > 0.0 {
                    *occupied |= 1 << (column / GROUP);
                }
                sum += f64::from(opacity);
            }
        }
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

/// Multiplies the transparency of one drop's streak in, its middle at `place` in cells; shares of rows and columns as in a
/// [`Stroke`](crate::rain::stroke::Stroke).
fn add_drop(contents: &Contents, place: [f32; 2], there: f32, rows: usize, clear: &mut [f32]) {
    let texel = [contents.cell[0] / COLUMNS as f64, contents.cell[1] / rows as f64];
    let radius = 0.5 * contents.diameter;
    let half =
        (0.5 * bansho_base::math::sqrt(contents.length * contents.length + 3.0 * radius * radius) / texel[1]).max(1e-3);
    let across = ((radius / texel[0]) as f32).max(1e-3);
    let middle = [place[0] * COLUMNS as f32, place[1] * rows as f32];
    let hidden = (PI * radius * radius / (texel[0] * texel[1])) as f32 * there;
    let (low, high) = (f64::from(middle[1]) - half, f64::from(middle[1]) + half);
    for line in low.floor() as i64..high.ceil() as i64 {
        let covered = (line as f64 + 1.0).min(high) - (line as f64).max(low);
        let amount = hidden * (0.5 * covered.max(0.0) / half) as f32;
        let row = line.rem_euclid(rows as i64) as usize * STRIDE;
        let (first, last) = ((middle[0] - across).floor() as i64, (middle[0] + across).ceil() as i64);
        for column in first..last {
            let share = |edge: i64| disc_share((edge as f32 - middle[0]) / across);
            let opacity = (amount * (share(column + 1) - share(column))).min(1.0);
            clear[row + column.rem_euclid(COLUMNS as i64) as usize] *= 1.0 - opacity;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sheet(count: f64, diameter_mm: f64, length: f64) -> Sheet {
        let contents = Contents { count, diameter: 1e-3 * diameter_mm, length, cell: [1.0, 1.0] };
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
