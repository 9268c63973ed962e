//! Light of lamps, fires and the sun that fog scatters once toward the camera, for sixteen lines of sight at a time.
//!
//! The distance along a line of sight is replaced by the angle at the source (see [`reference`](super::scattering)). Angles are counted from the beginning
//! of a segment, so that a short one that is far from the source keeps its precision in `f32`.

use bansho_base::{
    math::{
        DVec3, approximations,
        simd::{LANES, LaneArray, Real},
    },
    phenomenon::surroundings::{Emitter, Light},
};

use super::scattering::{FEW_NODES, MANY_NODES, SMALL_ANGLE, phase_function};

/// Least distance of a light from a line of sight, m.
const MIN_DISTANCE: f32 = 1e-4;
/// Distance beyond which the light of a lamp is neglected, m: single precision holds its square.
const MAX_DISTANCE: f64 = 1e9;
const TURNS_PER_RADIAN: f32 = (1.0 / std::f64::consts::TAU) as f32;

/// Parts of sixteen lines of sight. Distances are from the camera, m.
pub(super) struct Segments {
    /// Unit vectors along the lines: all x, all y, all z.
    pub(super) directions: [LaneArray; 3],
    pub(super) begin: LaneArray,
    /// At least `begin`; may be infinite.
    pub(super) end: LaneArray,
}

/// A light as fog around a camera sees it.
pub(super) struct LightInFog {
    /// ACEScg, as of [`Light`].
    intensity: [f32; 3],
    geometry: Geometry,
}

enum Geometry {
    /// At infinity, in the direction of a unit vector.
    Directional([f32; 3]),
    Near {
        /// From the camera, m.
        offset: [f32; 3],
        /// Square of the distance within which the illuminance is constant, m^2.
        min_square: f32,
        cone: Option<Cone>,
    },
}

/// The cone of a spot.
struct Cone {
    axis: [f32; 3],
    /// Distance of the light from the camera along the axis, m.
    along: f32,
    cos_outer: f32,
    inverse_width: f32,
}

/// Sixteen segments as a light sees them.
struct SegmentsFromLight {
    /// Distance of the light from each line of sight, m.
    height: LaneArray,
    inverse_height: LaneArray,
    /// Distance from the point of the line that is nearest to the light to the beginning of the segment, m.
    first: LaneArray,
    /// Half of the angle that a segment subtends at the light, radians.
    half_angle: LaneArray,
    /// Cosine and sine of the angle at the light from the nearest point of the line to the middle of that angle.
    middle: [LaneArray; 2],
    /// Cosine of the angle between the line and the axis of a cone; 0 without one.
    line_cosine: LaneArray,
    /// Distance of the nearest point of the line from the light along the axis of a cone, m; 0 without one.
    nearest_along: LaneArray,
}

impl LightInFog {
    /// A light for fog around a camera at a position; `None` if it is too far away to be seen.
    pub(super) fn new(light: &Light, camera: DVec3) -> Option<Self> {
        let geometry = match light.emitter {
            Emitter::Directional { toward } => Geometry::Directional(toward.as_vec3().to_array()),
            Emitter::Point { position, .. } | Emitter::Spot { position, .. } => {
                let offset = position - camera;
                if offset.length() >= MAX_DISTANCE {
                    return None;
                }
                let (radius, cone) = match light.emitter {
                    Emitter::Spot { axis, cos_inner, cos_outer, .. } => {
                        let inverse_width = (1.0 / (cos_inner - cos_outer).max(1e-6)) as f32;
                        let (along, cos_outer) = (offset.dot(axis) as f32, cos_outer as f32);
                        (0.0, Some(Cone { axis: axis.as_vec3().to_array(), along, cos_outer, inverse_width }))
                    }
                    Emitter::Point { radius, .. } => (radius, None),
                    Emitter::Directional { .. } => (0.0, None),
                };
                let min_square = (radius * radius).max(1e-12) as f32;
                Geometry::Near { offset: offset.as_vec3().to_array(), min_square, cone }
            }
        };
        Some(Self { intensity: light.intensity, geometry })
    }

