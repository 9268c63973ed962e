//! Continuous collision detection of particles with solids: particles stop at a surface and slide along it.

use bansho_base::{
    math::{DVec3, Vec3},
    phenomenon::surroundings::Occluder,
};

/// Maximum number of passes over all solids per sub-step. If a particle's end point has not converged by then, the particle does not move.
const MAX_ITERATIONS: usize = 3;
/// Maximum number of sphere-tracing steps along one displacement.
const MAX_MARCH_STEPS: f64 = 128.0;
/// Bisection steps that refine a contact; the remaining error is small compared with the clearance.
const BISECTION_STEPS: usize = 8;
/// Factor by which a distance may be overestimated: outside its grid, the distance to a mesh is that of the grid's edge plus the distance to the edge.
const DISTANCE_OVERESTIMATE: f64 = 3.0;
/// Change of the end point, in clearances, below which the iteration has converged.
const CONVERGENCE_TOLERANCE: f64 = 1e-6;

/// The solids that particles collide with.
#[derive(Clone, Copy)]
pub(crate) struct Colliders<'a> {
    pub(crate) occluders: &'a [Occluder],
    /// Origin of particle positions, m.
    pub(crate) origin: DVec3,
    /// Distance that particles keep from a surface, m.
    pub(crate) clearance: f32,
}

/// First contact of a displacement with a solid.
struct Contact {
    position: DVec3,
    /// Outward unit normal of the solid.
    normal: DVec3,
}

/// The straight path of a particle in a sub-step.
struct Segment {
    start: DVec3,
    displacement: DVec3,
    length: f64,
}

impl Segment {
    /// The point at a distance from the start, m; the end beyond it.
    fn at(&self, distance: f64) -> DVec3 {
        self.start + self.displacement * (distance / self.length.max(f64::MIN_POSITIVE)).min(1.0)
    }
}

