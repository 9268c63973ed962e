//! A motion-blurred spark: a disc with soft edges, averaged along a line segment.

use bansho_base::{
    camera::{Camera, Lens},
    image::Rect,
    math::{self, DVec2},
    phenomenon::strip::{Strip, View},
};

/// The streak of a spark during the exposure.
#[derive(Clone, Debug)]
pub(crate) struct SparkStreak {
    from: DVec2,
    to: DVec2,
    radius: f64,
    /// ACEScg at full coverage, cd/m^2, such that the light of the whole streak is that of the spark.
    radiance: [f32; 3],
    /// Depth, m.
    depth: f64,
    /// Depth at which it is sorted among flames, m.
    pub(crate) sorting_depth: f64,
    /// Bounding box, pixels; may extend beyond the picture.
    min_pixel: [i64; 2],
    max_pixel: [i64; 2],
}

/// Half width of a streak's soft edge, pixels.
const EDGE_SOFTNESS: f64 = 0.7;

/// Smallest radius of a streak, pixels.
const MIN_RADIUS: f64 = 0.6;

impl SparkStreak {
    /// Appends the streaks of a sphere of luminous surface that moves between two positions in the picture: several where it crosses the seam of a panorama or the
    /// antipode of a fisheye. The sum of luminance times solid angle over the pixels of each image is `radiance` times the sphere's solid angle,
    /// steradian; both images of a fisheye share it. `radius` is in pixels; `depths` are the streak's own and that at which it is sorted.
    pub(crate) fn images(
        camera: &Camera,
        [from, to]: [DVec2; 2],
        radius: f64,
        radiance: [f32; 3],
        solid_angle: f64,
        depths: [f64; 2],
        streaks: &mut Vec<Self>,
    ) {
        let radius = radius.max(MIN_RADIUS);
        let first = streaks.len();
        if camera.lens == Lens::Perspective {
            // The only image, without a list of them.
            streaks.extend(Self::new(from, to, radius, radiance, depths));
        } else {
            let lines = camera.line_images(from, to, radius + EDGE_SOFTNESS).into_iter();
            streaks.extend(lines.filter_map(|[from, to]| Self::new(from, to, radius, radiance, depths)));
        }
        let images = &mut streaks[first..];
        let counted = if camera.lens == Lens::Fisheye { images.len() } else { images.len().min(1) };
        let covered: f64 = images[..counted].iter().map(|streak| streak.covered_solid_angle(camera)).sum();
        if covered <= 0.0 {
            return streaks.truncate(first);
        }
        for streak in images {
            streak.radiance = radiance.map(|value| value * (solid_angle / covered) as f32);
        }
    }

    fn new(from: DVec2, to: DVec2, radius: f64, radiance: [f32; 3], depths: [f64; 2]) -> Option<Self> {
        /// Maximum length, pixels; a longer streak is that of a spark right in front of the lens, and is discarded.
        const MAX_LENGTH: f64 = 4000.0;
        let margin = DVec2::splat(radius + EDGE_SOFTNESS);
        let (min_pixel, max_pixel) = (from.min(to) - margin, from.max(to) + margin);
        if !((max_pixel - min_pixel).max_element() < MAX_LENGTH && min_pixel.abs().max_element() < 1e9) {
            return None;
        }
        let [min_pixel, max_pixel] =
            [min_pixel, max_pixel].map(|pixel| pixel.to_array().map(|side| side.floor() as i64));
        let [depth, sorting_depth] = depths;
        Some(Self { from, to, radius, radiance, depth, sorting_depth, min_pixel, max_pixel })
    }

