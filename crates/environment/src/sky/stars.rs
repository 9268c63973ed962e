//! A random starry sky with the magnitude counts and approximate colors of the real one.

use bansho_base::{
    camera::{Camera, Lens},
    color::{black_body, luminance},
    host::parallel::prelude::*,
    math::{
        self, DVec2, DVec3, MulAdd,
        random::{Key, Purpose, direction, uniform},
    },
    phenomenon::strip::View,
    world::sky::{Night, SkyObserver},
};

/// Logarithm (base 10) of the number of stars in the whole sky that are brighter than magnitude -1, 0, 1 ... 9 (Allen's
/// Astrophysical Quantities, 4th edition, table 19.9, rounded).
const LOG_STAR_COUNTS: [f64; 11] = [0.15, 0.6, 1.15, 1.7, 2.25, 2.75, 3.21, 3.69, 4.16, 4.6, 5.05];
const MIN_MAGNITUDE: f64 = -1.0;
/// Magnitude of the faintest stars that are drawn individually.
const MAX_MAGNITUDE: f64 = 8.5;
/// Cumulative fraction of the naked-eye stars up to each spectral class, M to B, and the temperature there, K. The
/// fractions are rounded estimates, not catalog counts. The hottest have the color of 10,000 K.
const SPECTRAL_CLASSES: [[f64; 2]; 7] =
    [[0.0, 2800.0], [0.06, 3900.0], [0.32, 5200.0], [0.46, 6000.0], [0.61, 7400.0], [0.82, 10_000.0], [1.0, 10_000.0]];
/// Illuminance of a star of magnitude 0, lux.
const MAGNITUDE_0_LUX: f64 = 2.54e-6;
/// From this magnitude on, some stars are concentrated in the Milky Way.
const MILKY_WAY_MIN_MAGNITUDE: f64 = 4.0;
/// Radius of a star's image, pixels, and of those brighter than magnitude 2.
const IMAGE_RADIUS: f64 = 3.5;
const BRIGHT_IMAGE_RADIUS: f64 = 10.0;
/// Point spread function of a star: (1 + (r / core)^2)^-beta (Moffat 1969), core in pixels and beta = 5/2.
const PSF_CORE: f64 = 0.85;
const PSF_BETA: f64 = 2.5;

/// Largest number of camera samples of a star trail.
const MAX_TRAIL_SAMPLES: f64 = 64.0;

const STAR: Purpose = Purpose::named("star");

/// A star.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Star {
    direction: DVec3,
    magnitude: f64,
    /// Outside the atmosphere, lux.
    illuminance: f64,
    /// ACEScg of unit luminance.
    color: [f32; 3],
}

/// The stars of a scene.
#[derive(Clone, Debug)]
pub(super) struct Stars(Vec<Star>);

/// The image of a star.
#[derive(Clone, Copy, Debug)]
pub(super) struct StarImage {
    pub(super) pixel: DVec2,
    pub(super) radius: f64,
    /// Radiance at its center, cd/m^2.
    pub(super) radiance: [f32; 3],
}

/// Normal of the galactic plane.
pub(super) fn galactic_pole() -> DVec3 {
    DVec3::new(0.62, 0.38, 0.69).normalize()
}

impl Stars {
    /// The stars of a seed.
    pub(super) fn new(seed: u64) -> Self {
        let key = Key::new(seed, "stars");
        let count = math::pow(10.0, log_count(MAX_MAGNITUDE)) as u64;
        Self((0..count).map(|number| star(key, number, count)).collect())
    }

    /// The images of visible stars, sorted by row. Where the camera turns during the exposure, each star draws a trail.
    pub(super) fn star_images(
        &self,
        view: &View,
        night: &Night,
        observer: SkyObserver,
        brightness: f64,
    ) -> Vec<StarImage> {
        let horizon = observer.horizon_sine();
        let cameras = view.cameras_at_most(MAX_TRAIL_SAMPLES);
        let scale = brightness / psf_integral() / cameras.len() as f64;
        let mut star_images = Vec::new();
        for camera in &cameras {
            let images = self.0.par_iter().filter_map(|star| image(star, camera, view.size, night, horizon, scale));
            star_images.par_extend(images.flat_map_iter(|image| wrapped_images(image, camera, view.size)));
        }
        star_images.sort_by(|a, b| a.pixel.y.total_cmp(&b.pixel.y));
        star_images
    }
}

