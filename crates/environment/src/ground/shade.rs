//! The ground's light, pixel by pixel.

use std::f32::consts::PI;

use bansho_base::{
    image::Rect,
    math::{self, DVec2, DVec3, MulAdd},
    phenomenon::{
        Prepared,
        strip::{DepthInterval, Strip, View},
        surroundings::{Backdrop, Surroundings},
    },
};

use super::{
    Lake,
    parameters::{GroundKind, GroundParameters},
    surface::{Patch, Surface, fresnel},
    waves::Slope,
    wet_reflection::gloss,
};

/// Depth at which the ground ends, m: nearer than the sky, farther than all else.
pub(super) const HORIZON: f64 = 1e6;
/// Share of its light that soaked ground loses, since water keeps light in (Lekner & Dorf 1988).
const WET_DARKENING: f64 = 0.55;
/// Share of its light that soaked ground loses beyond that where water stands on it, which is deeper and often turbid.
const PUDDLE_DARKENING: f64 = 0.4;
/// Albedo of deep water.
pub(super) const WATER_ALBEDO: f32 = 0.02;

/// Share of its dry light that ground of this wetness keeps.
pub(super) fn darkening(wetness: f64) -> f64 {
    1.0 - WET_DARKENING * wetness
}

/// One frame of the ground.
pub(super) struct PreparedGround<'a> {
    pub(super) parameters: &'a GroundParameters,
    pub(super) surface: &'a Surface,
    pub(super) view: &'a View,
    pub(super) surroundings: &'a Surroundings<'a>,
    pub(super) wetness: f64,
    pub(super) lake: Option<Lake>,
    /// What stands behind all, as a film too rough for more mirrors it: the plate and its sky.
    pub(super) backdrop: Option<Backdrop>,
}

/// Where a pixel meets the ground.
struct Hit {
    pixel: DVec2,
    point: DVec3,
    depth: f64,
    /// Cosine between line of sight and normal.
    cos: f64,
    /// Length of ground that the pixel covers, the mean of along and across the line of sight, m.
    footprint: f64,
    /// Share of the pixel below the horizon.
    coverage: f64,
}

