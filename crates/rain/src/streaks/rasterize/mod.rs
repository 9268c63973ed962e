//! Rasterization of streaks with exact coverage.

mod columns;
mod packed;
pub(crate) mod tile;

pub(crate) use packed::PackedStreak;
use tile::StreakShading;

use crate::shutter_cameras::PixelBounds;

/// A streak in the picture: its coverage and the light of its drop.
///
/// The coverage of a pixel is a difference of cumulative distributions, along the streak and across it, so that the sum
/// over all pixels is the blocked area however thin or short the streak is. A thin streak has the same profile from end
/// to end. A wide one is the area swept by its disc, with round ends as soft as its width.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct StreakSegment {
    /// Center, pixels.
    pub(super) center: [f32; 2],
    /// Whether it is steeper than 45 degrees: its major axis is then the picture's y axis, else x.
    pub(super) steep: bool,
    /// Half its length along the major axis, pixels. For a thin streak, that of a line with the same variance; for a
    /// wide one, that of its disc's path.
    pub(super) half_length: f32,
    /// Change along the minor axis for each pixel along the major axis.
    pub(super) slope: f32,
    /// Half width along the minor axis, pixels, as of a disc with the same variance: the drop's own, and the slope
    /// within one pixel.
    pub(super) half_width: f32,
    /// Blocked area for each line of pixels across it, square pixels.
    pub(super) line_coverage: f32,
    /// Diameter of the drop, mm.
    pub(crate) diameter_mm: f32,
    /// Radiance and depth.
    pub(crate) shading: StreakShading,
}

/// A drop's path in the picture.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ScreenPath {
    /// Its center when the shutter opens and when it closes, pixels.
    pub(crate) ends: [[f32; 2]; 2],
    /// Radius of the drop, pixels.
    pub(crate) radius: f32,
    /// Blocked area, averaged over the exposure and summed over all pixels, square pixels: `pi r^2` times a gain.
    pub(crate) blocked_area: f32,
}

/// Half width from which on a streak is treated as wide, pixels. The ends of thin ones are sharp.
const MIN_WIDE_HALF_WIDTH: f32 = 1.25;
/// Minimum half length of a wide streak, pixels.
const MIN_HALF_LENGTH: f32 = 0.1;

impl StreakSegment {
    /// The streak of a drop, without light.
    #[inline(always)]
    pub(crate) fn new(
        ScreenPath { ends: [from, to], radius, blocked_area }: ScreenPath,
        depth: f32,
        diameter_mm: f32,
    ) -> Self {
        let travel = [to[0] - from[0], to[1] - from[1]];
        let steep = travel[1].abs() >= travel[0].abs();
        let (length, offset) = if steep { (travel[1], travel[0]) } else { (travel[0], travel[1]) };
        let slope = packed::quantize_slope(if length == 0.0 { 0.0 } else { offset / length });
        // Variances of a moving disc add: r^2/4 of the disc, L^2/12 of the path. Not fused, because this runs in scalar
        // code too.
        let square = radius * radius;
        let half_width =
            packed::round_to_bf16((square * (slope * slope + 1.0) + slope * slope * (1.0 / 3.0)).sqrt().max(1e-4));
        let half_length = if half_width < MIN_WIDE_HALF_WIDTH {
            (0.5 * (length * length + 3.0 * square).sqrt()).max(1e-3)
        } else {
            (0.5 * length.abs()).max(MIN_HALF_LENGTH)
        };
        Self {
            center: [0, 1].map(|axis| 0.5 * (from[axis] + to[axis])),
            steep,
            half_length,
            slope,
            half_width,
            line_coverage: blocked_area * 0.5 / half_length,
            diameter_mm,
            shading: StreakShading::new(depth),
        }
    }

