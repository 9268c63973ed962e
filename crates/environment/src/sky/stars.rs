//! A random starry sky with the magnitude counts of the real one, and about its colours.

use bansho_base::{
    camera::{Camera, Lens},
    color::{black_body, luminance},
    math::{
        self, DVec2, DVec3, MulAdd,
        random::{Key, Purpose, direction, uniform},
    },
    phenomenon::strip::View,
    world::sky::Night,
};
use rayon::prelude::*;

/// Logarithm (base 10) of the number of stars over the whole sky that are brighter than magnitude -1, 0, 1 ... 9 (Allen's Astrophysical
/// Quantities, 4th edition, table 19.9, in round numbers).
const COUNTS: [f64; 11] = [0.15, 0.6, 1.15, 1.7, 2.25, 2.75, 3.21, 3.69, 4.16, 4.6, 5.05];
const BRIGHTEST: f64 = -1.0;
/// Magnitude of the faintest stars that are drawn one by one.
const FAINTEST: f64 = 8.5;
/// Share of the naked-eye stars below the upper end of each spectral class, M to B, and the temperature there, K. The shares are estimates in
/// round numbers, not counted in a catalogue. The colours of the hottest are those of 10,000 K.
const CLASSES: [[f64; 2]; 7] =
    [[0.0, 2800.0], [0.06, 3900.0], [0.32, 5200.0], [0.46, 6000.0], [0.61, 7400.0], [0.82, 10_000.0], [1.0, 10_000.0]];
/// Illuminance of a star of magnitude 0, lux.
const LUX_AT_0: f64 = 2.54e-6;
/// Stars whose place follows the band of the Milky Way, in part, from this magnitude on.
const BAND_FROM: f64 = 4.0;
/// Reach of a star's image, pixels, and of those brighter than magnitude 2.
const REACH: f64 = 3.5;
const BRIGHT_REACH: f64 = 10.0;
/// Shape of a star's image: (1 + (r / core)^2)^-beta (Moffat 1969), core in pixels and beta = 5/2.
const CORE: f64 = 0.85;
const BETA: f64 = 2.5;

/// Most instants of a trail.
const MOST_INSTANTS: f64 = 64.0;

const STAR: Purpose = Purpose::named("star");

/// A star.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Star {
    direction: DVec3,
    magnitude: f64,
    /// Above the air, lux.
    illuminance: f64,
    /// ACEScg of unit luminance.
    colour: [f32; 3],
}

/// The stars of a scene.
#[derive(Clone, Debug)]
pub(super) struct Stars(Vec<Star>);

/// A star as a picture shows it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spot {
    pub(super) pixel: DVec2,
    pub(super) reach: f64,
    /// Radiance at the middle of its image, cd/m^2.
    pub(super) radiance: [f32; 3],
}

/// Normal of the Milky Way's plane.
pub(super) fn galactic_pole() -> DVec3 {
    DVec3::new(0.62, 0.38, 0.69).normalize()
}

impl Stars {
    /// The stars of a seed.
    pub(super) fn new(seed: u64) -> Self {
        let key = Key::new(seed, "stars");
        let count = math::pow(10.0, log_count(FAINTEST)) as u64;
        Self((0..count).map(|number| star(key, number, count)).collect())
    }

    /// Those that a picture shows, by row of their middle. Where the camera turns while the shutter is open, each draws a trail.
    pub(super) fn spots(&self, view: &View, night: &Night, brightness: f64) -> Vec<Spot> {
        let cameras = view.cameras_at_most(MOST_INSTANTS);
        let scale = brightness / shape_sum() / cameras.len() as f64;
        let mut spots = Vec::new();
        for camera in &cameras {
            let spot = |star: &Star| spot(star, camera, view.size, night, scale);
            spots.par_extend(self.0.par_iter().filter_map(spot).flat_map_iter(|spot| images(spot, camera, view.size)));
        }
        spots.sort_by(|a, b| a.pixel.y.total_cmp(&b.pixel.y));
        spots
    }
}

