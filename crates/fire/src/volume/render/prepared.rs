//! One prepared frame of a volume flame.

use std::sync::OnceLock;

use bansho_base::{
    camera::Lens,
    color,
    host::{once::get_or_compute, parallel::prelude::*},
    image::Rect,
    math::{self, DVec2, DVec3},
    phenomenon::{
        Deflection, Prepared,
        strip::{AovDescriptor, AovRule, DepthInterval, Strip, View},
    },
};
use bansho_fluid::Grid;
use fearless_simd::dispatch;

use super::{
    blocks::SeenMixtures,
    field::GasField,
    haze::{HeatHaze, Refraction},
    march::TilePart,
    nodes::TILE,
    optics::{GasOptics, LEAST_SEEN},
    rays::{GasRays, Gathered, TimeSamples},
    smoke::SmokeLight,
};
use crate::{
    chemiluminescence_color,
    particles::render::VISIBLE_SOOT_ABSORPTION,
    sparks::SparkStreak,
    volume::{
        fuel::{LAST_SOOT, Mixture},
        parameters::VolumeRenderingParameters,
    },
};

/// Extinction of visible light by the smoke of flames, m^2 per kg of soot (Mulholland and Croarkin 2000).
const SMOKE_EXTINCTION: f64 = 8700.0;
/// Mixture fraction, over the stoichiometric, from which on smoke is seen. Less is not drawn, and what is drawn counts from here, so that smoke has no edge where it
/// ends.
const LEAST_SMOKE: f32 = 0.004;

/// Rows of pixels that are computed together where nothing but gas is in the picture. Bands are at multiples of it in the picture.
const BAND: usize = 32;
/// Rows of a strip, as pictures are usually divided; others are slower.
const STRIP_ROWS: usize = 8;

/// AOVs of a volume flame, in the order of a strip's planes.
pub(crate) const AOVS: &[AovDescriptor] = &[
    AovDescriptor {
        name: "temperature_k",
        unit: "K",
        doc: "Gas temperature, weighted by the luminance that its soot adds; 0 where no soot glows.",
        rule: AovRule::WeightedMean,
    },
    AovDescriptor {
        name: "optical_depth",
        unit: "",
        doc: "Optical depth of soot and smoke along the line of sight; 0 where there is none.",
        rule: AovRule::Sum,
    },
    AovDescriptor {
        name: "deflection.X",
        unit: "rad",
        doc: "Angle to the right by which hot gas deflects light from behind, including `heat_haze_gain`; 0 without deflection.",
        rule: AovRule::Sum,
    },
    AovDescriptor {
        name: "deflection.Y",
        unit: "rad",
        doc: "Angle upward by which hot gas deflects light from behind, including `heat_haze_gain`; 0 without deflection.",
        rule: AovRule::Sum,
    },
    AovDescriptor {
        name: "motion.X",
        unit: "pixels",
        doc: "Motion of the gas to the next frame, to the right, weighted by luminance; 0 where no soot glows.",
        rule: AovRule::WeightedMean,
    },
    AovDescriptor {
        name: "motion.Y",
        unit: "pixels",
        doc: "Motion of the gas to the next frame, downward, weighted by luminance; 0 where no soot glows.",
        rule: AovRule::WeightedMean,
    },
];

/// The gas of one state as the renderer sees it.
#[derive(Clone, Copy)]
pub(crate) struct RenderedGas<'a> {
    pub(crate) mixture: Mixture,
    pub(crate) rendering: &'a VolumeRenderingParameters,
    /// Largest volume fraction of soot.
    pub(crate) soot: f64,
    pub(crate) smoke_yield: f64,
    /// Time of the state, s.
    pub(crate) time: f64,
    /// Largest speed of gas, m/s.
    pub(crate) speed: f64,
}

