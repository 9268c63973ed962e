//! One drop's way while the shutter is open, as the picture shows it.

use super::{
    bands::{BAND, Extent},
    patch::{Layer, Patch, STRETCH},
};

/// A streak in the picture: what a drop hides and the light it sends.
///
/// Its share of each pixel is that of the pixel's line across it times that of the pixel within the line. Both are differences of a
/// distribution function, so that they add up to one however thin or short the streak is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Stroke {
    /// Half way along it, pixels.
    middle: [f32; 2],
    /// Whether it runs down the picture rather than across: its axis is then 1, else 0.
    upright: bool,
    /// Half its length along that axis, as a line that spreads as much, pixels.
    half: f32,
    /// How far it leans to the other axis for each pixel along.
    lean: f32,
    /// Half width across at each pixel along, as a disc that spreads as much: the drop's, and its lean within a pixel.
    across: f32,
    /// What it hides of each line of pixels across it, square pixels.
    density: f32,
    /// Diameter of the drop, mm.
    pub(crate) diameter_mm: f32,
    /// What it shows.
    pub(crate) layer: Layer,
}

/// A drop's way through the picture.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Way {
    /// Where the drop's middle was when the shutter opened and when it closed, pixels.
    pub(crate) ends: [[f32; 2]; 2],
    /// Radius of the drop, pixels.
    pub(crate) radius: f32,
    /// What it hides of the picture, summed over all pixels and averaged over the exposure, square pixels: `pi r^2` and whatever gain.
    pub(crate) hidden: f32,
}

/// Share of a disc's area that lies left of `t`, with the disc from -1 to 1: the integral of `2 sqrt(1 - t^2) / pi`, eq. of the streak's
/// profile, as its series with the last term set so that it ends at 1; at most 0.002 off.
#[inline(always)]
pub(crate) fn disc_share(t: f32) -> f32 {
    let t = at_most(1.0, at_least(-1.0, t));
    let s = t * t;
    let odd = t * (-0.022_935_f32).mul_add(s, -0.025).mul_add(s, -1.0 / 6.0).mul_add(s, 1.0);
    odd.mul_add(std::f32::consts::FRAC_2_PI, 0.5)
}

/// Lines across a streak that are drawn at a time: the rows of a band.
const LINES: usize = BAND;
const _: () = assert!(STRETCH.is_multiple_of(LINES));

impl Stroke {
    /// The streak of a drop, still without light.
    #[inline(always)]
    pub(crate) fn new(Way { ends: [from, to], radius, hidden }: Way, depth: f32, diameter_mm: f32) -> Self {
        let way = [to[0] - from[0], to[1] - from[1]];
        let upright = way[1].abs() >= way[0].abs();
        let (length, aside) = if upright { (way[1], way[0]) } else { (way[0], way[1]) };
        let lean = if length == 0.0 { 0.0 } else { aside / length };
        // A disc that moves: variances add, that of a disc is r^2/4, that of a way L^2/12. Not fused: this is needed where vectors are not.
        let square = radius * radius;
        let half = (0.5 * (length * length + 3.0 * square).sqrt()).max(1e-3);
        let across = (square * (lean * lean + 1.0) + lean * lean * (1.0 / 3.0)).sqrt().max(1e-4);
        Self {
            middle: [0, 1].map(|axis| 0.5 * (from[axis] + to[axis])),
            upright,
            half,
            lean,
            across,
            density: hidden * 0.5 / half,
            diameter_mm,
            layer: Layer::new(depth),
        }
    }

    /// Half way along it, pixels.
    pub(crate) fn middle(&self) -> [f32; 2] {
        self.middle
    }

    /// Greatest opacity of any of its pixels: that of its axis, or all that a line hides where it is narrower than a pixel.
    pub(crate) fn peak(&self) -> f32 {
        self.density * (std::f32::consts::FRAC_2_PI / self.across).min(1.0)
    }

    /// Where it may touch the picture.
    #[inline(always)]
    pub(crate) fn extent(&self) -> Extent {
        let aside = self.lean.abs() * self.half + self.across;
        let reach = if self.upright { [aside, self.half] } else { [self.half, aside] };
        [0, 1].map(|axis| [self.middle[axis] - reach[axis], self.middle[axis] + reach[axis]])
    }

    /// Whether it may touch a picture of so many columns and rows.
    #[inline(always)]
    pub(crate) fn meets(&self, size: [f64; 2]) -> bool {
        let extent = self.extent();
        (0..2).all(|axis| extent[axis][1] > 0.0 && f64::from(extent[axis][0]) < size[axis])
    }

    /// Lays it behind what a patch holds; `measure` is told column and row in the patch and opacity of each pixel.
    #[inline(always)]
    pub(crate) fn draw(&self, patch: &mut Patch, measure: &mut impl FnMut([usize; 2], f32)) {
        if self.upright {
            self.draw_lines::<true>(0, patch, measure);
        } else {
            let columns = self.lines::<false>(patch.origin(), STRETCH);
            for first in (columns.start / LINES * LINES..columns.end).step_by(LINES) {
                self.draw_lines::<false>(first, patch, measure);
            }
        }
    }

