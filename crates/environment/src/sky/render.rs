//! Draws the sky: rows of radiance, hills in front of them, stars where they are not hidden. A night sky is kept and reused by following frames while neither
//! camera nor sky change.

use std::{
    f64::consts::TAU,
    ops::Range,
    sync::{Arc, OnceLock},
};

use bansho_base::{
    camera::{Camera, directions::Directions},
    image::Rect,
    math::{self, DVec2, DVec3, MulAdd, approximations, simd::LANES},
    phenomenon::{
        PlateRole, Prepared,
        strip::{DepthInterval, Strip, View},
    },
    world::sky::Sky,
};
use fearless_simd::{Simd, dispatch};

use super::{
    night::NightSky,
    skyline::{Ridge, Skyline},
    stars::{MAX_IMAGE_WIDTH, StarImage},
};

/// Radiance of hills and trees relative to the zenith.
pub(super) const HILL_SHADE: f32 = 0.04;
/// Scattering of clear air at the ground, 1/m, as for the glow of a town: by night its light lies over the hills.
const SCATTERING_PER_M: f64 = 4e-5;
/// Sine of the elevation of the sky whose radiance that light has.
const AIRLIGHT_SINE: f32 = 0.02;

/// What is seen of the ranges of hills at sixteen pixels.
struct VisibleRanges {
    /// Opacity of the air before them.
    haze: [f32; LANES],
    /// Distance of the one that is seen most, m.
    distances: [f32; LANES],
}

/// The sky of a frame.
pub(super) struct PreparedSky<'a> {
    pub(super) view: &'a View,
    /// Cameras at instants of the exposure, as many as its motion needs, with equal weights.
    pub(super) cameras: Vec<Camera>,
    pub(super) sky: Sky,
    /// The night sky; `None` by day.
    pub(super) cache: Option<SkyCache>,
    pub(super) skyline: Option<&'a Skyline>,
    /// Depth interval of the hills.
    pub(super) hills: DepthInterval,
}

