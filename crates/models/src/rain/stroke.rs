//! One drop's way while the shutter is open, as the picture shows it.

use bansho_base::{canvas::GrayPlanes, image::Rect};

use super::bands::Extent;

/// A streak in the picture: what a drop hides and the light it sends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Stroke {
    /// Where the drop's middle was when the shutter opened and when it closed, pixels.
    pub(crate) ends: [[f32; 2]; 2],
    /// Radius of the drop, pixels.
    pub(crate) radius: f32,
    /// What it hides of the picture, summed over all pixels and averaged over the exposure, square pixels: `pi r^2` and whatever gain.
    pub(crate) hidden: f32,
    /// Depth, m.
    pub(crate) depth: f32,
    /// Diameter of the drop, mm.
    pub(crate) diameter_mm: f32,
    /// Radiance where it hides all, ACEScg, cd/m^2.
    pub(crate) light: [f32; 3],
}

/// Share of a disc's area that lies left of `t`, with the disc from -1 to 1: the integral of `2 sqrt(1 - t^2) / pi`, eq. of the streak's
/// profile, as its series with the last term set so that it ends at 1; at most 0.002 off.
#[inline(always)]
pub(crate) fn disc_share(t: f32) -> f32 {
    let t = t.clamp(-1.0, 1.0);
    let s = t * t;
    let odd = t * (-0.022_935_f32).mul_add(s, -0.025).mul_add(s, -1.0 / 6.0).mul_add(s, 1.0);
    odd.mul_add(std::f32::consts::FRAC_2_PI, 0.5)
}

/// The streak along the axis it mostly follows: its middle, half its length and how far it leans to the other axis for each pixel.
#[derive(Clone, Copy)]
struct Along {
    middle: [f32; 2],
    half: f32,
    lean: f32,
    /// Half width across at each pixel along, as a disc that spreads as much: the drop's, and its lean within a pixel.
    across: f32,
}

impl Stroke {
    /// Half way along it, pixels.
    pub(crate) fn middle(&self) -> [f32; 2] {
        [0, 1].map(|axis| 0.5 * (self.ends[0][axis] + self.ends[1][axis]))
    }

    /// Whether it runs down the picture rather than across.
    fn upright(&self) -> bool {
        let [from, to] = self.ends;
        (to[1] - from[1]).abs() >= (to[0] - from[0]).abs()
    }

    /// `axis` is 1 for an upright streak, 0 for a level one.
    fn along(&self, axis: usize) -> Along {
        let [from, to] = self.ends;
        let length = to[axis] - from[axis];
        let lean = if length == 0.0 { 0.0 } else { (to[1 - axis] - from[1 - axis]) / length };
        let radius_squared = self.radius * self.radius;
        Along {
            middle: [0, 1].map(|k| 0.5 * (from[k] + to[k])),
            // A disc that moves: variances add, that of a disc is r^2/4, that of a way L^2/12.
            half: 0.5 * length.mul_add(length, 3.0 * radius_squared).sqrt().max(1e-3),
            lean,
            across: (radius_squared.mul_add(lean.mul_add(lean, 1.0), lean * lean * (1.0 / 3.0))).sqrt().max(1e-4),
        }
    }

    /// Whether it may touch a picture of so many columns and rows.
    pub(crate) fn meets(&self, size: [f64; 2]) -> bool {
        let extent = self.extent();
        (0..2).all(|axis| extent[axis][1] > 0.0 && f64::from(extent[axis][0]) < size[axis])
    }

    /// Where it may touch the picture.
    pub(crate) fn extent(&self) -> Extent {
        let [from, to] = self.ends;
        let axis = usize::from(self.upright());
        let along = self.along(axis);
        // Ends are softened by the drop's own size, sides by the lean.
        let mut reach = [along.across; 2];
        reach[axis] = along.half - 0.5 * (from[axis] - to[axis]).abs();
        [0, 1].map(|axis| [from[axis].min(to[axis]) - reach[axis], from[axis].max(to[axis]) + reach[axis]])
    }