/// All copies of a star's image that overlap the picture: a panorama wraps around.
fn wrapped_images(image: StarImage, camera: &Camera, size: [usize; 2]) -> impl Iterator<Item = StarImage> {
    let turn = std::f64::consts::TAU * camera.focal_pixels;
    let turns: &[f64] = if camera.lens == Lens::Panorama { &[0.0, -1.0, 1.0] } else { &[0.0] };
    turns
        .iter()
        .map(move |turns| StarImage { pixel: image.pixel + DVec2::new(turns * turn, 0.0), ..image })
        .filter(move |image| image.is_inside(size))
}

/// Logarithm (base 10) of the number of stars brighter than a magnitude.
fn log_count(magnitude: f64) -> f64 {
    let position = (magnitude - MIN_MAGNITUDE).clamp(0.0, LOG_STAR_COUNTS.len() as f64 - 1.001);
    math::lerp(LOG_STAR_COUNTS[position as usize], LOG_STAR_COUNTS[position as usize + 1], position.fract())
}

/// The magnitude of the star with this rank, from the brightest on: inverse of `log_count`.
fn magnitude_of_rank(rank: f64) -> f64 {
    let log = math::log10(rank.max(1e-9)).max(LOG_STAR_COUNTS[0] - 0.6);
    let above = LOG_STAR_COUNTS.partition_point(|count| *count < log).clamp(1, LOG_STAR_COUNTS.len() - 1);
    MIN_MAGNITUDE + above as f64 - 1.0
        + (log - LOG_STAR_COUNTS[above - 1]) / (LOG_STAR_COUNTS[above] - LOG_STAR_COUNTS[above - 1])
}

/// The temperature at a quantile of the naked-eye stars, K.
fn temperature_of_quantile(fraction: f64) -> f64 {
    let above = SPECTRAL_CLASSES.partition_point(|class| class[0] < fraction).clamp(1, SPECTRAL_CLASSES.len() - 1);
    let [from, to] = [SPECTRAL_CLASSES[above - 1], SPECTRAL_CLASSES[above]];
    math::lerp(from[1], to[1], (fraction - from[0]) / (to[0] - from[0]))
}

fn star(key: Key, number: u64, count: u64) -> Star {
    let words = key.words(number, 0, STAR);
    let magnitude = magnitude_of_rank((number as f64 + f64::from(uniform(words[0]))).min(count as f64));
    let mut toward = direction([words[1], words[2]]).as_dvec3();
    let more_words = key.words(number, 1, STAR);
    // Faint stars are more distant and concentrate in the galactic plane.
    if magnitude > MILKY_WAY_MIN_MAGNITUDE && uniform(more_words[0]) < 0.35 {
        let pole = galactic_pole();
        let height = toward.dot(pole);
        toward = (toward - pole * (height * 0.85)).normalize();
    }
    let color = black_body().radiance(temperature_of_quantile(f64::from(uniform(words[3]))) as f32);
    let scale = 1.0 / luminance(color);
    let illuminance = MAGNITUDE_0_LUX * math::pow(10.0, -0.4 * magnitude);
    Star { direction: toward, magnitude, illuminance, color: color.map(|value| value * scale) }
}

/// Integral of the point spread function, square pixels.
fn psf_integral() -> f64 {
    std::f64::consts::PI * PSF_CORE * PSF_CORE / (PSF_BETA - 1.0)
}

