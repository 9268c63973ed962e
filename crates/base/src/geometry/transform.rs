//! Position, rotation and uniform scale of an object.

use glam::{DQuat, DVec3};

use crate::math;

/// World-from-local transform: scale, then rotation, then translation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transform {
    /// Position of the local origin in world space, m.
    pub position: DVec3,
    /// Rotation.
    pub rotation: DQuat,
    /// Uniform scale, above 0.
    pub scale: f64,
}

impl Transform {
    /// Scaled by `scale`, rotated about x, then y, then z by `rotation_deg` degrees, and moved to `position`.
    pub fn new(position: [f64; 3], rotation_deg: [f64; 3], scale: f64) -> Self {
        Self { position: position.into(), rotation: rotation_from_euler(rotation_deg.map(f64::to_radians)), scale }
    }

    /// World-space point of a local point.
    pub fn point_in_world(&self, point: DVec3) -> DVec3 {
        self.position + self.rotation * (point * self.scale)
    }

    /// Local point of a world-space point.
    pub fn point_in_local(&self, point: DVec3) -> DVec3 {
        self.rotation.inverse() * (point - self.position) / self.scale
    }

    /// Local direction of a world-space direction; the length is unchanged.
    pub fn direction_in_local(&self, direction: DVec3) -> DVec3 {
        self.rotation.inverse() * direction
    }

    /// World-space direction of a local direction; the length is unchanged.
    pub fn direction_in_world(&self, direction: DVec3) -> DVec3 {
        self.rotation * direction
    }
}

/// Rotation about x, then y, then z by these angles, radians.
fn rotation_from_euler(angles: [f64; 3]) -> DQuat {
    let [(sx, cx), (sy, cy), (sz, cz)] = angles.map(|angle| math::sin_cos(0.5 * angle));
    let (cc, cs, sc, ss) = (cx * cz, cx * sz, sx * cz, sx * sz);
    DQuat::from_xyzw(cy * sc - sy * cs, cy * ss + sy * cc, cy * cs - sy * sc, cy * cc + sy * ss)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_are_about_x_then_y_then_z() {
        let placement = Transform::new([1.0, 0.0, 0.0], [90.0, 0.0, 90.0], 2.0);
        // y turns to z about x, and z stays when turned about z; x turns to y.
        assert!((placement.point_in_world(DVec3::Y) - DVec3::new(1.0, 0.0, 2.0)).length() < 1e-12);
        assert!((placement.direction_in_world(DVec3::X) - DVec3::Y).length() < 1e-12);
    }

    #[test]
    fn there_and_back_is_the_same_point() {
        let placement = Transform::new([1.0, -2.0, 3.0], [10.0, 20.0, 30.0], 0.3);
        let point = DVec3::new(0.4, 5.0, -6.0);
        assert!((placement.point_in_local(placement.point_in_world(point)) - point).length() < 1e-12);
    }
}