/// All places where a star's image reaches into the picture: a panorama begins anew where it ends.
fn images(spot: Spot, camera: &Camera, size: [usize; 2]) -> impl Iterator<Item = Spot> {
    let turn = std::f64::consts::TAU * camera.focal_pixels;
    let turns: &[f64] = if camera.lens == Lens::Panorama { &[0.0, -1.0, 1.0] } else { &[0.0] };
    let image = move |turns: &f64| Spot { pixel: spot.pixel + DVec2::new(turns * turn, 0.0), ..spot };
    turns.iter().map(image).filter(move |spot| spot.is_inside(size))
}

/// Logarithm of the number of stars brighter than a magnitude.
fn log_count(magnitude: f64) -> f64 {
    let place = (magnitude - BRIGHTEST).clamp(0.0, COUNTS.len() as f64 - 1.001);
    math::lerp(COUNTS[place as usize], COUNTS[place as usize + 1], place.fract())
}

/// The magnitude of the star of that rank, from the brightest on.
fn magnitude_of_rank(rank: f64) -> f64 {
    let log = math::log10(rank.max(1e-9)).max(COUNTS[0] - 0.6);
    let above = COUNTS.partition_point(|count| *count < log).clamp(1, COUNTS.len() - 1);
    BRIGHTEST + above as f64 - 1.0 + (log - COUNTS[above - 1]) / (COUNTS[above] - COUNTS[above - 1])
}

/// The temperature, K, that this share of the stars stays below.
fn temperature_of_quantile(share: f64) -> f64 {
    let above = CLASSES.partition_point(|class| class[0] < share).clamp(1, CLASSES.len() - 1);
    let [from, to] = [CLASSES[above - 1], CLASSES[above]];
    math::lerp(from[1], to[1], (share - from[0]) / (to[0] - from[0]))
}

fn star(key: Key, number: u64, count: u64) -> Star {
    let words = key.words(number, 0, STAR);
    let magnitude = magnitude_of_rank((number as f64 + f64::from(uniform(words[0]))).min(count as f64));
    let mut toward = direction([words[1], words[2]]).as_dvec3();
    let more = key.words(number, 1, STAR);
    // Faint stars are far ones, and crowd to the plane of the galaxy.
    if magnitude > BAND_FROM && uniform(more[0]) < 0.35 {
        let pole = galactic_pole();
        let height = toward.dot(pole);
        toward = (toward - pole * (height * 0.85)).normalize();
    }
    let colour = black_body().radiance(temperature_of_quantile(f64::from(uniform(words[3]))) as f32);
    let scale = 1.0 / luminance(colour);
    let illuminance = LUX_AT_0 * math::pow(10.0, -0.4 * magnitude);
    Star { direction: toward, magnitude, illuminance, colour: colour.map(|value| value * scale) }
}

/// Sum of the shape over all pixels.
fn shape_sum() -> f64 {
    std::f64::consts::PI * CORE * CORE / (BETA - 1.0)
}

fn spot(star: &Star, camera: &Camera, size: [usize; 2], night: &Night, brightness: f64) -> Option<Spot> {
    if star.direction.y < 0.0 {
        return None;
    }
    let pixel = camera.project(camera.position + star.direction * 1e9)?.pixel;
    let reach = if star.magnitude < 2.0 { BRIGHT_REACH } else { REACH };
    // What is beside a panorama may be within it a turn further.
    let turned = camera.lens == Lens::Panorama && is_near(DVec2::new(0.0, pixel.y), reach, size);
    if !turned && !is_near(pixel, reach, size) {
        return None;
    }
    let share = night.transmittance(math::asin(star.direction.y));
    let illuminance = star.illuminance * share * brightness;
    let radiance = (illuminance / solid_angle(camera, pixel)?) as f32;
    Some(Spot { pixel, reach, radiance: star.colour.map(|value| value * radiance) })
}