fn image(
    star: &Star,
    camera: &Camera,
    size: [usize; 2],
    night: &Night,
    horizon: f64,
    brightness: f64,
) -> Option<StarImage> {
    if star.direction.y < horizon {
        return None;
    }
    let pixel = camera.project(camera.position + star.direction * 1e9)?.pixel;
    let radius = if star.magnitude < 2.0 { BRIGHT_IMAGE_RADIUS } else { IMAGE_RADIUS };
    // An image beside a panorama may wrap around into it.
    let turned = camera.lens == Lens::Panorama && is_near(DVec2::new(0.0, pixel.y), radius, size);
    if !turned && !is_near(pixel, radius, size) {
        return None;
    }
    let transmittance = night.transmittance(math::asin(star.direction.y));
    let illuminance = star.illuminance * transmittance * brightness;
    let radiance = (illuminance / solid_angle(camera, pixel)?) as f32;
    Some(StarImage { pixel, radius, radiance: star.color.map(|value| value * radiance) })
}

/// Whether a position is within `radius` pixels of a picture of `size` pixels.
fn is_near(pixel: DVec2, radius: f64, size: [usize; 2]) -> bool {
    let [width, height] = size.map(|side| side as f64);
    pixel.x > -radius && pixel.x < width + radius && pixel.y > -radius && pixel.y < height + radius
}

/// The unit vector toward what the camera shows at a pixel.
fn line_of_sight(camera: &Camera, pixel: DVec2) -> Option<DVec3> {
    camera.direction(pixel).map(DVec3::normalize)
}

/// Solid angle of a pixel. At the edge of a dome, half a pixel to the left or up stands for half a pixel to the right or down.
fn solid_angle(camera: &Camera, pixel: DVec2) -> Option<f64> {
    let (half_right, half_down) = (DVec2::new(0.5, 0.0), DVec2::new(0.0, 0.5));
    let middle = line_of_sight(camera, pixel)?;
    let beside = line_of_sight(camera, pixel + half_right).or_else(|| line_of_sight(camera, pixel - half_right))?;
    let below = line_of_sight(camera, pixel + half_down).or_else(|| line_of_sight(camera, pixel - half_down))?;
    Some((4.0 * (beside - middle).cross(below - middle).length()).max(1e-18))
}

/// Largest width of a star's image, pixels.
pub(super) const MAX_IMAGE_WIDTH: usize = 24;

impl StarImage {
    /// Whether it overlaps a picture of `size` pixels.
    fn is_inside(&self, size: [usize; 2]) -> bool {
        is_near(self.pixel, self.radius, size)
    }

