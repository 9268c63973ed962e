//! Draws lamps as discs, with the glare of the lens around them.

use bansho_base::{
    color,
    image::Rect,
    math::{self, DVec2, MulAdd, simd::LANES},
    phenomenon::{
        Prepared,
        strip::{DepthInterval, Strip, View},
        surroundings::Emitter,
    },
};

use fearless_simd::dispatch;

use super::model::Lamp;

/// Fraction of a spot's light that its housing scatters outside of the cone.
pub(super) const STRAY_LIGHT: f64 = 0.02;

/// Fraction of a lamp's light that a clean lens scatters around its image.
pub(super) const GLARE_FRACTION: f64 = 0.0012;
/// Angles between which the glare falls with the cube of the angle, as in the eye (Vos 1984), radians. Below the first,
/// or within the lamp if it looks larger, it is constant; at the second it ends.
pub(super) const GLARE_ANGLES: [f64; 2] = [0.002, 0.12];

/// Luminance of the glare by angle from a lamp, for each lux that arrives from it: `k / (theta^2 + a^2)^(3/2)`, faded
/// to 0 at the end.
#[derive(Clone, Copy, Debug)]
pub(super) struct Glare {
    /// a^2.
    pub(super) core: f64,
    /// k.
    pub(super) strength: f64,
}

impl Glare {
    /// Square of the angle at which it ends.
    pub(super) const END: f64 = GLARE_ANGLES[1] * GLARE_ANGLES[1];

    /// The glare of a lamp with this angular radius, radians.
    pub(super) fn new(radius: f64) -> Self {
        let core = radius.clamp(GLARE_ANGLES[0], GLARE_ANGLES[1]);
        let (c, e) = (core * core, Self::END);
        let (rise, end) = ((e + c) / e, math::sqrt(e + c));
        // Integral of (1 - s/e)^2 / (s + c)^(3/2) over pi ds, by the substitution u = s + c: (rise - u/e)^2 u^(-3/2).
        let whole = 2.0 * rise * rise / core
            + (4.0 * rise * core - 2.0 / 3.0 * c * core / e - 16.0 / 3.0 * end * (e + c) / e) / e;
        Self { core: c, strength: GLARE_FRACTION / (std::f64::consts::PI * whole) }
    }

    /// The glare in sixteen pixels of a row: the first is at the angles `x` and `y` from the lamp, each at the angle `step` from the one before.
    #[inline(always)]
    pub(super) fn at_sixteen(&self, [x, y, step]: [f32; 3]) -> [f32; LANES] {
        let (core, strength) = (self.core as f32, self.strength as f32);
        let mut weights = [0.0; LANES];
        for i in 0..LANES {
            let across = step.fma(i as f32, x);
            let square = across.fma(across, y * y);
            let fade = square.fma(-1.0 / Self::END as f32, 1.0);
            let fade = if fade > 0.0 { fade } else { 0.0 };
            let from = square + core;
            weights[i] = strength * (fade * fade) / (from * from.sqrt());
        }
        weights
    }
}

/// A sphere of radius r with I candela toward the camera has the luminance I / (pi r^2).
pub(super) fn project_lamp(lamp: &Lamp, view: &View) -> Option<Disc> {
    let (position, cone) = match lamp.light.emitter {
        Emitter::Directional { .. } => return None,
        Emitter::Point { position, .. } => (position, 1.0),
        Emitter::Spot { position, .. } => {
            // The falloff of the cone toward the camera: the illuminance there without the inverse square.
            let distance_squared = (view.camera.position - position).length_squared();
            let toward = color::luminance(lamp.light.illuminance(view.camera.position).0) as f64 * distance_squared;
            let full = f64::from(color::luminance(lamp.light.intensity)).max(f64::MIN_POSITIVE);
            (position, (toward / full).max(STRAY_LIGHT))
        }
    };
    let projection = view.camera.project(position)?;
    let radius = lamp.radius * projection.pixels_per_meter;
    // A disc smaller than a pixel is drawn larger and dimmer.
    let drawn_radius = radius.max(0.75);
    let scale =
        cone / (std::f64::consts::PI * lamp.radius * lamp.radius) * (radius / drawn_radius) * (radius / drawn_radius);
    let distance = (position - view.camera.position).length_squared();
    let disc = Disc {
        center: projection.pixel,
        radius: drawn_radius,
        depth: projection.depth,
        radiance: [0.0; 3],
        solid: radius >= 0.75,
        illuminance: lamp.light.intensity.map(|value| (f64::from(value) * cone / distance) as f32),
    };
    let scale =
        (1.0 - GLARE_FRACTION) * scale * std::f64::consts::PI * drawn_radius * drawn_radius / disc.pixels_covered();
    Some(Disc { radiance: lamp.light.intensity.map(|value| (f64::from(value) * scale) as f32), ..disc })
}

/// A lamp in the picture.
#[derive(Clone, Copy, Debug)]
pub(super) struct Disc {
    /// Pixels.
    pub(super) center: DVec2,
    /// Pixels.
    pub(super) radius: f64,
    /// m.
    pub(super) depth: f64,
    pub(super) radiance: [f32; 3],
    /// Whether it hides what is behind it: discs smaller than a pixel do not.
    pub(super) solid: bool,
    /// Illuminance at the camera, lux.
    pub(super) illuminance: [f32; 3],
}

impl Disc {
    /// Fraction of the pixel in column `x` and row `y` that it covers.
    pub(super) fn coverage(&self, x: f64, y: f64) -> f64 {
        (self.radius + 0.5 - (DVec2::new(x, y) + 0.5 - self.center).length()).clamp(0.0, 1.0)
    }

