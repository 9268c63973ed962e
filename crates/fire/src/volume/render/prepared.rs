//! One prepared frame of a volume flame.

use std::sync::OnceLock;

use bansho_base::{
    camera::Lens,
    color,
    host::{
        observer::{Cancelled, Observer, check},
        once::get_or_compute,
    },
    image::Rect,
    math::{self, DVec2, DVec3},
    phenomenon::{
        Deflection, Prepared,
        strip::{AovDescriptor, AovRule, DepthInterval, Strip, View},
        surroundings::{Light, Surroundings},
    },
};

use fearless_simd::dispatch;

use super::{
    field::{GasField, SeenMixtures},
    haze::{HeatHaze, Refraction},
    march::{Gathered, Ray, RayMarcher},
    sheet::{LAST_SOOT, SheetTable},
    smoke::SmokeLight,
};
use crate::{
    chemiluminescence_color,
    particles::render::VISIBLE_SOOT_ABSORPTION,
    sparks::SparkStreak,
    volume::{fuel::Mixture, parameters::VolumeRenderingParameters},
};

/// Extinction of visible light by the smoke of flames, m^2 per kg of soot (Mulholland and Croarkin 2000).
const SMOKE_EXTINCTION: f64 = 8700.0;
/// Longest way of gas in one time sample of an exposure, cells.
const STREAK_CELLS: f64 = 2.5;
/// Most time samples.
const MAX_TIME_SAMPLES: f64 = 8.0;
/// Mixture fraction, over the stoichiometric, from which on gas is seen if it has no smoke.
const LEAST_SEEN: f32 = 0.8;
/// The same if it has. Less is not drawn, and what is drawn counts from here, so that smoke has no edge where it ends.
const LEAST_SMOKE: f32 = 0.004;

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
    pub(crate) sheet: &'a SheetTable,
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
}

/// The gas of one frame, ready to be drawn into strips.
pub(crate) struct PreparedVolume<'a> {
    gas: RenderedGas<'a>,
    field: GasField<'a>,
    /// Length of a step of a ray, cells.
    step: f64,
    view: &'a View,
    smoke_light: Option<SmokeLight>,
    sparks: Vec<SparkStreak>,
    /// Pixels in which gas may be seen, and its interval of depth.
    rect: Rect,
    depths: DepthInterval,
    time_samples: usize,
    haze: OnceLock<Option<HeatHaze>>,
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
        field: GasField<'a>,
        step: f64,
        lights: &[Light],
        sparks: Vec<SparkStreak>,
        view: &'a View,
        surroundings: &Surroundings,
        observer: &dyn Observer,
    ) -> Result<Self, Cancelled> {
        check(observer)?;
        let corners = field.seen_corners();
        let has_smoke = gas.smoke_yield > 0.0;
        let smoke_light =
            if has_smoke { SmokeLight::new(&field, lights, surroundings, gas.rendering.smoke_albedo) } else { None };
        let streak = gas.speed * view.shutter.duration() / field.grid.spacing;
        Ok(Self {
            rect: corners.map_or(Rect::default(), |corners| rect_of_box(corners, view)),
            depths: corners.map_or(DepthInterval { near: 0.0, far: 0.0 }, |corners| depths_of_box(corners, view)),
            time_samples: (streak / STREAK_CELLS).ceil().clamp(1.0, MAX_TIME_SAMPLES) as usize,
            smoke_light,
            gas,
            field,
            step,
            view,
            sparks,
            haze: OnceLock::new(),
        })
    }

    fn marcher(&self) -> RayMarcher<'_> {
        let RenderedGas { rendering, .. } = self.gas;
        RayMarcher {
            field: &self.field,
            step: self.step,
            sheet: self.gas.sheet,
            mixture: self.gas.mixture,
            black_body: color::black_body(),
            soot_absorption: (self.gas.soot * VISIBLE_SOOT_ABSORPTION * rendering.soot_gain) as f32,
            smoke_extinction: (self.gas.smoke_yield * SMOKE_EXTINCTION * rendering.soot_gain) as f32,
            least_smoke: self.gas.seen().smoke,
            smoke_light: self.smoke_light.as_ref(),
            blue: rendering.blue as f32,
            offset_s: (self.view.shutter.middle() - self.gas.time) as f32,
            exposure_s: self.view.shutter.duration() as f32,
            time_samples: self.time_samples,
        }
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
        dispatch!(math::simd::level(), _simd => self.draw_rows(rect, [near, far], strip));
    }

    /// Draws the pixels of `rect` between two depths, m.
    #[inline(always)]
    fn draw_rows(&self, rect: Rect, [near, far]: [f64; 2], strip: &mut Strip) {
        let marcher = self.marcher();
        let blue = chemiluminescence_color();
        let mut row = RowBuffers::new(rect.width);
        for y in rect.y..rect.bottom() {
            let first = (y - strip.rect.y) * strip.rect.width + rect.x - strip.rect.x;
            let mut has_gas = false;
            for x in 0..rect.width {
                let pixel = DVec2::new((rect.x + x) as f64 + 0.5, y as f64 + 0.5);
                let far = far.min(f64::from(strip.plate_depth(first + x)));
                let gathered = self.view.camera.direction(pixel).and_then(|direction| {
                    let ray = Ray::new(&self.field, self.view.camera.position, direction);
                    marcher.gather(&ray, [near, far])
                });
                row.set(x, gathered.as_ref(), &marcher, blue);
                let Some(gathered) = gathered else { continue };
                has_gas = true;
                if !strip.aovs.is_empty() {
                    self.write_aovs(&gathered, first + x, strip);
                }
            }
            if has_gas {
                let [red, green, blue] = &row.radiance;
                strip.add_row_behind(first, [red, green, blue], Some(&row.opacity), &row.depth);
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

/// A row of pixels before it is added to a strip.
struct RowBuffers {
    radiance: [Vec<f32>; 3],
    opacity: Vec<f32>,
    depth: Vec<f32>,
}

impl RowBuffers {
    fn new(width: usize) -> Self {
        let zeros = || vec![0.0; width];
        Self { radiance: [zeros(), zeros(), zeros()], opacity: zeros(), depth: zeros() }
    }

    fn set(&mut self, x: usize, gathered: Option<&Gathered>, marcher: &RayMarcher, blue: [f32; 3]) {
        let Some(gathered) = gathered else {
            self.radiance.iter_mut().for_each(|plane| plane[x] = 0.0);
            (self.opacity[x], self.depth[x]) = (0.0, f32::INFINITY);
            return;
        };
        // The light of a sum of black bodies has nearly the color of one at their mean temperature.
        let kelvin = if gathered.luminance > 0.0 { gathered.luminance_kelvin / gathered.luminance } else { 0.0 };
        let glow = marcher.black_body.radiance(kelvin);
        let per_luminance = gathered.luminance / color::luminance(glow).max(f32::MIN_POSITIVE);
        for c in 0..3 {
            self.radiance[c][x] = glow[c] * per_luminance + gathered.blue * blue[c] + gathered.scattered[c];
        }
        (self.opacity[x], self.depth[x]) = (gathered.opacity, gathered.depth);
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
