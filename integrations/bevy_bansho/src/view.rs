//! The cameras of effects, and the surfaces that show their pictures.
//!
//! A billboard and its picture are one perspective projection: the effect's camera is where Bevy's camera is, and its picture plane is the quad. So each
//! texel of the quad shows what Bevy's camera sees through it, whatever the direction from which it is seen.

use bansho::{
    CameraParameters,
    base::{camera::Lens, math},
};
use bevy::{
    camera::Exposure,
    ecs::system::SystemParam,
    math::{DVec3, Vec3Swizzles, ops},
    prelude::*,
};

use crate::light::PlacedLight;

/// Elevation of the camera above or below a billboard up to which it stays upright, radians. Beyond it the billboard tilts.
const UPRIGHT_ELEVATION: f32 = std::f32::consts::FRAC_PI_4;
/// Distances beyond which the perspective of a billboard does not change any more, in heights and in widths of the billboard.
const FARTHEST: [f32; 2] = [8.0, 2.0];
/// Smallest distance of the effect's camera from a billboard, in heights of the billboard.
const NEAREST: f32 = 0.1;
/// Largest shift of the principal point that `CameraParameters` allow, picture heights.
const MAX_SHIFT: f32 = 10.0;
/// Distance of an overlay from the camera, in near distances.
const OVERLAY_DISTANCE: f32 = 2.0;
/// Radius of the sphere that shows a sky, m.
const SKY_RADIUS: f32 = 1e5;
/// Height of the eye above the origin for a sky, m.
const EYE_HEIGHT: f64 = 1.7;

/// Marks the camera that billboards face, whose exposure they have, and around which skies are. Without it that is the active 3-D camera with the lowest
/// order.
#[derive(Clone, Component, Copy, Debug, Default)]
pub struct EffectCamera;

/// Pose and projection of an effect's camera, in the coordinates of the effect, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CameraPose {
    pub(crate) lens: Lens,
    pub(crate) position: DVec3,
    pub(crate) target: DVec3,
    pub(crate) roll_deg: f64,
    pub(crate) vertical_fov_deg: f64,
    pub(crate) shift: [f64; 2],
}

/// How a picture is drawn and shown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct View {
    /// Camera of the effect.
    pub(crate) camera: CameraPose,
    /// Pose of the mesh with the picture. Billboards: relative to the entity's position, in world axes. Overlays: relative to the camera. Skies: relative to
    /// the camera's position, in world axes.
    pub(crate) surface: Transform,
}

/// Where the child entities of an effect belong, relative to it.
pub(crate) struct Placed {
    pub(crate) surface: Transform,
    pub(crate) light: Option<PlacedLight>,
}

impl CameraPose {
    /// `camera` with this pose and projection; exposure time and near distance stay.
    pub(crate) fn applied_to(&self, camera: &CameraParameters) -> CameraParameters {
        CameraParameters {
            lens: self.lens,
            position: self.position.to_array().into(),
            target: self.target.to_array().into(),
            up: CameraParameters::default().up,
            roll_deg: self.roll_deg.into(),
            vertical_fov_deg: self.vertical_fov_deg.into(),
            focal_length_mm: None,
            shift: self.shift,
            ..camera.clone()
        }
    }
}