    /// The streak of a drop whose disc the lens stretches, without light and diameter: like that of a disc of some `radius` that is spread along its path, the
    /// vector `travel` about its `center`, and along the vector `widening`, all in pixels.
    pub(crate) fn stretched(
        center: [f32; 2],
        travel: [f32; 2],
        widening: [f32; 2],
        radius: f32,
        blocked_area: f32,
        depth: f32,
    ) -> Self {
        // Variances and covariance of both, times 12.
        let squares = [0, 1].map(|axis| travel[axis] * travel[axis] + widening[axis] * widening[axis]);
        let product = travel[0] * travel[1] + widening[0] * widening[1];
        let steep = squares[1] >= squares[0];
        let along = if steep { squares[1] } else { squares[0] };
        let slope = packed::quantize_slope(if along == 0.0 { 0.0 } else { product / along });
        // The variance across that is left at any position along the major axis.
        let cross = travel[0] * widening[1] - travel[1] * widening[0];
        let spread = if along == 0.0 { 0.0 } else { cross * cross / along };
        let square = radius * radius;
        let half_width = (square * (slope * slope + 1.0) + (slope * slope + spread) * (1.0 / 3.0)).sqrt();
        let half_width = packed::round_to_bf16(half_width.max(1e-4));
        let half_length = if half_width < MIN_WIDE_HALF_WIDTH {
            (0.5 * (along + 3.0 * square).sqrt()).max(1e-3)
        } else {
            // The ends of a wide streak are as soft as it is wide; what that adds to the variance along it is taken from its length.
            let ends = half_width * half_width / (slope * slope + 1.0) - square;
            (0.25 * along - 0.75 * ends).max(MIN_HALF_LENGTH * MIN_HALF_LENGTH).sqrt()
        };
        Self {
            center,
            steep,
            half_length,
            slope,
            half_width,
            line_coverage: blocked_area * 0.5 / half_length,
            diameter_mm: 0.0,
            shading: StreakShading::new(depth),
        }
    }

    /// Its length along the major axis, pixels.
    pub(crate) fn length(&self) -> f64 {
        2.0 * f64::from(self.half_length)
    }

    /// One of `count` pieces of equal length, in the order in which the drop passes them downward or to the right. All together cover what it covers.
    pub(crate) fn piece(&self, index: usize, count: usize) -> Self {
        let half_length = self.half_length / count as f32;
        let along = (2 * index + 1) as f32 * half_length - self.half_length;
        let offset = if self.steep { [self.slope * along, along] } else { [along, self.slope * along] };
        Self { center: [0, 1].map(|axis| self.center[axis] + offset[axis]), half_length, ..*self }
    }

    /// Maximum opacity of its pixels: that on its axis, or the whole coverage of a line where it is narrower than a
    /// pixel.
    #[inline(always)]
    pub(crate) fn peak(&self) -> f32 {
        let shortening = if self.is_wide() { (self.half_length / self.chord(0.0)).min(1.0) } else { 1.0 };
        shortening * self.line_coverage * (std::f32::consts::FRAC_2_PI / self.half_width).min(1.0)
    }

    #[inline(always)]
    fn is_wide(&self) -> bool {
        self.half_width >= MIN_WIDE_HALF_WIDTH
    }

    /// Half the chord of its disc along the major axis, at an offset from the axis, pixels.
    #[inline(always)]
    fn chord(&self, offset: f32) -> f32 {
        let square = self.half_width * self.half_width - offset * offset;
        (if square > 0.0 { square.sqrt() } else { 0.0 }) / (self.slope * self.slope + 1.0)
    }

    /// Half of its extent along the major axis, pixels.
    #[inline(always)]
    fn reach(&self) -> f32 {
        if self.is_wide() {
            self.half_length + self.half_width / (self.slope * self.slope + 1.0).sqrt()
        } else {
            self.half_length
        }
    }