impl RenderedGas<'_> {
    /// The mixture fractions between which gas is seen.
    pub(crate) fn seen(&self) -> SeenMixtures {
        let has_smoke = self.smoke_yield * self.rendering.soot_gain > 0.0;
        let [least_sheet, least_smoke, last] =
            [LEAST_SEEN, LEAST_SMOKE, LAST_SOOT].map(|relative| relative * self.mixture.stoichiometric);
        SeenMixtures { smoke: if has_smoke { least_smoke } else { least_sheet }, sheet: least_sheet, last }
    }

    /// What gas emits and absorbs.
    pub(crate) fn optics(&self) -> GasOptics {
        let gain = self.rendering.soot_gain;
        GasOptics {
            mixture: self.mixture,
            soot_absorption: (self.soot * VISIBLE_SOOT_ABSORPTION * gain) as f32,
            smoke_extinction: (self.smoke_yield * SMOKE_EXTINCTION * gain) as f32,
            least_smoke: self.seen().smoke,
            blue: self.rendering.blue as f32,
        }
    }

    /// The parts of the exposure of a view.
    pub(crate) fn time_samples(&self, view: &View, grid: &Grid) -> TimeSamples {
        let offset = view.shutter.middle() - self.time;
        TimeSamples::new(offset, view.shutter.duration(), self.speed / grid.spacing)
    }
}

/// The gas of one frame, ready to be drawn into strips.
pub(crate) struct PreparedVolume<'a> {
    gas: RenderedGas<'a>,
    field: GasField,
    /// Length of a step of a ray, cells.
    step: f64,
    view: &'a View,
    smoke_light: Option<SmokeLight>,
    times: TimeSamples,
    /// Distance between rays along which gas is looked up, pixels.
    node_pixels: usize,
    sparks: Vec<SparkStreak>,
    /// Pixels in which gas may be seen, and its interval of depth.
    rect: Rect,
    depths: DepthInterval,
    haze: OnceLock<Option<HeatHaze>>,
    /// The pixels of each tile and band of rows, where neither slices nor plates cut the gas.
    bands: Vec<OnceLock<Option<TilePixels>>>,
}

/// The interval of depth of a box, m.
pub(crate) fn depths_of_box([low, high]: [DVec3; 2], view: &View) -> DepthInterval {
    let depths = corners([low, high]).map(|corner| view.camera.depth(corner));
    let (nearest, farthest) =
        depths.into_iter().fold((f64::INFINITY, 0.0_f64), |(near, far), depth| (near.min(depth), far.max(depth)));
    // Depths along the axis of a fisheye are distances, least on a side of the box rather than at a corner.
    let position = view.camera.position;
    let distance = (position.clamp(low, high) - position).length();
    DepthInterval { near: nearest.min(distance).max(view.camera.near), far: farthest.max(view.camera.near).next_up() }
}

fn corners([low, high]: [DVec3; 2]) -> [DVec3; 8] {
    std::array::from_fn(|i| {
        let side = |bit: usize, axis: usize| if i >> bit & 1 == 1 { high[axis] } else { low[axis] };
        DVec3::new(side(0, 0), side(1, 1), side(2, 2))
    })
}

/// The pixels in which a box may be seen.
fn rect_of_box(box_corners: [DVec3; 2], view: &View) -> Rect {
    let whole = view.window;
    let mut low = DVec2::INFINITY;
    let mut high = DVec2::NEG_INFINITY;
    for corner in corners(box_corners) {
        // Behind the camera, and where straight lines are no lines in the picture, all pixels may show it.
        let is_straight = view.camera.lens == Lens::Perspective && view.camera.depth(corner) > view.camera.near;
        let Some(projection) = view.camera.project_beyond_circle(corner).filter(|_| is_straight) else { return whole };
        low = low.min(projection.pixel);
        high = high.max(projection.pixel);
    }
    let clamp = |value: f64, limit: usize| value.clamp(0.0, limit as f64) as usize;
    let (left, top) = (clamp(low.x.floor() - 1.0, view.size[0]), clamp(low.y.floor() - 1.0, view.size[1]));
    let (right, bottom) = (clamp(high.x.ceil() + 1.0, view.size[0]), clamp(high.y.ceil() + 1.0, view.size[1]));
    Rect { x: left, y: top, width: right - left, height: bottom - top }.intersection(&whole)
}

