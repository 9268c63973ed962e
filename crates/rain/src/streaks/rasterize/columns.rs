//! Rasterization of a streak into a tile, one column of eight rows at a time.

use bansho_base::math::simd::Real;

use super::{
    StreakSegment,
    tile::{TILE_COLUMNS, TILE_ROWS, TileBuffer, TileRows},
};

/// Cumulative distribution of a disc's area: the fraction left of `t`, for a disc from -1 to 1. The integral of `2
/// sqrt(1 - t^2) / pi`, which is the streak's profile. A series whose last term is chosen so that it ends at 1; the
/// error is at most 0.002.
#[inline(always)]
fn disc_cdf(t: f32) -> f32 {
    let t = t.simd_max(-1.0).simd_min(1.0);
    let s = t * t;
    let odd = t * (-0.022_935_f32).fma(s, -0.025).fma(s, -1.0 / 6.0).fma(s, 1.0);
    odd.fma(std::f32::consts::FRAC_2_PI, 0.5)
}

/// Upper edges of the rows of a tile.
const ROW_OFFSETS: TileRows = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];
/// Lower edges of the rows of a tile.
const NEXT_ROW_OFFSETS: TileRows = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0];

/// The opacities of a streak in successive columns of eight rows.
trait ColumnCoverage {
    /// Opacities of the column whose left edge is at `x`, pixels from the streak's center.
    fn next_column(&mut self, x: f32) -> TileRows;
}

impl StreakSegment {
    /// Composites the streak under the contents of a tile; `measure` gets column and row within the tile and the opacity of
    /// each pixel.
    #[inline(always)]
    pub(crate) fn draw(&self, buffer: &mut TileBuffer, measure: &mut impl FnMut([usize; 2], f32)) {
        // All coordinates are relative to the streak's center.
        let [left, top] = [0, 1].map(|axis| buffer.origin()[axis] as i32 as f32 - self.center[axis]);
        let touched_columns = self.touched_columns(left, top);
        // The streak does not extend to the left of its first column, unless the tile begins there.
        let clip_left = if touched_columns.start > 0 { None } else { Some(left) };
        // Four loops, each compiled by itself: the branch is taken once for a streak, not once for each column.
        match (self.is_wide(), self.steep) {
            (false, true) => {
                self.composite_columns(touched_columns, left, SteepStreak::new(self, clip_left, top), buffer, measure);
            }
            (false, false) => {
                self.composite_columns(touched_columns, left, ShallowStreak { segment: self, top }, buffer, measure);
            }
            (true, true) => self.composite_columns(
                touched_columns,
                left,
                WideStreak::<true> { segment: self, top },
                buffer,
                measure,
            ),
            (true, false) => self.composite_columns(
                touched_columns,
                left,
                WideStreak::<false> { segment: self, top },
                buffer,
                measure,
            ),
        }
    }

    /// Columns of a tile that the streak may touch.
    #[inline(always)]
    fn touched_columns(&self, left: f32, top: f32) -> std::ops::Range<usize> {
        let (reach, bottom) = (self.reach(), top + TILE_ROWS as f32);
        let [low, high] = if self.steep {
            // Its axis within the rows.
            let ends = [top.simd_max(-reach), bottom.simd_min(reach)].map(|along| self.slope * along);
            [ends[1].simd_min(ends[0]) - self.half_width, ends[1].simd_max(ends[0]) + self.half_width]
        } else {
            /// Below this slope the rows do not bound the columns.
            const MIN_SLOPE: f32 = 1e-3;
            let within = [top - self.half_width, bottom + self.half_width].map(|row| row / self.slope);
            let [from, to] = [within[1].simd_min(within[0]) - 1.0, within[1].simd_max(within[0]) + 1.0];
            if self.slope.abs() < MIN_SLOPE { [-reach, reach] } else { [from.simd_max(-reach), to.simd_min(reach)] }
        };
        clamp_column(low - left)..clamp_column(high + 1.0 - left)
    }

    #[inline(always)]
    fn composite_columns(
        &self,
        columns: std::ops::Range<usize>,
        left: f32,
        mut opacities: impl ColumnCoverage,
        buffer: &mut TileBuffer,
        measure: &mut impl FnMut([usize; 2], f32),
    ) {
        for column in columns {
            let mut opacities = opacities.next_column(left + column as i32 as f32);
            buffer.mask_by_plate(column, self.shading.depth, &mut opacities);
            buffer.composite_under(column, &opacities, &self.shading);
            for (row, opacity) in opacities.into_iter().enumerate() {
                if opacity > 0.0 {
                    measure([column, row], opacity);
                }
            }
        }
    }

    /// For a thin streak, coverage of a line of pixels across it between two positions along it, and the position of
    /// its axis there.
    #[inline(always)]
    fn line_crossing(&self, from: f32, to: f32) -> (f32, f32) {
        let (from, to) = (from.simd_max(-self.half_length), to.simd_min(self.half_length));
        (self.line_coverage * (to - from).simd_max(0.0), self.slope * 0.5 * (from + to))
    }
}

/// The column of a tile at a distance from its left edge, pixels; at most one past the last.
#[inline(always)]
fn clamp_column(x: f32) -> usize {
    x.simd_max(0.0).simd_min(TILE_COLUMNS as f32) as i32 as usize
}

/// A thin streak that is steeper than 45 degrees.
struct SteepStreak {
    coverage: TileRows,
    /// Position of its axis in each row.
    center: TileRows,
    /// Reciprocal of its half width.
    scale: f32,
    /// Cumulative distribution at the left edge of the next column, for each row.
    cdf_left: TileRows,
}

