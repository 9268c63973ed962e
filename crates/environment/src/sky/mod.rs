//! The sky as a background, where there is no plate: by day, at twilight or at night, with a skyline of hills and
//! trees.
//!
//! The radiance model itself is [`Sky`], since it also lights other things; this module draws it. By night it adds
//! stars and the Milky Way.
//!
//! # References
//! - Allen's Astrophysical Quantities, 4th edition (2000): numbers of stars by magnitude.
//! - A. F. J. Moffat, Astron. Astrophys. 3 (1969): point spread function of a star's image.
//!
//! # Equations
//!
//! | equation | function |
//! | --- | --- |
//! | radiance by day, by elevation | [`Sky::radiance_at_elevations`] |
//! | radiance by night: an almucantar's even part, twilight glow and Milky Way | `night::NightSky::radiance` |
//! | number of stars brighter than a magnitude | `stars::log_count`, `stars::magnitude_of_rank` |
//! | illuminance of a star, `2.54e-6 lux * 10^(-0.4 m)` | `stars::star` |
//! | Moffat's point spread function, `(1 + (r / core)^2)^-5/2` | `stars::StarImage::psf_row` |
//!
//! # Data flow
//! [`SkyBackdrop`] makes stars and skyline once. For a frame, `night::NightSky` tabulates the night by elevation, and
//! `stars` projects the visible stars into images; both are kept in a `row_cache::SkyCache` for following frames with
//! the same camera and sky. `PreparedSky` draws rows of sixteen pixels at a time, averaged over the cameras of the
//! exposure: first the hills of `skyline` at their distance, then the sky behind everything else, with the stars added
//! where nothing hides it.

mod night;
mod row_cache;
mod skyline;
mod stars;

use std::{
    f64::consts::TAU,
    ops::Range,
    sync::{Arc, Mutex, PoisonError},
};

use bansho_base::{
    camera::{Camera, directions::Directions},
    color,
    host::observer::{Cancelled, Observer},
    image::Rect,
    math::{DVec2, DVec3, MulAdd, approximations, simd::LANES},
    phenomenon::{
        Phenomenon, PhenomenonInfo, Prepared, Run,
        strip::{DepthInterval, Shutter, Strip, View},
        surroundings::{Publication, Surroundings},
    },
    world::sky::{Sky, SkyKind, SkyParameters},
};

use fearless_simd::{Level, Simd, dispatch};
use night::NightSky;
use row_cache::{SkyCache, SkyRow};
use skyline::Skyline;
use stars::{MAX_IMAGE_WIDTH, Stars};

/// The sky of a scene, infinitely far and opaque, with hills before it; at night with stars.
pub struct SkyBackdrop {
    parameters: SkyParameters,
    stars: Option<Stars>,
    skyline: Option<Skyline>,
    /// What the frame before showed, which the next one shows again if neither camera nor sky change.
    cache: Mutex<Option<SkyCache>>,
}

impl SkyBackdrop {
    /// The name of its layer.
    pub const NAME: &str = "sky";

    /// A sky with these parameters.
    pub fn new(parameters: SkyParameters, seed: u64) -> Self {
        let night = parameters.kind == SkyKind::Night;
        let stars = (night && parameters.night.stars > 0.0).then(|| Stars::new(seed));
        Self { stars, skyline: Skyline::new(&parameters, seed), parameters, cache: Mutex::default() }
    }

    /// The night that a sky shows in a view; none by day.
    fn cache(&self, sky: &Sky, view: &View, cameras: &[Camera]) -> Option<SkyCache> {
        let night = sky.night()?;
        // The lock is never held while threads work together.
        let cached = || self.cache.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(cache) = cached().as_mut().filter(|cache| cache.matches(cameras, view.size, sky)) {
            cache.enable_row_cache();
            return Some(cache.clone());
        }
        let star_images = self.stars.as_ref().map(|stars| stars.star_images(view, night, self.parameters.night.stars));
        let cache = SkyCache {
            cameras: cameras.to_vec(),
            size: view.size,
            sky: *sky,
            night: Arc::new(NightSky::new(sky, night, self.parameters.night.milky_way)),
            star_images: Arc::new(star_images.unwrap_or_default()),
            rows: None,
        };
        *cached() = Some(cache.clone());
        Some(cache)
    }

    /// Where the hills stand.
    fn hills(&self) -> DepthInterval {
        let near = self.parameters.hills_distance;
        DepthInterval { near, far: near * (1.0 + 1e-4) }
    }
}

