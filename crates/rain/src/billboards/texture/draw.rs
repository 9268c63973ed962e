//! Draws one streak into a texture with exact area coverage.

use bansho_base::image::Image;

use crate::streaks::coverage::Streak;

/// Quadrature lines within a row of pixels at a streak's ends, where its width varies.
const SAMPLE_LINES: usize = 4;

/// Draws a streak over an image, with wrap-around. The drop's center is at `start` when the shutter opens, m from the
/// left and upper edges, and falls. A pixel is `pixel` wide and high, m. `weight` scales the opacity between two positions along the streak, m.
pub(crate) fn draw_streak(
    streak: &Streak,
    [axis, start]: [f64; 2],
    pixel: [f64; 2],
    weight: &dyn Fn(f64, f64) -> f64,
    image: &mut Image<1>,
) {
    let [width, height] = pixel;
    let first_column = ((axis - streak.radius) / width).floor();
    let columns = ((axis + streak.radius) / width).floor() - first_column + 1.0;
    let across = PixelColumns { streak, left: first_column * width - axis, pixel, columns: columns as usize };
    let mut opacities = vec![0.0; across.columns];
    let within = across.line(0.5 * streak.length);
    let first_row = ((start - streak.radius) / height).floor() as i64;
    let last_row = ((start + streak.length + streak.radius) / height).floor() as i64;
    for row in first_row..=last_row {
        let from = row as f64 * height - start;
        let whole = streak.is_within(from) && streak.is_within(from + height);
        let opacities = if whole { &within } else { across.end_row(from, &mut opacities) };
        let y = row.rem_euclid(image.height() as i64) as usize;
        blend(image.row_mut(y), first_column as i64, weight(from, from + height), opacities);
    }
}

/// Draws the paper's line over an image, with wrap-around: one pixel wide, alike in opacity from `start` downward over `length`, m.
pub(crate) fn draw_line([x, start]: [f64; 2], length: f64, opacity: f64, pixel: f64, image: &mut Image<1>) {
    let column = (x / pixel).floor() as i64;
    let (first, last) = ((start / pixel).floor() as i64, ((start + length) / pixel).floor() as i64);
    for row in first..=last {
        let top = row as f64 * pixel;
        let covered = ((top + pixel).min(start + length) - top.max(start)) / pixel;
        let y = row.rem_euclid(image.height() as i64) as usize;
        blend(image.row_mut(y), column, covered.clamp(0.0, 1.0), &[opacity]);
    }
}

/// Composites opacities over a row, with wrap-around.
fn blend(row: &mut [[f32; 1]], first_column: i64, weight: f64, opacities: &[f64]) {
    let width = row.len();
    let mut x = first_column.rem_euclid(width as i64) as usize;
    for &opacity in opacities {
        let [under] = &mut row[x];
        *under += (weight * opacity) as f32 * (1.0 - *under);
        x = if x + 1 == width { 0 } else { x + 1 };
    }
}

/// The columns of pixels that a streak covers.
struct PixelColumns<'a> {
    streak: &'a Streak,
    /// Left edge of the first pixel relative to the axis, m.
    left: f64,
    pixel: [f64; 2],
    columns: usize,
}

impl PixelColumns<'_> {
    /// Mean opacity of each pixel on the line at `s`.
    fn line(&self, s: f64) -> Vec<f64> {
        let mut opacities = vec![0.0; self.columns];
        self.add_line(s, 1.0, &mut opacities);
        opacities
    }

    fn add_line(&self, s: f64, weight: f64, opacities: &mut [f64]) {
        let mut before = 0.0;
        for (index, opacity) in opacities.iter_mut().enumerate() {
            let until = self.streak.opacity_integral_to(self.left + (index + 1) as f64 * self.pixel[0], s);
            *opacity += weight * (until - before) / self.pixel[0];
            before = until;
        }
    }

    /// Mean opacity of each pixel of a row that begins at `from` and contains an end of the streak. The distribution
    /// comes from quadrature, the sum is exact.
    fn end_row<'b>(&self, from: f64, opacities: &'b mut [f64]) -> &'b [f64] {
        let (streak, [width, height]) = (self.streak, self.pixel);
        let (top, bottom) = (from.max(-streak.radius), (from + height).min(streak.length + streak.radius));
        opacities.fill(0.0);
        let step = (bottom - top) / SAMPLE_LINES as f64;
        (0..SAMPLE_LINES).for_each(|line| self.add_line(top + step * (line as f64 + 0.5), 1.0, opacities));
        let area =
            streak.blocked_area() * (streak.area_fraction_along(from + height) - streak.area_fraction_along(from));
        let found: f64 = opacities.iter().sum();
        let scale = if found > 0.0 { area / (found * width * height) } else { 0.0 };
        // Near the rim of a resolved drop, rounding may exceed the range of an opacity.
        opacities.iter_mut().for_each(|opacity| *opacity = (*opacity * scale).clamp(0.0, 1.0));
        opacities
    }
}