    /// Adds the radiance that segments scatter toward their beginnings, ACEScg, cd/m^2, in fog with an extinction coefficient in 1/m.
    #[inline(always)]
    pub(super) fn add(&self, segments: &Segments, extinction: f32, light: &mut [LaneArray; 3]) {
        let factors = match &self.geometry {
            Geometry::Directional(toward) => directional(toward, segments, extinction),
            Geometry::Near { offset, min_square, cone } => {
                let segments_from_light = SegmentsFromLight::new(offset, cone.as_ref(), segments);
                segments_from_light.factors(*min_square, cone.as_ref(), extinction)
            }
        };
        for c in 0..3 {
            for i in 0..LANES {
                light[c][i] = self.intensity[c].fma(factors[i], light[c][i]);
            }
        }
    }
}

/// Scattered radiance by illuminance: the light comes from outside of the fog, and is as strong everywhere.
#[inline(always)]
fn directional([x, y, z]: &[f32; 3], segments: &Segments, extinction: f32) -> LaneArray {
    let [xs, ys, zs] = &segments.directions;
    let mut factors = [0.0; LANES];
    for i in 0..LANES {
        let cosine = x.fma(xs[i], y.fma(ys[i], z * zs[i]));
        // The transmittance from the camera to the beginning is applied when the layers are composited.
        let passed = approximations::exp(-extinction * (segments.end[i] - segments.begin[i]));
        factors[i] = phase_function(cosine) * (1.0 - passed);
    }
    factors
}

impl SegmentsFromLight {
    #[inline(always)]
    fn new([x, y, z]: &[f32; 3], cone: Option<&Cone>, segments: &Segments) -> Self {
        let mut from_light = Self {
            height: [0.0; LANES],
            inverse_height: [0.0; LANES],
            first: [0.0; LANES],
            half_angle: [0.0; LANES],
            middle: [[0.0; LANES]; 2],
            line_cosine: [0.0; LANES],
            nearest_along: [0.0; LANES],
        };
        let [xs, ys, zs] = &segments.directions;
        for i in 0..LANES {
            let nearest = x.fma(xs[i], y.fma(ys[i], z * zs[i]));
            // The height of the light over the line by a cross product: as the difference of squares of the distance and of its part along the line
            // it would cancel in single precision.
            let across = [y * zs[i] - z * ys[i], z * xs[i] - x * zs[i], x * ys[i] - y * xs[i]];
            let square = across[0].fma(across[0], across[1].fma(across[1], across[2] * across[2]));
            let height = square.sqrt().simd_max(MIN_DISTANCE);
            let first = segments.begin[i] - nearest;
            let width = segments.end[i] - segments.begin[i];
            // The angle from u to u + w is that of the vector (h^2 + u (u + w), h w), and that of (u, h) if w is infinite.
            let is_endless = width > MAX_DISTANCE as f32;
            let along = if is_endless { first } else { height.fma(height, first * (first + width)) };
            let sideways = if is_endless { height } else { height * width };
            let half_angle = 0.5 * approximations::atan2(sideways, along);
            let turns = half_angle * TURNS_PER_RADIAN;
            let (sine, cosine) = (approximations::sin_turns(turns), approximations::cos_turns(turns));
            // The direction to the middle, by the addition theorem from that to the beginning: no second arctangent.
            let inverse = 1.0 / height.fma(height, first * first).sqrt();
            let (first_cosine, first_sine) = (height * inverse, first * inverse);
            (from_light.height[i], from_light.first[i], from_light.half_angle[i]) = (height, first, half_angle);
            from_light.inverse_height[i] = 1.0 / height;
            from_light.middle[0][i] = first_cosine * cosine - first_sine * sine;
            from_light.middle[1][i] = first_sine * cosine + first_cosine * sine;
            if let Some(Cone { axis, along, .. }) = cone {
                from_light.line_cosine[i] = axis[0].fma(xs[i], axis[1].fma(ys[i], axis[2] * zs[i]));
                from_light.nearest_along[i] = nearest.fma(from_light.line_cosine[i], -along);
            }
        }
        from_light
    }

    /// Scattered radiance by luminous intensity, 1/m^2: with few nodes where a segment subtends a small angle. Each line of sight has the same
    /// nodes whatever its neighbors need.
    #[inline(always)]
    fn factors(&self, min_square: f32, cone: Option<&Cone>, extinction: f32) -> LaneArray {
        let (mut any_small, mut any_large) = (false, false);
        for i in 0..LANES {
            let is_small = self.half_angle[i] < SMALL_ANGLE;
            any_small |= is_small;
            any_large |= !is_small;
        }
        // Both rules for all lanes if any lane needs them: a branch for each lane would not be vectorized.
        let few = if any_small { self.integrate(&FEW_NODES, min_square, cone, extinction) } else { [0.0; LANES] };
        let many = if any_large { self.integrate(&MANY_NODES, min_square, cone, extinction) } else { [0.0; LANES] };
        let mut factors = [0.0; LANES];
        for i in 0..LANES {
            factors[i] = if self.half_angle[i] < SMALL_ANGLE { few[i] } else { many[i] };
        }
        factors
    }