impl View {
    /// The billboard that shows the rectangle `meters` of the plane through the origin, from a camera at `eye`, m relative to the origin.
    pub(crate) fn billboard(meters: Rect, eye: Vec3) -> Self {
        let (size, middle) = (meters.size(), meters.center());
        let level = Vec3::new(eye.x, 0.0, eye.z).try_normalize().unwrap_or(Vec3::Z);
        let right = Vec3::Y.cross(level);
        let center = right * middle.x + Vec3::Y * middle.y;
        let elevation = ops::atan2(eye.y - center.y, eye.xz().length());
        let tilt = elevation - elevation.clamp(-UPRIGHT_ELEVATION, UPRIGHT_ELEVATION);
        let (sin, cos) = ops::sin_cos(tilt);
        let normal = level * cos + Vec3::Y * sin;
        let up = normal.cross(right);
        let eye = center + (eye - center).clamp_length_max((FARTHEST[0] * size.y).max(FARTHEST[1] * size.x));
        let offset = eye - center;
        let distance = offset.dot(normal).max(NEAREST * size.y);
        let foot = Vec2::new(offset.dot(right), offset.dot(up));
        let position = center + right * foot.x + up * foot.y + normal * distance;
        let shift = (-foot / size.y).clamp(Vec2::splat(-MAX_SHIFT), Vec2::splat(MAX_SHIFT));
        let camera = CameraPose {
            lens: Lens::Perspective,
            position: position.as_dvec3(),
            target: (position - normal).as_dvec3(),
            roll_deg: roll_deg(right.as_dvec3(), normal.as_dvec3()),
            vertical_fov_deg: fov_deg(0.5 * size.y / distance),
            shift: shift.as_dvec2().to_array(),
        };
        let rotation = Quat::from_mat3(&Mat3::from_cols(right, up, normal));
        Self { camera, surface: Transform { translation: center, rotation, scale: size.extend(1.0) } }
    }

    /// The overlay of a perspective camera, whose picture has a width of `picture_aspect` heights and covers the view.
    pub(crate) fn overlay(camera: &GlobalTransform, projection: &PerspectiveProjection, picture_aspect: f32) -> Self {
        let half_height = ops::tan(0.5 * projection.fov) * (projection.aspect_ratio / picture_aspect).max(1.0);
        let distance = OVERLAY_DISTANCE * projection.near;
        let height = 2.0 * distance * half_height;
        let position = camera.translation().as_dvec3();
        let camera = CameraPose {
            lens: Lens::Perspective,
            position,
            target: position + camera.forward().as_dvec3(),
            roll_deg: roll_deg(camera.right().as_dvec3(), camera.back().as_dvec3()),
            vertical_fov_deg: fov_deg(half_height),
            shift: [0.0; 2],
        };
        let scale = Vec3::new(height * picture_aspect, height, 1.0);
        Self { camera, surface: Transform::from_xyz(0.0, 0.0, -distance).with_scale(scale) }
    }

    /// A panorama whose middle is in the north, on a sphere.
    pub(crate) fn sky() -> Self {
        let position = DVec3::Y * EYE_HEIGHT;
        let camera = CameraPose {
            lens: Lens::Panorama,
            position,
            target: position - DVec3::Z,
            roll_deg: 0.0,
            vertical_fov_deg: CameraParameters::default().vertical_fov_deg.at(0.0),
            shift: [0.0; 2],
        };
        Self { camera, surface: Transform::from_scale(Vec3::splat(SKY_RADIUS)) }
    }
}

/// Vertical field of view for the tangent of half of it, degrees.
fn fov_deg(half_height: f32) -> f64 {
    2.0 * math::atan(f64::from(half_height)).to_degrees()
}

/// Rotation about the line of sight by which a camera that looks toward `-back` gets the axis `right`, degrees.
fn roll_deg(right: DVec3, back: DVec3) -> f64 {
    // As `bansho::CameraParameters` have it: straight up, north is at the top of the picture; straight down, south.
    let reference = if back.y.abs() > 0.999_999 { DVec3::Z * back.y.signum() } else { DVec3::Y };
    let level_right = reference.cross(back).normalize();
    let level_up = back.cross(level_right);
    math::atan2(right.dot(level_up), right.dot(level_right)).to_degrees()
}

/// The camera for which billboards and skies are drawn.
#[derive(SystemParam)]
pub(crate) struct ViewCamera<'w, 's> {
    cameras: Query<'w, 's, (Entity, &'static Camera, Option<&'static Exposure>, Has<EffectCamera>), With<Camera3d>>,
}

impl ViewCamera<'_, '_> {
    /// The camera and its exposure value.
    pub(crate) fn get(&self) -> Option<(Entity, f32)> {
        let active = self.cameras.iter().filter(|(_, camera, ..)| camera.is_active);
        let chosen = active.min_by_key(|(entity, camera, _, is_marked)| (!is_marked, camera.order, *entity));
        chosen.map(|(entity, _, exposure, _)| (entity, exposure.copied().unwrap_or_default().ev100))
    }
}

