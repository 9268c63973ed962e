//! The geometry of pointer drags in the viewport: camera orbit, pan and dolly, wind, and moved positions.

use bansho::{
    Plan,
    base::{
        camera::Camera,
        math::{self, DVec2, DVec3},
        parameters::Table,
    },
    scene::ValuePath,
};

use crate::document::keyframes::vector;

/// Position and target of a camera, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct CameraPose {
    pub(super) position: DVec3,
    pub(super) target: DVec3,
}

/// Angle of an orbit by a drag over the height of the viewport, radians.
const RADIANS_PER_HEIGHT: f64 = std::f64::consts::PI;
/// Targets at larger distances, such as those in the sky, are not orbited, m.
const MAX_ORBIT_DISTANCE_M: f64 = 30.0;
/// Smallest height above the ground to which a drag moves a camera, m.
const MIN_CAMERA_HEIGHT_M: f64 = 0.05;
/// Smallest angle between the line of sight and the vertical, radians.
const POLE_MARGIN_RAD: f64 = 0.02;

impl CameraPose {
    /// The pose at `time`, s: as the scene `root` states it, which may be newer than `plan`, else from `plan`.
    pub(super) fn at_time(plan: &Plan, root: &Table, time: f64) -> Self {
        let camera = &plan.scene().camera;
        let stated = ["position", "target"].map(|key| vector(root, &ValuePath::root().key("camera").key(key), time));
        Self {
            position: stated[0].unwrap_or_else(|| camera.position.at(time).into()),
            target: stated[1].unwrap_or_else(|| camera.target.at(time).into()),
        }
    }

    /// Rotated by a drag of `drag` viewport heights: about its target, or about the camera's own position if the target is too far away to be
    /// orbited.
    pub(super) fn rotated(self, drag: DVec2, camera: &Camera) -> Self {
        if (self.position - self.target).length() > MAX_ORBIT_DISTANCE_M {
            self.looking_around(drag, camera)
        } else {
            self.orbited(drag)
        }
    }

    fn orbited(self, drag: DVec2) -> Self {
        let offset = rotate(self.position - self.target, [-RADIANS_PER_HEIGHT * drag.x, RADIANS_PER_HEIGHT * drag.y]);
        Self { position: self.target + offset, ..self }.above_ground(self)
    }

    fn looking_around(self, drag: DVec2, camera: &Camera) -> Self {
        // A drag over the height of the picture turns by the field of view.
        let field = 2.0 * math::atan2(0.5 * camera.size[1], camera.focal_pixels);
        let offset = rotate(self.position - self.target, [field * drag.x, -field * drag.y]);
        Self { target: self.position - offset, ..self }
    }

    /// Panned in the image plane, so that points at the target's distance follow the pointer.
    pub(super) fn panned(self, drag: DVec2, camera: &Camera) -> Self {
        let distance = (self.position - self.target).length();
        if distance > MAX_ORBIT_DISTANCE_M {
            // Panning at that distance would move the camera very far.
            return self.looking_around(drag, camera);
        }
        let meters_per_height = camera.size[1] / camera.focal_pixels * distance;
        let shift =
            (camera.world_from_camera.y_axis * drag.y - camera.world_from_camera.x_axis * drag.x) * meters_per_height;
        Self { position: self.position + shift, target: self.target + shift }.above_ground(self)
    }

    /// Dollied toward the target by `steps`; away for negative ones.
    pub(super) fn dollied(self, steps: f64) -> Self {
        /// Factor of the distance per step.
        const STEP: f64 = 0.9;
        let offset = (self.position - self.target) * math::pow(STEP, steps);
        Self { position: self.target + offset, ..self }.above_ground(self)
    }

    /// The same pose, at least [`MIN_CAMERA_HEIGHT_M`] above the ground unless it was lower `before`.
    fn above_ground(self, before: Self) -> Self {
        let lowest = MIN_CAMERA_HEIGHT_M.min(before.position.y);
        Self { position: DVec3 { y: self.position.y.max(lowest), ..self.position }, ..self }
    }
}

/// `offset` rotated in azimuth and elevation, radians; the elevation is clamped below the pole.
fn rotate(offset: DVec3, [azimuth, elevation]: [f64; 2]) -> DVec3 {
    let distance = offset.length();
    if distance <= 0.0 {
        return offset;
    }
    let azimuth = math::atan2(offset.x, offset.z) + azimuth;
    let elevation = math::asin((offset.y / distance).clamp(-1.0, 1.0)) + elevation;
    let elevation =
        elevation.clamp(POLE_MARGIN_RAD - 0.5 * RADIANS_PER_HEIGHT, 0.5 * RADIANS_PER_HEIGHT - POLE_MARGIN_RAD);
    let ((sin_a, cos_a), (sin_b, cos_b)) = (math::sin_cos(azimuth), math::sin_cos(elevation));
    distance * DVec3::new(sin_a * cos_b, sin_b, cos_a * cos_b)
}

/// The wind of a drag by `drag` viewport heights, `strong` over the height of the viewport: in the image plane, as in section 6 of Inagaki et al.
pub(super) fn wind_of_drag(drag: DVec2, strong: f64, camera: &Camera) -> DVec3 {
    (camera.world_from_camera.x_axis * drag.x - camera.world_from_camera.y_axis * drag.y) * strong
}

