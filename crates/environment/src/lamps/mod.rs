//! Lamps as visible objects: the luminous disc of a point or spot light, and the glare that a camera's lens adds.
//!
//! # Reference
//! J. J. Vos, "Disability glare - a state of the art report", CIE J. 3 (1984): glare falls with the cube of the angle
//! close to a source.
//!
//! # Equations
//!
//! | equation | function |
//! | --- | --- |
//! | luminance of a sphere of radius r, `I / (pi r^2)` | `project_lamp` |
//! | glare `L = E k / (theta^2 + a^2)^(3/2)`, with a fade to 0 | `Glare::at`, normalized in `Glare::new` |
//!
//! # Data flow
//! [`Lamps`] holds a function of time that gives the visible lights. `project_lamp` turns each into a `Disc` in the
//! picture: center, radius, depth, radiance, and the illuminance at the camera. `PreparedLamps` draws the discs at
//! their depths, antialiased, and the glare of all of them in the nearest depth interval. Their light on other things
//! is the lights' own, not a matter of this module.

use std::sync::Arc;

use bansho_base::{
    color,
    host::observer::{Cancelled, Observer},
    image::Rect,
    math::{self, DVec2},
    phenomenon::{
        Phenomenon, PhenomenonInfo, Prepared, Run,
        strip::{DepthInterval, Shutter, Strip, View},
        surroundings::{Emitter, Light, Publication, Surroundings},
    },
};

/// The visible lights of a scene at any time.
pub struct Lamps {
    at: Box<dyn Fn(f64) -> Vec<Lamp> + Send + Sync>,
}

/// A light and the ball that it is seen as.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lamp {
    /// The light.
    pub light: Light,
    /// Radius of the ball, m.
    pub radius: f64,
}

impl Lamps {
    /// The name of their layer.
    pub const NAME: &str = "lamps";

    /// Lamps that `at` gives for a time in seconds.
    pub fn new(at: impl Fn(f64) -> Vec<Lamp> + Send + Sync + 'static) -> Self {
        Self { at: Box::new(at) }
    }
}

/// Fraction of a spot's light that its housing scatters outside of the cone.
const STRAY_LIGHT: f64 = 0.02;

/// Fraction of a lamp's light that a clean lens scatters around its image.
const GLARE_FRACTION: f64 = 0.0012;
/// Angles between which the glare falls with the cube of the angle, as in the eye (Vos 1984), radians. Below the first,
/// or within the lamp if it looks larger, it is constant; at the second it ends.
const GLARE_ANGLES: [f64; 2] = [0.002, 0.12];

/// Luminance of the glare by angle from a lamp, for each lux that arrives from it: `k / (theta^2 + a^2)^(3/2)`, faded
/// to 0 at the end.
#[derive(Clone, Copy, Debug)]
struct Glare {
    /// a^2.
    core: f64,
    /// k.
    strength: f64,
}

impl Glare {
    /// Square of the angle at which it ends.
    const END: f64 = GLARE_ANGLES[1] * GLARE_ANGLES[1];

    /// The glare of a lamp with this angular radius, radians.
    fn new(radius: f64) -> Self {
        let core = radius.clamp(GLARE_ANGLES[0], GLARE_ANGLES[1]);
        let (c, e) = (core * core, Self::END);
        let (rise, end) = ((e + c) / e, math::sqrt(e + c));
        // Integral of (1 - s/e)^2 / (s + c)^(3/2) over pi ds, by the substitution u = s + c: (rise - u/e)^2 u^(-3/2).
        let whole = 2.0 * rise * rise / core
            + (4.0 * rise * core - 2.0 / 3.0 * c * core / e - 16.0 / 3.0 * end * (e + c) / e) / e;
        Self { core: c, strength: GLARE_FRACTION / (std::f64::consts::PI * whole) }
    }

    fn at(&self, angle: f64) -> f64 {
        let square = angle * angle;
        let fade = (1.0 - square / Self::END).max(0.0);
        let from = square + self.core;
        self.strength * fade * fade / (from * math::sqrt(from))
    }
}