    /// Adds it behind what the planes of `strip` hold, within `rect`; `measure` is told each pixel's index and opacity.
    ///
    /// The share of each pixel is that of its row times that of its column within the row (or the other way round for a level
    /// streak). Both are differences of a distribution function, so that they add up to one however thin or short the streak is.
    #[inline(always)]
    pub(crate) fn draw(&self, rect: Rect, strip: Rect, planes: &mut GrayPlanes, measure: &mut impl FnMut(usize, f32)) {
        let axis = usize::from(self.upright());
        let along = self.along(axis);
        let (low, high) = (along.middle[axis] - along.half, along.middle[axis] + along.half);
        let [start, end] = [[rect.x, rect.y], [rect.right(), rect.bottom()]];
        let lines = clip(low, start[axis], end[axis])..clip(high + 1.0, start[axis], end[axis]);
        let side = 1 - axis;
        for first in lines.clone().step_by(LINES) {
            let spans = along.spans(axis, self.hidden, first as f32, [start[side], end[side]]);
            for (number, line) in (first..lines.end.min(first + LINES)).enumerate() {
                let [begin, finish] = [spans.begin[number] as usize, spans.finish[number] as usize];
                let across = Across {
                    begin: spans.begin[number] - spans.centre[number],
                    scale: spans.scale,
                    amount: spans.amount[number],
                };
                if axis == 1 {
                    let index = (line - strip.y) * strip.width + begin - strip.x;
                    let room = end[0] - begin >= LANES;
                    self.put_row(index, finish - begin, room, &across, planes, measure);
                } else {
                    for place in begin..finish {
                        let index = (place - strip.y) * strip.width + line - strip.x;
                        let [opacity, ..] = across.opacities((place - begin) as f32);
                        self.put(index, [opacity], planes, measure);
                    }
                }
            }
        }
    }

    /// Puts `count` pixels from `first` on behind what the planes hold; where there is `room` for a whole run, as one: no streak reaches
    /// beyond its own pixels.
    #[inline(always)]
    fn put_row(
        &self,
        first: usize,
        count: usize,
        room: bool,
        across: &Across,
        planes: &mut GrayPlanes,
        measure: &mut impl FnMut(usize, f32),
    ) {
        if count <= LANES && room {
            return self.put(first, across.opacities(0.0), planes, measure);
        }
        for begin in (0..count).step_by(LANES) {
            let opacities = across.opacities(begin as f32);
            if count - begin >= LANES {
                self.put(first + begin, opacities, planes, measure);
                continue;
            }
            for (number, opacity) in opacities[..count - begin].iter().enumerate() {
                self.put(first + begin + number, [*opacity], planes, measure);
            }
        }
    }

    /// Puts a run of pixels from `first` on behind what the planes hold.
    #[inline(always)]
    fn put<const N: usize>(
        &self,
        first: usize,
        mut opacities: [f32; N],
        planes: &mut GrayPlanes,
        measure: &mut impl FnMut(usize, f32),
    ) {
        if let Some(plate) = planes.plate_depth.get(first..).and_then(<[f32]>::first_chunk::<N>) {
            for lane in 0..N {
                opacities[lane] = if plate[lane] <= self.depth { 0.0 } else { opacities[lane] };
            }
        }
        let mut hidden = [0.0; N];
        if let Some(through) = planes.transmittance[first..].first_chunk_mut::<N>() {
            for lane in 0..N {
                hidden[lane] = through[lane] * opacities[lane];
                through[lane] -= hidden[lane];
            }
        }
        for c in 0..3 {
            if let Some(radiance) = planes.radiance[c][first..].first_chunk_mut::<N>() {
                for lane in 0..N {
                    radiance[lane] = hidden[lane].mul_add(self.light[c], radiance[lane]);
                }
            }
        }
        if let Some(depth) = planes.depth[first..].first_chunk_mut::<N>() {
            for lane in 0..N {
                let shown = opacities[lane] > 0.0 && self.depth < depth[lane];
                depth[lane] = if shown { self.depth } else { depth[lane] };
            }
        }
        for lane in 0..N {
            if opacities[lane] > 0.0 {
                measure(first + lane, opacities[lane]);
            }
        }
    }
}

/// Pixels that are put at a time: about as many as a row of a streak has.
const LANES: usize = 4;
/// Rows, or columns, of a streak of which the pixels are found at a time.
const LINES: usize = 8;
/// Places of pixels' ends beyond the beginning of the first.
const ENDS: [f32; LINES] = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0];

/// What a streak covers of each of some lines across it.
struct Spans {
    /// First pixel, and one past the last.
    begin: [f32; LINES],
    finish: [f32; LINES],
    /// The streak's middle, pixels.
    centre: [f32; LINES],
    /// The sum of all opacities.
    amount: [f32; LINES],
    /// One over half the streak's width.
    scale: f32,
}