    /// Sum of the coverage over all pixels; for a small disc it depends on its position between pixels.
    pub(super) fn pixels_covered(&self) -> f64 {
        if self.radius > 8.0 {
            return std::f64::consts::PI * self.radius * self.radius;
        }
        let corner = (self.center - self.radius - 1.0).floor();
        let side = (2.0 * self.radius).ceil() as i32 + 3;
        let row = |y: i32| (0..side).map(move |x| self.coverage(corner.x + f64::from(x), corner.y + f64::from(y)));
        (0..side).flat_map(row).sum()
    }

    pub(super) fn bounds(&self, view: &View) -> Rect {
        self.square_bounds(self.radius + 1.0, view)
    }

    /// Pixels that its glare may reach.
    pub(super) fn glare_bounds(&self, view: &View) -> Rect {
        self.square_bounds(GLARE_ANGLES[1] * view.camera.focal_pixels, view)
    }

    /// The square of pixels around it.
    pub(super) fn square_bounds(&self, reach: f64, view: &View) -> Rect {
        let reach = DVec2::splat(reach);
        let clamp = |value: f64, side: usize| value.clamp(0.0, side as f64) as usize;
        let (low, high) = (self.center - reach, self.center + reach);
        let (x, y) = (clamp(low.x.floor(), view.size[0]), clamp(low.y.floor(), view.size[1]));
        let (right, bottom) = (clamp(high.x.ceil(), view.size[0]), clamp(high.y.ceil(), view.size[1]));
        Rect { x, y, width: right - x, height: bottom - y }
    }
}

/// Whether the lens adds glare: not in mirrored views.
pub(super) fn has_glare(view: &View) -> bool {
    view.mirror.is_none()
}

/// The lamps of a frame, nearest first.
pub(super) struct PreparedLamps<'a> {
    pub(super) view: &'a View,
    pub(super) discs: Vec<Disc>,
}

impl PreparedLamps<'_> {
    pub(super) fn discs_in(&self, slice: &DepthInterval) -> impl Iterator<Item = &Disc> {
        let slice = *slice;
        self.discs.iter().filter(move |disc| slice.contains(disc.depth))
    }

    /// The lamps whose glare belongs to a depth interval: all, in the nearest one.
    pub(super) fn glare_sources(&self, slice: &DepthInterval) -> &[Disc] {
        if has_glare(self.view) && slice.contains(0.0) { &self.discs } else { &[] }
    }

    /// Adds the glare of a lamp where the plate does not hide the lamp.
    #[inline(always)]
    pub(super) fn add_glare(&self, disc: &Disc, strip: &mut Strip) {
        let rect = disc.glare_bounds(self.view).intersection(&strip.rect);
        let glare = Glare::new(disc.radius / self.view.camera.focal_pixels);
        for y in rect.y..rect.bottom() {
            // Batches begin at multiples of sixteen in the whole picture, whatever the strip.
            let mut x = rect.x / LANES * LANES;
            while x < rect.right() {
                let mut weights = glare.at_sixteen(self.offset(disc, x, y));
                let inside = rect.x.max(x) - x..rect.right().min(x + LANES) - x;
                let first = (y - strip.rect.y) * strip.rect.width + x + inside.start - strip.rect.x;
                if strip.has_plate() {
                    for i in inside.clone() {
                        let is_seen = strip.visible(first + i - inside.start, disc.depth as f32);
                        weights[i] = if is_seen { weights[i] } else { 0.0 };
                    }
                }
                let mut light = [weights; 3];
                for c in 0..3 {
                    for i in 0..LANES {
                        light[c][i] = disc.illuminance[c] * weights[i];
                    }
                }
                let [red, green, blue] = &light;
                let radiance = [&red[inside.clone()], &green[inside.clone()], &blue[inside.clone()]];
                strip.add_row_behind(first, radiance, None, &[f32::INFINITY; LANES][inside]);
                x += LANES;
            }
        }
    }

    /// Angles from a lamp to the center of the pixel in column `x` and row `y` to the right and down, and between pixels, radians.
    fn offset(&self, disc: &Disc, x: usize, y: usize) -> [f32; 3] {
        let per_pixel = 1.0 / self.view.camera.focal_pixels;
        let offset = (DVec2::new(x as f64, y as f64) + 0.5 - disc.center) * per_pixel;
        [offset.x as f32, offset.y as f32, per_pixel as f32]
    }
}

impl Prepared for PreparedLamps<'_> {
    fn bounds(&self, slice: &DepthInterval) -> Rect {
        let discs = self.discs_in(slice).map(|disc| disc.bounds(self.view));
        let glares = self.glare_sources(slice).iter().map(|disc| disc.glare_bounds(self.view));
        discs.chain(glares).fold(Rect::default(), |all, rect| all.union(&rect))
    }

    fn draw(&self, slice: &DepthInterval, strip: &mut Strip) {
        for disc in self.glare_sources(slice) {
            dispatch!(bansho_base::math::simd::level(), _simd => self.add_glare(disc, strip));
        }
        for disc in self.discs_in(slice) {
            let rect = disc.bounds(self.view).intersection(&strip.rect);
            for y in rect.y..rect.bottom() {
                for x in rect.x..rect.right() {
                    let index = (y - strip.rect.y) * strip.rect.width + x - strip.rect.x;
                    let coverage = disc.coverage(x as f64, y as f64) as f32;
                    if coverage > 0.0 && strip.visible(index, disc.depth as f32) {
                        let transmittance = if disc.solid { 1.0 - coverage } else { 1.0 };
                        let light = disc.radiance.map(|value| value * coverage);
                        strip.add_behind(index, light, [transmittance; 3], disc.depth as f32);
                    }
                }
            }
        }
    }
}