impl PreparedGround<'_> {
    fn hit(&self, pixel: DVec2) -> Option<Hit> {
        let camera = &self.view.camera;
        let direction = camera.direction(pixel)?;
        let length = direction.length();
        let cos = -direction.y / length;
        // A pixel spans about 1 / focal radians.
        let coverage = (cos * camera.focal_pixels + 0.5).clamp(0.0, 1.0);
        let drop = camera.position.y - self.parameters.height;
        if coverage <= 0.0 || drop <= 0.0 {
            return None;
        }
        let cos = cos.max(0.5 / camera.focal_pixels);
        let distance = (drop / cos).min(HORIZON * 0.5);
        let depth = distance / length;
        let footprint = distance / (camera.focal_pixels * math::sqrt(cos.max(1e-6)));
        Some(Hit { pixel, point: camera.position + direction * depth, depth, cos, footprint, coverage })
    }

    /// Light thrown back evenly to all sides: `albedo / pi` of the illuminance.
    fn diffuse(&self, hit: &Hit, patch: &Patch) -> [f32; 3] {
        let plate = self.parameters.kind == GroundKind::Plate;
        // A plate was lit by its own sky.
        let mut illuminance = if plate { [0.0; 3] } else { self.surroundings.sky.horizontal_illuminance() };
        for light in &self.surroundings.others.lights {
            let (each, toward) = light.illuminance(hit.point);
            let facing = toward.y.max(0.0) as f32;
            (0..3).for_each(|c| illuminance[c] = each[c].fma(facing, illuminance[c]));
        }
        let albedo = match self.parameters.kind {
            GroundKind::Water => [WATER_ALBEDO; 3],
            GroundKind::Plate => patch.albedo.map(|value| value * self.darkening()),
            GroundKind::Land => {
                let standing = 1.0 - PUDDLE_DARKENING * self.wetness * patch.puddle;
                patch.albedo.map(|value| value * self.darkening() * standing as f32)
            }
        };
        [0, 1, 2].map(|c| illuminance[c] * albedo[c] / PI)
    }

    /// Share of its dry light that the wet ground keeps.
    fn darkening(&self) -> f32 {
        darkening(self.wetness) as f32
    }

    /// Light that the water on the ground mirrors.
    fn mirrored(&self, hit: &Hit, patch: &Patch) -> [f32; 3] {
        if self.wetness <= 0.0 {
            return [0.0; 3];
        }
        match &self.lake {
            Some(lake) => self.seen_in_lake(hit, lake),
            None => self.seen_in_film(hit, patch),
        }
    }

    /// A wet ground mirrors sharply in its puddles, and in streaks between them.
    fn seen_in_film(&self, hit: &Hit, patch: &Patch) -> [f32; 3] {
        let viewer = -(hit.point - self.view.camera.position).normalize_or_zero();
        let place = DVec2::new(hit.point.x, hit.point.z);
        let facets = self.surface.facets(place, hit.footprint, patch.film);
        let backdrop = self.backdrop.as_ref().map(|Backdrop { image, side }| {
            let [red, green, blue, _] = image.between(hit.pixel / *side as f64);
            [red, green, blue]
        });
        let rough = gloss(self.surroundings, backdrop, hit.point, viewer, &facets);
        let still = self.surroundings.reflection.map_or([0.0; 4], |image| image.between(hit.pixel));
        let (puddle, fresnel, wetness) = (patch.puddle as f32, fresnel(hit.cos) as f32, self.wetness as f32);
        [0, 1, 2].map(|c| wetness * (puddle * fresnel).fma(still[c], (1.0 - puddle) * rough[c]))
    }

    fn seen_in_lake(&self, hit: &Hit, lake: &Lake) -> [f32; 3] {
        let slope = lake.waves.slope(DVec2::new(hit.point.x, hit.point.z), hit.footprint);
        let still = self.surroundings.reflection.map_or([0.0; 4], |image| image.between(self.seen_in_wave(hit, slope)));
        let rough = lake.rough.between(hit.pixel);
        let (lost, fresnel) = (slope.unresolved as f32, fresnel(hit.cos) as f32);
        [0, 1, 2].map(|c| fresnel * lost.fma(rough[c], (1.0 - lost) * still[c]))
    }

    /// The pixel of the mirror's picture that a tilted wave shows: what lies far away moves by twice the tilt.
    fn seen_in_wave(&self, hit: &Hit, slope: Slope) -> DVec2 {
        let camera = &self.view.camera;
        let sight = (hit.point - camera.position).normalize_or_zero();
        let normal = DVec3::new(-slope.resolved.x, 1.0, -slope.resolved.y).normalize();
        let mirrored = sight - 2.0 * sight.dot(normal) * normal;
        let below = DVec3::new(mirrored.x, -mirrored.y.abs(), mirrored.z);
        camera.project(camera.position + below * HORIZON).map_or(hit.pixel, |place| place.pixel)
    }

    fn radiance(&self, hit: &Hit) -> [f32; 3] {
        let patch = self.surface.at(DVec2::new(hit.point.x, hit.point.z), hit.footprint);
        let (diffuse, mirrored) = (self.diffuse(hit, &patch), self.mirrored(hit, &patch));
        [0, 1, 2].map(|c| hit.coverage as f32 * (diffuse[c] + mirrored[c]))
    }

    /// Whether what the plate shows at a pixel, at this depth, is ground: no higher than the tolerance, nor than a pixel that looks along it
    /// can tell.
    fn is_ground(&self, hit: &Hit, plate: f64) -> bool {
        let drop = self.view.camera.position.y - self.parameters.height;
        let above = drop * (1.0 - plate / hit.depth);
        above.abs() < self.parameters.level().tolerance_at(plate, self.view.camera.focal_pixels)
    }

    /// Whether the sample is to be drawn, and what it lets through.
    fn through(&self, hit: &Hit, strip: &Strip, index: usize) -> Option<f32> {
        if self.parameters.kind == GroundKind::Plate {
            let here = !strip.has_plate() || self.is_ground(hit, f64::from(strip.plate_depth(index)));
            return here.then_some(self.darkening());
        }
        strip.visible(index, hit.depth as f32).then_some(1.0 - hit.coverage as f32)
    }
}

impl Prepared for PreparedGround<'_> {
    fn bounds(&self, slice: &DepthInterval) -> Rect {
        let all = DepthInterval { near: 0.0, far: HORIZON };
        if slice.overlaps(&all) { Rect::of_size(self.view.size[0], self.view.size[1]) } else { Rect::default() }
    }

    fn draw(&self, slice: &DepthInterval, strip: &mut Strip) {
        let rect = strip.rect;
        for index in 0..strip.len() {
            let pixel = DVec2::new((rect.x + index % rect.width) as f64, (rect.y + index / rect.width) as f64) + 0.5;
            let Some(hit) = self.hit(pixel) else { continue };
            if !slice.contains(hit.depth) {
                continue;
            }
            if let Some(through) = self.through(&hit, strip, index) {
                strip.add_behind(index, self.radiance(&hit), [through; 3], hit.depth as f32);
            }
        }
    }
}
