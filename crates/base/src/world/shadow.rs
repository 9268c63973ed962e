//! Shadows of solids, by sphere tracing of their signed distances.

use super::occluder::Occluder;
use crate::math::{self, DVec3};

/// Steps after which a ray that grazes a solid counts as shadowed.
const MAX_STEPS: usize = 48;
/// Distance from a surface at which it is met, m.
const CLOSE: f64 = 1e-3;
/// Distance from a point at which what hides the light from it begins, m.
const NEAREST: f64 = 5e-3;
/// Heights above the ground at which the nearness of solids is measured for the light of the sky, m, with weights.
const SKY_SAMPLES: [[f64; 2]; 4] = [[0.08, 0.25], [0.25, 0.25], [0.6, 0.3], [1.5, 0.2]];

/// Fraction of a light that reaches `point`: it is in direction `toward` (unit vector) at `distance` (m), and has the angular radius `size`. Half shadows
/// follow from how nearly the ray misses a solid.
pub fn visibility(casters: &[Occluder], point: DVec3, toward: DVec3, distance: f64, size: f64) -> f64 {
    visibility_past(casters.iter(), point, toward, distance, size)
}

/// As [`visibility`], of any casters.
fn visibility_past<'a>(
    casters: impl Iterator<Item = &'a Occluder>,
    point: DVec3,
    toward: DVec3,
    distance: f64,
    size: f64,
) -> f64 {
    // Within the lamp nothing is between.
    if distance <= 0.0 {
        return 1.0;
    }
    let mut visible = 1.0_f64;
    for caster in casters {
        // Not from the point itself: a solid that stands on the ground would shadow all that it touches.
        let Some([mut travel, end]) = segment_near(caster, point, toward, [NEAREST, distance], size, 0.0) else {
            continue;
        };
        for _ in 0..MAX_STEPS {
            let near = caster.signed_distance(point + toward * travel);
            // Seen from the point, the light is a disc with a radius of travel * size here, and the nearest surface cuts it at `near` from its
            // center.
            visible = visible.min(0.5 + 0.5 * near / (travel * size));
            if near < CLOSE {
                return 0.0;
            }
            travel += near;
            if travel > end {
                break;
            }
        }
    }
    // Close to the area of a disc on one side of a straight edge.
    math::smoothstep(0.0, 1.0, visible)
}

/// The mean of [`visibility`] over a parallelogram with these sides (m) around `point`: the part of a plane that a pixel shows. Most pixels are wholly in the
/// light or in shadow, which one ray shows; others take four.
pub fn mean_visibility(
    casters: &[Occluder],
    point: DVec3,
    sides: [DVec3; 2],
    toward: DVec3,
    distance: f64,
    size: f64,
) -> f64 {
    /// Positions within the parallelogram: each in another quarter of both sides.
    const SAMPLES: [[f64; 2]; 4] = [[-0.375, -0.125], [-0.125, 0.375], [0.125, -0.375], [0.375, 0.125]];
    if distance <= 0.0 {
        return 1.0;
    }
    let spread = 0.5 * (sides[0].length() + sides[1].length());
    match coverage(casters, point, toward, distance, size, spread) {
        Coverage::None => 1.0,
        Coverage::Whole => 0.0,
        Coverage::Part(casters_near) => {
            let near = || {
                casters
                    .iter()
                    .enumerate()
                    .filter(|(index, _)| casters_near & bit(*index) != 0)
                    .map(|(_, caster)| caster)
            };
            let seen = SAMPLES.map(|[first, second]| {
                let offset = sides[0] * first + sides[1] * second;
                // A light at infinity is in the same direction everywhere.
                let (toward, distance) = if distance.is_finite() {
                    let to_light = toward * distance - offset;
                    (to_light.normalize_or_zero(), to_light.length())
                } else {
                    (toward, distance)
                };
                visibility_past(near(), point + offset, toward, distance, size)
            });
            0.25 * seen.iter().sum::<f64>()
        }
    }
}

/// How much of a light is hidden from all that is near a point.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Coverage {
    None,
    /// Perhaps some, by casters whose [`bit`]s are set.
    Part(u64),
    Whole,
}

