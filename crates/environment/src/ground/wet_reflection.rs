//! Glossy reflection in a rough film of water: the long highlights of lamps on a wet road.

use bansho_base::math::simd::Real;

/// Fresnel reflectance of water at the cosine of the angle of incidence (Schlick 1994, n = 1.333).
#[inline(always)]
pub(super) fn fresnel<R: Real>(cos: R) -> R {
    let grazing = cos.broadcast(1.0) - cos.simd_clamp01();
    let square = grazing * grazing;
    (square * square * grazing).fma(cos.broadcast(0.9796), cos.broadcast(0.0204))
}

/// A direction in the upper hemisphere from which a film is lit or seen.
#[derive(Clone, Copy, Debug)]
pub(super) struct FilmDirection<R> {
    /// Unit vector away from the film.
    pub(super) toward: [R; 3],
    /// Square of the tangent of the angle to the normal.
    tan_squared: R,
}

impl<R: Real> FilmDirection<R> {
    #[inline(always)]
    pub(super) fn new(toward: [R; 3]) -> Self {
        let y = toward[1];
        let one = y.broadcast(1.0);
        Self { toward, tan_squared: one / (y * y).simd_max(y.broadcast(1e-9)) - one }
    }
}

/// Microfacets of wet ground. The slope distribution has longer tails than a Gaussian (Burley 2012: GTR with exponent
/// 3), so that highlights fade without an edge.
#[derive(Clone, Copy, Debug)]
pub(super) struct Microfacets<R> {
    /// Mean slope: that of the bumps that are resolved.
    pub(super) tilt: [R; 2],
    /// Slopes of the unresolved film and of the grains that protrude from it: r.m.s. along each axis of a Gaussian with
    /// the same median.
    pub(super) slopes: [R; 2],
    /// Fraction of the film.
    pub(super) film: R,
}

impl<R: Real> Microfacets<R> {
    /// Radiance toward `viewer` for an illuminance of one lux from `light` on a plane that faces it: `F D G / (4
    /// cos_viewer)` (Cook & Torrance 1982). A light of angular diameter `width` widens the distribution.
    #[inline(always)]
    pub(super) fn specular_lobe(&self, light: &FilmDirection<R>, viewer: &FilmDirection<R>, width: R) -> R {
        let (zero, quarter) = (width.broadcast(0.0), width.broadcast(0.25));
        let ([lx, ly, lz], [vx, vy, vz]) = (light.toward, viewer.toward);
        // The vector halfway, of length 2 cos(angle of incidence), whose slope is that of the facets that mirror the light.
        let (x, y, z) = (lx + vx, (ly + vy).simd_max(width.broadcast(1e-6)), lz + vz);
        let length_squared = x.fma(x, y.fma(y, z * z));
        let per_y = width.broadcast(1.0) / y;
        let (slope_x, slope_z) = (zero - x.fma(per_y, self.tilt[0]), zero - z.fma(per_y, self.tilt[1]));
        let square = slope_x.fma(slope_x, slope_z * slope_z);
        let source = (quarter * width) * (quarter * width);
        let mut facets = [zero; 2];
        for kind in 0..2 {
            let slope = self.slopes[kind].simd_max(width.broadcast(1e-3));
            let tans = [light.tan_squared, viewer.tan_squared];
            facets[kind] = gtr3_distribution_with_masking(square, slope.fma(slope, source), tans);
        }
        let facets = self.film.fma(facets[0] - facets[1], facets[1]);
        let cos_squared = y * y / length_squared;
        let cos_incidence = vx.fma(x, vy.fma(y, vz * z)) / length_squared.simd_sqrt();
        let cos_viewer = vy.simd_max(width.broadcast(1e-3));
        // D is a distribution of slopes: cos^-4 makes it one of normals.
        let lobe = fresnel(cos_incidence) * facets / (width.broadcast(4.0) * cos_viewer * (cos_squared * cos_squared));
        let lit = zero.select_lt(ly, lobe, zero);
        zero.select_lt(vy, lit, zero)
    }

    /// Mean slope toward a viewer.
    #[inline(always)]
    pub(super) fn mean_slope(&self) -> R {
        self.film.fma(self.slopes[0] - self.slopes[1], self.slopes[1])
    }
}