/// Depth of the sky: behind everything.
const FAR: DepthInterval = DepthInterval { near: 1e12, far: f64::INFINITY };
/// Radiance of hills and trees relative to the zenith.
const HILL_SHADE: f32 = 0.04;

impl Phenomenon for SkyBackdrop {
    fn info(&self) -> PhenomenonInfo<'_> {
        PhenomenonInfo::new(Self::NAME)
    }

    fn luminance(&self) -> f64 {
        f64::from(color::luminance(self.parameters.at(0.0).radiance(DVec3::Y)))
    }

    fn start(self: Arc<Self>) -> Box<dyn Run> {
        Box::new(self)
    }
}

impl Run for SkyBackdrop {
    fn publish(&self, _shutter: Shutter) -> Publication {
        Publication::default()
    }

    fn depth_intervals(&self, _view: &View, _surroundings: &Surroundings) -> Vec<DepthInterval> {
        if self.skyline.is_some() { vec![self.hills(), FAR] } else { vec![FAR] }
    }

    fn prepare<'a>(
        &'a self,
        view: &'a View,
        surroundings: &'a Surroundings<'a>,
        _observer: &dyn Observer,
    ) -> Result<Box<dyn Prepared + 'a>, Cancelled> {
        let sky = surroundings.sky;
        let cameras = view.cameras();
        let cache = self.cache(&sky, view, &cameras);
        Ok(Box::new(PreparedSky { view, cameras, sky, cache, skyline: self.skyline.as_ref(), hills: self.hills() }))
    }
}

struct PreparedSky<'a> {
    view: &'a View,
    /// At as many instants as its motion needs, each for an equal part of the exposure.
    cameras: Vec<Camera>,
    sky: Sky,
    /// The night; none by day.
    cache: Option<SkyCache>,
    skyline: Option<&'a Skyline>,
    /// Where it stands.
    hills: DepthInterval,
}