/// A bit of a caster. Of more than 64 casters, several have the same.
fn bit(index: usize) -> u64 {
    1 << (index % 64)
}

/// What is hidden of a light, of the angular radius `size`, from points up to `spread` (m) away from `point`.
fn coverage(casters: &[Occluder], point: DVec3, toward: DVec3, distance: f64, size: f64, spread: f64) -> Coverage {
    let mut casters_near = 0;
    for (index, caster) in casters.iter().enumerate() {
        let segment = segment_near(caster, point, toward, [NEAREST, distance], size, spread);
        let Some([mut travel, end]) = segment else { continue };
        for _ in 0..MAX_STEPS {
            let near = caster.signed_distance(point + toward * travel);
            // All rays from all these points to the light are within this radius.
            let radius = travel * size + spread;
            if near < -radius {
                return Coverage::Whole;
            }
            if near < radius + CLOSE {
                casters_near |= bit(index);
            }
            // On through the solid, which may be thicker farther on.
            travel += near.abs().max(0.25 * radius).max(CLOSE);
            if travel > end {
                break;
            }
        }
    }
    if casters_near == 0 { Coverage::None } else { Coverage::Part(casters_near) }
}

/// The part of a ray between two distances (m) from which a light of the angular radius `size`, seen from up to `spread` (m) beside it, may be partly hidden by
/// a solid; `None` if there is none.
fn segment_near(
    caster: &Occluder,
    point: DVec3,
    toward: DVec3,
    [from, to]: [f64; 2],
    size: f64,
    spread: f64,
) -> Option<[f64; 2]> {
    let Some((center, radius)) = caster.bounding_sphere() else { return Some([from, to]) };
    let offset = center - point;
    let along = offset.dot(toward).clamp(0.0, to);
    let reach = radius + along * size + spread;
    if (offset - toward * along).length_squared() > reach * reach {
        return None;
    }
    let Occluder::Mesh { distance, placement } = caster else { return Some([from, to]) };
    // The box of a mesh fills a small part of its sphere, if it is a post or a car.
    let margin = DVec3::splat(((along + radius) * size + spread) / placement.scale);
    let [low, high] = distance.bounds();
    let [low, high] = [low - margin, high + margin];
    let (origin, direction) = (placement.point_in_local(point), placement.direction_in_local(toward) / placement.scale);
    let [a, b] = [low, high].map(|corner| (corner - origin) / direction);
    // NaN where a ray lies in the plane of a side. Whether it then counts as meeting the box does not matter: the margin lies around all that hides the light.
    let [enter, leave] = [a.min(b), a.max(b)];
    let enter = enter.to_array().into_iter().fold(from, f64::max);
    let leave = leave.to_array().into_iter().fold(to, f64::min);
    (enter <= leave).then_some([enter, leave])
}

/// Distance from a point to the bounds of a solid, m: the box of a mesh, else a sphere; 0 or less within them, and without bounds.
fn distance_to_bounds(caster: &Occluder, point: DVec3) -> f64 {
    let Occluder::Mesh { distance, placement } = caster else {
        return caster.bounding_sphere().map_or(0.0, |(center, radius)| (center - point).length() - radius);
    };
    let ([low, high], local) = (distance.bounds(), placement.point_in_local(point));
    (local - local.clamp(low, high)).length() * placement.scale
}