impl SteepStreak {
    #[inline(always)]
    fn new(segment: &StreakSegment, clip_left: Option<f32>, top: f32) -> Self {
        let mut streak = Self {
            coverage: [0.0; TILE_ROWS],
            center: [0.0; TILE_ROWS],
            scale: 1.0 / segment.half_width,
            cdf_left: [0.0; TILE_ROWS],
        };
        for row in 0..TILE_ROWS {
            (streak.coverage[row], streak.center[row]) =
                segment.line_crossing(top + ROW_OFFSETS[row], top + NEXT_ROW_OFFSETS[row]);
        }
        if let Some(left) = clip_left {
            for row in 0..TILE_ROWS {
                streak.cdf_left[row] = disc_cdf((left - streak.center[row]) * streak.scale);
            }
        }
        streak
    }
}

impl ColumnCoverage for SteepStreak {
    #[inline(always)]
    fn next_column(&mut self, x: f32) -> TileRows {
        let mut opacities = [0.0; TILE_ROWS];
        for row in 0..TILE_ROWS {
            // The right edge of a pixel is the left edge of the next, so that each value of the distribution is computed once, and the pixels of a
            // row together have the whole coverage.
            let after = disc_cdf((x + 1.0 - self.center[row]) * self.scale);
            opacities[row] = clamp_opacity(self.coverage[row] * (after - self.cdf_left[row]));
            self.cdf_left[row] = after;
        }
        opacities
    }
}

/// A thin streak that is shallower than 45 degrees.
struct ShallowStreak<'a> {
    segment: &'a StreakSegment,
    top: f32,
}

impl ColumnCoverage for ShallowStreak<'_> {
    #[inline(always)]
    fn next_column(&mut self, x: f32) -> TileRows {
        let (coverage, center) = self.segment.line_crossing(x, x + 1.0);
        // A shallow streak advances along columns: in each it is a vertical profile about the middle of its axis there.
        let (above, scale) = (self.top - center, 1.0 / self.segment.half_width);
        let mut opacities = [0.0; TILE_ROWS];
        for row in 0..TILE_ROWS {
            let [cdf_left, after] = [above + ROW_OFFSETS[row], above + NEXT_ROW_OFFSETS[row]];
            opacities[row] = clamp_opacity(coverage * (disc_cdf(after * scale) - disc_cdf(cdf_left * scale)));
        }
        opacities
    }
}

/// A wide streak, steep or shallow.
struct WideStreak<'a, const STEEP: bool> {
    segment: &'a StreakSegment,
    top: f32,
}

impl<const STEEP: bool> ColumnCoverage for WideStreak<'_, STEEP> {
    /// At an offset from the axis, the disc covers a point while its chord passes over it: for the overlap of chord and
    /// path. The total over the line is the profile's fraction of the blocked area.
    #[inline(always)]
    fn next_column(&mut self, x: f32) -> TileRows {
        let StreakSegment { half_length, slope, half_width, line_coverage, .. } = *self.segment;
        let (whole, scale) = (2.0 * half_length * line_coverage, 1.0 / half_width);
        let mut opacities = [0.0; TILE_ROWS];
        for row in 0..TILE_ROWS {
            let y = self.top + ROW_OFFSETS[row];
            let (along, offset) = if STEEP { (y, x) } else { (x, y) };
            let offset = offset - slope * (along + 0.5);
            let fraction = disc_cdf((offset + 1.0) * scale) - disc_cdf(offset * scale);
            // Sheared by the slope, a disc becomes an ellipse, whose chords have their centers off the axis.
            let center = -slope * (offset + 0.5) / (slope * slope + 1.0);
            let chord = self.segment.chord(offset + 0.5).simd_max(MIN_HALF_CHORD);
            let covered =
                covered(along + 1.0 - center, half_length, chord) - covered(along - center, half_length, chord);
            opacities[row] = clamp_opacity(whole * fraction * covered);
        }
        opacities
    }
}

/// Minimum half chord, pixels: avoids a division by zero.
const MIN_HALF_CHORD: f32 = 0.1;

/// Cumulative distribution of a chord's coverage along its path: of the overlap of `+-chord` about `along` with the
/// path `+-half`.
#[inline(always)]
fn covered(along: f32, half_length: f32, chord: f32) -> f32 {
    let reach = half_length + chord;
    let along = along.simd_max(-reach).simd_min(reach);
    (clamp_integral(along + half_length, chord) - clamp_integral(along - half_length, chord))
        / (4.0 * half_length * chord)
}

/// Integral of `clamp(s, -chord, chord)` from 0 to `s`.
#[inline(always)]
fn clamp_integral(s: f32, chord: f32) -> f32 {
    let magnitude = s.abs();
    let limit = magnitude.simd_min(chord);
    limit * (magnitude - 0.5 * limit)
}

/// Clamps rounding errors.
#[inline(always)]
fn clamp_opacity(value: f32) -> f32 {
    value.simd_clamp01()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_share_of_a_disc_is_its_integral() {
        let (mut sum, steps) = (0.0, 4000);
        for i in 0..steps {
            let t = (i as f32 + 0.5) / steps as f32 * 2.0 - 1.0;
            sum += (1.0 - t * t).sqrt() * 2.0 / steps as f32 * std::f32::consts::FRAC_2_PI;
            let end = (i as f32 + 1.0) / steps as f32 * 2.0 - 1.0;
            assert!((disc_cdf(end) - sum).abs() < 2.5e-3, "{end}");
        }
        for (t, fraction) in [(-2.0, 0.0), (0.0, 0.5), (2.0, 1.0)] {
            assert!((disc_cdf(t) - fraction).abs() < 1e-6);
        }
    }
}
