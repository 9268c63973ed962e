//! The light of an effect as a point light of Bevy.

use std::f32::consts::PI;

use bansho::base::{
    math::DVec3,
    phenomenon::surroundings::{Emitter, Light},
};
use bevy::prelude::*;

/// Illuminance below which a light is cut off, lux.
const LEAST_LUX: f32 = 0.25;
/// Largest range of a light, m.
const MAX_RANGE: f32 = 100.0;

/// A point light relative to the entity of its effect, in world axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PlacedLight {
    /// Position, m.
    pub(crate) position: Vec3,
    /// Linear sRGB with 1 as the largest component.
    pub(crate) color: [f32; 3],
    /// Factor of the color, candela.
    pub(crate) candela: f32,
    /// Radius of the emitter, m.
    pub(crate) radius: f32,
}

impl PlacedLight {
    /// All point lights of an effect as one; `None` if none shines.
    pub(crate) fn merged(lights: &[Light]) -> Option<Self> {
        let light = Light::merge_points(lights)?;
        let Emitter::Point { position, radius } = light.emitter else { return None };
        let srgb = light.srgb();
        Some(Self { position: vec3(position), color: srgb.color, candela: srgb.intensity, radius: radius as f32 })
    }

    /// Sets what the effect determines. Bevy's intensity is the luminous power in lumens, 4 pi times the luminous intensity in candela.
    pub(crate) fn set(&self, light: &mut PointLight) {
        light.color = Color::linear_rgb(self.color[0], self.color[1], self.color[2]);
        light.intensity = 4.0 * PI * self.candela;
        light.radius = self.radius;
        light.range = (self.candela / LEAST_LUX).sqrt().min(MAX_RANGE);
    }
}

fn vec3(point: DVec3) -> Vec3 {
    Vec3::new(point.x as f32, point.y as f32, point.z as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn candela_become_lumens() {
        let at =
            |x: f64, intensity| Light { emitter: Emitter::Point { position: DVec3::X * x, radius: 0.1 }, intensity };
        let white = bansho::base::color::acescg_from_srgb([100.0; 3]);
        let merged = PlacedLight::merged(&[at(0.0, white), at(1.0, white)]).unwrap();
        let mut light = PointLight { shadow_maps_enabled: true, ..default() };
        merged.set(&mut light);
        assert!((light.intensity - 4.0 * PI * 200.0).abs() < 0.1, "{}", light.intensity);
        assert!((merged.position - Vec3::X * 0.5).length() < 1e-6 && light.shadow_maps_enabled);
        assert_eq!(PlacedLight::merged(&[]), None);
    }
}
