//! Upright rectangles: flame sheets and rain billboards.

use super::Camera;
use crate::math::{DVec2, DVec3};

/// An upright rectangle in world space with coordinates x in [0, 1] across and y in [0, 1] up.
#[derive(Clone, Copy, Debug)]
pub struct UprightQuad {
    /// Center of its bottom edge, m.
    pub base: DVec3,
    /// Horizontal unit vector across.
    pub right: DVec3,
    /// Unit vector up, leaning with the wind along the line of sight.
    pub up: DVec3,
    /// Width and height, m.
    pub size: DVec2,
}

/// Horizontal unit vector across a quad at `base` that faces `camera`.
pub fn right_facing(camera: &Camera, base: DVec3) -> DVec3 {
    let toward = camera.position - base;
    let level = DVec3::new(toward.x, 0.0, toward.z);
    let own_right = camera.orientation.col(0);
    // Seen from straight above or below there is no horizontal direction to the camera: use the camera's own right vector.
    let fallback = DVec3::new(own_right.x, 0.0, own_right.z).try_normalize().unwrap_or(DVec3::X);
    level.try_normalize().map_or(fallback, |toward| DVec3::Y.cross(toward))
}

impl UprightQuad {
    /// The quad at `base`; `lean` is the tangent of the angle by which its top leans toward `right x up`.
    pub fn new(base: DVec3, right: DVec3, size: DVec2, lean: f64) -> Self {
        let forward = right.cross(DVec3::Y);
        Self { base, right, up: (DVec3::Y + forward * lean).normalize(), size }
    }

    /// The point (x, y) of the quad in world space, m.
    pub fn point(&self, x: f64, y: f64) -> DVec3 {
        self.base + self.right * ((x - 0.5) * self.size.x) + self.up * (y * self.size.y)
    }
}
