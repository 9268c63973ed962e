//! Gas against solids: it is put back to their surface and slides along it.

use bansho_base::{
    math::{DVec3, Vec3},
    surroundings::Occluder,
};

/// Where a particle that would lie in a solid goes, and what becomes of its velocity.
///
/// Particles keep `clearance` from the surface; of their velocity only what points into the solid is taken.
pub(crate) fn keep_out(
    occluders: &[Occluder],
    origin: DVec3,
    clearance: f32,
    mut place: Vec3,
    mut velocity: Vec3,
) -> (Vec3, Vec3) {
    for occluder in occluders {
        let point = origin + place.as_dvec3();
        let inside = f64::from(clearance) - occluder.signed_distance(point);
        if inside > 0.0 {
            let normal = occluder.normal(point);
            place = (point + normal * inside - origin).as_vec3();
            let normal = normal.as_vec3();
            velocity -= normal * velocity.dot(normal).min(0.0);
        }
    }
    (place, velocity)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gas_slides_along_the_ground() {
        let ground = [Occluder::HalfSpace { point: DVec3::Y, normal: DVec3::Y }];
        let origin = DVec3::new(5.0, 1.0, 0.0);
        let (place, velocity) = keep_out(&ground, origin, 0.1, Vec3::new(0.0, -0.3, 0.0), Vec3::new(2.0, -3.0, 0.0));
        assert!((place - Vec3::new(0.0, 0.1, 0.0)).length() < 1e-6);
        assert_eq!(velocity, Vec3::new(2.0, 0.0, 0.0));
        let free = (Vec3::new(0.0, 0.2, 0.0), Vec3::new(0.0, -3.0, 0.0));
        assert_eq!(keep_out(&ground, origin, 0.1, free.0, free.1), free);
    }
}