    /// Its bounding box.
    #[inline(always)]
    pub(crate) fn extent(&self) -> PixelBounds {
        let along = self.reach();
        let offset = self.slope.abs() * along + self.half_width;
        let reach = if self.steep { [offset, along] } else { [along, offset] };
        [0, 1].map(|axis| [self.center[axis] - reach[axis], self.center[axis] + reach[axis]])
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::{image::Rect, phenomenon::strip::Strip};
    use fearless_simd::dispatch;

    use super::tile::TILE_ROWS;
    use super::{tile::TileBuffer, *};
    use crate::streaks::coverage::Streak;

    /// What a drop hides that does not overlap itself.
    fn disc(radius: f32) -> f32 {
        std::f32::consts::PI * radius * radius
    }

    fn segment(from: [f32; 2], to: [f32; 2], radius: f32) -> StreakSegment {
        StreakSegment::new(ScreenPath { ends: [from, to], radius, blocked_area: disc(radius) }, 2.0, 1.0)
    }

    /// Opacity of each pixel of a picture, drawn from column `left` on.
    fn drawn(segment: &StreakSegment, size: [usize; 2], left: usize) -> Vec<f32> {
        let mut opacity = vec![0.0; size[0] * size[1]];
        for y in (0..size[1]).step_by(TILE_ROWS) {
            let rect = Rect { x: left, y, width: size[0] - left, height: TILE_ROWS.min(size[1] - y) };
            let mut strip = Strip::default();
            strip.reset(rect, None, 0);
            let mut planes = strip.gray_planes_mut().unwrap();
            let mut buffer = TileBuffer::default();
            let level = bansho_base::math::simd::level();
            dispatch!(level, simd => buffer.load(simd, [0, y], rect, rect, &planes));
            segment.draw(&mut buffer, &mut |[column, row], value| {
                if (left..size[0]).contains(&column) && row < rect.height {
                    opacity[(y + row) * size[0] + column] += value;
                }
            });
            dispatch!(level, simd => buffer.store(simd, rect, rect, &mut planes));
            let blocked_area = planes.transmittance.iter().map(|through| 1.0 - through);
            for (index, blocked_area) in blocked_area.enumerate() {
                let known = opacity[(y + index / rect.width) * size[0] + left + index % rect.width];
                assert!((blocked_area - known).abs() < 1e-6);
            }
        }
        opacity
    }

    #[test]
    fn a_streak_hides_its_drop_however_thin_short_or_slanted_it_is() {
        for to in [[20.3, 50.0], [24.9, 30.1], [50.0, 20.5], [35.2, 35.1], [20.3, 20.9]] {
            for radius in [0.01, 0.2, 0.9] {
                let segment = segment([20.3, 20.9], to, radius);
                let sum: f32 = drawn(&segment, [64, 64], 0).iter().sum();
                let longest = (to[0] - 20.3).abs().max((to[1] - 20.9_f32).abs());
                // A drop that does not move is opaque and cannot hide more.
                let tolerance = if longest < 2.0 * radius { 0.15 } else { 1e-4 };
                assert!((sum / disc(radius) - 1.0).abs() < tolerance, "{to:?} {radius}: {sum}");
            }
        }
    }

    #[test]
    fn a_disc_that_is_not_stretched_is_an_ordinary_streak() {
        for to in [[24.9, 50.0], [50.0, 26.0], [29.0, 52.0], [20.3, 20.9]] {
            for radius in [0.3, 3.0] {
                let path = ScreenPath { ends: [[20.3, 20.9], to], radius, blocked_area: disc(radius) };
                let known = StreakSegment::new(path, 2.0, 0.0);
                let travel = [0, 1].map(|axis: usize| to[axis] - path.ends[0][axis]);
                let found = StreakSegment::stretched(known.center, travel, [0.0; 2], radius, disc(radius), 2.0);
                assert_eq!((known.steep, known.center), (found.steep, found.center));
                for (known, found) in [
                    (known.half_length, found.half_length),
                    (known.half_width, found.half_width),
                    (known.line_coverage, found.line_coverage),
                    (1.0 + known.slope, 1.0 + found.slope),
                ] {
                    assert!((found / known - 1.0).abs() < 1e-2, "{to:?} {radius}: {known} {found}");
                }
            }
        }
    }

    #[test]
    fn a_stretched_streak_is_as_large_and_as_wide_as_it_should_be() {
        for (travel, widening) in
            [([0.0, 30.0], [6.0, 0.0]), ([3.0, 2.0], [20.0, 0.0]), ([9.0, 9.0], [8.0, -6.0]), ([0.0, 0.0], [5.0, 12.0])]
        {
            for radius in [0.3, 2.5] {
                let area = 0.1 * disc(radius);
                let segment = StreakSegment::stretched([32.3; 2], travel, widening, radius, area, 2.0);
                let opacity = drawn(&segment, [64, 64], 0);
                let moment = |weight: &dyn Fn([f32; 2]) -> f32| -> f32 {
                    let at = |index: usize| [index % 64, index / 64].map(|count| count as f32 + 0.5 - 32.3);
                    opacity.iter().enumerate().map(|(index, value)| value / area * weight(at(index))).sum()
                };
                assert!((moment(&|_| 1.0) - 1.0).abs() < 0.01, "{travel:?} {widening:?}: {}", moment(&|_| 1.0));
                // Variances of path, widening, disc and pixel add.
                for [a, b] in [[0, 0], [0, 1], [1, 1]] {
                    let own = if a == b { 0.25 * radius * radius + 1.0 / 12.0 } else { 0.0 };
                    let expected = (travel[a] * travel[b] + widening[a] * widening[b]) / 12.0 + own;
                    let found = moment(&|place| place[a] * place[b]);
                    let scale = [travel, widening].as_flattened().iter().map(|side| side * side).sum::<f32>() / 12.0;
                    let error = (found - expected).abs();
                    assert!(
                        error < 0.15 * (scale + radius * radius + 1.0),
                        "{travel:?} {widening:?} {radius}: {found} {expected}"
                    );
                }
            }
        }
    }

    #[test]
    fn the_pieces_of_a_streak_cover_what_it_covers() {
        for (to, radius) in [([24.9, 50.0], 0.3), ([50.0, 26.0], 0.9), ([29.0, 52.0], 3.0)] {
            let whole = segment([20.3, 20.9], to, radius);
            let opacity = drawn(&whole, [64, 64], 0);
            let mut sum = vec![0.0; opacity.len()];
            for index in 0..7 {
                let piece = drawn(&whole.piece(index, 7), [64, 64], 0);
                sum.iter_mut().zip(piece).for_each(|(sum, piece)| *sum += piece);
            }
            let [all, pieces] = [&opacity, &sum].map(|values| values.iter().sum::<f32>());
            assert!((pieces / all - 1.0).abs() < 1e-3, "{to:?}: {pieces} {all}");
            // Where two pieces meet within a pixel, they cross it at two positions.
            let largest = opacity.iter().copied().fold(0.0, f32::max);
            for (index, (sum, whole)) in sum.iter().zip(&opacity).enumerate() {
                assert!((sum - whole).abs() < 0.04 * largest, "{to:?} {index}: {sum} {whole}");
            }
        }
    }

    #[test]
    fn a_wide_streak_hides_its_drop_wherever_it_falls_between_pixels() {
        for place in [[60.0, 60.0], [60.3, 60.9], [60.5, 60.71]] {
            for travel in
                [[0.0, 0.0], [0.6, 2.0], [0.0, 70.0], [13.0, 51.0], [40.0, 40.0], [50.0, -19.0], [-37.0, 41.0]]
            {
                for radius in [1.26, 2.0, 4.4, 9.0] {
                    let ends = [-0.5, 0.5].map(|share| [0, 1].map(|axis| place[axis] + share * travel[axis]));
                    let sum: f32 = drawn(&segment(ends[0], ends[1], radius), [128, 128], 0).iter().sum();
                    // One that hardly moves is opaque and cannot hide more.
                    let tolerance = if travel[1] * travel[1] < 4.0 * radius * radius { 0.03 } else { 1e-3 };
                    assert!((sum / disc(radius) - 1.0).abs() < tolerance, "{place:?} {travel:?} {radius}: {sum}");
                }
            }
        }
    }

    #[test]
    fn a_thick_upright_streak_has_the_profile_of_the_paper_s_source() {
        let segment = segment([32.0, 4.0], [32.0, 60.0], 6.0);
        let opacity = drawn(&segment, [64, 64], 0);
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
            let segment = segment([20.3, 20.9], to, 1.3);
            let whole = drawn(&segment, [64, 64], 0);
            let part = drawn(&segment, [64, 64], 23);
            for (index, opacity) in part.into_iter().enumerate() {
                assert_eq!(opacity, if index % 64 < 23 { 0.0 } else { whole[index] });
            }
            let [low, high] = segment.extent()[1];
            for (index, opacity) in whole.iter().enumerate() {
                let row = (index / 64) as f32;
                assert!(*opacity == 0.0 || (row + 1.0 >= low && row <= high), "{row} {low} {high}");
            }
        }
    }