impl PreparedSky<'_> {
    #[inline(always)]
    fn draw_sky<S: Simd>(&self, simd: S, strip: &mut Strip) {
        let rect = strip.rect;
        let far = vec![f32::INFINITY; rect.width];
        let mut uncached = SkyRow::default();
        for y in rect.y..rect.bottom() {
            let first = (y - rect.y) * rect.width;
            let cached = if rect.width == self.view.size[0] { self.cached_row(simd, y) } else { None };
            let row = match cached {
                Some(row) if !strip.has_plate() => row,
                _ => {
                    match cached {
                        Some(row) => uncached.clone_from(row),
                        None => self.fill_row(simd, &mut uncached, y, rect.x..rect.right()),
                    }
                    uncached.mask_by_plate(strip, first);
                    &uncached
                }
            };
            let [red, green, blue] = &row.planes;
            strip.add_row_behind(first, [red, green, blue], Some(&row.opacity), &far);
        }
    }

    /// A complete row of the picture from the cache, if there is one.
    #[inline(always)]
    fn cached_row<S: Simd>(&self, simd: S, y: usize) -> Option<&SkyRow> {
        let row = self.cache.as_ref()?.rows.as_ref()?.get(y)?;
        if row.get().is_none() {
            // Not in a closure, which would be compiled without the target features of `S`.
            let mut drawn = SkyRow::default();
            self.fill_row(simd, &mut drawn, y, 0..self.view.size[0]);
            return Some(row.get_or_init(|| drawn));
        }
        row.get()
    }

    /// Draws pixels of row `y`, ignoring the plate.
    #[inline(always)]
    fn fill_row<S: Simd>(&self, simd: S, row: &mut SkyRow, y: usize, pixels: Range<usize>) {
        let weight = 1.0 / self.cameras.len() as f32;
        row.clear(pixels.len());
        // Batches are aligned to the picture, so that a crop changes no pixel.
        let mut x = pixels.start / LANES * LANES;
        while x < pixels.end {
            for camera in &self.cameras {
                let mut directions = Directions::new(camera, x, y);
                directions.normalize();
                let colors = self.radiance(simd, &directions);
                for i in pixels.start.max(x) - x..pixels.end.min(x + LANES) - x {
                    if directions.seen[i] {
                        row.add(x + i - pixels.start, colors[i], weight);
                    }
                }
            }
            x += LANES;
        }
        self.add_stars(row, y, pixels);
    }

    /// Radiance in batches of directions: red, green, blue and 0.
    #[inline(always)]
    fn radiance<S: Simd>(&self, simd: S, directions: &Directions) -> [[f32; 4]; LANES] {
        if let Some(cache) = &self.cache {
            return cache.night.radiance(simd, directions);
        }
        let mut colors = [[0.0; 4]; LANES];
        if let Some(planes) = self.sky.radiance_at_elevations(&directions.axes[1]) {
            for i in 0..LANES {
                for c in 0..3 {
                    colors[i][c] = planes[c][i];
                }
            }
        }
        colors
    }

    /// Adds the stars of one row where the sky is visible.
    #[inline(always)]
    fn add_stars(&self, row: &mut SkyRow, y: usize, pixels: Range<usize>) {
        let star_images = self.cache.as_ref().map_or(&[][..], |cache| &cache.star_images);
        let from = star_images.partition_point(|image| image.pixel.y < y as f64 - 12.0);
        for image in &star_images[from..] {
            if image.pixel.y >= y as f64 + 12.0 {
                return;
            }
            if (y as f64 + 0.5 - image.pixel.y).abs() >= image.radius {
                continue;
            }
            let low = (image.pixel.x - image.radius).floor().max(pixels.start as f64) as usize;
            let high = (image.pixel.x + image.radius).ceil().clamp(0.0, pixels.end as f64) as usize;
            if low >= high {
                continue;
            }
            let shapes = image.psf_row(low, y);
            for x in low..high.min(low + MAX_IMAGE_WIDTH) {
                let at = x - pixels.start;
                let shape = shapes[x - low] * row.opacity[at];
                for c in 0..3 {
                    row.planes[c][at] = image.radiance[c].fma(shape, row.planes[c][at]);
                }
            }
        }
    }

    /// Draws hills and trees as a dark silhouette.
    #[inline(always)]
    fn draw_hills(&self, skyline: &Skyline, strip: &mut Strip) {
        let rect = strip.rect;
        let shade = self.sky.radiance(DVec3::Y).map(|value| value * HILL_SHADE);
        let near = self.hills.near as f32;
        let highest = skyline.highest + 1.0 / self.view.camera.focal_pixels as f32;
        let mut x = rect.x / LANES * LANES;
        while x < rect.right() {
            if self.is_above(rect, x, highest) {
                x += LANES;
                continue;
            }
            let inside = rect.x.max(x) - x..rect.right().min(x + LANES) - x;
            for y in rect.y..rect.bottom() {
                let mut coverage = self.coverage(skyline, x, y);
                let first = (y - rect.y) * rect.width + x + inside.start - rect.x;
                if strip.has_plate() {
                    for i in inside.clone() {
                        coverage[i] = if strip.visible(first + i - inside.start, near) { coverage[i] } else { 0.0 };
                    }
                }
                if coverage == [0.0; LANES] {
                    continue;
                }
                let (mut planes, mut depths) = ([[0.0; LANES]; 3], [f32::INFINITY; LANES]);
                for i in 0..LANES {
                    for c in 0..3 {
                        planes[c][i] = shade[c] * coverage[i];
                    }
                    depths[i] = if coverage[i] > 0.0 { near } else { f32::INFINITY };
                }
                let [red, green, blue] = &planes;
                let light = [&red[inside.clone()], &green[inside.clone()], &blue[inside.clone()]];
                strip.add_row_behind(first, light, Some(&coverage[inside.clone()]), &depths[inside.clone()]);
            }
            x += LANES;
        }
    }

    /// Coverage of pixels from `x` on in row `y` by the hills, averaged over the exposure.
    #[inline(always)]
    fn coverage(&self, skyline: &Skyline, x: usize, y: usize) -> [f32; LANES] {
        let weight = 1.0 / self.cameras.len() as f32;
        let mut mean = [0.0; LANES];
        for camera in &self.cameras {
            let coverage = hill_coverage(camera, skyline, x, y);
            for i in 0..LANES {
                mean[i] = coverage[i].fma(weight, mean[i]);
            }
        }
        mean
    }

    /// Conservative test: whether all pixels of a strip from `x` on are above this sine of the elevation.
    fn is_above(&self, rect: Rect, x: usize, sine: f32) -> bool {
        // Bound on the deviation of the sine from linear interpolation between the corners.
        let angle = LANES as f64 / self.view.camera.focal_pixels;
        let min_sine = f64::from(sine) + angle * angle;
        let rows = [rect.y, rect.bottom()].map(|y| y as f64);
        let mut corners = rows.into_iter().flat_map(|y| [x, x + LANES].map(|x| DVec2::new(x as f64, y)));
        let is_above = |corner: DVec2| {
            self.cameras
                .iter()
                .all(|camera| camera.direction(corner).is_some_and(|toward| toward.y > min_sine * toward.length()))
        };
        corners.all(is_above)
    }
}