/// A sphere of radius r with I candela toward the camera has the luminance I / (pi r^2).
fn project_lamp(lamp: &Lamp, view: &View) -> Option<Disc> {
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
struct Disc {
    center: DVec2,
    radius: f64,
    depth: f64,
    radiance: [f32; 3],
    solid: bool,
    /// Illuminance at the camera, lux.
    illuminance: [f32; 3],
}

impl Disc {
    /// Fraction of the pixel in column `x` and row `y` that it covers.
    fn coverage(&self, x: f64, y: f64) -> f64 {
        (self.radius + 0.5 - (DVec2::new(x, y) + 0.5 - self.center).length()).clamp(0.0, 1.0)
    }

    /// Sum of the coverage over all pixels; for a small disc it depends on its position between pixels.
    fn pixels_covered(&self) -> f64 {
        if self.radius > 8.0 {
            return std::f64::consts::PI * self.radius * self.radius;
        }
        let corner = (self.center - self.radius - 1.0).floor();
        let side = (2.0 * self.radius).ceil() as i32 + 3;
        let row = |y: i32| (0..side).map(move |x| self.coverage(corner.x + f64::from(x), corner.y + f64::from(y)));
        (0..side).flat_map(row).sum()
    }

    fn bounds(&self, view: &View) -> Rect {
        self.square_bounds(self.radius + 1.0, view)
    }

    /// Pixels that its glare may reach.
    fn glare_bounds(&self, view: &View) -> Rect {
        self.square_bounds(GLARE_ANGLES[1] * view.camera.focal_pixels, view)
    }

    /// The square of pixels around it.
    fn square_bounds(&self, reach: f64, view: &View) -> Rect {
        let reach = DVec2::splat(reach);
        let clamp = |value: f64, side: usize| value.clamp(0.0, side as f64) as usize;
        let (low, high) = (self.center - reach, self.center + reach);
        let (x, y) = (clamp(low.x.floor(), view.size[0]), clamp(low.y.floor(), view.size[1]));
        let (right, bottom) = (clamp(high.x.ceil(), view.size[0]), clamp(high.y.ceil(), view.size[1]));
        Rect { x, y, width: right - x, height: bottom - y }
    }
}

impl Phenomenon for Lamps {
    fn info(&self) -> PhenomenonInfo<'_> {
        PhenomenonInfo::new(Self::NAME)
    }

    /// Lamps do not set the exposure: they are meant to be far brighter than what they light.
    fn luminance(&self) -> f64 {
        0.0
    }

    fn start(self: Arc<Self>) -> Box<dyn Run> {
        Box::new(self)
    }
}

impl Run for Lamps {
    /// The lights are the scene's own, so all have them already.
    fn publish(&self, _shutter: Shutter) -> Publication {
        Publication::default()
    }

    fn depth_intervals(&self, view: &View, _surroundings: &Surroundings) -> Vec<DepthInterval> {
        let discs = (self.at)(view.shutter.middle());
        // Glare arises in the lens, in front of everything.
        let near = |disc: &Disc| if has_glare(view) { 0.0 } else { disc.depth };
        let depth = |disc: Disc| DepthInterval { near: near(&disc), far: disc.depth.next_up() };
        discs.iter().filter_map(|lamp| project_lamp(lamp, view)).map(depth).collect()
    }

    fn prepare<'a>(
        &'a self,
        view: &'a View,
        _surroundings: &'a Surroundings<'a>,
        _observer: &dyn Observer,
    ) -> Result<Box<dyn Prepared + 'a>, Cancelled> {
        let lamps = (self.at)(view.shutter.middle());
        let mut discs: Vec<Disc> = lamps.iter().filter_map(|lamp| project_lamp(lamp, view)).collect();
        discs.sort_by(|a, b| a.depth.total_cmp(&b.depth));
        Ok(Box::new(PreparedLamps { view, discs }))
    }
}

/// Whether the lens adds glare: not in mirrored views.
fn has_glare(view: &View) -> bool {
    view.mirror.is_none()
}

struct PreparedLamps<'a> {
    view: &'a View,
    discs: Vec<Disc>,
}

impl PreparedLamps<'_> {
    fn discs_in(&self, slice: &DepthInterval) -> impl Iterator<Item = &Disc> {
        let slice = *slice;
        self.discs.iter().filter(move |disc| slice.contains(disc.depth))
    }

    /// The lamps whose glare belongs to a depth interval: all, in the nearest one.
    fn glare_sources(&self, slice: &DepthInterval) -> &[Disc] {
        if has_glare(self.view) && slice.contains(0.0) { &self.discs } else { &[] }
    }

    /// Adds the glare of a lamp where the plate does not hide the lamp.
    fn add_glare(&self, disc: &Disc, strip: &mut Strip) {
        let rect = disc.glare_bounds(self.view).intersection(&strip.rect);
        let focal = self.view.camera.focal_pixels;
        let glare = Glare::new(disc.radius / focal);
        for y in rect.y..rect.bottom() {
            for x in rect.x..rect.right() {
                let index = (y - strip.rect.y) * strip.rect.width + x - strip.rect.x;
                let distance = (DVec2::new(x as f64, y as f64) + 0.5 - disc.center).length();
                let weight = glare.at(distance / focal) as f32;
                if weight > 0.0 && strip.visible(index, disc.depth as f32) {
                    strip.emit(index, disc.illuminance.map(|value| value * weight), f32::INFINITY);
                }
            }
        }
    }
}