    /// The point spread function at the pixels of row `y` from `x` on, 1 at its center.
    #[inline(always)]
    pub(super) fn psf_row(&self, x: usize, y: usize) -> [f32; MAX_IMAGE_WIDTH] {
        const PER_CORE: f32 = (1.0 / (PSF_CORE * PSF_CORE)) as f32;
        let down = (y as f64 + 0.5 - self.pixel.y) as f32;
        let first = (x as f64 + 0.5 - self.pixel.x) as f32;
        let radius = (self.radius * self.radius) as f32;
        let mut shapes = [0.0; MAX_IMAGE_WIDTH];
        for i in 0..MAX_IMAGE_WIDTH {
            let across = first + i as f32;
            let squared = across.fma(across, down * down);
            let base = squared.fma(PER_CORE, 1.0);
            let shape = 1.0 / (base * base * base.sqrt());
            shapes[i] = if squared < radius { shape } else { 0.0 };
        }
        shapes
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::{camera::CameraParameters, phenomenon::strip::Shutter};

    use crate::sky::SkyParameters;

    use super::*;

    #[test]
    fn there_are_as_many_stars_as_in_the_real_sky() {
        let stars = Stars::new(7);
        let brighter = |magnitude: f64| stars.0.iter().filter(|star| star.magnitude < magnitude).count() as f64;
        // Whole sky: about 50 above magnitude 2, 500 above 4, 5000 above 6.
        for (magnitude, expected) in [(2.0, 50.0), (4.0, 560.0), (6.0, 4900.0)] {
            assert!((brighter(magnitude) / expected - 1.0).abs() < 0.15, "{magnitude}: {}", brighter(magnitude));
        }
        assert!(stars.0[0].magnitude < 0.0 && stars.0[0].magnitude > -2.5);
        assert!(stars.0.iter().all(|star| (star.direction.length() - 1.0).abs() < 1e-5));
    }

    #[test]
    fn there_are_as_many_stars_of_each_color_as_of_its_classes() {
        let stars = Stars::new(7);
        let redness = |color: [f32; 3]| color[0] / color[2];
        let redder = |than: f32| {
            let limit = redness(black_body().radiance(than));
            stars.0.iter().filter(|star| redness(star.color) > limit).count() as f64 / stars.0.len() as f64
        };
        let [reddish, bluish] = [redder(5200.0), 1.0 - redder(7400.0)];
        assert!((reddish - 0.32).abs() < 0.01, "{reddish} are of the classes K and M");
        assert!((bluish - 0.39).abs() < 0.01, "{bluish} are of the classes A and B");
        assert!(redness(black_body().radiance(2800.0)) > 4.0 && redness(black_body().radiance(10_000.0)) < 0.7);
    }

    #[test]
    fn a_star_at_a_panoramas_seam_is_whole() {
        let night = *SkyParameters { kind: bansho_base::world::sky::SkyKind::Night, ..SkyParameters::default() }
            .at(0.0)
            .night()
            .unwrap();
        let camera = CameraParameters {
            lens: Lens::Panorama,
            position: [0.0; 3].into(),
            target: [0.0, 0.0, -60.0].into(),
            ..CameraParameters::default()
        };
        let size = [128, 64];
        let view = View::new(camera, Shutter { open: 0.0, close: 0.0 }, 0.0, size, 0);
        let light = |x: f64| {
            let direction = view.camera.direction(DVec2::new(x, 20.0)).unwrap();
            let star = Star { direction, magnitude: 1.0, illuminance: 1.0, color: [1.0; 3] };
            let image = image(&star, &view.camera, size, &night, 0.0, 1.0).unwrap();
            let all = wrapped_images(image, &view.camera, size).flat_map(|image| {
                (0..size[1])
                    .flat_map(move |y| (0..size[0]).step_by(16).flat_map(move |x| image.psf_row(x, y)[..16].to_vec()))
            });
            all.map(f64::from).sum::<f64>()
        };
        for x in [0.0, 0.7, 127.4, 128.0] {
            // As much as a star in the middle that lies alike between pixels.
            let ratio = light(x) / light(64.0 + x.fract());
            assert!((ratio - 1.0).abs() < 1e-3, "{x}: {ratio}");
        }
    }

    #[test]
    fn a_star_keeps_its_light_wherever_it_lies_between_pixels() {
        let night = *SkyParameters { kind: bansho_base::world::sky::SkyKind::Night, ..SkyParameters::default() }
            .at(0.0)
            .night()
            .unwrap();
        let shutter = Shutter { open: 0.0, close: 0.0 };
        let camera = CameraParameters { target: [0.0, 30.0, -60.0].into(), ..CameraParameters::default() };
        let view = View::new(camera, shutter, 0.0, [64, 48], 0);
        for offset in [0.0, 0.3, 0.5] {
            let direction = view.camera.direction(DVec2::new(32.0 + offset, 24.2)).unwrap().normalize();
            let star = Star {
                direction,
                magnitude: 1.0,
                illuminance: MAGNITUDE_0_LUX * math::pow(10.0, -0.4),
                color: [1.0; 3],
            };
            let image = image(&star, &view.camera, view.size, &night, 0.0, 1.0 / psf_integral()).unwrap();
            let mut lux = 0.0;
            for (x, y) in (0..64).flat_map(|x| (0..48).map(move |y| (x, y))) {
                let solid = solid_angle(&view.camera, DVec2::new(x as f64 + 0.5, y as f64 + 0.5)).unwrap();
                lux += f64::from(image.psf_row(x, y)[0] * image.radiance[0]) * solid;
            }
            let expected = MAGNITUDE_0_LUX * math::pow(10.0, -0.4) * night.transmittance(math::asin(direction.y));
            // The wings beyond the reach are left out.
            assert!((0.9..1.05).contains(&(lux / expected)), "{offset}: {}", lux / expected);
        }
    }
}
