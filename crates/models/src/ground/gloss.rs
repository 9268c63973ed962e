//! Light that a rough film of water mirrors: the long streaks of lamps on a wet road.

use std::f64::consts::PI;

use bansho_base::{
    math::{self, DVec3},
    surroundings::{Emitter, Surroundings},
};

use super::surface::fresnel;

/// Radiance from a film of water on level ground at `point`, seen from the unit vector `viewer`, whose facets have Gaussian slopes with an r.m.s. of
/// `slope` along each axis (Cook & Torrance 1982, with Beckmann's distribution).
pub(super) fn gloss(surroundings: &Surroundings, point: DVec3, viewer: DVec3, slope: f64) -> [f32; 3] {
    let mirrored = DVec3::new(-viewer.x, viewer.y, -viewer.z);
    let mut radiance = surroundings.sky.radiance(mirrored).map(|value| value * fresnel(viewer.y) as f32);
    for light in &surroundings.others.lights {
        let (illuminance, toward) = light.illuminance(point);
        // The facets of a wide light lie as much further apart as the light is wide.
        let width = match light.emitter {
            Emitter::Point { position, radius } => radius / (position - point).length().max(radius),
            Emitter::Directional { .. } | Emitter::Spot { .. } => 0.0,
        };
        let share = lobe(toward, viewer, math::hypot(slope, 0.25 * width)) as f32;
        (0..3).for_each(|c| radiance[c] = illuminance[c].mul_add(share, radiance[c]));
    }
    radiance
}

/// Radiance toward `viewer` for one lux from `light` on a plane that faces it: `F D G / (4 cos_viewer)`.
fn lobe(light: DVec3, viewer: DVec3, slope: f64) -> f64 {
    let Some(half) = (light + viewer).try_normalize() else { return 0.0 };
    if light.y <= 0.0 || viewer.y <= 0.0 {
        return 0.0;
    }
    let roughness = 2.0 * slope.max(1e-3) * slope.max(1e-3);
    let cos_squared = half.y * half.y;
    let facets =
        math::exp((cos_squared - 1.0) / (cos_squared * roughness)) / (PI * roughness * cos_squared * cos_squared);
    let along = viewer.dot(half).max(1e-6);
    let shadow = (2.0 * half.y * viewer.y.min(light.y) / along).min(1.0);
    fresnel(along) * facets * shadow / (4.0 * viewer.y.max(1e-3))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Share of a lux that is mirrored into the whole hemisphere, over what Fresnel says of a level mirror.
    fn mirrored_share(light: DVec3, slope: f64) -> f64 {
        let (rings, turns) = (400, 400);
        let mut sum = 0.0;
        for ring in 0..rings {
            // Equal steps of the cosine are equal solid angles.
            let y = (f64::from(ring) + 0.5) / f64::from(rings);
            let across = math::sqrt(1.0 - y * y);
            for turn in 0..turns {
                let (sin, cos) = math::sin_cos(f64::from(turn) / f64::from(turns) * 2.0 * PI);
                sum += lobe(light, DVec3::new(across * cos, y, across * sin), slope) * y;
            }
        }
        sum * 2.0 * PI / f64::from(rings * turns) / (light.y * fresnel(light.y))
    }

    #[test]
    fn a_little_rough_water_mirrors_as_much_as_calm_water() {
        let light = DVec3::new(0.6, 0.8, 0.0);
        for slope in [0.03, 0.08] {
            let share = mirrored_share(light, slope);
            assert!((share - 1.0).abs() < 0.06, "slope {slope}: {share}");
        }
    }

    #[test]
    fn a_low_lamp_is_drawn_out_toward_the_viewer_more_than_sideways() {
        let viewer = |turn: f64, rise: f64| {
            let (sin, cos) = math::sin_cos(turn);
            DVec3::new(-cos, rise, sin).normalize()
        };
        let light = DVec3::new(1.0, 0.2, 0.0).normalize();
        let at = |turn, rise| lobe(light, viewer(turn, rise), 0.06);
        let straight = at(0.0, 0.2);
        assert!(at(0.0, 0.3) > 0.3 * straight, "0.1 radians up");
        assert!(at(0.1, 0.2) < 0.3 * straight, "0.1 radians sideways");
    }
}