/// The point at `pixel` that has the same depth as `point`.
pub(super) fn move_at_depth(point: DVec3, pixel: DVec2, camera: &Camera) -> Option<DVec3> {
    Some(camera.position + camera.direction(pixel)? * camera.depth(point))
}

/// Rounded to a millimeter, so that files stay readable.
pub(super) fn rounded(vector: DVec3) -> [f64; 3] {
    // + 0.0 turns -0 into 0.
    vector.to_array().map(|number| (number * 1000.0).round() / 1000.0 + 0.0)
}

#[cfg(test)]
mod tests {
    use bansho::base::camera::CameraParameters;

    use super::*;

    const POSE: CameraPose = CameraPose { position: DVec3::new(0.0, 1.0, 4.0), target: DVec3::new(0.0, 1.0, 0.0) };

    fn camera_at(pose: CameraPose) -> Camera {
        let parameters = CameraParameters {
            position: pose.position.to_array().into(),
            target: pose.target.to_array().into(),
            ..CameraParameters::default()
        };
        parameters.at(0.0, [160, 90])
    }

    fn camera() -> Camera {
        camera_at(POSE)
    }

    fn near(a: DVec3, b: DVec3) -> bool {
        (a - b).length() < 1e-9
    }

    #[test]
    fn half_a_height_to_the_left_orbits_a_quarter() {
        let pose = POSE.orbited(DVec2::new(-0.5, 0.0));
        assert!(near(pose.position, DVec3::new(4.0, 1.0, 0.0)) && pose.target == POSE.target);
        let high = POSE.orbited(DVec2::new(0.0, 3.0));
        assert!(high.position.y < 5.0 && high.position.y > 4.99, "never over the pole");
        assert!(((high.position - high.target).length() - 4.0).abs() < 1e-9);
    }

    #[test]
    fn far_targets_are_looked_at_from_the_same_position() {
        let pose = CameraPose { position: DVec3::new(0.0, 1.7, 0.0), target: DVec3::new(0.0, 60.0, -60.0) };
        let camera = camera_at(pose);
        let before = camera.project(pose.target).unwrap().pixel;
        let drag = DVec2::new(0.0, 0.2);
        for moved in [pose.rotated(drag, &camera), pose.panned(drag, &camera)] {
            assert_eq!(moved.position, pose.position, "the camera does not move");
            let after = camera_at(moved).project(pose.target).unwrap().pixel;
            let followed = (after - before) / 90.0;
            assert!(followed.x.abs() < 1e-9 && (followed.y - 0.2).abs() < 0.03, "{followed}");
        }
        let right = pose.rotated(DVec2::new(0.1, 0.0), &camera);
        assert!(camera_at(right).project(pose.target).unwrap().pixel.x > before.x + 5.0);
    }

    #[test]
    fn drags_bring_no_camera_under_the_ground() {
        let low = CameraPose { position: DVec3::new(0.0, 0.5, 4.0), ..POSE };
        let camera = camera_at(low);
        let up = DVec2::new(0.0, -0.4);
        for moved in
            [low.rotated(up, &camera), low.panned(up, &camera), low.panned(-8.0 * up, &camera), low.dollied(-30.0)]
        {
            assert!(moved.position.y >= MIN_CAMERA_HEIGHT_M, "{moved:?}");
        }
        let beneath = CameraPose { position: DVec3::new(0.0, -2.0, 4.0), ..POSE };
        assert_eq!(beneath.rotated(DVec2::ZERO, &camera).position.y, -2.0, "who is there already stays");
    }

    #[test]
    fn a_panned_point_stays_under_the_pointer() {
        let camera = camera();
        let before = camera.project(POSE.target).unwrap().pixel;
        let pose = POSE.panned(DVec2::new(0.25, -0.1), &camera);
        let after = camera_at(pose).project(POSE.target).unwrap().pixel;
        assert!((after - before - DVec2::new(0.25, -0.1) * 90.0).length() < 1e-6, "{before} {after}");
    }

    #[test]
    fn dolly_steps_are_reversible() {
        assert!(near(POSE.dollied(3.0).dollied(-3.0).position, POSE.position));
        assert!(near(POSE.dollied(1.0).position, DVec3::new(0.0, 1.0, 3.6)));
    }

    #[test]
    fn a_drag_to_the_right_blows_to_the_right() {
        assert!(near(wind_of_drag(DVec2::new(0.5, 0.0), 8.0, &camera()), DVec3::new(4.0, 0.0, 0.0)));
        assert!(near(wind_of_drag(DVec2::new(0.0, -0.25), 8.0, &camera()), DVec3::new(0.0, 2.0, 0.0)));
    }

    #[test]
    fn a_dragged_lamp_lies_under_the_pointer_at_its_depth() {
        let (camera, lamp, pixel) = (camera(), DVec3::new(0.5, 2.0, -1.0), DVec2::new(20.0, 70.0));
        let moved = move_at_depth(lamp, pixel, &camera).unwrap();
        assert!((camera.depth(moved) - camera.depth(lamp)).abs() < 1e-9);
        assert!((camera.project(moved).unwrap().pixel - pixel).length() < 1e-9);
        assert_eq!(rounded(DVec3::new(1.234_56, -0.000_4, 2.0)), [1.235, 0.0, 2.0]);
    }
}