    /// Lines of a patch that it touches, of those up to `end`: rows for an upright streak, columns for a level one.
    #[inline(always)]
    fn lines<const UPRIGHT: bool>(&self, origin: [usize; 2], end: usize) -> std::ops::Range<usize> {
        let axis = usize::from(UPRIGHT);
        let middle = self.middle[axis] - origin[axis] as i32 as f32;
        let [low, high] = [middle - self.half, middle + self.half + 1.0];
        let held = |place: f32| at_most(end as i32 as f32, at_least(0.0, place)) as i32 as usize;
        held(low)..held(high)
    }

    /// Draws the lines of a patch from `first` on.
    #[inline(always)]
    fn draw_lines<const UPRIGHT: bool>(
        &self,
        first: usize,
        patch: &mut Patch,
        measure: &mut impl FnMut([usize; 2], f32),
    ) {
        let origin = patch.origin();
        let touched = self.lines::<UPRIGHT>(origin, first + LINES);
        let touched = touched.start.max(first) - first..touched.end.max(first) - first;
        let across = self.across::<UPRIGHT>(first, origin);
        let count = across.count(self.across);
        let places = across.within(if UPRIGHT { STRETCH } else { BAND }, count);
        // Nothing lies before the first pixel, and all before the end of the last.
        let mut before = if places.start == 0 { [0.0; LINES] } else { across.shares(places.start as f32) };
        for aside in places {
            let after = if aside + 1 == count { [1.0; LINES] } else { across.shares((aside + 1) as f32) };
            let place = |line: usize| {
                let place = (across.begin[line] + aside) as usize;
                if UPRIGHT { [place, first + line] } else { [first + line, place] }
            };
            let (mut opacities, mut depths) = ([0.0; LINES], [f32::INFINITY; LINES]);
            for line in 0..LINES {
                opacities[line] = at_most(1.0, at_least(0.0, across.amount[line] * (after[line] - before[line])));
            }
            before = after;
            if patch.has_plate() {
                for line in touched.clone() {
                    opacities[line] = if patch.hides(place(line), self.layer.depth) { 0.0 } else { opacities[line] };
                }
            }
            for line in 0..LINES {
                depths[line] = if opacities[line] > 0.0 { self.layer.depth } else { f32::INFINITY };
            }
            for line in touched.clone() {
                patch.put_behind(place(line), opacities[line], depths[line], &self.layer);
                if opacities[line] > 0.0 && patch.holds(place(line)) {
                    measure(place(line), opacities[line]);
                }
            }
        }
    }

    /// What it covers of the lines of a patch from `first` on.
    #[inline(always)]
    fn across<const UPRIGHT: bool>(&self, first: usize, origin: [usize; 2]) -> Across {
        let axis = usize::from(UPRIGHT);
        let (low, high) = (self.middle[axis] - self.half, self.middle[axis] + self.half);
        let start = (origin[axis] + first) as i32 as f32;
        let edge = origin[1 - axis] as i32 as f32;
        let mut across =
            Across { begin: [0; LINES], offset: [0.0; LINES], amount: [0.0; LINES], scale: 1.0 / self.across };
        for line in 0..LINES {
            let (from, to) = (at_least(low, start + NUMBERS[line]), at_most(high, start + (NUMBERS[line] + 1.0)));
            across.amount[line] = self.density * (to - from);
            let centre = self.lean.mul_add(0.5 * (from + to) - self.middle[axis], self.middle[1 - axis]);
            let begin = (centre - self.across).floor();
            across.begin[line] = whole(begin - edge);
            across.offset[line] = begin - centre;
        }
        across
    }
}

/// Comparisons that become one instruction each, unlike those that ask what is not a number.
#[inline(always)]
fn at_least(least: f32, value: f32) -> f32 {
    if value > least { value } else { least }
}

#[inline(always)]
fn at_most(most: f32, value: f32) -> f32 {
    if value < most { value } else { most }
}

/// A whole number as an integer, held to +-2^20, in steps that become vectors.
#[inline(always)]
fn whole(value: f32) -> i32 {
    /// 3 * 2^22: added to a whole number it leaves that in the low bits of the sum.
    const ROUND: f32 = 12_582_912.0;
    const MOST: f32 = 1_048_576.0;
    (at_most(MOST, at_least(-MOST, value)) + ROUND).to_bits() as i32 - ROUND.to_bits() as i32
}

/// 0, 1 and so on, of each line.
const NUMBERS: [f32; LINES] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];

/// What a streak covers of each of some lines across it.
struct Across {
    /// First pixel of the line, counted from the patch's edge.
    begin: [i32; LINES],
    /// Where that pixel begins, from the streak's middle, pixels.
    offset: [f32; LINES],
    /// The sum of all opacities.
    amount: [f32; LINES],
    /// One over half the streak's width.
    scale: f32,
}