impl PreparedSky<'_> {
    #[inline(always)]
    pub(super) fn draw_sky<S: Simd>(&self, simd: S, strip: &mut Strip) {
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
    pub(super) fn cached_row<S: Simd>(&self, simd: S, y: usize) -> Option<&SkyRow> {
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
    pub(super) fn fill_row<S: Simd>(&self, simd: S, row: &mut SkyRow, y: usize, pixels: Range<usize>) {
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
                    if directions.visible[i] {
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
    pub(super) fn radiance<S: Simd>(&self, simd: S, directions: &Directions) -> [[f32; 4]; LANES] {
        if let Some(cache) = &self.cache {
            return cache.night.radiance(simd, directions);
        }
        let mut colors = [[0.0; 4]; LANES];
        if let Some(planes) = self.sky.radiance_at_elevations(&directions.components[1]) {
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
    pub(super) fn add_stars(&self, row: &mut SkyRow, y: usize, pixels: Range<usize>) {
        let star_images = self.cache.as_ref().map_or(&[][..], |cache| &cache.star_images);
        // Images are sorted by row, and none extends farther than 12 rows from its center.
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

    /// Draws hills and trees as a dark silhouette, by night with airlight before them.
    #[inline(always)]
    pub(super) fn draw_hills<S: Simd>(&self, simd: S, skyline: &Skyline, strip: &mut Strip) {
        let rect = strip.rect;
        let shade = self.sky.radiance(DVec3::Y).map(|value| value * HILL_SHADE);
        let near = self.hills.near as f32;
        let mut opacities = Vec::with_capacity(skyline.ranges.len());
        for (distance, _) in &skyline.ranges {
            opacities.push(1.0 - math::exp(-SCATTERING_PER_M * distance * self.hills.near) as f32);
        }
        let highest = skyline.outline.highest + 1.0 / self.view.camera.focal_pixels as f32;
        let mut x = rect.x / LANES * LANES;
        while x < rect.right() {
            if self.is_above(rect, x, highest) {
                x += LANES;
                continue;
            }
            let inside = rect.x.max(x) - x..rect.right().min(x + LANES) - x;
            for y in rect.y..rect.bottom() {
                let mut coverage = self.coverage(&skyline.outline, x, y);
                let first = (y - rect.y) * rect.width + x + inside.start - rect.x;
                if strip.has_plate() {
                    for i in inside.clone() {
                        coverage[i] = if strip.visible(first + i - inside.start, near) { coverage[i] } else { 0.0 };
                    }
                }
                if coverage == [0.0; LANES] {
                    continue;
                }
                let airlight = self.airlight(simd, x, y);
                let VisibleRanges { haze, distances } = self.visible_ranges(skyline, &opacities, x, y);
                let (mut planes, mut depths) = ([[0.0; LANES]; 3], [f32::INFINITY; LANES]);
                for i in 0..LANES {
                    for c in 0..3 {
                        planes[c][i] = airlight[i][c].fma(haze[i], shade[c]) * coverage[i];
                    }
                    depths[i] = if coverage[i] > 0.0 { distances[i] } else { f32::INFINITY };
                }
                let [red, green, blue] = &planes;
                let light = [&red[inside.clone()], &green[inside.clone()], &blue[inside.clone()]];
                strip.add_row_behind(first, light, Some(&coverage[inside.clone()]), &depths[inside.clone()]);
            }
            x += LANES;
        }
    }

    /// What is seen of the ranges at pixels from `x` on in row `y`, with the opacities of the air before each.
    #[inline(always)]
    fn visible_ranges(&self, skyline: &Skyline, opacities: &[f32], x: usize, y: usize) -> VisibleRanges {
        let (mut haze, mut distances) = ([0.0; LANES], [0.0; LANES]);
        let (mut open, mut most) = ([1.0_f32; LANES], [0.0; LANES]);
        let last = skyline.ranges.len() - 1;
        for (number, (distance, ridge)) in skyline.ranges.iter().enumerate() {
            let distance = (distance * self.hills.near) as f32;
            // What is above all others belongs to the farthest.
            let coverage = if number == last { [1.0; LANES] } else { self.coverage(ridge, x, y) };
            for i in 0..LANES {
                let seen = open[i] * coverage[i];
                haze[i] = seen.fma(opacities[number], haze[i]);
                distances[i] = if seen > most[i] { distance } else { distances[i] };
                most[i] = seen.max(most[i]);
                open[i] -= seen;
            }
        }
        VisibleRanges { haze, distances }
    }

    /// Radiance of the night sky just above the horizon at the azimuths of pixels from `x` on in row `y`, without the glow of a town, most of which lies
    /// behind the hills; 0 by day.
    #[inline(always)]
    fn airlight<S: Simd>(&self, simd: S, x: usize, y: usize) -> [[f32; 4]; LANES] {
        let Some(cache) = &self.cache else { return [[0.0; 4]; LANES] };
        let mut directions = Directions::new(&self.view.camera, x, y);
        let [xs, ys, zs] = &mut directions.components;
        for i in 0..LANES {
            let level = xs[i].fma(xs[i], zs[i] * zs[i]).sqrt().max(1e-9);
            [xs[i], ys[i], zs[i]] = [xs[i] / level, AIRLIGHT_SINE, zs[i] / level];
        }
        cache.night.natural_radiance(simd, &directions)
    }

    /// Coverage of pixels from `x` on in row `y` by the hills below a ridge, averaged over the exposure.
    #[inline(always)]
    pub(super) fn coverage(&self, ridge: &Ridge, x: usize, y: usize) -> [f32; LANES] {
        let weight = 1.0 / self.cameras.len() as f32;
        let mut mean = [0.0; LANES];
        for camera in &self.cameras {
            let coverage = hill_coverage(camera, ridge, x, y);
            for i in 0..LANES {
                mean[i] = coverage[i].fma(weight, mean[i]);
            }
        }
        mean
    }

    /// Conservative test: whether all pixels of a strip from `x` on are above this sine of the elevation.
    pub(super) fn is_above(&self, rect: Rect, x: usize, sine: f32) -> bool {
        // Bound on the deviation of the sine from linear interpolation between the corners.
        let angle = LANES as f64 / self.view.camera.focal_pixels;
        let min_sine = f64::from(sine) + angle * angle;
        for y in [rect.y, rect.bottom()] {
            for x in [x, x + LANES] {
                let corner = DVec2::new(x as f64, y as f64);
                let mut directions = self.cameras.iter().map(|camera| camera.direction(corner));
                if !directions.all(|toward| toward.is_some_and(|toward| toward.y > min_sine * toward.length())) {
                    return false;
                }
            }
        }
        true
    }
}

impl PreparedSky<'_> {
    /// The rows that may show the edge of the hills, in any lens.
    fn skyline_rows(&self, skyline: &Skyline) -> Rect {
        let [width, height] = self.view.size;
        // No lens shows more than 1 / f radians in a pixel. The middle of a square is at most 0.71 of its side from its corners, and edges are a pixel wide.
        let margin = 0.8 * SQUARE_SIDE as f64 / self.view.camera.focal_pixels;
        let sines = f64::from(skyline.outline.lowest) - margin..f64::from(skyline.outline.highest) + margin;
        let mut rows_of_squares = (0..height.div_ceil(SQUARE_SIDE)).filter(|&row| self.has_square_within(row, &sines));
        let Some(first) = rows_of_squares.next() else { return Rect::default() };
        let last = rows_of_squares.next_back().unwrap_or(first);
        let (y, bottom) = (first * SQUARE_SIDE, ((last + 1) * SQUARE_SIDE).min(height));
        Rect { x: 0, y, width, height: bottom - y }
    }

    /// Whether the middle of any square of a row of squares has an elevation whose sine is within a range, in any of the poses of the camera.
    fn has_square_within(&self, row: usize, sines: &Range<f64>) -> bool {
        for column in 0..self.view.size[0].div_ceil(SQUARE_SIDE) {
            let middle = [column, row].map(|index| (index * SQUARE_SIDE + SQUARE_SIDE / 2) as f64);
            for toward in self.cameras.iter().filter_map(|camera| camera.direction(DVec2::from(middle))) {
                if sines.contains(&(toward.y / toward.length())) {
                    return true;
                }
            }
        }
        false
    }
}

/// Side of the squares in which the edge of the hills is looked for, pixels.
const SQUARE_SIDE: usize = 16;

/// Coverage of pixels from `x` on in row `y` by the hills, for one camera.
#[inline(always)]
pub(super) fn hill_coverage(camera: &Camera, ridge: &Ridge, x: usize, y: usize) -> [f32; LANES] {
    let sharpness = camera.focal_pixels as f32;
    let mut directions = Directions::new(camera, x, y);
    directions.normalize();
    let Directions { components: [xs, sines, zs], visible: seen } = &directions;
    let (mut above, mut below) = (true, true);
    for i in 0..LANES {
        above &= sines[i] > ridge.highest + 1.0 / sharpness;
        below &= sines[i] < ridge.lowest - 1.0 / sharpness;
    }
    let (mut coverage, mut turns) = ([0.0; LANES], [0.0; LANES]);
    if above {
        return coverage;
    }
    // Most batches are wholly above or below the skyline: azimuths, which take an arctangent, are needed only near it.
    if !below {
        for i in 0..LANES {
            turns[i] = approximations::atan2(xs[i], -zs[i]) * (1.0 / TAU) as f32;
        }
    }
    for i in 0..LANES {
        let hidden = if below { 1.0 } else { ridge.sine(turns[i]) };
        let cover = (hidden - sines[i]).fma(sharpness, 0.5).clamp(0.0, 1.0);
        coverage[i] = if seen[i] { cover } else { 0.0 };
    }
    coverage
}

impl Prepared for PreparedSky<'_> {
    fn bounds(&self, slice: &DepthInterval) -> Rect {
        let hills = self.skyline.is_some() && slice.overlaps(&self.hills);
        if hills || slice.overlaps(&FAR) {
            Rect::from_size(self.view.size[0], self.view.size[1])
        } else {
            Rect::default()
        }
    }

    /// By day, the rows of the skyline.
    fn moving_bounds(&self) -> Rect {
        match self.skyline {
            Some(skyline) if self.cache.is_none() => self.skyline_rows(skyline),
            _ => self.bounds(&DepthInterval::ALL),
        }
    }

    fn draw(&self, slice: &DepthInterval, strip: &mut Strip) {
        let level = bansho_base::math::simd::level();
        if let Some(skyline) = self.skyline.filter(|_| slice.contains(self.hills.near)) {
            dispatch!(level, simd => self.draw_hills(simd, skyline, strip));
        }
        if slice.overlaps(&FAR) {
            dispatch!(level, simd => self.draw_sky(simd, strip));
        }
    }

    fn plate_role(&self) -> PlateRole {
        PlateRole::Behind
    }
}

/// Depth of the sky: behind everything.
pub(super) const FAR: DepthInterval = DepthInterval { near: 1e12, far: f64::INFINITY };

/// Largest picture whose rows are cached, pixels: 16 bytes each.
const MAX_CACHED_PIXELS: usize = 1 << 22;

/// A night sky through a camera.
#[derive(Clone)]
pub(super) struct SkyCache {
    pub(super) cameras: Vec<Camera>,
    pub(super) size: [usize; 2],
    pub(super) sky: Sky,
    pub(super) night: Arc<NightSky>,
    /// Stars, from the top down.
    pub(super) star_images: Arc<Vec<StarImage>>,
    /// Finished rows; `None` until a second frame shows the same sky.
    pub(super) rows: Option<Arc<Vec<OnceLock<SkyRow>>>>,
}

impl SkyCache {
    /// Whether the cache is valid for a frame with these cameras.
    pub(super) fn matches(&self, cameras: &[Camera], size: [usize; 2], sky: &Sky) -> bool {
        self.cameras == cameras && self.size == size && self.sky == *sky
    }

    /// Starts to cache rows.
    pub(super) fn enable_row_cache(&mut self) {
        if self.rows.is_none() && self.size[0] * self.size[1] <= MAX_CACHED_PIXELS {
            self.rows = Some(Arc::new((0..self.size[1]).map(|_| OnceLock::new()).collect()));
        }
    }
}

/// A row of sky.
#[derive(Clone, Debug, Default)]
pub(super) struct SkyRow {
    pub(super) planes: [Vec<f32>; 3],
    pub(super) opacity: Vec<f32>,
}

impl SkyRow {
    /// Clears it to a width.
    pub(super) fn clear(&mut self, width: usize) {
        for plane in self.planes.iter_mut().chain([&mut self.opacity]) {
            plane.clear();
            plane.resize(width, 0.0);
        }
    }

    /// Adds the sky of one camera of the exposure.
    #[inline(always)]
    pub(super) fn add(&mut self, x: usize, [red, green, blue, _]: [f32; 4], weight: f32) {
        let [reds, greens, blues] = &mut self.planes;
        reds[x] = red.fma(weight, reds[x]);
        greens[x] = green.fma(weight, greens[x]);
        blues[x] = blue.fma(weight, blues[x]);
        self.opacity[x] = (self.opacity[x] + weight).min(1.0);
    }

    /// Clears the pixels in which the plate of a strip hides the sky; the row begins at pixel `first` of the strip.
    pub(super) fn mask_by_plate(&mut self, strip: &Strip, first: usize) {
        if !strip.has_plate() {
            return;
        }
        for x in 0..self.opacity.len() {
            if !strip.visible(first + x, FAR.near as f32) {
                self.planes.iter_mut().chain([&mut self.opacity]).for_each(|plane| plane[x] = 0.0);
            }
        }
    }
}