impl<'a> PreparedVolume<'a> {
    pub(crate) fn new(
        gas: RenderedGas<'a>,
        field: GasField,
        smoke_light: Option<SmokeLight>,
        step: f64,
        sparks: Vec<SparkStreak>,
        view: &'a View,
    ) -> Self {
        let corners = field.seen_corners();
        let nowhere = DepthInterval { near: 0.0, far: 0.0 };
        let depths = corners.map_or(nowhere, |corners| depths_of_box(corners, view));
        let rect = corners.map_or(Rect::default(), |corners| rect_of_box(corners, view));
        let count = |first: usize, end: usize, side: usize| end.div_ceil(side) - first / side;
        let bands = count(rect.x, rect.right(), TILE) * count(rect.y, rect.bottom(), BAND);
        Self {
            rect,
            depths,
            times: gas.time_samples(view, &field.grid),
            node_pixels: GasRays::node_pixels(&field, &view.camera, depths.far),
            smoke_light,
            gas,
            field,
            step,
            view,
            sparks,
            haze: OnceLock::new(),
            bands: std::iter::repeat_with(OnceLock::new).take(bands).collect(),
        }
    }

    pub(super) fn rays(&self) -> GasRays<'_> {
        GasRays {
            field: &self.field,
            optics: self.gas.optics(),
            smoke_light: self.smoke_light.as_ref(),
            times: self.times,
            camera: &self.view.camera,
            step: self.step,
            node_pixels: self.node_pixels,
        }
    }

    /// Luminance of all pixels that may show gas, by rays one at a time.
    pub(crate) fn single_ray_luminance(&self) -> Vec<f32> {
        let (rays, rect) = (self.rays(), self.rect);
        let range = [self.depths.near, self.depths.far];
        let row = |y: usize| {
            (rect.x..rect.right()).map(move |x| (x, y)).map(|(x, y)| {
                let pixel = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
                let gathered = dispatch!(math::simd::level(), simd => rays.gather_single(simd, pixel, range));
                gathered.map_or(0.0, |gathered| gathered.luminance + color::luminance(gathered.scattered))
            })
        };
        (rect.y..rect.bottom()).into_par_iter().flat_map_iter(row).collect()
    }

    fn haze(&self) -> Option<&HeatHaze> {
        get_or_compute(&self.haze, || {
            let refraction = Refraction {
                field: &self.field,
                mixture: self.gas.mixture,
                gain: self.gas.rendering.heat_haze_gain,
                depths: [self.depths.near, self.depths.far],
            };
            HeatHaze::new(&refraction, self.view, self.rect)
        })
        .as_ref()
    }

    fn draw_gas(&self, slice: &DepthInterval, strip: &mut Strip) {
        let rect = self.rect.intersection(&strip.rect);
        let (near, far) = (slice.near.max(self.depths.near), slice.far.min(self.depths.far));
        if rect.is_empty() || near >= far {
            return;
        }
        let is_whole = near == self.depths.near && far == self.depths.far;
        let (first_tile, tiles) = (rect.x / TILE, rect.right().div_ceil(TILE) - rect.x / TILE);
        // Strips of the same band begin at different tiles, so that threads do not wait for each other.
        let begin = rect.y / STRIP_ROWS * tiles * STRIP_ROWS / BAND;
        for number in 0..tiles {
            let x = (first_tile + (begin + number) % tiles) * TILE;
            let tile_rect = Rect { x, width: TILE, ..rect }.intersection(&rect);
            if is_whole && !strip.has_plate() && strip.aovs.is_empty() {
                self.draw_from_bands(tile_rect, strip);
            } else {
                self.draw_tile(tile_rect, [near, far], strip);
            }
        }
    }

    /// Draws a part of a tile.
    fn draw_tile(&self, rect: Rect, depths: [f64; 2], strip: &mut Strip) {
        let Rect { x: column, y: row, width, .. } = strip.rect;
        let plate_depth = |x: usize, y: usize| strip.plate_depth((y - row) * width + x - column);
        let part = TilePart { rect, depths, plate_depth: &plate_depth, has_motion: !strip.aovs.is_empty() };
        let rays = self.rays();
        let gathered = dispatch!(math::simd::level(), simd => rays.gather_tile(simd, &part));
        let Some(gathered) = gathered else { return };
        if !strip.aovs.is_empty() {
            self.write_tile_aovs(rect, &gathered, strip);
        }
        TilePixels::new(rect, &gathered).add_to(strip);
    }

    /// Draws a part of a tile from pixels that are computed for several strips at once: neighboring strips would look up the same nodes.
    fn draw_from_bands(&self, rect: Rect, strip: &mut Strip) {
        let tile = (rect.x / TILE) - self.rect.x / TILE;
        let tiles = (self.rect.right() - 1) / TILE - self.rect.x / TILE + 1;
        for band in rect.y / BAND..=(rect.bottom() - 1) / BAND {
            let index = (band - self.rect.y / BAND) * tiles + tile;
            // Waiting for another thread is safe: what it computes does not use the thread pool.
            let pixels = self.bands[index].get_or_init(|| {
                let whole = Rect { x: rect.x / TILE * TILE, y: band * BAND, width: TILE, height: BAND };
                let rect = whole.intersection(&self.rect);
                let depths = [self.depths.near, self.depths.far];
                let part = TilePart { rect, depths, plate_depth: &|_, _| f32::INFINITY, has_motion: false };
                let rays = self.rays();
                let gathered = dispatch!(math::simd::level(), simd => rays.gather_tile(simd, &part));
                gathered.map(|gathered| TilePixels::new(rect, &gathered))
            });
            if let Some(pixels) = pixels {
                pixels.add_to(strip);
            }
        }
    }

    fn write_tile_aovs(&self, rect: Rect, gathered: &[Gathered], strip: &mut Strip) {
        for (row, gathered) in gathered.chunks_exact(rect.width).enumerate() {
            let first = (rect.y + row - strip.rect.y) * strip.rect.width + rect.x - strip.rect.x;
            for (x, gathered) in gathered.iter().enumerate().filter(|(_, gathered)| gathered.is_visible()) {
                self.write_aovs(gathered, first + x, strip);
            }
        }
    }

    fn write_aovs(&self, gathered: &Gathered, index: usize, strip: &mut Strip) {
        /// Luminance above which temperature and motion are recorded, cd/m^2.
        const LEAST_LUMINANCE: f32 = 1e-3;
        strip.aovs[1].add(index, gathered.optical_depth, 1.0);
        if gathered.luminance <= LEAST_LUMINANCE {
            return;
        }
        strip.aovs[0].add(index, gathered.luminance_kelvin / gathered.luminance, gathered.luminance);
        let [u, v, w, depth] = gathered.motion.map(|value| f64::from(value / gathered.luminance));
        let x = strip.rect.x + index % strip.rect.width;
        let y = strip.rect.y + index / strip.rect.width;
        let pixel = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
        let Some(direction) = self.view.camera.direction(pixel) else { return };
        let here = self.view.camera.position + direction * depth;
        let middle = self.view.shutter.middle();
        let next = here + DVec3::new(u, v, w) * (self.view.next_middle - middle);
        let then = self.view.camera_at(self.view.next_middle).project_beyond_circle(next);
        if let Some(then) = then {
            strip.aovs[4].add(index, (then.pixel.x - pixel.x) as f32, gathered.luminance);
            strip.aovs[5].add(index, (then.pixel.y - pixel.y) as f32, gathered.luminance);
        }
    }

    fn write_deflection(&self, slice: &DepthInterval, strip: &mut Strip) {
        let Some(haze) = self.haze().filter(|haze| slice.contains(haze.depth.next_down())) else { return };
        let rect = haze.rect.intersection(&strip.rect);
        for y in rect.y..rect.bottom() {
            for x in rect.x..rect.right() {
                let index = (y - strip.rect.y) * strip.rect.width + x - strip.rect.x;
                let [right, up] = haze.angle.at(x - haze.rect.x, y - haze.rect.y);
                strip.aovs[2].add(index, right, 1.0);
                strip.aovs[3].add(index, up, 1.0);
            }
        }
    }
}

