//! Rays, and where they meet simple solids around the origin.

use bansho_base::math::{self, DVec3};

/// A ray; its direction need not be a unit vector, and distances are in its lengths.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ray {
    /// m.
    pub(super) origin: DVec3,
    pub(super) direction: DVec3,
}

/// Where a ray meets a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Hit {
    /// Distance, in lengths of the ray's direction.
    pub(super) t: f64,
    /// Outward unit normal.
    pub(super) normal: DVec3,
}

impl Ray {
    pub(super) fn at(&self, t: f64) -> DVec3 {
        self.origin + self.direction * t
    }
}

/// The interval of a ray within a convex solid, with the normals at both ends, to its first end within limits.
fn first_end([(enter, enter_normal), (leave, leave_normal)]: [(f64, DVec3); 2], [from, to]: [f64; 2]) -> Option<Hit> {
    if enter > leave {
        return None;
    }
    let hits = [Hit { t: enter, normal: enter_normal }, Hit { t: leave, normal: leave_normal }];
    hits.into_iter().find(|hit| hit.t > from && hit.t < to)
}

/// A sphere of `radius`.
pub(super) fn sphere(ray: &Ray, radius: f64, limits: [f64; 2]) -> Option<Hit> {
    let (a, b) = (ray.direction.length_squared(), ray.origin.dot(ray.direction));
    let discriminant = b * b - a * (ray.origin.length_squared() - radius * radius);
    if discriminant < 0.0 {
        return None;
    }
    let root = math::sqrt(discriminant);
    let ends = [(-b - root) / a, (-b + root) / a].map(|t| (t, ray.at(t) / radius));
    first_end(ends, limits)
}

/// The part of a vector across the axis of an upright cylinder.
fn horizontal(vector: DVec3) -> DVec3 {
    DVec3::new(vector.x, 0.0, vector.z)
}

/// A box with these half sides.
pub(super) fn cuboid(ray: &Ray, half: DVec3, limits: [f64; 2]) -> Option<Hit> {
    let mut ends = [(f64::NEG_INFINITY, DVec3::Y), (f64::INFINITY, DVec3::Y)];
    for axis in 0..3 {
        ends = within_slab(ray, DVec3::AXES[axis], half[axis], ends)?;
    }
    first_end(ends, limits)
}

/// An upright cylinder.
pub(super) fn cylinder(ray: &Ray, radius: f64, half_height: f64, limits: [f64; 2]) -> Option<Hit> {
    let (origin, direction) = (horizontal(ray.origin), horizontal(ray.direction));
    let (a, b, c) = (direction.length_squared(), origin.dot(direction), origin.length_squared() - radius * radius);
    let discriminant = b * b - a * c;
    let ends = if a < 1e-300 {
        // Along the axis.
        if c > 0.0 {
            return None;
        }
        [(f64::NEG_INFINITY, DVec3::Y), (f64::INFINITY, DVec3::Y)]
    } else if discriminant < 0.0 {
        return None;
    } else {
        let root = math::sqrt(discriminant);
        [(-b - root) / a, (-b + root) / a].map(|t| (t, horizontal(ray.at(t)) / radius))
    };
    first_end(within_slab(ray, DVec3::Y, half_height, ends)?, limits)
}

/// The interval of a ray between two planes at `-half` and `half` along `axis`, cut out of an interval.
fn within_slab(
    ray: &Ray,
    axis: DVec3,
    half: f64,
    [mut enter, mut leave]: [(f64, DVec3); 2],
) -> Option<[(f64, DVec3); 2]> {
    let (start, speed) = (ray.origin.dot(axis), ray.direction.dot(axis));
    if speed == 0.0 {
        return (start.abs() <= half).then_some([enter, leave]);
    }
    let toward = axis * speed.signum();
    let [near, far] = [(-half * speed.signum() - start) / speed, (half * speed.signum() - start) / speed];
    if near > enter.0 {
        enter = (near, -toward);
    }
    if far < leave.0 {
        leave = (far, toward);
    }
    Some([enter, leave])
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [f64; 2] = [0.0, f64::INFINITY];

    #[test]
    fn hits_worked_by_hand() {
        let ahead = |x: f64, y: f64| Ray { origin: DVec3::new(x, y, 5.0), direction: DVec3::new(0.0, 0.0, -2.0) };
        let hit = sphere(&ahead(0.6, 0.0), 1.0, ALL).unwrap();
        assert!((hit.t - 2.1).abs() < 1e-12 && (hit.normal - DVec3::new(0.6, 0.0, 0.8)).length() < 1e-12);
        assert_eq!(sphere(&ahead(1.1, 0.0), 1.0, ALL), None);
        let half = DVec3::new(1.0, 2.0, 3.0);
        assert_eq!(cuboid(&ahead(0.9, 1.9), half, ALL), Some(Hit { t: 1.0, normal: DVec3::Z }));
        assert_eq!(cuboid(&ahead(0.9, 2.1), half, ALL), None);
        // From inside the far side is met.
        assert_eq!(cuboid(&ahead(0.0, 0.0), half, [1.5, 9.0]), Some(Hit { t: 4.0, normal: -DVec3::Z }));
        let hit = cylinder(&ahead(0.6, 1.0), 1.0, 2.0, ALL).unwrap();
        assert!((hit.t - 2.1).abs() < 1e-12 && (hit.normal - DVec3::new(0.6, 0.0, 0.8)).length() < 1e-12);
        assert_eq!(cylinder(&ahead(0.6, 2.1), 1.0, 2.0, ALL), None);
        let down = |x: f64| Ray { origin: DVec3::new(x, 7.0, 0.0), direction: -DVec3::Y };
        assert_eq!(cylinder(&down(0.5), 1.0, 2.0, ALL), Some(Hit { t: 5.0, normal: DVec3::Y }));
        assert_eq!(cylinder(&down(1.5), 1.0, 2.0, ALL), None);
    }
}
