//! Shadows of solids, by sphere tracing of their signed distances.

use super::occluder::Occluder;
use crate::math::{self, DVec3};

/// Steps after which a ray that grazes a solid counts as shadowed.
const MAX_STEPS: usize = 48;
/// Distance from a surface at which it is met, m.
const CLOSE: f64 = 1e-3;
/// Heights above the ground at which the nearness of solids is measured for the light of the sky, m, with weights.
const SKY_SAMPLES: [[f64; 2]; 4] = [[0.08, 0.25], [0.25, 0.25], [0.6, 0.3], [1.5, 0.2]];

/// Fraction of a light that reaches `point`: it is in direction `toward` (unit vector) at `distance` (m), and has the angular radius `size`. Half shadows
/// follow from how nearly the ray misses a solid.
pub fn visibility(casters: &[Occluder], point: DVec3, toward: DVec3, distance: f64, size: f64) -> f64 {
    // Within the lamp nothing is between.
    if distance <= 0.0 {
        return 1.0;
    }
    let mut visible = 1.0_f64;
    for caster in casters {
        if misses_bounds(caster, point, toward, distance, size) {
            continue;
        }
        // Not from the point itself: a solid that stands on the ground would shadow all that it touches.
        let mut travel = 5e-3;
        for _ in 0..MAX_STEPS {
            let near = caster.signed_distance(point + toward * travel);
            // Seen from the point, the light is a disc with a radius of travel * size here, and the nearest surface cuts it at `near` from its
            // center.
            visible = visible.min(0.5 + 0.5 * near / (travel * size));
            if near < CLOSE {
                return 0.0;
            }
            travel += near;
            if travel > distance {
                break;
            }
        }
    }
    // Close to the area of a disc on one side of a straight edge.
    math::smoothstep(0.0, 1.0, visible)
}

/// Whether a ray with a cone of angular radius `size` misses the bounding sphere of a solid.
fn misses_bounds(caster: &Occluder, point: DVec3, toward: DVec3, distance: f64, size: f64) -> bool {
    let Some((center, radius)) = caster.bounding_sphere() else { return false };
    let offset = center - point;
    let along = offset.dot(toward).clamp(0.0, distance);
    let reach = radius + along * size;
    (offset - toward * along).length_squared() > reach * reach
}

/// Fraction of the sky's light that reaches level ground at `point`: the nearer solids are above it, the less (ambient occlusion).
pub fn sky_visibility(casters: &[Occluder], point: DVec3) -> f64 {
    let mut visible = 1.0;
    for caster in casters {
        if let Some((center, radius)) = caster.bounding_sphere() {
            // From so far away, each sample is nearer to the ground than to the solid, which therefore hides nothing.
            let reach = radius + 2.0 * SKY_SAMPLES[SKY_SAMPLES.len() - 1][0];
            if (center - point).length_squared() > reach * reach {
                continue;
            }
        }
        let hidden = SKY_SAMPLES.map(|[height, weight]| {
            let near = caster.signed_distance(point + DVec3::Y * height).max(0.0);
            weight * (1.0 - near / height).max(0.0)
        });
        visible *= 1.0 - hidden.iter().sum::<f64>();
    }
    visible
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ball_darkens_its_shadow_and_half_darkens_its_edge() {
        let ball = [Occluder::Sphere { center: DVec3::Y * 2.0, radius: 0.5 }];
        let seen = |x: f64, distance: f64| visibility(&ball, DVec3::X * x, DVec3::Y, distance, 0.05);
        assert_eq!((seen(0.0, 10.0), seen(0.45, 10.0), seen(1.0, 10.0)), (0.0, 0.0, 1.0));
        // The edge of the penumbra of a light of angular radius 0.05, 2 m away, is 0.1 m beyond the ball's.
        assert!((0.02..0.98).contains(&seen(0.55, 10.0)) && seen(0.61, 10.0) == 1.0, "{}", seen(0.55, 10.0));
        assert_eq!(seen(0.0, 1.0), 1.0, "a light in front of it is not hidden");
        assert_eq!(visibility(&ball, DVec3::ZERO, DVec3::Y, -0.04, 0.05), 1.0, "within the lamp");
        assert_eq!(visibility(&[], DVec3::ZERO, DVec3::Y, 10.0, 0.05), 1.0);
    }

    #[test]
    fn the_sky_is_hidden_where_a_solid_touches_the_ground() {
        let ball = [Occluder::Sphere { center: DVec3::Y * 0.3, radius: 0.3 }];
        let open = |x: f64| sky_visibility(&ball, DVec3::X * x);
        assert!(open(0.02) < 0.5 && open(0.6) > open(0.3) && open(5.0) == 1.0, "{} {}", open(0.02), open(0.3));
    }
}
