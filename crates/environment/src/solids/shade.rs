//! Radiance of a surface in the light of lamps, fires, the sky and the ground around it.

use std::f64::consts::PI;

use bansho_base::{
    math::{self, DVec3},
    phenomenon::surroundings::{IncidentLight, Light, Surroundings},
};

use super::{
    Material,
    pose::{Pose, SurfacePoint},
};
use crate::ground::height_of_level_ground;

/// Albedo of the ground for the light that it reflects onto the obstacles: wet asphalt or soil.
const GROUND_ALBEDO: f64 = 0.07;

/// What lights the obstacles.
pub(super) struct Shading<'a> {
    surroundings: &'a Surroundings<'a>,
    /// Height of the ground, m.
    ground: Option<f64>,
}

/// BRDF of a GGX surface: `F D G / (4 cos cos)`, with Schlick's F and Hammon's approximation of Smith's G.
fn specular_brdf(material: &Material, normal: DVec3, viewer: DVec3, toward: DVec3) -> f64 {
    let half = (viewer + toward).normalize_or(normal);
    let [to_light, to_viewer] = [toward, viewer].map(|direction| normal.dot(direction).max(1e-4));
    let square = material.roughness * material.roughness;
    let across = normal.dot(half).clamp(0.0, 1.0);
    let spread = across * across * (square - 1.0) + 1.0;
    let distribution = square / (PI * spread * spread);
    let visibility = 0.5 / math::lerp(2.0 * to_light * to_viewer, to_light + to_viewer, material.roughness);
    fresnel(material.reflectance, viewer.dot(half)) * distribution * visibility
}

/// Fresnel reflectance at the cosine of the angle of incidence (Schlick 1994).
fn fresnel(reflectance: f64, cos: f64) -> f64 {
    let rest = 1.0 - cos.clamp(0.0, 1.0);
    reflectance + (1.0 - reflectance) * rest * rest * rest * rest * rest
}

impl<'a> Shading<'a> {
    pub(super) fn new(surroundings: &'a Surroundings<'a>) -> Self {
        Self { surroundings, ground: height_of_level_ground(&surroundings.others.occluders) }
    }

    /// Whether lights move, so that what they light differs from pose to pose.
    pub(super) fn lights_move(&self) -> bool {
        !self.surroundings.light_parts.is_empty()
    }

    /// Radiance of a surface toward the camera of a pose, ACEScg, cd/m^2.
    pub(super) fn radiance(&self, surface: &SurfacePoint, pose: &Pose) -> [f32; 3] {
        let viewer = (pose.camera.position - surface.point).normalize_or(surface.normal);
        // Interpolated normals may face away at the silhouette.
        let facing = surface.normal.dot(viewer).min(0.0);
        let normal = (surface.normal - viewer * facing).normalize_or(surface.normal);
        let surface = SurfacePoint { normal, ..*surface };
        let (direct, ambient) = (self.lights(&surface, viewer, pose), self.ambient(&surface, viewer));
        [0, 1, 2].map(|c| (direct[c] + ambient[c]) as f32)
    }

    /// Light of lamps and fires: diffuse and glossy reflection.
    fn lights(&self, surface: &SurfacePoint, viewer: DVec3, pose: &Pose) -> [f64; 3] {
        let material = &surface.solid.material;
        let mut radiance = [0.0; 3];
        let all = &self.surroundings.others.lights;
        for light in pose.fraction.map_or(all.as_slice(), |fraction| self.surroundings.lights_at(fraction)) {
            let (illuminance, toward, distance) = self.arriving(light, surface.point);
            let cos = surface.normal.dot(toward);
            if cos <= 0.0 || illuminance == [0.0; 3] {
                continue;
            }
            let reach = if distance > 0.0 { distance } else { f64::INFINITY };
            if pose.is_shadowed(surface.point, toward, reach) {
                continue;
            }
            let glossy = specular_brdf(material, surface.normal, viewer, toward);
            for c in 0..3 {
                radiance[c] += illuminance[c] * cos * (f64::from(material.albedo[c]) / PI + glossy);
            }
        }
        radiance
    }