    #[test]
    fn a_wide_streak_is_what_its_disc_covers_on_its_way() {
        for (to, radius) in [([41.2, 66.9], 6.0), ([66.3, 30.1], 5.0), ([31.4, 60.2], 9.0), ([34.9, 39.6], 8.0)] {
            let from = [31.3, 31.1];
            let opacity = drawn(&segment(from, to, radius), [96, 96], 0);
            let travel = [to[0] - from[0], to[1] - from[1]].map(f64::from);
            let length = (travel[0] * travel[0] + travel[1] * travel[1]).sqrt();
            let streak = Streak { radius: f64::from(radius), length };
            let peak = streak.profile(0.0);
            let (mut off, mut square) = (0.0_f64, 0.0);
            for (index, found) in opacity.iter().enumerate() {
                let place = [index % 96, index / 96].map(|count| count as f64 + 0.5);
                let offset = [0, 1].map(|axis| place[axis] - f64::from(from[axis]));
                let along = (offset[0] * travel[0] + offset[1] * travel[1]) / length;
                let offset = (offset[0] * travel[1] - offset[1] * travel[0]) / length;
                let error = (f64::from(*found) - streak.opacity(offset, along)).abs() / peak;
                off = off.max(error);
                square += error * error;
            }
            let area = std::f64::consts::PI * streak.radius * streak.radius + 2.0 * streak.radius * length;
            let spread = (square / area).sqrt();
            // At its rim it is as steep as a disc's, which pixels blur.
            assert!(off < 0.25 && spread < 0.03, "{to:?} {radius}: {off} {spread}");
        }
    }

    #[test]
    fn ends_of_wide_streaks_are_as_soft_as_they_are_wide() {
        for (to, radius) in [([60.0, 110.0], 12.0), ([110.0, 36.0], 12.0), ([61.0, 120.0], 2.0)] {
            let segment = segment([60.0, 20.0], to, radius);
            let opacity = drawn(&segment, [128, 128], 0);
            // Along its axis: the disc passes a place near its end in as many pixels as it is wide.
            let along = if segment.steep { 1 } else { 0 };
            let at = |step: usize| {
                let place = step as f32 + 0.5;
                let offset = (segment.center[1 - along] + segment.slope * (place - segment.center[along])) as usize;
                opacity[if along == 1 { step * 128 + offset } else { offset * 128 + step }]
            };
            let steepest = (1..128).map(|step| (at(step) - at(step - 1)).abs()).fold(0.0, f32::max);
            assert!(
                steepest < 1.2 * segment.peak() / (2.0 * radius) + 0.02 * segment.peak(),
                "{steepest} {}",
                segment.peak()
            );
        }
    }
}