/// Pixels of a part of a tile.
struct TilePixels {
    rect: Rect,
    radiance: [Vec<f32>; 3],
    opacity: Vec<f32>,
    depth: Vec<f32>,
    /// Whether there is gas in a row.
    has_gas: Vec<bool>,
}

impl TilePixels {
    fn new(rect: Rect, gathered: &[Gathered]) -> Self {
        let zeros = || vec![0.0; gathered.len()];
        let mut pixels = Self {
            rect,
            radiance: [zeros(), zeros(), zeros()],
            opacity: zeros(),
            depth: vec![f32::INFINITY; gathered.len()],
            has_gas: vec![false; rect.height],
        };
        let (black_body, blue) = (color::black_body(), chemiluminescence_color());
        for (index, gathered) in gathered.iter().enumerate().filter(|(_, gathered)| gathered.is_visible()) {
            // The light of a sum of black bodies has nearly the color of one at their mean temperature.
            let kelvin = if gathered.luminance > 0.0 { gathered.luminance_kelvin / gathered.luminance } else { 0.0 };
            let glow = black_body.radiance(kelvin);
            let per_luminance = gathered.luminance / color::luminance(glow).max(f32::MIN_POSITIVE);
            for c in 0..3 {
                pixels.radiance[c][index] = glow[c] * per_luminance + gathered.blue * blue[c] + gathered.scattered[c];
            }
            (pixels.opacity[index], pixels.depth[index]) = (gathered.opacity, gathered.depth);
            pixels.has_gas[index / rect.width] = true;
        }
        pixels
    }