impl Across {
    /// How many pixels from the first on any line needs.
    #[inline(always)]
    fn count(&self, across: f32) -> i32 {
        let mut least = self.offset;
        for half in [LINES / 2, LINES / 4, LINES / 8] {
            for line in 0..half {
                least[line] = at_most(least[line], least[line + half]);
            }
        }
        // Held so that it can be counted.
        at_most(1e6, across - least[0]) as i32 + 1
    }

    /// Which of `count` pixels from the first on may lie within a patch of so many, for any line.
    #[inline(always)]
    fn within(&self, pixels: usize, count: i32) -> std::ops::Range<i32> {
        // A streak leans one way, so its outer lines begin outermost.
        let (one, other) = (self.begin[0], self.begin[LINES - 1]);
        (-one.max(other)).max(0)..(pixels as i32 - one.min(other)).min(count)
    }

    /// Share of each line's amount that lies before the edge `aside` pixels from its first pixel's.
    #[inline(always)]
    fn shares(&self, aside: f32) -> [f32; LINES] {
        let mut shares = [0.0; LINES];
        for line in 0..LINES {
            shares[line] = disc_share((self.offset[line] + aside) * self.scale);
        }
        shares
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bansho_base::{canvas::Strip, image::Rect};

    /// What a drop hides that does not overlap itself.
    fn disc(radius: f32) -> f32 {
        std::f32::consts::PI * radius * radius
    }

    fn stroke(from: [f32; 2], to: [f32; 2], radius: f32) -> Stroke {
        Stroke::new(Way { ends: [from, to], radius, hidden: disc(radius) }, 2.0, 1.0)
    }

    /// Opacity of each pixel of a picture, drawn from column `left` on.
    fn drawn(stroke: &Stroke, size: [usize; 2], left: usize) -> Vec<f32> {
        let mut opacity = vec![0.0; size[0] * size[1]];
        for y in (0..size[1]).step_by(BAND) {
            let rect = Rect { x: left, y, width: size[0] - left, height: BAND.min(size[1] - y) };
            let mut strip = Strip::default();
            strip.reset(rect, None, 0);
            let mut planes = strip.gray_planes_mut().unwrap();
            let mut patch = Patch::default();
            patch.load([0, y], rect, rect, &planes);
            stroke.draw(&mut patch, &mut |[column, row], value| {
                if (left..size[0]).contains(&column) && row < rect.height {
                    opacity[(y + row) * size[0] + column] += value;
                }
            });
            patch.store(rect, rect, &mut planes);
            let hidden = planes.transmittance.iter().map(|through| 1.0 - through);
            for (index, hidden) in hidden.enumerate() {
                let known = opacity[(y + index / rect.width) * size[0] + left + index % rect.width];
                assert!((hidden - known).abs() < 1e-6);
            }
        }
        opacity
    }

    #[test]
    fn a_streak_hides_its_drop_however_thin_short_or_slanted_it_is() {
        for to in [[20.3, 50.0], [24.9, 30.1], [50.0, 20.5], [35.2, 35.1], [20.3, 20.9]] {
            for radius in [0.01, 0.2, 0.9] {
                let stroke = stroke([20.3, 20.9], to, radius);
                let sum: f32 = drawn(&stroke, [64, 64], 0).iter().sum();
                let longest = (to[0] - 20.3).abs().max((to[1] - 20.9_f32).abs());
                // A drop that does not move is opaque and cannot hide more.
                let tolerance = if longest < 2.0 * radius { 0.15 } else { 1e-4 };
                assert!((sum / disc(radius) - 1.0).abs() < tolerance, "{to:?} {radius}: {sum}");
            }
        }
    }

    #[test]
    fn a_thick_upright_streak_has_the_profile_of_the_paper_s_source() {
        let stroke = stroke([32.0, 4.0], [32.0, 60.0], 6.0);
        let opacity = drawn(&stroke, [64, 64], 0);
        for column in 26..38 {
            let offset = column as f32 + 0.5 - 32.0;
            let expected = 2.0 * (36.0 - offset * offset).sqrt() / 56.0;
            let found = opacity[32 * 64 + column];
            assert!((found / expected - 1.0).abs() < 0.05, "{column}: {found} {expected}");
        }
    }

    #[test]
    fn a_crop_changes_no_pixel_and_no_pixel_lies_outside_the_rows() {
        for to in [[25.0, 50.0], [50.0, 26.0]] {
            let stroke = stroke([20.3, 20.9], to, 1.3);
            let whole = drawn(&stroke, [64, 64], 0);
            let part = drawn(&stroke, [64, 64], 23);
            for (index, opacity) in part.into_iter().enumerate() {
                assert_eq!(opacity, if index % 64 < 23 { 0.0 } else { whole[index] });
            }
            let [low, high] = stroke.extent()[1];
            for (index, opacity) in whole.iter().enumerate() {
                let row = (index / 64) as f32;
                assert!(*opacity == 0.0 || (row + 1.0 >= low && row <= high), "{row} {low} {high}");
            }
        }
    }

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
