//! Shading of the ground, pixel by pixel.

use std::f32::consts::PI;

use bansho_base::{
    color::{acescg_from_srgb, luminance},
    image::Rect,
    math::{self, DVec2, DVec3, MulAdd},
    phenomenon::{
        Prepared,
        strip::{DepthInterval, Strip, View},
        surroundings::{Backdrop, IncidentLight, Light, Occluder, Surroundings},
    },
};

use super::{
    model::LakeFrame,
    parameters::{GroundKind, GroundParameters},
    surface::{Surface, SurfaceSample},
    waves::WaveSlope,
    wet_reflection::{ShadowedLight, fresnel, glossy_reflection},
};
use crate::shadow::{sky_visibility, visibility};

/// Depth at which the ground ends, m: in front of the sky, behind all other phenomena.
pub(super) const HORIZON: f64 = 1e6;
/// Fraction of its albedo that soaked ground loses, by total internal reflection in the water (Lekner & Dorf 1988).
const WET_DARKENING: f64 = 0.55;
/// Fraction that puddles lose beyond that: they are deeper, and often turbid.
const PUDDLE_DARKENING: f64 = 0.4;
/// Radius of lamps for the width of half shadows, m; and the angular radius of sun and moon.
const SOURCE_RADIUS: f64 = 0.08;
const SUN_RADIUS: f64 = 0.004_65;
/// Albedo of deep water.
const WATER_ALBEDO: f32 = 0.02;

/// Albedo of wet ground relative to dry ground.
fn wet_albedo_factor(wetness: f64) -> f64 {
    1.0 - WET_DARKENING * wetness
}

impl GroundParameters {
    /// Luminance of the diffuse albedo at time `t`, with the darkening by wetness.
    #[must_use]
    pub fn reflectance(&self, t: f64) -> f64 {
        match self.kind {
            GroundKind::Water => f64::from(WATER_ALBEDO),
            GroundKind::Land | GroundKind::Plate => {
                let dry = luminance(acescg_from_srgb(self.color.map(|value| value as f32)));
                f64::from(dry) * wet_albedo_factor(self.wetness.at(t))
            }
        }
    }
}

/// The lights that arrive at a point of the ground. Shadows in lights that contribute next to nothing there are left out.
fn shadowed_lights(lights: &[Light], casters: &[Occluder], point: DVec3) -> Vec<ShadowedLight> {
    /// Fraction of all light.
    const NEGLIGIBLE: f32 = 1e-3;
    let arriving: Vec<IncidentLight> = lights.iter().map(|light| light.incident_light(point)).collect();
    let whole: f32 = arriving.iter().map(|light| luminance(light.illuminance)).sum();
    let shadowed = |IncidentLight { illuminance, toward, distance }: IncidentLight| {
        if casters.is_empty() || toward.y <= 0.0 || luminance(illuminance) <= NEGLIGIBLE * whole {
            return (illuminance, toward);
        }
        let reach = if distance > 0.0 { distance - SOURCE_RADIUS } else { f64::INFINITY };
        let size = if distance > 0.0 { SOURCE_RADIUS / distance } else { SUN_RADIUS };
        let visible = visibility(casters, point, toward, reach, size) as f32;
        (illuminance.map(|value| value * visible), toward)
    };
    arriving.into_iter().map(shadowed).collect()
}

/// One frame of the ground.
pub(super) struct PreparedGround<'a> {
    pub(super) parameters: &'a GroundParameters,
    pub(super) surface: &'a Surface,
    pub(super) view: &'a View,
    pub(super) surroundings: &'a Surroundings<'a>,
    pub(super) wetness: f64,
    pub(super) lake: Option<LakeFrame>,
    /// The plate and its sky, blurred as a rough film of water reflects them.
    pub(super) backdrop: Option<Backdrop>,
}

/// Intersection of a pixel's line of sight with the ground.
struct Hit {
    pixel: DVec2,
    point: DVec3,
    depth: f64,
    /// Cosine of the angle between the line of sight and the normal.
    cos: f64,
    /// Length of ground that the pixel covers, m: the geometric mean of along and across the line of sight.
    footprint: f64,
    /// Fraction of the pixel below the horizon.
    coverage: f64,
}

