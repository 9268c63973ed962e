//! One streak into a texture, exactly antialiased: each pixel gets the share of it that the drop hides.

use bansho_base::image::Image;

use super::{FallingDrop, StreakCube};
use crate::rain::streak::Streak;

/// Lines within a row of pixels at a streak's ends, where its width changes along it.
const LINES: usize = 4;

/// Draws the streak of a drop over what is there.
pub(super) fn streak(cube: &StreakCube, drop: &FallingDrop, image: &mut Image<1>) {
    let (streak, pixel) = (cube.streak(drop), cube.pixel());
    // Downward from the upper edge, as rows run; the drop falls along it.
    let (axis, start) = (drop.position[0], cube.edge - drop.position[1]);
    let first_column = ((axis - streak.radius) / pixel).floor();
    let columns = ((axis + streak.radius) / pixel).floor() - first_column + 1.0;
    let across = Across { streak: &streak, left: first_column * pixel - axis, pixel, columns: columns as usize };
    let mut shares = vec![0.0; across.columns];
    let within = across.line(0.5 * streak.length);
    let first_row = ((start - streak.radius) / pixel).floor() as i64;
    let last_row = ((start + streak.length + streak.radius) / pixel).floor() as i64;
    for row in first_row..=last_row {
        let from = row as f64 * pixel - start;
        let whole = streak.is_within(from) && streak.is_within(from + pixel);
        let shares = if whole { &within } else { across.end_row(from, &mut shares) };
        let y = row.rem_euclid(image.height() as i64) as usize;
        blend(image.row_mut(y), first_column as i64, shares);
    }
}

/// Lays opacities over a row, around its end.
fn blend(row: &mut [[f32; 1]], first_column: i64, opacities: &[f64]) {
    let width = row.len();
    let mut x = first_column.rem_euclid(width as i64) as usize;
    for &opacity in opacities {
        let [under] = &mut row[x];
        *under += opacity as f32 * (1.0 - *under);
        x = if x + 1 == width { 0 } else { x + 1 };
    }
}

/// The pixels that a streak covers in every row.
struct Across<'a> {
    streak: &'a Streak,
    /// Left edge of the first pixel, from the axis, m.
    left: f64,
    pixel: f64,
    columns: usize,
}

impl Across<'_> {
    /// Mean opacity of each pixel on the line at `s`.
    fn line(&self, s: f64) -> Vec<f64> {
        let mut opacities = vec![0.0; self.columns];
        self.add_line(s, 1.0, &mut opacities);
        opacities
    }

    fn add_line(&self, s: f64, weight: f64, opacities: &mut [f64]) {
        let mut before = 0.0;
        for (index, opacity) in opacities.iter_mut().enumerate() {
            let until = self.streak.opacity_until(self.left + (index + 1) as f64 * self.pixel, s);
            *opacity += weight * (until - before) / self.pixel;
            before = until;
        }
    }

    /// Mean opacity of each pixel of a row that begins at `from` and holds an end of the streak: the form by some lines,
    /// the sum exactly.
    fn end_row<'b>(&self, from: f64, opacities: &'b mut [f64]) -> &'b [f64] {
        let (streak, pixel) = (self.streak, self.pixel);
        let (top, bottom) = (from.max(-streak.radius), (from + pixel).min(streak.length + streak.radius));
        opacities.fill(0.0);
        let step = (bottom - top) / LINES as f64;
        (0..LINES).for_each(|line| self.add_line(top + step * (line as f64 + 0.5), 1.0, opacities));
        let area = streak.blocked_area() * (streak.share_along(from + pixel) - streak.share_along(from));
        let found: f64 = opacities.iter().sum();
        let scale = if found > 0.0 { area / (found * pixel * pixel) } else { 0.0 };
        // Rounding near a resolved drop's rim may exceed what a pixel can hide.
        opacities.iter_mut().for_each(|opacity| *opacity = (*opacity * scale).clamp(0.0, 1.0));
        opacities
    }
}
