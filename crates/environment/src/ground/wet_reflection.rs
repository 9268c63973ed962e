//! Glossy reflection in a rough film of water: the long highlights of lamps on a wet road.

use std::f64::consts::PI;

use bansho_base::{
    math::{self, DVec2, DVec3, MulAdd},
    phenomenon::surroundings::{Emitter, Surroundings},
};

use crate::shadow::visibility;

/// A light that arrives at a point of the ground, in the shadows of obstacles: illuminance on a plane that faces it, lux, and the unit vector toward it.
pub(super) type ShadowedLight = ([f32; 3], DVec3);

/// Distance that stands for infinity, m.
const FAR: f64 = 1e3;

/// Fresnel reflectance of water at the cosine of the angle of incidence (Schlick 1994, n = 1.333).
pub(super) fn fresnel(cos: f64) -> f64 {
    let grazing = 1.0 - cos.clamp(0.0, 1.0);
    let fifth = grazing * grazing * grazing * grazing * grazing;
    0.0204 + 0.9796 * fifth
}

/// Microfacets of wet ground. The slope distribution has longer tails than a Gaussian (Burley 2012: GTR with exponent
/// 3), so that highlights fade without an edge.
#[derive(Clone, Copy, Debug)]
pub(super) struct Microfacets {
    /// Mean slope: that of the bumps that are resolved.
    pub(super) tilt: DVec2,
    /// Slopes of the unresolved film and of the grains that protrude from it: r.m.s. along each axis of a Gaussian with
    /// the same median.
    pub(super) slopes: [f64; 2],
    /// Fraction of the film.
    pub(super) film: f64,
}

impl Microfacets {
    /// Radiance toward `viewer` for an illuminance of one lux from `light` on a plane that faces it: `F D G / (4
    /// cos_viewer)` (Cook & Torrance 1982). A light of angular diameter `width` widens the distribution.
    fn specular_lobe(&self, light: DVec3, viewer: DVec3, width: f64) -> f64 {
        let Some(half) = (light + viewer).try_normalize() else { return 0.0 };
        if light.y <= 0.0 || viewer.y <= 0.0 {
            return 0.0;
        }
        let slope = DVec2::new(-half.x, -half.z) / half.y - self.tilt;
        let square = slope.length_squared();
        let weight = |slope: f64| {
            gtr3_distribution_with_masking(square, math::hypot(slope.max(1e-3), 0.25 * width), light.y, viewer.y)
        };
        let microfacets = math::lerp(weight(self.slopes[1]), weight(self.slopes[0]), self.film);
        let cos_squared = half.y * half.y;
        fresnel(viewer.dot(half)) * microfacets / (4.0 * viewer.y.max(1e-3) * cos_squared * cos_squared)
    }

    /// Mean slope toward a viewer.
    fn mean_slope(&self) -> f64 {
        math::lerp(self.slopes[1], self.slopes[0], self.film)
    }
}

/// GTR distribution D of facets whose slope differs by the root of `square` from the mean, times Smith masking and
/// shadowing G for the cosines of light and viewer.
fn gtr3_distribution_with_masking(square: f64, slope: f64, light: f64, viewer: f64) -> f64 {
    /// Square of the scale at which the median slope equals that of a Gaussian: `2 ln 2 / (sqrt 2 - 1)`.
    const MEDIAN: f64 = 3.346_817;
    let width = MEDIAN * slope * slope;
    let tail = 1.0 + square / width;
    let masking = |cos: f64| 0.5 * (math::sqrt(1.0 + width * (1.0 / (cos * cos).max(1e-9) - 1.0)) - 1.0);
    2.0 / (PI * width * tail * tail * tail * (1.0 + masking(light) + masking(viewer)))
}