#[cfg(test)]
mod tests {
    use bevy::camera::CameraProjection;

    use super::*;

    /// The pixel at which the effect's camera sees a point, as fractions of width and height from the top left.
    fn seen_at(view: &View, size: [usize; 2], point: DVec3) -> [f64; 2] {
        let camera = view.camera.applied_to(&CameraParameters::default()).at(0.0, size);
        let pixel = camera.project(bansho::base::math::DVec3::from(point.to_array())).unwrap().pixel;
        [pixel.x / size[0] as f64, pixel.y / size[1] as f64]
    }

    #[test]
    fn corners_of_a_billboard_are_the_corners_of_its_picture() {
        let meters = Rect::new(-0.4, -0.12, 0.6, 1.28);
        for eye in [[0.0, 0.5, 3.0], [2.0, 4.0, -1.0], [-1.0, -0.5, 2.0], [0.3, 6.0, 0.1], [0.0, 5.0, 0.0]] {
            let view = View::billboard(meters, Vec3::from(eye));
            for (corner, expected) in [
                ([-0.5, 0.5], [0.0, 0.0]),
                ([0.5, 0.5], [1.0, 0.0]),
                ([0.5, -0.5], [1.0, 1.0]),
                ([0.0, 0.0], [0.5, 0.5]),
            ] {
                let point = view.surface.transform_point(Vec3::new(corner[0], corner[1], 0.0)).as_dvec3();
                let found = seen_at(&view, [500, 700], point);
                let error = (found[0] - expected[0]).abs().max((found[1] - expected[1]).abs());
                assert!(error < 1e-4, "{eye:?} {corner:?}: {found:?}");
            }
        }
    }

    #[test]
    fn near_a_billboard_its_camera_is_that_of_the_view() {
        let meters = Rect::new(-0.4, -0.1, 0.4, 1.2);
        for eye in [[0.0, 0.5, 3.0], [2.0, 4.0, -1.0], [0.1, 5.0, 0.1]] {
            let view = View::billboard(meters, Vec3::from(eye));
            assert!((view.camera.position - DVec3::from(eye.map(f64::from))).length() < 1e-5, "{eye:?}");
        }
        let upright = View::billboard(meters, Vec3::new(0.0, 2.0, 3.0));
        assert!((upright.surface.rotation * Vec3::Y - Vec3::Y).length() < 1e-6);
    }

    #[test]
    fn an_overlay_covers_the_view_and_sees_what_bevy_sees() {
        let pose = Transform::from_xyz(1.0, 2.0, 3.0).looking_at(Vec3::new(-4.0, 1.0, 2.0), Vec3::new(0.3, 1.0, 0.2));
        let projection = PerspectiveProjection { aspect_ratio: 1.5, ..default() };
        let view = View::overlay(&GlobalTransform::from(pose), &projection, 1.5);
        let size = [600, 400];
        let clip_from_world = projection.get_clip_from_view() * pose.to_matrix().inverse();
        for point in [[-4.0, 1.0, 2.0], [-3.0, 2.5, 3.0], [-5.0, 0.0, 1.0]] {
            let clip = clip_from_world.project_point3(Vec3::from(point));
            let expected = [0.5 + 0.5 * f64::from(clip.x), 0.5 - 0.5 * f64::from(clip.y)];
            let found = seen_at(&view, size, DVec3::from(point.map(f64::from)));
            assert!(
                (found[0] - expected[0]).abs().max((found[1] - expected[1]).abs()) < 1e-5,
                "{found:?} {expected:?}"
            );
        }
        let corner = view.surface.transform_point(Vec3::new(0.5, 0.5, 0.0));
        let clip = projection.get_clip_from_view().project_point3(corner);
        assert!((clip.xy() - Vec2::ONE).length() < 1e-5, "{clip}");
    }
}