/// Whether a place is within `reach` pixels of a picture of `size` pixels.
fn is_near(pixel: DVec2, reach: f64, size: [usize; 2]) -> bool {
    let inside = |place: f64, side: usize| place > -reach && place < side as f64 + reach;
    inside(pixel.x, size[0]) && inside(pixel.y, size[1])
}

/// Solid angle of a pixel.
fn solid_angle(camera: &Camera, pixel: DVec2) -> Option<f64> {
    let at = |x: f64, y: f64| camera.direction(pixel + DVec2::new(x, y)).map(DVec3::normalize);
    let (middle, right, down) = (at(0.0, 0.0)?, at(0.5, 0.0), at(0.0, 0.5));
    let (across, along) = (right.or(at(-0.5, 0.0))? - middle, down.or(at(0.0, -0.5))? - middle);
    Some((4.0 * across.cross(along).length()).max(1e-18))
}

/// Most pixels of a star's image in a row.
pub(super) const MOST_PIXELS: usize = 24;

impl Spot {
    /// Whether its image reaches into a picture of `size` pixels.
    fn is_inside(&self, size: [usize; 2]) -> bool {
        is_near(self.pixel, self.reach, size)
    }

    /// The shape of its image at the pixels of row `y` from `x` on, 1 at its middle.
    #[inline(always)]
    pub(super) fn row(&self, x: usize, y: usize) -> [f32; MOST_PIXELS] {
        const PER_CORE: f32 = (1.0 / (CORE * CORE)) as f32;
        let down = (y as f64 + 0.5 - self.pixel.y) as f32;
        let first = (x as f64 + 0.5 - self.pixel.x) as f32;
        let reach = (self.reach * self.reach) as f32;
        let mut shapes = [0.0; MOST_PIXELS];
        for i in 0..MOST_PIXELS {
            let across = first + i as f32;
            let squared = across.fma(across, down * down);
            let base = squared.fma(PER_CORE, 1.0);
            let shape = 1.0 / (base * base * base.sqrt());
            shapes[i] = if squared < reach { shape } else { 0.0 };
        }
        shapes
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::{camera::CameraParameters, phenomenon::strip::Shutter, world::sky::SkyParameters};

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
    fn there_are_as_many_stars_of_each_colour_as_of_its_classes() {
        let stars = Stars::new(7);
        let redness = |colour: [f32; 3]| colour[0] / colour[2];
        let redder = |than: f32| {
            let limit = redness(black_body().radiance(than));
            stars.0.iter().filter(|star| redness(star.colour) > limit).count() as f64 / stars.0.len() as f64
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
            let star = Star { direction, magnitude: 1.0, illuminance: 1.0, colour: [1.0; 3] };
            let spot = spot(&star, &view.camera, size, &night, 1.0).unwrap();
            let all = images(spot, &view.camera, size).flat_map(|image| {
                (0..size[1])
                    .flat_map(move |y| (0..size[0]).step_by(16).flat_map(move |x| image.row(x, y)[..16].to_vec()))
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
            let star =
                Star { direction, magnitude: 1.0, illuminance: LUX_AT_0 * math::pow(10.0, -0.4), colour: [1.0; 3] };
            let spot = spot(&star, &view.camera, view.size, &night, 1.0 / shape_sum()).unwrap();
            let mut lux = 0.0;
            for (x, y) in (0..64).flat_map(|x| (0..48).map(move |y| (x, y))) {
                let solid = solid_angle(&view.camera, DVec2::new(x as f64 + 0.5, y as f64 + 0.5)).unwrap();
                lux += f64::from(spot.row(x, y)[0] * spot.radiance[0]) * solid;
            }
            let expected = LUX_AT_0 * math::pow(10.0, -0.4) * night.transmittance(math::asin(direction.y));
            // The wings beyond the reach are left out.
            assert!((0.9..1.05).contains(&(lux / expected)), "{offset}: {}", lux / expected);
        }
    }
}