impl Along {
    /// The lines from `first` on, cut to pixels `[start, end]`.
    #[inline(always)]
    fn spans(&self, axis: usize, hidden: f32, first: f32, [start, end]: [usize; 2]) -> Spans {
        let (low, high) = (self.middle[axis] - self.half, self.middle[axis] + self.half);
        let (start, end) = (start as f32, end as f32);
        let density = hidden * (0.5 / self.half);
        let (mut begin, mut finish, mut centre, mut amount) = ([0.0; LINES], [0.0; LINES], [0.0; LINES], [0.0; LINES]);
        for line in 0..LINES {
            let (from, to) = ((first + (ENDS[line] - 1.0)).max(low), (first + ENDS[line]).min(high));
            amount[line] = density * (to - from);
            centre[line] = self.lean.mul_add(0.5 * (from + to) - self.middle[axis], self.middle[1 - axis]);
            begin[line] = (centre[line] - self.across).floor().max(start).min(end);
            finish[line] = (centre[line] + self.across + 1.0).floor().max(begin[line]).min(end);
        }
        Spans { begin, finish, centre, amount, scale: 1.0 / self.across }
    }
}

/// How opacity is spread over the pixels across a streak.
struct Across {
    /// Where the first pixel begins, from the streak's middle, pixels.
    begin: f32,
    /// One over half the streak's width.
    scale: f32,
    /// The sum of all opacities.
    amount: f32,
}

impl Across {
    /// Opacities of the pixels from number `from` on; they add up to the amount.
    #[inline(always)]
    fn opacities(&self, from: f32) -> [f32; LANES] {
        let begin = self.begin + from;
        let mut opacities = [0.0; LANES];
        for lane in 0..LANES {
            let before = disc_share((begin + (ENDS[lane] - 1.0)) * self.scale);
            let after = disc_share((begin + ENDS[lane]) * self.scale);
            opacities[lane] = (self.amount * (after - before)).clamp(0.0, 1.0);
        }
        opacities
    }
}

/// The pixel that holds a coordinate, held to `low..=high`.
#[inline(always)]
fn clip(coordinate: f32, low: usize, high: usize) -> usize {
    (coordinate.max(0.0) as usize).clamp(low, high.max(low))
}

#[cfg(test)]
mod tests {
    use super::*;
    use bansho_base::canvas::Strip;

    fn stroke(from: [f32; 2], to: [f32; 2], radius: f32) -> Stroke {
        let hidden = std::f32::consts::PI * radius * radius;
        Stroke { ends: [from, to], radius, hidden, depth: 2.0, diameter_mm: 1.0, light: [3.0, 2.0, 1.0] }
    }

    /// Opacity of each pixel of a picture drawn in strips of some rows.
    fn drawn(stroke: &Stroke, size: [usize; 2], rows: usize) -> Vec<f32> {
        let mut opacity = vec![0.0; size[0] * size[1]];
        for y in (0..size[1]).step_by(rows) {
            let mut strip = Strip::default();
            strip.reset(Rect { x: 0, y, width: size[0], height: rows.min(size[1] - y) }, None, 0);
            let rect = strip.rect;
            let mut planes = strip.gray_planes_mut().unwrap();
            stroke.draw(rect, rect, &mut planes, &mut |index, value| opacity[y * size[0] + index] += value);
        }
        opacity
    }

    #[test]
    fn a_streak_hides_its_drop_however_thin_short_or_slanted_it_is() {
        for to in [[20.3, 50.0], [24.9, 30.1], [50.0, 20.5], [35.2, 35.1], [20.3, 20.9]] {
            for radius in [0.01, 0.2, 0.9] {
                let stroke = stroke([20.3, 20.9], to, radius);
                let sum: f32 = drawn(&stroke, [64, 64], 64).iter().sum();
                let longest = (to[0] - 20.3).abs().max((to[1] - 20.9_f32).abs());
                // A drop that does not move is opaque and cannot hide more.
                let tolerance = if longest < 2.0 * radius { 0.15 } else { 1e-4 };
                assert!((sum / stroke.hidden - 1.0).abs() < tolerance, "{to:?} {radius}: {sum} {}", stroke.hidden);
            }
        }
    }

    #[test]
    fn a_thick_upright_streak_has_the_profile_of_the_paper_s_source() {
        let stroke = stroke([32.0, 4.0], [32.0, 60.0], 6.0);
        let opacity = drawn(&stroke, [64, 64], 64);
        for column in 26..38 {
            let offset = column as f32 + 0.5 - 32.0;
            let expected = 2.0 * (36.0 - offset * offset).sqrt() / 56.0;
            let found = opacity[32 * 64 + column];
            assert!((found / expected - 1.0).abs() < 0.05, "{column}: {found} {expected}");
        }
    }

    #[test]
    fn strips_change_no_pixel_and_no_pixel_lies_outside_the_rows() {
        for to in [[25.0, 50.0], [50.0, 26.0]] {
            let stroke = stroke([20.3, 20.9], to, 1.3);
            let whole = drawn(&stroke, [64, 64], 64);
            assert_eq!(whole, drawn(&stroke, [64, 64], 8));
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