    /// Sum over all pixels of coverage times solid angle: summed explicitly for small streaks, otherwise the area of a disc with soft edges times the
    /// mean solid angle of a pixel in it. Pixels beside the picture count as well.
    fn covered_solid_angle(&self, camera: &Camera) -> f64 {
        const MAX_SUMMED_PIXELS: i64 = 4096;
        if (self.max_pixel[0] - self.min_pixel[0] + 1) * (self.max_pixel[1] - self.min_pixel[1] + 1)
            <= MAX_SUMMED_PIXELS
        {
            let covered =
                self.pixels().map(|(x, y)| (x, y, self.coverage(x, y))).filter(|(.., coverage)| *coverage > 0.0);
            let solid_angles = covered.map(|(x, y, coverage)| {
                coverage * camera.pixel_solid_angle(DVec2::new(x as f64 + 0.5, y as f64 + 0.5))
            });
            return solid_angles.sum();
        }
        const POSITIONS: usize = 8;
        // The mean over a disc, exact for quadratic functions: at four points at 1/sqrt(2) of its radius.
        let offset = 0.5 * self.radius;
        let corners = [[-offset, -offset], [offset, -offset], [-offset, offset], [offset, offset]].map(DVec2::from);
        let sums = (0..POSITIONS).map(|i| {
            let middle = self.from.lerp(self.to, (i as f64 + 0.5) / POSITIONS as f64);
            corners.into_iter().map(|corner| camera.pixel_solid_angle(middle + corner)).sum::<f64>()
        });
        let sum: f64 = sums.sum();
        self.covered_area() * sum / (POSITIONS * corners.len()) as f64
    }

    /// Area of the disc, square pixels.
    fn covered_area(&self) -> f64 {
        // The variance of a smoothstep edge of half width s is s^2/5, that of a Beta(2, 2) distribution.
        std::f64::consts::PI * (self.radius * self.radius + EDGE_SOFTNESS * EDGE_SOFTNESS / 5.0)
    }

    fn pixels(&self) -> impl Iterator<Item = (i64, i64)> + use<> {
        let (min_pixel, max_pixel) = (self.min_pixel, self.max_pixel);
        (min_pixel[1]..=max_pixel[1]).flat_map(move |y| (min_pixel[0]..=max_pixel[0]).map(move |x| (x, y)))
    }

    /// Coverage of a pixel, averaged over the exposure: that of discs along the segment.
    fn coverage(&self, x: i64, y: i64) -> f64 {
        let (along, length) = (self.to - self.from, (self.to - self.from).length());
        let reach = self.radius + EDGE_SOFTNESS;
        let discs = (length / (0.25 * reach)).ceil().max(1.0);
        let offset = DVec2::new(x as f64 + 0.5, y as f64 + 0.5) - self.from;
        let direction = if length > 0.0 { along / length } else { DVec2::X };
        let (at, beside) = (offset.dot(direction), offset.perp_dot(direction));
        if beside.abs() >= reach {
            return 0.0;
        }
        // Only the discs within reach of the pixel.
        let [first, end] =
            [at - reach, at + reach].map(|position| (position * discs / length.max(1e-12)).clamp(0.0, discs));
        let near = if discs > 1.0 { first.floor() as i64..end.ceil() as i64 } else { 0..1 };
        let coverages = near.map(|disc| {
            let distance = math::hypot(at - length * (disc as f64 + 0.5) / discs, beside);
            1.0 - math::smoothstep(self.radius - EDGE_SOFTNESS, self.radius + EDGE_SOFTNESS, distance)
        });
        coverages.sum::<f64>() / discs
    }

    /// Bounding rectangle in the picture.
    pub(crate) fn bounds(&self, picture: [usize; 2]) -> Rect {
        let start = [0, 1].map(|axis| self.min_pixel[axis].clamp(0, picture[axis] as i64) as usize);
        let end = [0, 1].map(|axis| (self.max_pixel[axis] + 1).clamp(0, picture[axis] as i64) as usize);
        if start[0] >= end[0] || start[1] >= end[1] {
            return Rect::default();
        }
        Rect { x: start[0], y: start[1], width: end[0] - start[0], height: end[1] - start[1] }
    }