impl PreparedGround<'_> {
    fn hit(&self, pixel: DVec2) -> Option<Hit> {
        let camera = &self.view.camera;
        let direction = camera.direction(pixel)?;
        let length = direction.length();
        let cos = -direction.y / length;
        // A pixel subtends about 1 / focal radians.
        let coverage = (cos * camera.focal_pixels + 0.5).clamp(0.0, 1.0);
        let camera_height = camera.position.y - self.parameters.height;
        if coverage <= 0.0 || camera_height <= 0.0 {
            return None;
        }
        let cos = cos.max(0.5 / camera.focal_pixels);
        let distance = (camera_height / cos).min(HORIZON * 0.5);
        let depth = distance / length;
        let footprint = distance / (camera.focal_pixels * math::sqrt(cos.max(1e-6)));
        Some(Hit { pixel, point: camera.position + direction * depth, depth, cos, footprint, coverage })
    }

    /// Lambertian reflection: `albedo / pi` times the illuminance.
    fn diffuse(&self, hit: &Hit, sample: &SurfaceSample, lights: &[ShadowedLight]) -> [f32; 3] {
        let plate = self.parameters.kind == GroundKind::Plate;
        // The plate already contains the light of its own sky.
        let casters = &self.surroundings.others.shadow_casters;
        let mut illuminance = if plate { [0.0; 3] } else { self.surroundings.sky.horizontal_illuminance() };
        if !casters.is_empty() {
            let open = sky_visibility(casters, hit.point) as f32;
            illuminance = illuminance.map(|value| value * open);
        }
        for (each, toward) in lights {
            let facing = toward.y.max(0.0) as f32;
            (0..3).for_each(|c| illuminance[c] = each[c].fma(facing, illuminance[c]));
        }
        let albedo = match self.parameters.kind {
            GroundKind::Water => [WATER_ALBEDO; 3],
            GroundKind::Plate => sample.albedo.map(|value| value * self.wet_albedo_factor()),
            GroundKind::Land => {
                let puddle_factor = 1.0 - PUDDLE_DARKENING * self.wetness * sample.puddle;
                sample.albedo.map(|value| value * self.wet_albedo_factor() * puddle_factor as f32)
            }
        };
        [0, 1, 2].map(|c| illuminance[c] * albedo[c] / PI)
    }

    /// Albedo of the ground relative to dry ground.
    fn wet_albedo_factor(&self) -> f32 {
        wet_albedo_factor(self.wetness) as f32
    }

    /// Radiance that water on the ground reflects.
    fn specular(&self, hit: &Hit, sample: &SurfaceSample, lights: &[ShadowedLight]) -> [f32; 3] {
        if self.wetness <= 0.0 {
            return [0.0; 3];
        }
        match &self.lake {
            Some(lake) => self.lake_specular(hit, lake),
            None => self.film_reflection(hit, sample, lights),
        }
    }

    /// Wet ground: sharp reflections in puddles, glossy ones between them.
    fn film_reflection(&self, hit: &Hit, sample: &SurfaceSample, lights: &[ShadowedLight]) -> [f32; 3] {
        let viewer = -(hit.point - self.view.camera.position).normalize_or_zero();
        let position = DVec2::new(hit.point.x, hit.point.z);
        let microfacets = self.surface.microfacets(position, hit.footprint, sample.film);
        let backdrop = self.backdrop.as_ref().map(|Backdrop { image, pixel_size: side }| {
            let [red, green, blue, _] = image.sample_bilinear(hit.pixel / *side as f64);
            [red, green, blue]
        });
        let blurred_reflection =
            glossy_reflection(self.surroundings, lights, backdrop, hit.point, viewer, &microfacets);
        let mirror_image = self.surroundings.reflection.map_or([0.0; 4], |image| image.sample_bilinear(hit.pixel));
        let (puddle, fresnel, wetness) = (sample.puddle as f32, fresnel(hit.cos) as f32, self.wetness as f32);
        [0, 1, 2].map(|c| wetness * (puddle * fresnel).fma(mirror_image[c], (1.0 - puddle) * blurred_reflection[c]))
    }

    fn lake_specular(&self, hit: &Hit, lake: &LakeFrame) -> [f32; 3] {
        let slope = lake.waves.slope(DVec2::new(hit.point.x, hit.point.z), hit.footprint);
        let mirror_image = self
            .surroundings
            .reflection
            .map_or([0.0; 4], |image| image.sample_bilinear(self.reflected_pixel(hit, slope)));
        let blurred_reflection = lake.blurred_reflection.sample_bilinear(hit.pixel);
        let (unresolved, fresnel) = (slope.unresolved as f32, fresnel(hit.cos) as f32);
        [0, 1, 2].map(|c| fresnel * unresolved.fma(blurred_reflection[c], (1.0 - unresolved) * mirror_image[c]))
    }

    /// The pixel of the mirrored picture that a tilted wave shows, for distant objects: the reflection turns by twice
    /// the tilt.
    fn reflected_pixel(&self, hit: &Hit, slope: WaveSlope) -> DVec2 {
        let camera = &self.view.camera;
        let view_direction = (hit.point - camera.position).normalize_or_zero();
        let normal = DVec3::new(-slope.resolved.x, 1.0, -slope.resolved.y).normalize();
        let reflected = view_direction - 2.0 * view_direction.dot(normal) * normal;
        let below = DVec3::new(reflected.x, -reflected.y.abs(), reflected.z);
        camera.project(camera.position + below * HORIZON).map_or(hit.pixel, |position| position.pixel)
    }

    fn radiance(&self, hit: &Hit) -> [f32; 3] {
        let sample = self.surface.at(DVec2::new(hit.point.x, hit.point.z), hit.footprint);
        let others = &self.surroundings.others;
        let lights = shadowed_lights(&others.lights, &others.shadow_casters, hit.point);
        let (diffuse, specular) = (self.diffuse(hit, &sample, &lights), self.specular(hit, &sample, &lights));
        [0, 1, 2].map(|c| hit.coverage as f32 * (diffuse[c] + specular[c]))
    }

    /// Whether the plate at a pixel, with this depth, shows ground: within the tolerance of the height, and within what
    /// a pixel resolves at grazing angles.
    fn is_ground(&self, hit: &Hit, plate: f64) -> bool {
        let camera_height = self.view.camera.position.y - self.parameters.height;
        let above = camera_height * (1.0 - plate / hit.depth);
        above.abs() < self.parameters.mirror().tolerance_at(plate, self.view.camera.focal_pixels)
    }

    /// The transmittance of the sample; `None` if it is hidden.
    fn transmittance(&self, hit: &Hit, strip: &Strip, index: usize) -> Option<f32> {
        if self.parameters.kind == GroundKind::Plate {
            let is_ground = !strip.has_plate() || self.is_ground(hit, f64::from(strip.plate_depth(index)));
            return is_ground.then_some(self.wet_albedo_factor());
        }
        strip.visible(index, hit.depth as f32).then_some(1.0 - hit.coverage as f32)
    }
}

impl Prepared for PreparedGround<'_> {
    fn bounds(&self, slice: &DepthInterval) -> Rect {
        let all = DepthInterval { near: 0.0, far: HORIZON };
        if slice.overlaps(&all) { Rect::from_size(self.view.size[0], self.view.size[1]) } else { Rect::default() }
    }

    fn draw(&self, slice: &DepthInterval, strip: &mut Strip) {
        let rect = strip.rect;
        for index in 0..strip.len() {
            let pixel = DVec2::new((rect.x + index % rect.width) as f64, (rect.y + index / rect.width) as f64) + 0.5;
            let Some(hit) = self.hit(pixel) else { continue };
            if !slice.contains(hit.depth) {
                continue;
            }
            if let Some(transmittance) = self.transmittance(&hit, strip, index) {
                strip.add_behind(index, self.radiance(&hit), [transmittance; 3], hit.depth as f32);
            }
        }
    }
}