/// Radiance of a film of water on horizontal ground at `point`, toward the unit vector `viewer`. It reflects
/// `backdrop`, or else the sky, and `lights`: those of the surroundings as they arrive there.
pub(super) fn glossy_reflection(
    surroundings: &Surroundings,
    lights: &[ShadowedLight],
    backdrop: Option<[f32; 3]>,
    point: DVec3,
    viewer: DVec3,
    microfacets: &Microfacets,
) -> [f32; 3] {
    // At grazing angles the visible facets are those tilted toward the viewer: they reflect less, and from higher
    // directions.
    let rise = math::hypot(viewer.y, microfacets.mean_slope());
    let specular = DVec3::new(-viewer.x, rise, -viewer.z).normalize();
    let casters = &surroundings.others.shadow_casters;
    let backdrop_radiance = backdrop.unwrap_or_else(|| surroundings.sky.radiance(specular));
    let open = visibility(casters, point, specular, FAR, microfacets.mean_slope().max(0.02));
    let mut radiance = backdrop_radiance.map(|value| value * (fresnel(rise) * open) as f32);
    for (light, (illuminance, toward)) in surroundings.others.lights.iter().zip(lights) {
        let width = match light.emitter {
            Emitter::Point { position, radius } => radius / (position - point).length().max(radius),
            Emitter::Directional { .. } | Emitter::Spot { .. } => 0.0,
        };
        let weight = microfacets.specular_lobe(*toward, viewer, width) as f32;
        (0..3).for_each(|c| radiance[c] = illuminance[c].fma(weight, radiance[c]));
    }
    radiance
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Microfacets of one kind, none of which is seen by itself.
    fn even(slope: f64) -> Microfacets {
        Microfacets { tilt: DVec2::ZERO, slopes: [slope; 2], film: 1.0 }
    }

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
                sum += even(slope).specular_lobe(light, DVec3::new(across * cos, y, across * sin), 0.0) * y;
            }
        }
        sum * 2.0 * PI / f64::from(rings * turns) / (light.y * fresnel(light.y))
    }

    #[test]
    fn a_little_rough_water_mirrors_as_much_as_calm_water() {
        let light = DVec3::new(0.6, 0.8, 0.0);
        for slope in [0.03, 0.08] {
            let weight = mirrored_share(light, slope);
            assert!((weight - 1.0).abs() < 0.06, "slope {slope}: {weight}");
        }
    }

    #[test]
    fn a_low_lamp_is_drawn_out_toward_the_viewer_more_than_sideways() {
        let viewer = |turn: f64, rise: f64| {
            let (sin, cos) = math::sin_cos(turn);
            DVec3::new(-cos, rise, sin).normalize()
        };
        let light = DVec3::new(1.0, 0.2, 0.0).normalize();
        let at = |turn, rise| even(0.06).specular_lobe(light, viewer(turn, rise), 0.0);
        let straight = at(0.0, 0.2);
        assert!(at(0.0, 0.3) > 0.3 * straight, "0.1 radians up");
        assert!(at(0.1, 0.2) < 0.3 * straight, "0.1 radians sideways");
    }

    #[test]
    fn a_lamp_fades_without_an_edge() {
        let light = DVec3::new(1.0, 0.2, 0.0).normalize();
        let microfacets = Microfacets { tilt: DVec2::ZERO, slopes: [0.04, 0.16], film: 0.5 };
        let at = |step: i32| {
            let (sin, cos) = math::sin_cos(1e-3 * f64::from(step));
            microfacets.specular_lobe(light, DVec3::new(-cos, 0.2, sin).normalize(), 0.0)
        };
        // From one pixel of a usual lens to the next; a Gaussian's tail loses a third.
        assert!((0..400).all(|step| at(step + 1) < at(step) && at(step + 1) > 0.85 * at(step)));
    }

    #[test]
    fn a_tilted_film_mirrors_what_stands_aside() {
        let (light, viewer) = (DVec3::new(0.6, 0.8, 0.0), DVec3::new(-0.6, 0.8, 0.1).normalize());
        let half = (light + viewer).normalize();
        let tilt = DVec2::new(-half.x, -half.z) / half.y;
        let lobe = |tilt| Microfacets { tilt, ..even(0.03) }.specular_lobe(light, viewer, 0.0);
        assert!(lobe(tilt) > lobe(DVec2::ZERO) && lobe(tilt) > lobe(2.0 * tilt));
    }

    #[test]
    fn water_mirrors_two_hundredths_from_above_and_all_at_the_horizon() {
        assert!((fresnel(1.0) - 0.0204).abs() < 1e-12);
        assert!((fresnel(0.0) - 1.0).abs() < 1e-12);
        assert!((0.05..0.07).contains(&fresnel(0.5)));
    }
}