/// GTR distribution D of facets whose slope differs by the root of `square` from the mean, with a mean square slope, times Smith masking and
/// shadowing G for the squared tangents of light and viewer.
#[inline(always)]
fn gtr3_distribution_with_masking<R: Real>(square: R, slope_squared: R, tan_squared: [R; 2]) -> R {
    /// Square of the scale at which the median slope equals that of a Gaussian: `2 ln 2 / (sqrt 2 - 1)`.
    const MEDIAN: f32 = 3.346_817;
    let one = square.broadcast(1.0);
    let width = square.broadcast(MEDIAN) * slope_squared;
    let tail = one + square / width;
    // Smith's masking of either is `(root - 1) / 2`, and G is `1 / (1 + masking of light + masking of viewer)`.
    let light_root = width.fma(tan_squared[0], one).simd_sqrt();
    let viewer_root = width.fma(tan_squared[1], one).simd_sqrt();
    let masking = square.broadcast(0.5) * (light_root + viewer_root);
    square.broadcast(2.0) / (square.broadcast(std::f32::consts::PI) * width * (tail * tail * tail) * masking)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use bansho_base::math::{self, DVec2, DVec3};

    use super::*;

    /// Microfacets of one kind, none of which is seen by itself.
    fn even(slope: f64) -> Microfacets<f32> {
        Microfacets { tilt: [0.0; 2], slopes: [slope as f32; 2], film: 1.0 }
    }

    fn lobe(microfacets: &Microfacets<f32>, light: DVec3, viewer: DVec3) -> f64 {
        let [light, viewer] = [light, viewer].map(|toward| FilmDirection::new(toward.as_vec3().to_array()));
        f64::from(microfacets.specular_lobe(&light, &viewer, 0.0))
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
                sum += lobe(&even(slope), light, DVec3::new(across * cos, y, across * sin)) * y;
            }
        }
        sum * 2.0 * PI / f64::from(rings * turns) / (light.y * f64::from(fresnel(light.y as f32)))
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
        let at = |turn, rise| lobe(&even(0.06), light, viewer(turn, rise));
        let straight = at(0.0, 0.2);
        assert!(at(0.0, 0.3) > 0.3 * straight, "0.1 radians up");
        assert!(at(0.1, 0.2) < 0.3 * straight, "0.1 radians sideways");
    }

    #[test]
    fn a_lamp_fades_without_an_edge() {
        let light = DVec3::new(1.0, 0.2, 0.0).normalize();
        let microfacets = Microfacets { tilt: [0.0; 2], slopes: [0.04, 0.16], film: 0.5 };
        let at = |step: i32| {
            let (sin, cos) = math::sin_cos(1e-3 * f64::from(step));
            lobe(&microfacets, light, DVec3::new(-cos, 0.2, sin).normalize())
        };
        // From one pixel of a usual lens to the next; a Gaussian's tail loses a third.
        assert!((0..400).all(|step| at(step + 1) < at(step) && at(step + 1) > 0.85 * at(step)));
    }

    #[test]
    fn a_tilted_film_mirrors_what_stands_aside() {
        let (light, viewer) = (DVec3::new(0.6, 0.8, 0.0), DVec3::new(-0.6, 0.8, 0.1).normalize());
        let half = (light + viewer).normalize();
        let tilt = DVec2::new(-half.x, -half.z) / half.y;
        let tilted = |tilt: DVec2| lobe(&Microfacets { tilt: tilt.as_vec2().to_array(), ..even(0.03) }, light, viewer);
        assert!(tilted(tilt) > tilted(DVec2::ZERO) && tilted(tilt) > tilted(2.0 * tilt));
    }

    #[test]
    fn grazing_and_degenerate_directions_give_finite_light() {
        let values = [0.0, 1e-30, 1e-9, 1e-4, 0.5, 1.0];
        for (y, other) in values.into_iter().flat_map(|y| values.map(|other| (y, other))) {
            let toward = |y: f64, side: f64| DVec3::new(side * math::sqrt(1.0 - y * y), y, 0.0);
            for slope in [0.0, 1e-6, 0.5] {
                for side in [-1.0, 1.0] {
                    let seen = lobe(&even(slope), toward(y, 1.0), toward(other, side));
                    assert!(seen.is_finite() && seen >= 0.0, "{y} {other} {slope} {side}: {seen}");
                }
            }
        }
    }

    #[test]
    fn water_mirrors_two_hundredths_from_above_and_all_at_the_horizon() {
        assert!((fresnel(1.0_f32) - 0.0204).abs() < 1e-7);
        assert!((fresnel(0.0_f32) - 1.0).abs() < 1e-6);
        assert!((0.05..0.07).contains(&fresnel(0.5_f32)));
    }
}
