//! Solids that stand in the way of gas and drops.

use std::sync::Arc;

use glam::{DQuat, DVec3};

use crate::geometry::{distance_field::DistanceField, transform::Transform};

/// Something solid that stands in the way.
#[derive(Clone, Debug, PartialEq)]
pub enum Occluder {
    /// A ball.
    Sphere {
        /// Its middle, m.
        center: DVec3,
        /// Its radius, m.
        radius: f64,
    },
    /// All below a plane.
    HalfSpace {
        /// A point on the plane, m.
        point: DVec3,
        /// Unit normal, pointing out of the solid.
        normal: DVec3,
    },
    /// A box.
    Cuboid {
        /// Its middle, m.
        center: DVec3,
        /// Half its sides, m.
        half_extents: DVec3,
        /// How it is turned.
        rotation: DQuat,
    },
    /// A closed surface of triangles.
    Mesh {
        /// Distance to the surface, in the mesh's own coordinates.
        distance: Arc<DistanceField>,
        /// Where the mesh stands.
        placement: Transform,
    },
}

impl Occluder {
    /// Distance from `point` to the surface, m; negative inside.
    pub fn signed_distance(&self, point: DVec3) -> f64 {
        match self {
            Self::Sphere { center: centre, radius } => (point - *centre).length() - radius,
            Self::HalfSpace { point: on_plane, normal } => (point - *on_plane).dot(*normal),
            Self::Cuboid { center: centre, half_extents, rotation } => {
                let beyond = (rotation.inverse() * (point - *centre)).abs() - *half_extents;
                beyond.max(DVec3::ZERO).length() + beyond.max_element().min(0.0)
            }
            Self::Mesh { distance, placement } => distance.at(placement.to_local(point)) * placement.scale,
        }
    }

    /// Unit vector out of the solid at `point`, along which the distance grows fastest.
    pub fn normal(&self, point: DVec3) -> DVec3 {
        match self {
            Self::Sphere { center: centre, .. } => (point - *centre).normalize_or(DVec3::Y),
            Self::HalfSpace { normal, .. } => *normal,
            Self::Cuboid { center: centre, half_extents, rotation } => {
                *rotation * cuboid_normal(rotation.inverse() * (point - *centre), *half_extents)
            }
            Self::Mesh { distance, placement } => {
                placement.transform_direction(distance.normal(placement.to_local(point)))
            }
        }
    }
}

/// Away from the nearest point of an upright box around the origin.
fn cuboid_normal(point: DVec3, half_extents: DVec3) -> DVec3 {
    let beyond = point.abs() - half_extents;
    let outward = if beyond.max_element() > 0.0 {
        beyond.max(DVec3::ZERO)
    } else {
        let nearest = beyond.max_element();
        DVec3::select(beyond.cmpeq(DVec3::splat(nearest)), DVec3::ONE, DVec3::ZERO)
    };
    (outward * point.signum()).normalize_or(DVec3::Y)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::mesh;

    #[test]
    fn distances_and_normals_worked_by_hand() {
        let sphere = Occluder::Sphere { center: DVec3::X, radius: 0.5 };
        assert_eq!(sphere.signed_distance(DVec3::new(1.0, 2.0, 0.0)), 1.5);
        assert_eq!(sphere.normal(DVec3::new(1.0, 2.0, 0.0)), DVec3::Y);
        let ground = Occluder::HalfSpace { point: DVec3::Y, normal: DVec3::Y };
        assert_eq!(ground.signed_distance(DVec3::new(7.0, 0.25, 3.0)), -0.75);
        let turned = DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2);
        let plank = Occluder::Cuboid { center: DVec3::ZERO, half_extents: DVec3::new(2.0, 0.5, 1.0), rotation: turned };
        assert!((plank.signed_distance(DVec3::new(0.0, 3.0, 0.0)) - 1.0).abs() < 1e-12);
        assert!((plank.signed_distance(DVec3::new(0.3, 0.0, 0.0)) + 0.2).abs() < 1e-12);
        assert!((plank.normal(DVec3::new(0.3, 0.0, 0.0)) - DVec3::X).length() < 1e-12);
    }

    #[test]
    fn a_mesh_is_measured_where_it_stands() {
        let placement = Transform::new([10.0, 0.0, 0.0], [0.0, 30.0, 0.0], 2.0);
        let mesh = Occluder::Mesh { distance: Arc::new(DistanceField::new(&mesh::cube())), placement };
        let above = placement.to_world(DVec3::new(0.5, 1.02, 0.5));
        assert!((mesh.signed_distance(above) - 0.04).abs() < 1e-3);
        assert!((mesh.normal(above) - DVec3::Y).length() < 1e-3);
    }
}