    /// Gauss-Legendre quadrature over the angle at the light.
    #[inline(always)]
    fn integrate(&self, nodes: &[[f64; 2]], min_square: f32, cone: Option<&Cone>, extinction: f32) -> LaneArray {
        let mut sums = [0.0; LANES];
        for [node, weight] in nodes {
            // The nodes are symmetric: one sine and one cosine serve both sides of the middle.
            let turns_per_half_angle = *node as f32 * TURNS_PER_RADIAN;
            let (mut cosines, mut sines) = ([0.0; LANES], [0.0; LANES]);
            for i in 0..LANES {
                let turns = turns_per_half_angle * self.half_angle[i];
                (cosines[i], sines[i]) = (approximations::cos_turns(turns), approximations::sin_turns(turns));
            }
            // Both nodes of a pair, on both sides of the middle.
            for side in [1.0, -1.0] {
                let integrand = self.integrand(&cosines, &sines, side, min_square, cone, extinction);
                for i in 0..LANES {
                    sums[i] = integrand[i].fma(*weight as f32, sums[i]);
                }
            }
        }
        for i in 0..LANES {
            // With s = s0 + h tan a, ds / r^2 is da / h: what is left of the inverse-square law is a constant of the line. Half the angle scales the
            // nodes on [-1, 1].
            sums[i] *= extinction * self.half_angle[i] * self.inverse_height[i];
        }
        sums
    }