/// Coverage of pixels from `x` on in row `y` by the hills, for one camera.
#[inline(always)]
fn hill_coverage(camera: &Camera, skyline: &Skyline, x: usize, y: usize) -> [f32; LANES] {
    let sharpness = camera.focal_pixels as f32;
    let mut directions = Directions::new(camera, x, y);
    directions.normalize();
    let Directions { axes: [xs, sines, zs], seen } = &directions;
    let (mut above, mut below) = (true, true);
    for i in 0..LANES {
        above &= sines[i] > skyline.highest + 1.0 / sharpness;
        below &= sines[i] < skyline.lowest - 1.0 / sharpness;
    }
    let (mut coverage, mut turns) = ([0.0; LANES], [0.0; LANES]);
    if above {
        return coverage;
    }
    if !below {
        for i in 0..LANES {
            turns[i] = approximations::atan2(xs[i], -zs[i]) * (1.0 / TAU) as f32;
        }
    }
    for i in 0..LANES {
        let hidden = if below { 1.0 } else { skyline.sine(turns[i]) };
        let cover = (hidden - sines[i]).fma(sharpness, 0.5).clamp(0.0, 1.0);
        coverage[i] = if seen[i] { cover } else { 0.0 };
    }
    coverage
}

impl Prepared for PreparedSky<'_> {
    fn bounds(&self, slice: &DepthInterval) -> Rect {
        let hills = self.skyline.is_some() && slice.overlaps(&self.hills);
        if hills || slice.overlaps(&FAR) {
            Rect::of_size(self.view.size[0], self.view.size[1])
        } else {
            Rect::default()
        }
    }

    fn draw(&self, slice: &DepthInterval, strip: &mut Strip) {
        let level = Level::new();
        if let Some(skyline) = self.skyline.filter(|_| slice.contains(self.hills.near)) {
            dispatch!(level, _simd => self.draw_hills(skyline, strip));
        }
        if slice.overlaps(&FAR) {
            dispatch!(level, simd => self.draw_sky(simd, strip));
        }
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::{
        camera::CameraParameters,
        host::observer::Unobserved,
        math,
        math::curve::Interpolation,
        parameters::animated::Animated,
        world::wind::{Wind, WindParameters},
    };

    use super::*;

    /// Light of a night as a camera sees it that turns by so many degrees while the shutter is open: green, row by row.
    fn night_seen(turn_deg: f64, hills_deg: f64) -> Vec<f32> {
        let parameters = SkyParameters { kind: SkyKind::Night, hills_deg, ..SkyParameters::default() };
        let backdrop = SkyBackdrop::new(parameters.clone(), 3);
        let [x, z] = [math::sin(turn_deg.to_radians()) * 60.0, math::cos(turn_deg.to_radians()) * -60.0];
        let keys = vec![(0.0, [0.0, 30.0, -60.0]), (1.0, [x, 30.0, z])];
        let camera = CameraParameters {
            position: [0.0; 3].into(),
            target: Animated::keyed(keys, Interpolation::Linear).unwrap(),
            vertical_fov_deg: 60.0.into(),
            ..CameraParameters::default()
        };
        let view = View::new(camera, Shutter { open: 0.0, close: 1.0 }, 0.0, [240, 160], 0);
        let wind = Wind::new(WindParameters::default(), 1, None);
        let surroundings = Surroundings { sky: parameters.at(0.5), ..Surroundings::of_wind(&wind) };
        let prepared = backdrop.prepare(&view, &surroundings, &Unobserved).unwrap();
        let mut strip = Strip::default();
        strip.reset(Rect::of_size(240, 160), None, 0);
        prepared.draw(&DepthInterval::ALL, &mut strip);
        assert!((0..strip.len()).all(|pixel| strip.transmittance(pixel)[1] < 1e-5), "the sky is opaque");
        strip.radiance[1].clone()
    }

    #[test]
    fn stars_draw_trails_where_the_camera_turns() {
        let [still, turning] = [0.0, 6.0].map(|turn| night_seen(turn, 0.0));
        let brightest = |light: &[f32]| light.iter().fold(0.0_f32, |most, value| most.max(*value));
        let sum = |light: &[f32]| light.iter().map(|value| f64::from(*value)).sum::<f64>();
        // 6 degrees are some 15 pixels; a star's light is spread over them, and none is lost.
        assert!(brightest(&turning) < 0.3 * brightest(&still), "{} {}", brightest(&turning), brightest(&still));
        assert!((sum(&turning) / sum(&still) - 1.0).abs() < 0.15, "{}", sum(&turning) / sum(&still));
    }

    #[test]
    fn hills_are_soft_where_the_camera_turns() {
        // Neighbors along a row differ most at the hills' edges.
        let steepest = |light: Vec<f32>| {
            let rows = light.chunks(240).skip(120);
            let steps = rows.flat_map(|row| row.windows(2).map(|pair| (pair[0] - pair[1]).abs()).collect::<Vec<_>>());
            steps.fold(0.0_f32, f32::max)
        };
        let [still, turning] = [0.0, 6.0].map(|turn| steepest(night_seen(turn, 12.0)));
        assert!(turning < 0.5 * still, "{turning} {still}");
    }

    /// Light of a night in a part of a picture, of which the plate hides every third pixel.
    fn night_in(backdrop: &SkyBackdrop, rect: Rect, has_plate: bool) -> [Vec<f32>; 3] {
        let camera = CameraParameters {
            position: [0.0; 3].into(),
            target: [0.0, 30.0, -60.0].into(),
            vertical_fov_deg: 60.0.into(),
            ..CameraParameters::default()
        };
        let view = View::new(camera, Shutter { open: 0.0, close: 0.0 }, 0.0, [150, 90], 0);
        let wind = Wind::new(WindParameters::default(), 1, None);
        let surroundings = Surroundings { sky: backdrop.parameters.at(0.0), ..Surroundings::of_wind(&wind) };
        let prepared = backdrop.prepare(&view, &surroundings, &Unobserved).expect("nobody asks to stop");
        let depths: Vec<f32> = (0..150 * 90).map(|pixel| if pixel % 3 == 0 { 5.0 } else { f32::INFINITY }).collect();
        let mut strip = Strip::default();
        let rows = |y: usize| &depths[150 * y..150 * (y + 1)];
        strip.reset(rect, has_plate.then_some(&rows), 0);
        prepared.draw(&DepthInterval::ALL, &mut strip);
        strip.radiance
    }

    #[test]
    fn a_sky_that_is_shown_again_is_the_same() {
        let parameters = SkyParameters { kind: SkyKind::Night, ..SkyParameters::default() };
        let shown = SkyBackdrop::new(parameters.clone(), 3);
        let whole = Rect::of_size(150, 90);
        for (rect, has_plate) in [
            (whole, false),
            (whole, false),
            (Rect { x: 37, y: 11, width: 50, height: 30 }, false),
            (whole, true),
            (Rect { y: 40, height: 8, ..whole }, false),
        ] {
            let first = night_in(&SkyBackdrop::new(parameters.clone(), 3), rect, has_plate);
            assert!(night_in(&shown, rect, has_plate) == first, "{rect:?}, plate: {has_plate}");
            assert_eq!(first[1].contains(&0.0), has_plate);
        }
        let cached = shown.cache.lock().unwrap_or_else(PoisonError::into_inner);
        let rows = cached.as_ref().and_then(|cache| cache.rows.clone()).expect("it was shown again");
        assert!(rows.iter().all(|row| row.get().is_some()));
    }

    #[test]
    fn it_fills_the_picture_behind_everything_and_hides_what_is_behind_it() {
        let parameters = SkyParameters { luminance: Animated::from(300.0), ..SkyParameters::default() };
        let backdrop = SkyBackdrop::new(parameters.clone(), 1);
        let shutter = Shutter { open: 0.0, close: 0.0 };
        let view = View::new(CameraParameters::default(), shutter, 0.0, [16, 8], 0);
        let wind = Wind::new(WindParameters::default(), 1, None);
        let surroundings = Surroundings { sky: parameters.at(0.0), ..Surroundings::of_wind(&wind) };
        let prepared = backdrop.prepare(&view, &surroundings, &Unobserved).unwrap();
        let mut strip = Strip::default();
        strip.reset(Rect::of_size(16, 8), None, 0);
        prepared.draw(&FAR, &mut strip);
        assert!(strip.radiance[1].iter().all(|value| *value > 0.0));
        assert_eq!(strip.transmittance(77), [0.0; 3]);
        assert!(prepared.bounds(&DepthInterval { near: 0.0, far: 1e6 }).is_empty());
        assert!(strip.radiance[1][0] > strip.radiance[1][16 * 7], "an overcast sky is brighter above");
    }
}