    /// Adds those that are in a strip.
    fn add_to(&self, strip: &mut Strip) {
        let rect = self.rect.intersection(&strip.rect);
        for y in rect.y..rect.bottom() {
            let row = y - self.rect.y;
            if !self.has_gas[row] {
                continue;
            }
            let first = (y - strip.rect.y) * strip.rect.width + rect.x - strip.rect.x;
            let begin = row * self.rect.width + rect.x - self.rect.x;
            let pixels = begin..begin + rect.width;
            let [red, green, blue] = self.radiance.each_ref().map(|plane| &plane[pixels.clone()]);
            strip.add_row_behind(first, [red, green, blue], Some(&self.opacity[pixels.clone()]), &self.depth[pixels]);
        }
    }
}

impl Prepared for PreparedVolume<'_> {
    fn bounds(&self, slice: &DepthInterval) -> Rect {
        let gas = if slice.overlaps(&self.depths) { self.rect } else { Rect::default() };
        let sparks = self.sparks.iter().filter(|spark| slice.contains(spark.sorting_depth));
        sparks.fold(gas, |all, spark| all.union(&spark.bounds(self.view.size)))
    }

    fn draw(&self, slice: &DepthInterval, strip: &mut Strip) {
        let middle = 0.5 * (self.depths.near + self.depths.far);
        let in_slice = || self.sparks.iter().filter(|spark| slice.contains(spark.sorting_depth));
        in_slice().filter(|spark| spark.sorting_depth < middle).for_each(|spark| spark.draw(self.view, strip));
        self.draw_gas(slice, strip);
        if !strip.aovs.is_empty() {
            self.write_deflection(slice, strip);
        }
        in_slice().filter(|spark| spark.sorting_depth >= middle).for_each(|spark| spark.draw(self.view, strip));
    }

    fn may_refract(&self) -> bool {
        self.gas.rendering.heat_haze_gain > 0.0 && !self.rect.is_empty()
    }

    fn deflection(&self) -> Option<Deflection<'_>> {
        let haze = self.haze()?;
        Some(Deflection { depth: haze.depth, rect: haze.rect, angle: &haze.angle })
    }
}