impl Prepared for PreparedLamps<'_> {
    fn bounds(&self, slice: &DepthInterval) -> Rect {
        let discs = self.discs_in(slice).map(|disc| disc.bounds(self.view));
        let glares = self.glare_sources(slice).iter().map(|disc| disc.glare_bounds(self.view));
        discs.chain(glares).fold(Rect::default(), |all, rect| all.union(&rect))
    }

    fn draw(&self, slice: &DepthInterval, strip: &mut Strip) {
        self.glare_sources(slice).iter().for_each(|disc| self.add_glare(disc, strip));
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

#[cfg(test)]
mod tests {
    use bansho_base::{
        camera::CameraParameters,
        host::observer::Unobserved,
        math::DVec3,
        world::wind::{Wind, WindParameters},
    };

    use super::*;

    /// The picture's sum of luminance times solid angle, times distance squared: the intensity that the camera sees.
    fn intensity_seen(distance: f64, radius: f64, emitter: Emitter) -> f64 {
        let lamp = Lamp { light: Light { emitter, intensity: [50.0; 3] }, radius };
        let lamps = Lamps::new(move |_| vec![lamp]);
        let camera = CameraParameters {
            position: [0.0, 0.0, distance].into(),
            target: [0.0; 3].into(),
            ..CameraParameters::default()
        };
        let view = View::new(camera, Shutter { open: 0.0, close: 0.0 }, 0.0, [64, 64], 0);
        let wind = Wind::new(WindParameters::default(), 1, None);
        let surroundings = Surroundings::from_wind(&wind);
        let mut strip = Strip::default();
        strip.reset(Rect::from_size(64, 64), None, 0);
        lamps.prepare(&view, &surroundings, &Unobserved).unwrap().draw(&DepthInterval::ALL, &mut strip);
        let pixel = distance / view.camera.focal_pixels;
        strip.radiance[1].iter().map(|value| f64::from(*value)).sum::<f64>() * pixel * pixel
    }

    #[test]
    fn a_lamp_sends_its_intensity_to_the_camera_however_small_it_looks() {
        let point = Emitter::Point { position: DVec3::ZERO, radius: 0.1 };
        for (distance, radius) in [(5.0, 0.5), (20.0, 0.1), (500.0, 0.1)] {
            let seen = intensity_seen(distance, radius, point);
            assert!((seen / 50.0 - 1.0).abs() < 0.02, "{seen} cd at {distance} m");
        }
    }

    #[test]
    fn glare_is_its_share_of_the_light_and_falls_with_the_cube_of_the_angle() {
        let (steps, end) = (200_000, GLARE_ANGLES[1]);
        for radius in [0.0, 0.01, 0.05] {
            let glare = Glare::new(radius);
            let ring = |i: u32| {
                let angle = end * (f64::from(i) + 0.5) / f64::from(steps);
                glare.at(angle) * 2.0 * std::f64::consts::PI * angle * end / f64::from(steps)
            };
            let whole: f64 = (0..steps).map(ring).sum();
            assert!((whole / GLARE_FRACTION - 1.0).abs() < 1e-4, "{radius}: {whole}");
            assert_eq!(glare.at(end), 0.0);
        }
        let small = Glare::new(0.0);
        let fade = |angle: f64| {
            let left = 1.0 - angle * angle / Glare::END;
            left * left
        };
        let fall = small.at(0.02) / fade(0.02) / (small.at(0.01) / fade(0.01));
        assert!((fall - 0.125).abs() < 0.01, "{fall}");
    }

    #[test]
    fn a_spot_shines_into_its_cone_and_is_just_seen_from_elsewhere() {
        let spot = |axis| Emitter::Spot { position: DVec3::ZERO, axis, cos_inner: 0.9, cos_outer: 0.8 };
        assert!(intensity_seen(5.0, 0.2, spot(DVec3::Z)) > 40.0);
        assert!((intensity_seen(5.0, 0.2, spot(-DVec3::Z)) - 50.0 * STRAY_LIGHT).abs() < 0.02);
    }
}
