//! Draws lamps as discs, with the glare of the lens around them.

use bansho_base::{
    camera::angular_distance::{AngularDistance, chord},
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

use super::Lamp;

/// Fraction of a spot's light that its housing scatters outside of the cone.
pub(super) const STRAY_LIGHT: f64 = 0.02;

/// Fraction of a lamp's light that a clean lens scatters around its image.
pub(super) const GLARE_FRACTION: f64 = 0.0012;
/// Angles between which the glare falls with the cube of the angle, as in the eye (Vos 1984), radians. Below the first,
/// or within the lamp if it looks larger, it is constant; at the second it ends.
pub(super) const GLARE_ANGLES: [f64; 2] = [0.002, 0.12];

/// Luminance of the glare by angle from a lamp, for each lux that arrives from it: `k / (theta^2 + a^2)^(3/2)`, faded
/// to 0 at the end. Angles are measured as chords, 2 sin(theta / 2).
#[derive(Clone, Copy, Debug)]
pub(super) struct Glare {
    /// a^2.
    pub(super) core: f64,
    /// k.
    pub(super) strength: f64,
}

impl Glare {
    /// Square of the chord at which it ends.
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

    /// The glare at sixteen angles from the lamp, given as squares of chords.
    #[inline(always)]
    pub(super) fn at_sixteen(&self, squares: [f32; LANES]) -> [f32; LANES] {
        let (core, strength) = (self.core as f32, self.strength as f32);
        let mut weights = [0.0; LANES];
        for i in 0..LANES {
            let fade = squares[i].fma(-1.0 / Self::END as f32, 1.0);
            let fade = if fade > 0.0 { fade } else { 0.0 };
            let from = squares[i] + core;
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
    let camera = &view.camera;
    let depth = camera.depth(position);
    if depth.is_nan() || depth < camera.near {
        return None;
    }
    let to_lamp = position - camera.position;
    let distance = to_lamp.length();
    let angles = AngularDistance::new(camera, to_lamp / distance)?;
    let seen_radius = math::asin((lamp.radius / distance).min(1.0));
    // A disc smaller than a pixel is drawn larger and dimmer.
    let min_radius = MIN_RADIUS_PIXELS / angles.min_pixels_per_radian();
    let radius = seen_radius.max(min_radius);
    let illuminance = lamp.light.intensity.map(|value| f64::from(value) * cone / (distance * distance));
    let glare_rects = if has_glare(view) { angles.rects_within(GLARE_ANGLES[1], view.size) } else { Vec::new() };
    let disc = Disc {
        angles,
        radius,
        rects: angles.rects_within(radius, view.size),
        glare_rects,
        depth,
        radiance: [0.0; 3],
        solid: seen_radius >= min_radius,
        illuminance: illuminance.map(|value| value as f32),
    };
    // Luminance times solid angle, I / (pi r^2) 2 pi (1 - cos a) with sin a = r / d: the illuminance I / d^2 but for spheres right before the lens, whose
    // edge shines obliquely on a surface that faces their center.
    let whole = 2.0 / (1.0 + math::cos(seen_radius));
    let kept = if view.glare_is_added { 1.0 } else { 1.0 - GLARE_FRACTION };
    let scale = kept * whole / disc.solid_angle_covered();
    Some(Disc { radiance: illuminance.map(|value| (value * scale) as f32), ..disc })
}

/// Smallest radius of a disc in the picture, pixels.
const MIN_RADIUS_PIXELS: f64 = 0.75;

/// A lamp in the picture.
#[derive(Clone, Debug)]
pub(super) struct Disc {
    /// Angles of pixels from the direction of its center.
    pub(super) angles: AngularDistance,
    /// Angular radius with which it is drawn, radians.
    pub(super) radius: f64,
    /// The parts of the picture that contain it.
    pub(super) rects: Vec<Rect>,
    /// The parts of the picture that its glare may reach.
    pub(super) glare_rects: Vec<Rect>,
    /// m.
    pub(super) depth: f64,
    pub(super) radiance: [f32; 3],
    /// Whether it hides what is behind it: discs smaller than a pixel do not.
    pub(super) solid: bool,
    /// Illuminance at the camera, lux.
    pub(super) illuminance: [f32; 3],
}

impl Disc {
    /// Fraction of the pixel with this center that it covers.
    pub(super) fn coverage(&self, center: DVec2) -> f64 {
        (self.angles.pixels_inside(chord(self.radius), center) + 0.5).clamp(0.0, 1.0)
    }

    /// Sum over all pixels of their coverage times their solid angle, steradian; for a small disc it depends on its position between pixels. Pixels beside
    /// the picture count as well.
    fn solid_angle_covered(&self) -> f64 {
        /// From this radius on, pixels, the sum is that of the circle.
        const RESOLVED_RADIUS: f64 = 8.0;
        /// A small disc that is spread over more pixels is stretched by the edge of a wide lens, so that its position between pixels matters little.
        /// This many take a fifth of a second. A fisheye of 360 degrees spreads a lamp behind the camera over all of its rim.
        const MAX_PIXELS: u64 = 1 << 22;
        let circle = std::f64::consts::PI * chord(self.radius) * chord(self.radius);
        if self.radius * self.angles.min_pixels_per_radian() > RESOLVED_RADIUS {
            return circle;
        }
        let Some([columns, rows]) = self.angles.pixels_within(self.radius) else { return circle };
        if columns.start.abs_diff(columns.end).saturating_mul(rows.start.abs_diff(rows.end)) > MAX_PIXELS {
            return circle;
        }
        let centers = rows.flat_map(|y| columns.clone().map(move |x| DVec2::new(x as f64 + 0.5, y as f64 + 0.5)));
        let covered: f64 =
            centers.map(|center| self.coverage(center) * self.angles.camera().pixel_solid_angle(center)).sum();
        if covered > 0.0 { covered } else { circle }
    }
}

/// Whether lamps have a glare of their own: not in mirrored views, nor where the whole picture gets glare.
pub(super) fn has_glare(view: &View) -> bool {
    view.mirror.is_none() && !view.glare_is_added
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

    /// Adds the glare of a lamp in `rect`, where the plate does not hide the lamp.
    #[inline(always)]
    fn add_glare(disc: &Disc, rect: Rect, strip: &mut Strip) {
        let glare = Glare::new(disc.radius);
        for y in rect.y..rect.bottom() {
            // Batches begin at multiples of sixteen in the whole picture, whatever the strip.
            let mut x = rect.x / LANES * LANES;
            while x < rect.right() {
                let mut weights = glare.at_sixteen(disc.angles.squares(x, y));
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

    /// Adds the light of a disc in `rect` and hides what is behind it.
    fn add_disc(disc: &Disc, rect: Rect, strip: &mut Strip) {
        for (x, y) in (rect.y..rect.bottom()).flat_map(|y| (rect.x..rect.right()).map(move |x| (x, y))) {
            let index = (y - strip.rect.y) * strip.rect.width + x - strip.rect.x;
            let center = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
            let coverage = disc.coverage(center) as f32;
            if coverage > 0.0 && disc.angles.camera().is_in_circle(center) && strip.visible(index, disc.depth as f32) {
                let transmittance = if disc.solid { 1.0 - coverage } else { 1.0 };
                let light = disc.radiance.map(|value| value * coverage);
                strip.add_behind(index, light, [transmittance; 3], disc.depth as f32);
            }
        }
    }
}

impl Prepared for PreparedLamps<'_> {
    fn bounds(&self, slice: &DepthInterval) -> Rect {
        let discs = self.discs_in(slice).flat_map(|disc| &disc.rects);
        let glares = self.glare_sources(slice).iter().flat_map(|disc| &disc.glare_rects);
        discs.chain(glares).fold(Rect::default(), |all, rect| all.union(rect))
    }

    fn draw(&self, slice: &DepthInterval, strip: &mut Strip) {
        let drawn = strip.rect;
        for disc in self.glare_sources(slice) {
            for rect in disc.glare_rects.iter().map(|rect| rect.intersection(&drawn)) {
                dispatch!(bansho_base::math::simd::level(), _simd => Self::add_glare(disc, rect, strip));
            }
        }
        for disc in self.discs_in(slice) {
            for rect in disc.rects.iter().map(|rect| rect.intersection(&drawn)) {
                Self::add_disc(disc, rect, strip);
            }
        }
    }
}