    /// Adds its light to the strip, behind the current contents.
    pub(crate) fn draw(&self, view: &View, strip: &mut Strip) {
        let rect = self.bounds(view.size).intersection(&strip.rect);
        for y in rect.y..rect.bottom() {
            for x in rect.x..rect.right() {
                if !view.camera.is_in_circle(DVec2::new(x as f64 + 0.5, y as f64 + 0.5)) {
                    continue;
                }
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
    use bansho_base::{camera::CameraParameters, phenomenon::strip::Shutter};

    use super::*;

    fn view(lens: Lens, size: [usize; 2]) -> View {
        let camera =
            CameraParameters { lens, fisheye_fov_deg: 360.0, vertical_fov_deg: 120.0.into(), ..Default::default() };
        View::new(camera, Shutter { open: 0.0, close: 0.0 }, 0.0, size, 0)
    }

    /// Sum of luminance times solid angle of all images of a streak.
    fn light(view: &View, streaks: &[SparkStreak]) -> f64 {
        let mut strip = Strip::default();
        strip.reset(Rect::from_size(view.size[0], view.size[1]), None, 0);
        streaks.iter().for_each(|streak| streak.draw(view, &mut strip));
        let center = |i: usize| DVec2::new((i % view.size[0]) as f64 + 0.5, (i / view.size[0]) as f64 + 0.5);
        let pixel = |(i, value): (usize, &f32)| f64::from(*value) * view.camera.pixel_solid_angle(center(i));
        strip.radiance[0].iter().enumerate().map(pixel).sum()
    }

    #[test]
    fn a_streak_keeps_the_sparks_light_through_every_lens_however_small_or_long_it_is() {
        for (lens, size) in [(Lens::Perspective, [160, 120]), (Lens::Fisheye, [128, 128]), (Lens::Panorama, [160, 80])]
        {
            let view = view(lens, size);
            for (from, to, radius) in [
                (DVec2::new(20.3, 20.9), DVec2::new(20.3, 20.9), 0.6),
                (DVec2::new(50.3, 20.9), DVec2::new(108.0, 51.5), 0.6),
                (DVec2::new(45.0, 40.0), DVec2::new(45.0, 48.0), 4.0),
                // Across the seam of the panorama, and the antipode of the fisheye.
                (DVec2::new(1.2, 62.0), DVec2::new(size[0] as f64 - 3.2, 65.0), 0.6),
                (DVec2::new(0.4, 62.0), DVec2::new(0.4, 62.0), 2.0),
            ] {
                let is_cut = lens == Lens::Perspective && from.x < 2.0;
                let mut streaks = Vec::new();
                SparkStreak::images(&view.camera, [from, to], radius, [3.0, 2.0, 1.0], 1e-3, [2.0; 2], &mut streaks);
                let ratio = light(&view, &streaks) / 3e-3;
                assert!(is_cut || (ratio - 1.0).abs() < 1e-4, "{lens:?} {from} to {to}: {ratio}");
            }
        }
    }

    #[test]
    fn the_solid_angle_of_large_streaks_is_what_counting_their_pixels_gives() {
        let camera = view(Lens::Perspective, [800, 600]).camera;
        for (to, radius) in
            [(DVec2::new(300.0, 200.5), 3.0), (DVec2::new(20.0, 400.0), 1.5), (DVec2::new(20.0, 30.0), 80.0)]
        {
            let streak = SparkStreak::new(DVec2::new(20.3, 20.9), to, radius, [1.0; 3], [2.0; 2]).unwrap();
            let counted: f64 = streak.pixels().map(|(x, y)| streak.coverage(x, y)).sum();
            assert!((streak.covered_area() / counted - 1.0).abs() < 2e-3, "{} {counted}", streak.covered_area());
            let center = |(x, y): (i64, i64)| DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
            let counted: f64 = streak
                .pixels()
                .map(|pixel| streak.coverage(pixel.0, pixel.1) * camera.pixel_solid_angle(center(pixel)))
                .sum();
            let covered = streak.covered_solid_angle(&camera);
            assert!((covered / counted - 1.0).abs() < 0.01, "{to}: {covered} {counted}");
        }
    }
}