/// Fraction of the sky's light that reaches level ground at `point`: the nearer solids are above it, the less (ambient occlusion).
pub fn sky_visibility(casters: &[Occluder], point: DVec3) -> f64 {
    let mut visible = 1.0;
    for caster in casters {
        // From so far away, each sample is nearer to the ground than to the solid, which therefore hides nothing.
        if distance_to_bounds(caster, point) > 2.0 * SKY_SAMPLES[SKY_SAMPLES.len() - 1][0] {
            continue;
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
    use std::sync::Arc;

    use super::*;
    use crate::geometry::{distance_field::DistanceField, mesh, transform::Transform};

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
    fn a_pixel_has_the_mean_of_the_shadow_within_it() {
        let placement = Transform::new([0.0, 1.2, 0.0], [20.0, 30.0, 10.0], 0.4);
        let cube = Occluder::Mesh { distance: Arc::new(DistanceField::new(&mesh::cube())), placement };
        let casters = [cube, Occluder::Sphere { center: DVec3::new(1.5, 0.8, 0.0), radius: 0.3 }];
        let lamp = DVec3::new(0.3, 4.0, -0.5);
        let sides = [DVec3::X * 0.05, DVec3::Z * 0.3];
        let (mut edges, mut error) = (0, 0.0_f64);
        for step in 0..900_u32 {
            let point = DVec3::new(f64::from(step % 30) * 0.13 - 1.5, 0.0, f64::from(step / 30) * 0.09 - 1.3);
            let seen_from = |point: DVec3| {
                let to_light = lamp - point;
                visibility(&casters, point, to_light.normalize(), to_light.length(), 0.01)
            };
            let mut expected = 0.0;
            for index in 0..256_u32 {
                let [first, second] = [index % 16, index / 16].map(|part| (f64::from(part) + 0.5) / 16.0 - 0.5);
                expected += seen_from(point + sides[0] * first + sides[1] * second) / 256.0;
            }
            let to_light = lamp - point;
            let found = mean_visibility(&casters, point, sides, to_light.normalize(), to_light.length(), 0.01);
            if (0.02..0.98).contains(&expected) {
                edges += 1;
                error += (found - expected).abs();
            } else {
                assert!((found - expected).abs() < 0.26, "{point}: {found} instead of {expected}");
            }
        }
        assert!(edges > 60 && error < 0.1 * f64::from(edges), "{edges} edges, mean error {}", error / f64::from(edges));
    }

    #[test]
    fn the_box_of_a_mesh_leaves_out_only_what_hides_nothing() {
        // Turned and scaled.
        let placement = Transform::new([1.0, 1.5, -0.5], [20.0, 30.0, 10.0], 0.4);
        let caster = Occluder::Mesh { distance: Arc::new(DistanceField::new(&mesh::cube())), placement };
        let whole = |point: DVec3, toward: DVec3, distance: f64, size: f64| {
            let (mut visible, mut travel) = (1.0_f64, 5e-3);
            for _ in 0..400 {
                let near = caster.signed_distance(point + toward * travel);
                visible = visible.min(0.5 + 0.5 * near / (travel * size));
                // In small steps, so that nothing depends on where they are.
                travel += (0.25 * near).max(2e-3);
                if near < CLOSE {
                    return 0.0;
                }
                if travel > distance {
                    break;
                }
            }
            math::smoothstep(0.0, 1.0, visible)
        };
        let (mut hidden, mut partly, mut differing) = (0, 0, 0);
        for step in 0..4000_u32 {
            let unit = |prime: f64| (f64::from(step) * prime).fract();
            let point = DVec3::new(2.0 * unit(0.618_034), 0.0, 2.0 * unit(0.754_878) - 1.5);
            let toward = DVec3::new(unit(0.569_84) - 0.5, 0.3 + unit(0.2847), unit(0.430_16) - 0.5).normalize();
            let [seen, expected] =
                [visibility(std::slice::from_ref(&caster), point, toward, 5.0, 0.05), whole(point, toward, 5.0, 0.05)];
            differing += u32::from((seen - expected).abs() > 0.12);
            hidden += u32::from(expected == 0.0);
            partly += u32::from((0.1..0.9).contains(&expected));
        }
        // Some rays graze an edge between two of their steps.
        assert!(hidden > 150 && partly > 50 && differing < 4, "{hidden} {partly} {differing}");
        let along_a_side = visibility(std::slice::from_ref(&caster), DVec3::new(1.0, 0.0, -0.5), DVec3::Y, 5.0, 0.05);
        assert_eq!(along_a_side, 0.0, "a ray along an axis");
    }

    #[test]
    fn the_sky_is_hidden_where_a_solid_touches_the_ground() {
        let ball = [Occluder::Sphere { center: DVec3::Y * 0.3, radius: 0.3 }];
        let open = |x: f64| sky_visibility(&ball, DVec3::X * x);
        assert!(open(0.02) < 0.5 && open(0.6) > open(0.3) && open(5.0) == 1.0, "{} {}", open(0.02), open(0.3));
    }
}