    /// The integrand at an angle from the middle, given by its cosine and sine and its side: phase function, transmittance and the form of the light. One
    /// loop for each step, so that the compiler makes vectors of all of them.
    #[inline(always)]
    fn integrand(
        &self,
        cosines: &LaneArray,
        sines: &LaneArray,
        side: f32,
        min_square: f32,
        cone: Option<&Cone>,
        extinction: f32,
    ) -> LaneArray {
        let [middle_cosine, middle_sine] = &self.middle;
        let (mut distance, mut inverse, mut along, mut phase) =
            ([0.0; LANES], [0.0; LANES], [0.0; LANES], [0.0; LANES]);
        for i in 0..LANES {
            let sine = side * sines[i];
            let cosine = middle_cosine[i] * cosines[i] - middle_sine[i] * sine;
            let sine = middle_sine[i] * cosines[i] + middle_cosine[i] * sine;
            // At a right angle an endless segment is infinitely far away.
            let cosine = cosine.simd_max(1e-7);
            (distance[i], inverse[i]) = (self.height[i] / cosine, cosine * self.inverse_height[i]);
            along[i] = sine * distance[i];
            phase[i] = phase_function(-sine);
        }
        let (mut integrand, inverse_min_square) = ([0.0; LANES], 1.0 / min_square);
        for i in 0..LANES {
            // From the light to the point, and from there to the beginning of the segment: the fog in front of it has been drawn already.
            let depth = extinction * ((along[i] - self.first[i]).simd_max(0.0) + distance[i]);
            let square = distance[i] * distance[i];
            // Within the radius of the light its illuminance does not grow any more: the factor takes back what the substitution has divided out.
            let form = (square * inverse_min_square).simd_min(1.0);
            integrand[i] = form * phase[i] * approximations::exp(-depth);
        }
        if let Some(Cone { cos_outer, inverse_width, .. }) = cone {
            for i in 0..LANES {
                let cone_cosine = along[i].fma(self.line_cosine[i], self.nearest_along[i]) * inverse[i];
                integrand[i] *= ((cone_cosine - cos_outer) * inverse_width).simd_smoothstep();
            }
        }
        integrand
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::math;
    use fearless_simd::dispatch;

    use super::*;
    use crate::fog::scattering::{extinction, reference};

    /// Lines of sight in many directions, with parts that begin and end everywhere.
    fn segments(scale: f32) -> (Segments, [DVec3; LANES]) {
        let mut segments = Segments { directions: [[0.0; LANES]; 3], begin: [0.0; LANES], end: [0.0; LANES] };
        let lines = std::array::from_fn(|i| {
            let turn = i as f64 * 0.7;
            DVec3::new(math::sin(turn), 0.4 * math::cos(2.3 * turn), -math::cos(turn)).normalize()
        });
        for i in 0..LANES {
            let line: [f32; 3] = lines[i].as_vec3().to_array();
            (0..3).for_each(|axis| segments.directions[axis][i] = line[axis]);
            segments.begin[i] = scale * [0.0, 0.5, 3.0, 9.0][i % 4];
            segments.end[i] = segments.begin[i] + scale * [0.2, 4.0, 40.0, f32::INFINITY][i / 4];
        }
        (segments, lines)
    }

    #[test]
    fn sixteen_lines_of_sight_have_the_light_of_each_in_double_precision() {
        let camera = DVec3::new(100.0, 2.0, -50.0);
        let position = camera + DVec3::new(1.5, 1.0, -6.0);
        let axis = DVec3::new(-0.2, -1.0, 0.3).normalize();
        let emitters = [
            Emitter::Point { position, radius: 0.05 },
            Emitter::Spot { position, axis, cos_inner: 0.9, cos_outer: 0.5 },
            Emitter::Directional { toward: DVec3::new(0.3, 0.8, -0.5).normalize() },
        ];
        let mut lit = 0;
        for (emitter, scale) in emitters.into_iter().flat_map(|emitter| [(emitter, 1.0), (emitter, 20.0)]) {
            let light = Light { emitter, intensity: [300.0, 100.0, 0.0] };
            let (segments, lines) = segments(scale);
            for visibility_m in [20.0, 300.0] {
                let beta = extinction(visibility_m);
                let in_fog = LightInFog::new(&light, camera).unwrap();
                let mut found = [[0.0; LANES]; 3];
                dispatch!(bansho_base::math::simd::level(), _simd => in_fog.add(&segments, beta as f32, &mut found));
                for i in 0..LANES {
                    let (begin, end) = (f64::from(segments.begin[i]), f64::from(segments.end[i]));
                    let segment = reference::Segment {
                        eye: camera + lines[i] * begin,
                        direction: lines[i],
                        begin: 0.0,
                        end: end - begin,
                    };
                    let expected = reference::scattered(&light, &segment, beta);
                    for c in 0..3 {
                        let (found, expected) = (found[c][i], expected[c]);
                        let is_near = (found - expected).abs() <= 2e-3 * expected + 1e-6;
                        assert!(is_near, "{emitter:?}, line {i} scaled by {scale}: {found} instead of {expected}");
                        lit += usize::from(expected > 1e-3);
                    }
                }
            }
        }
        assert!(lit > 150, "{lit}");
    }

    #[test]
    fn every_vector_level_has_the_same_bits() {
        let light = Light {
            emitter: Emitter::Point { position: DVec3::new(0.2, 0.0, -3.0), radius: 0.0 },
            intensity: [1.0; 3],
        };
        let (in_fog, (segments, _)) = (LightInFog::new(&light, DVec3::ZERO).unwrap(), segments(1.0));
        let (mut wide, mut narrow) = ([[0.0; LANES]; 3], [[0.0; LANES]; 3]);
        dispatch!(bansho_base::math::simd::level(), _simd => in_fog.add(&segments, 0.05, &mut wide));
        bansho_base::dispatch_baseline!(_simd => in_fog.add(&segments, 0.05, &mut narrow));
        assert_eq!(wide, narrow);
    }

    #[test]
    fn lights_and_segments_anywhere_give_finite_light() {
        for offset in [0.0, 1e-20, 1e-3, 1e5, 9e8] {
            let emitter = Emitter::Point { position: DVec3::new(0.0, 0.0, -offset), radius: 0.0 };
            let Some(light) = LightInFog::new(&Light { emitter, intensity: [1e6; 3] }, DVec3::ZERO) else { continue };
            for scale in [1e-6, 1.0, 1e6, 1e12] {
                let mut sum = [[0.0; LANES]; 3];
                dispatch!(bansho_base::math::simd::level(), _simd => light.add(&segments(scale).0, 0.1, &mut sum));
                let is_finite = sum.iter().flatten().all(|value| value.is_finite() && *value >= 0.0);
                assert!(is_finite, "{offset} {scale}: {sum:?}");
            }
        }
        let far = Emitter::Point { position: DVec3::new(0.0, 0.0, 1e12), radius: 0.0 };
        assert!(LightInFog::new(&Light { emitter: far, intensity: [1.0; 3] }, DVec3::ZERO).is_none());
    }
}