    /// Illuminance of a light after the extinction by the air between (lux), the direction toward it, and its distance.
    fn arriving(&self, light: &Light, point: DVec3) -> ([f64; 3], DVec3, f64) {
        let IncidentLight { illuminance, toward, distance } = light.incident_light(point);
        let transmittance = math::exp(-self.surroundings.others.extinction * distance);
        (illuminance.map(|value| f64::from(value) * transmittance), toward, distance)
    }

    /// Light of the sky and of the ground: diffuse from both hemispheres, and the mirror image in a clear coat.
    fn ambient(&self, surface: &SurfacePoint, viewer: DVec3) -> [f64; 3] {
        let SurfacePoint { point, normal, solid, .. } = *surface;
        let sky = self.surroundings.sky.horizontal_illuminance().map(f64::from);
        let up = 0.5 + 0.5 * normal.y;
        // The ground that a surface sees is about as far away as the surface is high.
        let ground = self.ground_radiance(point + DVec3::new(normal.x, 0.0, normal.z) * 1.5, sky);
        let mirrored = 2.0 * normal.dot(viewer) * normal - viewer;
        let mirrored_radiance = if mirrored.y >= 0.0 {
            self.surroundings.sky.radiance(mirrored).map(f64::from)
        } else {
            let down = self.ground.map_or(1.0, |height| (point.y - height).max(0.0)) / -mirrored.y.min(-0.02);
            self.ground_radiance(point + mirrored * down, sky)
        };
        let material = &solid.material;
        let glossy = fresnel(material.reflectance, normal.dot(viewer)) * (1.0 - 0.7 * material.roughness);
        [0, 1, 2].map(|c| {
            let diffuse = f64::from(material.albedo[c]) * (up * sky[c] / PI + (1.0 - up) * ground[c]);
            diffuse + glossy * mirrored_radiance[c]
        })
    }

    /// Radiance of the ground below a point, without shadows.
    fn ground_radiance(&self, point: DVec3, sky: [f64; 3]) -> [f64; 3] {
        let Some(height) = self.ground else { return [0.0; 3] };
        let on_ground = DVec3::new(point.x, height, point.z);
        let mut illuminance = sky;
        for light in &self.surroundings.others.lights {
            let (arriving, toward, _) = self.arriving(light, on_ground);
            (0..3).for_each(|c| illuminance[c] += arriving[c] * toward.y.max(0.0));
        }
        illuminance.map(|value| value * GROUND_ALBEDO / PI)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rough_surface_reflects_no_more_than_arrives() {
        // The BRDF times the cosine, integrated over the hemisphere, is at most 1 for a perfect reflector; nearly 1 where it is smooth.
        for (roughness, least) in [(0.1, 0.85), (0.4, 0.6), (1.0, 0.3)] {
            for slant in [0.0, 0.5, 0.9] {
                let material = Material { albedo: [0.0; 3], roughness, reflectance: 1.0 };
                let viewer = DVec3::new(slant, 0.0, math::sqrt(1.0 - slant * slant));
                let (rings, mut sum) = (400, 0.0);
                for i in 0..rings {
                    for j in 0..2 * rings {
                        let cos = (f64::from(i) + 0.5) / f64::from(rings);
                        let (sin, angle) = (math::sqrt(1.0 - cos * cos), PI * (f64::from(j) + 0.5) / f64::from(rings));
                        let toward = DVec3::new(sin * math::cos(angle), sin * math::sin(angle), cos);
                        sum += specular_brdf(&material, DVec3::Z, viewer, toward) * cos;
                    }
                }
                let whole = sum * PI / f64::from(rings * rings);
                assert!(whole < 1.03 && whole > least, "{roughness} {slant}: {whole}");
            }
        }
        assert!((fresnel(0.04, 1.0) - 0.04).abs() < 1e-12 && (fresnel(0.04, 0.0) - 1.0).abs() < 1e-12);
    }
}
