//! Sprites that no ellipse describes: balls of gas near the poles of a panorama or the point behind a fisheye lens, where the picture shows one direction
//! as a line, and balls so near that they are seen in a large part of all directions.
//!
//! A ball seen from the distance r in the direction c passes the ray d at `b = r sin a`, with a the angle between c and d. So its line integral is a
//! function of the direction of a cell alone, whatever the lens.

use bansho_base::{
    camera::{Camera, Lens},
    math::{self, DVec2, DVec3},
};

use super::{
    grid::Raster,
    kernel::{MIN_S, Profile},
};

/// A ball as seen in all directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Cap {
    /// Direction of its center, a unit vector in world axes.
    pub(crate) direction: [f32; 3],
    /// Square of its distance relative to its radius.
    pub(crate) falloff: f32,
}

impl Cap {
    /// Weight of the profile in a direction, a unit vector.
    #[inline(always)]
    pub(crate) fn weight(&self, profile: Profile, direction: &[f32; 3]) -> f32 {
        // From the chord between the directions: 1 - cos^2 would cancel for small angles.
        let mut chord = 0.0_f32;
        for axis in 0..3 {
            let difference = direction[axis] - self.direction[axis];
            chord = difference.mul_add(difference, chord);
        }
        let (cosine, sine_squared) = (0.5_f32.mul_add(-chord, 1.0), chord * 0.25_f32.mul_add(-chord, 1.0));
        let s = self.falloff.mul_add(-sine_squared, 1.0);
        if s <= MIN_S {
            return 0.0;
        }
        // Fraction of the ray through the ball that is in front of the camera: all of it, none, or, from within the ball, a part.
        let in_front = (0.5 + 0.5 * cosine * (self.falloff / s).sqrt()).clamp(0.0, 1.0);
        in_front * profile.at(s)
    }
}

/// Unit vectors in world axes toward the centers of all cells, row by row.
pub(crate) fn directions(camera: &Camera, cells: &Raster) -> Vec<[f32; 3]> {
    let mut directions = Vec::with_capacity(cells.rows * cells.columns);
    for row in 0..cells.rows {
        for column in 0..cells.columns {
            let center = DVec2::new(cells.center(0, column), cells.center(1, row));
            directions.push(direction(camera, center).as_vec3().to_array());
        }
    }
    directions
}

/// The direction at a position in the picture, also beyond its edges and the circle of a fisheye, where interpolation reads.
fn direction(camera: &Camera, pixel: DVec2) -> DVec3 {
    if camera.lens != Lens::Fisheye {
        return camera.direction(pixel).map_or(DVec3::NEG_Z, |direction| direction.normalize_or(DVec3::NEG_Z));
    }
    let offset = (pixel - camera.principal_point) / camera.focal_pixels;
    let angle = offset.length();
    let (sin, cos) = math::sin_cos(angle);
    let across = if angle > 0.0 { sin / angle } else { 1.0 };
    camera.world_from_camera * DVec3::new(offset.x * across, -offset.y * across, -cos)
}
