//! Solid obstacles for gas and drops.

use std::sync::Arc;

use glam::{DQuat, DVec2, DVec3};

use crate::geometry::{distance_field::DistanceField, transform::Transform};

/// A solid obstacle.
#[derive(Clone, Debug, PartialEq)]
pub enum Occluder {
    /// A sphere.
    Sphere {
        /// Its center, m.
        center: DVec3,
        /// Its radius, m.
        radius: f64,
    },
    /// Everything below a plane.
    HalfSpace {
        /// A point on the plane, m.
        point: DVec3,
        /// Unit normal, pointing out of the solid.
        normal: DVec3,
    },
    /// A box.
    Cuboid {
        /// Its center, m.
        center: DVec3,
        /// Half of its sides, m.
        half_extents: DVec3,
        /// Its rotation.
        rotation: DQuat,
    },
    /// A cylinder.
    Cylinder {
        /// Its center, m.
        center: DVec3,
        /// Its radius, m.
        radius: f64,
        /// Half of its height, m.
        half_height: f64,
        /// Its rotation; without it the axis is vertical.
        rotation: DQuat,
    },
    /// A closed triangle mesh.
    Mesh {
        /// Distance field in the local coordinates of the mesh.
        distance: Arc<DistanceField>,
        /// World-from-local transform of the mesh.
        placement: Transform,
    },
}

impl Occluder {
    /// Whether two lists hold the same solids. Distance fields are compared by their place in memory, since they are large.
    pub fn are_same(some: &[Self], others: &[Self]) -> bool {
        some.len() == others.len() && some.iter().zip(others).all(|(a, b)| a.is_same(b))
    }

    fn is_same(&self, other: &Self) -> bool {
        match (self, other) {
            (
                Self::Mesh { distance, placement },
                Self::Mesh { distance: other_distance, placement: other_placement },
            ) => Arc::ptr_eq(distance, other_distance) && placement == other_placement,
            _ => self == other,
        }
    }

    /// The same solid elsewhere, m.
    #[must_use]
    pub fn translated(&self, offset: DVec3) -> Self {
        let mut moved = self.clone();
        match &mut moved {
            Self::Sphere { center, .. } | Self::Cuboid { center, .. } | Self::Cylinder { center, .. } => {
                *center += offset;
            }
            Self::HalfSpace { point, .. } => *point += offset,
            Self::Mesh { placement, .. } => placement.position += offset,
        }
        moved
    }

    /// Distance from `point` to the surface, m; negative inside.
    pub fn signed_distance(&self, point: DVec3) -> f64 {
        match self {
            Self::Sphere { center, radius } => (point - *center).length() - radius,
            Self::HalfSpace { point: on_plane, normal } => (point - *on_plane).dot(*normal),
            Self::Cuboid { center, half_extents, rotation } => {
                let beyond = (rotation.inverse() * (point - *center)).abs() - *half_extents;
                beyond.max(DVec3::ZERO).length() + beyond.max_element().min(0.0)
            }
            Self::Cylinder { center, radius, half_height, rotation } => {
                let local = rotation.inverse() * (point - *center);
                let beyond = DVec2::new(DVec2::new(local.x, local.z).length() - radius, local.y.abs() - half_height);
                beyond.max(DVec2::ZERO).length() + beyond.max_element().min(0.0)
            }
            Self::Mesh { distance, placement } => distance.at(placement.point_in_local(point)) * placement.scale,
        }
    }

    /// Outward unit normal at `point`: the gradient of the signed distance.
    pub fn normal(&self, point: DVec3) -> DVec3 {
        match self {
            Self::Sphere { center, .. } => (point - *center).normalize_or(DVec3::Y),
            Self::HalfSpace { normal, .. } => *normal,
            Self::Cuboid { center, half_extents, rotation } => {
                *rotation * cuboid_normal(rotation.inverse() * (point - *center), *half_extents)
            }
            Self::Cylinder { center, radius, half_height, rotation } => {
                *rotation * cylinder_normal(rotation.inverse() * (point - *center), *radius, *half_height)
            }
            Self::Mesh { distance, placement } => {
                placement.direction_in_world(distance.normal(placement.point_in_local(point)))
            }
        }
    }

