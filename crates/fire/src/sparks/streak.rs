//! A motion-blurred spark: a line segment with soft edges.

use bansho_base::{
    image::Rect,
    math::{self, DVec2},
    phenomenon::strip::Strip,
};

/// The streak of a spark during the exposure.
#[derive(Clone, Debug)]
pub(crate) struct Streak {
    from: DVec2,
    to: DVec2,
    radius: f64,
    /// ACEScg at full coverage, cd/m^2, such that the light of the whole streak is that of the spark.
    radiance: [f32; 3],
    /// Depth, m.
    pub(crate) depth: f64,
    /// Bounding box, pixels; may extend beyond the picture.
    min_pixel: [i64; 2],
    max_pixel: [i64; 2],
}

/// Half width of a streak's soft edge, pixels.
const EDGE_SOFTNESS: f64 = 0.7;

impl Streak {
    /// A streak that distributes the light `radiance` times `area` (square pixels) over its coverage.
    pub(crate) fn new(from: DVec2, to: DVec2, radius: f64, radiance: [f32; 3], area: f64, depth: f64) -> Option<Self> {
        /// Maximum length, pixels; a longer streak is that of a spark right in front of the lens, and is discarded.
        const MAX_LENGTH: f64 = 4000.0;
        let margin = DVec2::splat(radius + EDGE_SOFTNESS);
        let (min_pixel, max_pixel) = (from.min(to) - margin, from.max(to) + margin);
        if !((max_pixel - min_pixel).max_element() < MAX_LENGTH && min_pixel.abs().max_element() < 1e9) {
            return None;
        }
        let whole = |fraction: DVec2| [fraction.x.floor() as i64, fraction.y.floor() as i64];
        let mut streak =
            Self { from, to, radius, radiance, depth, min_pixel: whole(min_pixel), max_pixel: whole(max_pixel) };
        let covered_area = streak.covered_area();
        if covered_area <= 0.0 {
            return None;
        }
        streak.radiance = radiance.map(|value| value * (area / covered_area) as f32);
        Some(streak)
    }

    /// Sum of the coverage over all pixels: summed explicitly for small streaks, otherwise the area of a capsule with soft edges.
    fn covered_area(&self) -> f64 {
        const MAX_SUMMED_PIXELS: i64 = 4096;
        if (self.max_pixel[0] - self.min_pixel[0] + 1) * (self.max_pixel[1] - self.min_pixel[1] + 1)
            <= MAX_SUMMED_PIXELS
        {
            return self.pixels().map(|(x, y)| self.coverage(x, y)).sum();
        }
        // The variance of a smoothstep edge of half width s is s^2/5, that of a Beta(2, 2) distribution.
        let round = self.radius * self.radius + EDGE_SOFTNESS * EDGE_SOFTNESS / 5.0;
        2.0 * (self.to - self.from).length() * self.radius + std::f64::consts::PI * round
    }

    fn pixels(&self) -> impl Iterator<Item = (i64, i64)> + use<> {
        let (min_pixel, max_pixel) = (self.min_pixel, self.max_pixel);
        (min_pixel[1]..=max_pixel[1]).flat_map(move |y| (min_pixel[0]..=max_pixel[0]).map(move |x| (x, y)))
    }

    /// Coverage of a pixel, from the distance of its center to the segment.
    fn coverage(&self, x: i64, y: i64) -> f64 {
        let point = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
        let along = self.to - self.from;
        let fraction = ((point - self.from).dot(along) / along.length_squared().max(1e-12)).clamp(0.0, 1.0);
        let distance = (point - self.from - along * fraction).length();
        1.0 - math::smoothstep(self.radius - EDGE_SOFTNESS, self.radius + EDGE_SOFTNESS, distance)
    }

    /// Bounding rectangle in the picture.
    pub(crate) fn bounds(&self, picture: [usize; 2]) -> Rect {
        let clip = |value: i64, side: usize| value.clamp(0, side as i64) as usize;
        let start = [clip(self.min_pixel[0], picture[0]), clip(self.min_pixel[1], picture[1])];
        let end = [clip(self.max_pixel[0] + 1, picture[0]), clip(self.max_pixel[1] + 1, picture[1])];
        if start[0] >= end[0] || start[1] >= end[1] {
            return Rect::default();
        }
        Rect { x: start[0], y: start[1], width: end[0] - start[0], height: end[1] - start[1] }
    }

    /// Adds its light to the strip, behind the current contents.
    pub(crate) fn draw(&self, picture: [usize; 2], strip: &mut Strip) {
        let rect = self.bounds(picture).intersection(&strip.rect);
        for y in rect.y..rect.bottom() {
            for x in rect.x..rect.right() {
                let index = (y - strip.rect.y) * strip.rect.width + x - strip.rect.x;
                let coverage = self.coverage(x as i64, y as i64) as f32;
                if coverage > 0.0 && strip.visible(index, self.depth as f32) {
                    strip.emit(index, self.radiance.map(|value| value * coverage), self.depth as f32);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_streak_keeps_the_sparks_light_however_small_or_long_it_is() {
        for (to, radius) in
            [(DVec2::new(20.3, 20.9), 0.6), (DVec2::new(48.0, 31.5), 0.6), (DVec2::new(25.0, 40.0), 4.0)]
        {
            let streak = Streak::new(DVec2::new(20.3, 20.9), to, radius, [3.0, 2.0, 1.0], 0.37, 2.0).unwrap();
            let mut strip = Strip::default();
            strip.reset(Rect::from_size(64, 64), None, 0);
            streak.draw([64, 64], &mut strip);
            let sum: f32 = strip.radiance[0].iter().sum();
            assert!((sum - 3.0 * 0.37).abs() < 1e-4, "{sum}");
        }
    }

    #[test]
    fn the_area_of_large_streaks_is_what_counting_their_pixels_gives() {
        for (to, radius) in
            [(DVec2::new(300.0, 200.5), 3.0), (DVec2::new(20.0, 400.0), 1.5), (DVec2::new(20.0, 30.0), 80.0)]
        {
            let streak = Streak::new(DVec2::new(20.3, 20.9), to, radius, [1.0; 3], 1.0, 2.0).unwrap();
            let counted: f64 = streak.pixels().map(|(x, y)| streak.coverage(x, y)).sum();
            assert!((streak.covered_area() / counted - 1.0).abs() < 2e-3, "{} {counted}", streak.covered_area());
        }
    }
}
