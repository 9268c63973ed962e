//! Laying a streak into a patch: eight rows of a column at a time.

use bansho_base::math::MulAdd;

use super::{
    Stroke, at_least, at_most,
    tile::{Patch, Rows, STRETCH},
};
use crate::streaks::bin::BAND;

/// Share of a disc's area that lies left of `t`, with the disc from -1 to 1: the integral of `2 sqrt(1 - t^2) / pi`, eq. of the streak's
/// profile, as its series with the last term set so that it ends at 1; at most 0.002 off.
#[inline(always)]
fn disc_share(t: f32) -> f32 {
    let t = at_most(1.0, at_least(-1.0, t));
    let s = t * t;
    let odd = t * (-0.022_935_f32).fma(s, -0.025).fma(s, -1.0 / 6.0).fma(s, 1.0);
    odd.fma(std::f32::consts::FRAC_2_PI, 0.5)
}

/// 0, 1 and so on, of each row.
const NUMBERS: Rows = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];
/// Those of the next rows.
const NEXT: Rows = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0];

/// The opacities of a streak in eight rows, column after column.
trait Columns {
    /// Those of the pixels right of `x`, pixels from the streak's middle.
    fn next(&mut self, x: f32) -> Rows;
}

impl Stroke {
    /// Lays it behind what a patch holds; `measure` is told column and row in the patch and opacity of each pixel.
    #[inline(always)]
    pub(crate) fn draw(&self, patch: &mut Patch, measure: &mut impl FnMut([usize; 2], f32)) {
        // All places are counted from the streak's middle.
        let [left, top] = [0, 1].map(|axis| patch.origin()[axis] as i32 as f32 - self.middle[axis]);
        let touched = self.touched(left, top);
        // Nothing of it lies left of its first column, unless the patch begins there.
        let cut = if touched.start > 0 { None } else { Some(left) };
        match (self.is_wide(), self.upright) {
            (false, true) => self.lay(touched, left, Down::new(self, cut, top), patch, measure),
            (false, false) => self.lay(touched, left, Level { stroke: self, top }, patch, measure),
            (true, true) => self.lay(touched, left, Swept::<true> { stroke: self, top }, patch, measure),
            (true, false) => self.lay(touched, left, Swept::<false> { stroke: self, top }, patch, measure),
        }
    }

    /// Columns of a patch that it may touch.
    #[inline(always)]
    fn touched(&self, left: f32, top: f32) -> std::ops::Range<usize> {
        let (reach, bottom) = (self.reach(), top + BAND as f32);
        let [low, high] = if self.upright {
            // Its axis within the rows.
            let ends = [at_least(-reach, top), at_most(reach, bottom)].map(|along| self.lean * along);
            [at_most(ends[0], ends[1]) - self.across, at_least(ends[0], ends[1]) + self.across]
        } else {
            /// Below this lean the rows end no streak.
            const LEVEL: f32 = 1e-3;
            let within = [top - self.across, bottom + self.across].map(|row| row / self.lean);
            let [from, to] = [at_most(within[0], within[1]) - 1.0, at_least(within[0], within[1]) + 1.0];
            if self.lean.abs() < LEVEL { [-reach, reach] } else { [at_least(-reach, from), at_most(reach, to)] }
        };
        let held = |place: f32| at_most(STRETCH as f32, at_least(0.0, place - left)) as i32 as usize;
        held(low)..held(high + 1.0)
    }

    #[inline(always)]
    fn lay(
        &self,
        columns: std::ops::Range<usize>,
        left: f32,
        mut opacities: impl Columns,
        patch: &mut Patch,
        measure: &mut impl FnMut([usize; 2], f32),
    ) {
        for column in columns {
            let mut opacities = opacities.next(left + column as i32 as f32);
            patch.hide_by_plate(column, self.layer.depth, &mut opacities);
            patch.put_behind(column, &opacities, &self.layer);
            for (row, opacity) in opacities.into_iter().enumerate() {
                if opacity > 0.0 {
                    measure([column, row], opacity);
                }
            }
        }
    }

    /// What a line of pixels across it between two places along takes of a thin one: its sum, and where it crosses that line.
    #[inline(always)]
    fn line(&self, from: f32, to: f32) -> (f32, f32) {
        let (from, to) = (at_least(-self.half, from), at_most(self.half, to));
        (self.density * at_least(0.0, to - from), self.lean * 0.5 * (from + to))
    }
}