    /// A sphere that contains it: center and radius, m. `None` for a half space.
    pub fn bounding_sphere(&self) -> Option<(DVec3, f64)> {
        match self {
            Self::Sphere { center, radius } => Some((*center, *radius)),
            Self::HalfSpace { .. } => None,
            Self::Cuboid { center, half_extents, .. } => Some((*center, half_extents.length())),
            Self::Cylinder { center, radius, half_height, .. } => {
                Some((*center, DVec2::new(*radius, *half_height).length()))
            }
            Self::Mesh { distance, placement } => {
                let [low, high] = distance.bounds();
                Some((placement.point_in_world(0.5 * (low + high)), 0.5 * placement.scale * (high - low).length()))
            }
        }
    }
}

/// Outward normal of an upright cylinder around the origin.
fn cylinder_normal(point: DVec3, radius: f64, half_height: f64) -> DVec3 {
    let across = DVec3::new(point.x, 0.0, point.z);
    let [beside, above] = [across.length() - radius, point.y.abs() - half_height];
    let side = across.normalize_or(DVec3::X);
    let cap = DVec3::Y * point.y.signum();
    let outward = match (beside > 0.0, above > 0.0) {
        (true, true) => side * beside + cap * above,
        (true, false) => side,
        (false, true) => cap,
        (false, false) if beside > above => side,
        (false, false) => cap,
    };
    outward.normalize_or(DVec3::Y)
}

/// Outward normal of an axis-aligned box around the origin.
fn cuboid_normal(point: DVec3, half_extents: DVec3) -> DVec3 {
    let beyond = point.abs() - half_extents;
    let outward = if beyond.max_element() > 0.0 {
        beyond.max(DVec3::ZERO)
    } else {
        let largest = beyond.max_element();
        DVec3::select(beyond.cmpeq(DVec3::splat(largest)), DVec3::ONE, DVec3::ZERO)
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
    fn a_cylinder_is_measured_beside_above_and_at_its_edge() {
        let lying = DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2);
        for (rotation, along) in [(DQuat::IDENTITY, DVec3::Y), (lying, DVec3::X)] {
            let post = Occluder::Cylinder { center: DVec3::ONE, radius: 0.5, half_height: 2.0, rotation };
            let at = |beside: f64, above: f64| DVec3::ONE + DVec3::Z * beside + along * above;
            for (point, distance, normal) in [
                (at(1.5, 0.0), 1.0, DVec3::Z),
                (at(0.0, -3.0), 1.0, -along),
                (at(0.8, 2.4), 0.5, DVec3::Z * 0.6 + along * 0.8),
                (at(0.4, 1.0), -0.1, DVec3::Z),
            ] {
                assert!((post.signed_distance(point) - distance).abs() < 1e-12, "{point}");
                assert!((post.normal(point) - normal).length() < 1e-12, "{point} {}", post.normal(point));
            }
            let (center, radius) = post.bounding_sphere().unwrap();
            assert!(center == DVec3::ONE && (radius * radius - 4.25).abs() < 1e-12);
        }
    }

    #[test]
    fn a_mesh_is_measured_where_it_stands() {
        let placement = Transform::new([10.0, 0.0, 0.0], [0.0, 30.0, 0.0], 2.0);
        let mesh = Occluder::Mesh { distance: Arc::new(DistanceField::new(&mesh::cube())), placement };
        let above = placement.point_in_world(DVec3::new(0.5, 1.02, 0.5));
        assert!((mesh.signed_distance(above) - 0.04).abs() < 1e-3);
        assert!((mesh.normal(above) - DVec3::Y).length() < 1e-3);
    }
}