impl Colliders<'_> {
    /// Moves a particle from `position` by `displacement`, and removes the components of its velocities that point into solids.
    /// Returns the new position and velocities.
    pub(crate) fn collide<const N: usize>(
        &self,
        position: Vec3,
        displacement: Vec3,
        mut velocities: [Vec3; N],
    ) -> (Vec3, [Vec3; N]) {
        let start = self.origin + position.as_dvec3();
        let straight_end = start + displacement.as_dvec3();
        let mut to = straight_end;
        for _ in 0..MAX_ITERATIONS {
            let before = to;
            for occluder in self.occluders {
                if let Some(Contact { position, normal }) = self.contact(occluder, start, to) {
                    let remaining = to - position;
                    to = self.push_out(occluder, position + remaining - normal * remaining.dot(normal).min(0.0));
                    let normal = normal.as_vec3();
                    for velocity in &mut velocities {
                        *velocity -= normal * velocity.dot(normal).min(0.0);
                    }
                }
            }
            if (to - before).length() < CONVERGENCE_TOLERANCE * f64::from(self.clearance) {
                let end = if to == straight_end { position + displacement } else { (to - self.origin).as_vec3() };
                return (end, velocities);
            }
        }
        // Not converged, as between two solids: the particle stays at its position.
        (position, [Vec3::ZERO; N])
    }

    /// First point of the displacement within the clearance of a solid, by sphere tracing; `None` if there is none.
    fn contact(&self, occluder: &Occluder, start: DVec3, to: DVec3) -> Option<Contact> {
        let clearance = f64::from(self.clearance);
        let segment = Segment { start, displacement: to - start, length: (to - start).length() };
        let (mut last_free, mut distance_along) = (0.0, 0.0);
        loop {
            let distance = occluder.signed_distance(segment.at(distance_along)) - clearance;
            if distance < 0.0 {
                for _ in 0..BISECTION_STEPS {
                    let middle = 0.5 * (last_free + distance_along);
                    let inside = occluder.signed_distance(segment.at(middle)) < clearance;
                    if inside { distance_along = middle } else { last_free = middle }
                }
                let position = segment.at(distance_along);
                return Some(Contact { position, normal: occluder.normal(position) });
            }
            last_free = distance_along;
            if distance_along >= segment.length || distance > DISTANCE_OVERESTIMATE * (segment.length - distance_along)
            {
                return None;
            }
            // The clearance makes every solid at least twice as thick, so that none is stepped over.
            distance_along = (distance_along
                + (distance / DISTANCE_OVERESTIMATE).max(clearance).max(segment.length / MAX_MARCH_STEPS))
            .min(segment.length);
        }
    }

    /// Projects a position out of a solid, to the clearance.
    fn push_out(&self, occluder: &Occluder, position: DVec3) -> DVec3 {
        let inside = f64::from(self.clearance) - occluder.signed_distance(position);
        if inside > 0.0 { position + occluder.normal(position) * inside } else { position }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use bansho_base::{
        geometry::{distance_field::DistanceField, mesh::Mesh, transform::Transform},
        math::DQuat,
    };

    use super::*;

    fn solids(occluders: &[Occluder]) -> Colliders<'_> {
        Colliders { occluders, origin: DVec3::ZERO, clearance: 0.01 }
    }

    /// A horizontal plate centered at a height of 0.6.
    fn plate(thickness: f64) -> Occluder {
        let half_extents = DVec3::new(3.0, 0.5 * thickness, 3.0);
        Occluder::Cuboid { center: DVec3::Y * 0.6, half_extents, rotation: DQuat::IDENTITY }
    }

    /// The same plate as a mesh, 2 x 0.2 x 2 m.
    fn slab() -> Occluder {
        let corner = |i: usize| [i & 1, i >> 1 & 1, i >> 2].map(|bit| bit as f32 - 0.5);
        let corners = (0..8).map(|i| std::array::from_fn(|axis| corner(i)[axis] * [2.0, 0.2, 2.0][axis])).collect();
        let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles = faces.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        let mesh = Mesh::new(corners, triangles).unwrap();
        let placement = Transform::new([0.0, 0.6, 0.0], [0.0; 3], 1.0);
        Occluder::Mesh { distance: Arc::new(DistanceField::new(&mesh)), placement }
    }

    #[test]
    fn gas_slides_along_the_ground() {
        let ground = [Occluder::HalfSpace { point: DVec3::Y, normal: DVec3::Y }];
        let solids = Colliders { origin: DVec3::new(5.0, 1.0, 0.0), clearance: 0.1, ..solids(&ground) };
        let velocity = Vec3::new(2.0, -3.0, 0.0);
        let (position, [remaining]) = solids.collide(Vec3::new(0.0, 0.2, 0.0), velocity * 0.1, [velocity]);
        assert!((position - Vec3::new(0.2, 0.1, 0.0)).length() < 1e-6, "{position}");
        assert_eq!(remaining, Vec3::new(2.0, 0.0, 0.0));
        // A particle in the ground is pushed out at once; a velocity that leads away is unchanged.
        assert!((solids.collide(Vec3::Y * -0.3, Vec3::ZERO, [Vec3::ZERO]).0 - Vec3::Y * 0.1).length() < 1e-6);
        let rising = (Vec3::Y * 0.1, Vec3::Y * 0.05);
        assert_eq!(solids.collide(rising.0, rising.1, [rising.1]), (Vec3::Y * 0.15, [rising.1]));
    }

    #[test]
    fn nothing_passes_through_a_plate_however_thin_and_fast() {
        for occluder in [plate(0.005), plate(0.02), plate(0.0), slab()] {
            let plate = [occluder];
            for (start, speed) in (0..400).map(|i| (0.3 + 0.0007 * i as f32, 0.01 + 0.003 * i as f32)) {
                let below = (0.59 - 0.1 * f32::from(matches!(plate[0], Occluder::Mesh { .. }))).min(start);
                let displacement = Vec3::new(0.3 * speed, speed, -0.1 * speed);
                let (position, [velocity]) = solids(&plate).collide(Vec3::Y * below, displacement, [displacement]);
                assert!(position.y < 0.6, "{:?}: from {below} by {displacement} to {position}", plate[0]);
                assert!(
                    position.y == below + displacement.y || velocity.y < 0.01 * speed,
                    "{velocity} behind the plate"
                );
                assert!(
                    (position.x - displacement.x).abs() < 0.02 + 0.1 * speed,
                    "it slides: {position} by {displacement}"
                );
            }
        }
    }

    #[test]
    fn gas_that_one_solid_turns_into_another_keeps_out_of_both() {
        let wall = Occluder::HalfSpace { point: DVec3::X * 0.2, normal: DVec3::NEG_X };
        let solids_of = [plate(0.1), wall];
        let (position, [velocity]) = solids(&solids_of).collide(Vec3::Y * 0.4, Vec3::new(0.5, 0.5, 0.1), [Vec3::ONE]);
        assert!((position - Vec3::new(0.19, 0.54, 0.1)).length() < 1e-5 && velocity.max_element() <= 1.0, "{position}");
        assert_eq!([velocity.x, velocity.y], [0.0; 2]);
    }
}