/// A thin streak that runs down.
struct Down {
    amount: Rows,
    /// Where it crosses each row.
    centre: Rows,
    /// One over half its width.
    scale: f32,
    /// Share of each row's amount that lies left of the next column.
    before: Rows,
}

impl Down {
    #[inline(always)]
    fn new(stroke: &Stroke, cut: Option<f32>, top: f32) -> Self {
        let mut down =
            Self { amount: [0.0; BAND], centre: [0.0; BAND], scale: 1.0 / stroke.across, before: [0.0; BAND] };
        for row in 0..BAND {
            (down.amount[row], down.centre[row]) = stroke.line(top + NUMBERS[row], top + NEXT[row]);
        }
        if let Some(left) = cut {
            for row in 0..BAND {
                down.before[row] = disc_share((left - down.centre[row]) * down.scale);
            }
        }
        down
    }
}

impl Columns for Down {
    #[inline(always)]
    fn next(&mut self, x: f32) -> Rows {
        let mut opacities = [0.0; BAND];
        for row in 0..BAND {
            let after = disc_share((x + 1.0 - self.centre[row]) * self.scale);
            opacities[row] = opacity(self.amount[row] * (after - self.before[row]));
            self.before[row] = after;
        }
        opacities
    }
}

/// A thin streak that runs across.
struct Level<'a> {
    stroke: &'a Stroke,
    top: f32,
}

impl Columns for Level<'_> {
    #[inline(always)]
    fn next(&mut self, x: f32) -> Rows {
        let (amount, centre) = self.stroke.line(x, x + 1.0);
        let (above, scale) = (self.top - centre, 1.0 / self.stroke.across);
        let mut opacities = [0.0; BAND];
        for row in 0..BAND {
            let [before, after] = [above + NUMBERS[row], above + NEXT[row]];
            opacities[row] = opacity(amount * (disc_share(after * scale) - disc_share(before * scale)));
        }
        opacities
    }
}

/// A wide streak, along rows or columns as its axis runs.
struct Swept<'a, const UPRIGHT: bool> {
    stroke: &'a Stroke,
    top: f32,
}

impl<const UPRIGHT: bool> Columns for Swept<'_, UPRIGHT> {
    /// So far aside of the axis, the disc covers a place while its chord passes: for the overlap of chord and way. What it hides
    /// there in all is the profile's share of that line.
    #[inline(always)]
    fn next(&mut self, x: f32) -> Rows {
        let Stroke { half, lean, across, density, .. } = *self.stroke;
        let (whole, scale) = (2.0 * half * density, 1.0 / across);
        let mut opacities = [0.0; BAND];
        for row in 0..BAND {
            let y = self.top + NUMBERS[row];
            let (along, aside) = if UPRIGHT { (y, x) } else { (x, y) };
            let aside = aside - lean * (along + 0.5);
            let share = disc_share((aside + 1.0) * scale) - disc_share(aside * scale);
            // In coordinates that lean as the streak does a disc is an ellipse, and its chords have their middles off the axis.
            let middle = -lean * (aside + 0.5) / (lean * lean + 1.0);
            let chord = at_least(LEAST_CHORD, self.stroke.chord(aside + 0.5));
            let passed = passed(along + 1.0 - middle, half, chord) - passed(along - middle, half, chord);
            opacities[row] = opacity(whole * share * passed);
        }
        opacities
    }
}

/// Half the least chord that is told apart from none, pixels.
const LEAST_CHORD: f32 = 0.1;

/// Share of all that a chord covers on its way that lies before `along`: of the overlap of `+-chord` about `along` with the way `+-half`.
#[inline(always)]
fn passed(along: f32, half: f32, chord: f32) -> f32 {
    let reach = half + chord;
    let along = at_most(reach, at_least(-reach, along));
    (climbed(along + half, chord) - climbed(along - half, chord)) / (4.0 * half * chord)
}

/// Integral of `clamp(s, -chord, chord)` up to `s`, from 0.
#[inline(always)]
fn climbed(s: f32, chord: f32) -> f32 {
    let size = s.abs();
    let least = at_most(chord, size);
    least * (size - 0.5 * least)
}

/// What is an opacity whatever rounding did.
#[inline(always)]
fn opacity(value: f32) -> f32 {
    at_most(1.0, at_least(0.0, value))
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
            assert!((disc_share(end) - sum).abs() < 2.5e-3, "{end}");
        }
        for (t, share) in [(-2.0, 0.0), (0.0, 0.5), (2.0, 1.0)] {
            assert!((disc_share(t) - share).abs() < 1e-6);
        }
    }
}
