//! What hands do in the viewport, as numbers: the camera's ways, the wind of a drag, a lamp that is moved.

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

/// Where a camera stands and what it looks at, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct CameraPose {
    pub(super) position: DVec3,
    pub(super) target: DVec3,
}

/// Angle of a drag over the height of the viewport, radians.
const TURN: f64 = std::f64::consts::PI;
/// Targets that are farther away, as those in the sky, are not gone around, m.
const FAR: f64 = 30.0;
/// As low as hands bring a camera that stands above the ground, m.
const LOWEST: f64 = 0.05;
/// Nearest that the line of sight comes to straight up or down, radians.
const POLE: f64 = 0.02;

impl CameraPose {
    /// Where the camera stands at `time`: as the scene `root` states it, for hands are faster than plans, else as `plan` has it.
    pub(super) fn of(plan: &Plan, root: &Table, time: f64) -> Self {
        let camera = &plan.scene().camera;
        let stated = |key: &str| vector(root, &ValuePath::root().key("camera").key(key), time);
        let or = |stated: Option<DVec3>, planned: [f64; 3]| stated.unwrap_or(DVec3::from(planned));
        Self {
            position: or(stated("position"), camera.position.at(time)),
            target: or(stated("target"), camera.target.at(time)),
        }
    }

    /// Turned about its target by a drag of `drag` viewport heights, or where that lies too far away to go around, about itself: what
    /// is dragged follows the hand.
    pub(super) fn turned(self, drag: DVec2, camera: &Camera) -> Self {
        if (self.position - self.target).length() > FAR { self.looked_around(drag, camera) } else { self.orbited(drag) }
    }

    fn orbited(self, drag: DVec2) -> Self {
        let turned = turned(self.position - self.target, [-TURN * drag.x, TURN * drag.y]);
        Self { position: self.target + turned, ..self }.above_ground(self)
    }

    fn looked_around(self, drag: DVec2, camera: &Camera) -> Self {
        // A drag over the height of the picture turns by the field of view.
        let field = 2.0 * math::atan2(0.5 * camera.size[1], camera.focal_pixels);
        let turned = turned(self.position - self.target, [field * drag.x, -field * drag.y]);
        Self { target: self.position - turned, ..self }
    }

    /// Panned in the image plane, so that points at the target's distance follow the pointer.
    pub(super) fn panned(self, drag: DVec2, camera: &Camera) -> Self {
        let distance = (self.position - self.target).length();
        if distance > FAR {
            // Panning at that distance would move the camera very far.
            return self.looked_around(drag, camera);
        }
        let meters = camera.size[1] / camera.focal_pixels * distance;
        let shift = (camera.world_from_camera.y_axis * drag.y - camera.world_from_camera.x_axis * drag.x) * meters;
        Self { position: self.position + shift, target: self.target + shift }.above_ground(self)
    }

    /// Dollied toward the target by `steps`; away for negative ones.
    pub(super) fn dollied(self, steps: f64) -> Self {
        /// Factor of the distance per step.
        const STEP: f64 = 0.9;
        let distance = (self.position - self.target) * math::pow(STEP, steps);
        Self { position: self.target + distance, ..self }.above_ground(self)
    }

    /// The same, kept above the ground where it was `before`.
    fn above_ground(self, before: Self) -> Self {
        let lowest = LOWEST.min(before.position.y);
        Self { position: DVec3 { y: self.position.y.max(lowest), ..self.position }, ..self }
    }
}

/// `offset` rotated in azimuth and elevation, radians; the elevation is clamped below the pole.
fn turned(offset: DVec3, [around, up]: [f64; 2]) -> DVec3 {
    let distance = offset.length();
    if distance <= 0.0 {
        return offset;
    }
    let around = math::atan2(offset.x, offset.z) + around;
    let above = math::asin((offset.y / distance).clamp(-1.0, 1.0)) + up;
    let above = above.clamp(POLE - 0.5 * TURN, 0.5 * TURN - POLE);
    let ((sin_a, cos_a), (sin_b, cos_b)) = (math::sin_cos(around), math::sin_cos(above));
    distance * DVec3::new(sin_a * cos_b, sin_b, cos_a * cos_b)
}

/// The wind, m/s, of a drag by `drag` viewport heights: in the image plane, as in the paper.
pub(super) fn wind(drag: DVec2, camera: &Camera) -> DVec3 {
    /// Wind of a drag over the whole height, m/s.
    const STRONGEST: f64 = 8.0;
    let along = camera.world_from_camera.x_axis * drag.x - camera.world_from_camera.y_axis * drag.y;
    along * STRONGEST
}

/// Where a point goes when it is dragged to `pixel`: to the same depth.
pub(super) fn dragged(point: DVec3, pixel: DVec2, camera: &Camera) -> Option<DVec3> {
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
    fn half_a_height_to_the_left_turns_a_quarter() {
        let pose = POSE.orbited(DVec2::new(-0.5, 0.0));
        assert!(near(pose.position, DVec3::new(4.0, 1.0, 0.0)) && pose.target == POSE.target);
        let high = POSE.orbited(DVec2::new(0.0, 3.0));
        assert!(high.position.y < 5.0 && high.position.y > 4.99, "never over the pole");
        assert!(((high.position - high.target).length() - 4.0).abs() < 1e-9);
    }

    #[test]
    fn far_targets_are_looked_around_for_and_follow_the_hand() {
        let pose = CameraPose { position: DVec3::new(0.0, 1.7, 0.0), target: DVec3::new(0.0, 60.0, -60.0) };
        let camera = camera_at(pose);
        let before = camera.project(pose.target).unwrap().pixel;
        let drag = DVec2::new(0.0, 0.2);
        for moved in [pose.turned(drag, &camera), pose.panned(drag, &camera)] {
            assert_eq!(moved.position, pose.position, "it stays where it stands");
            let after = camera_at(moved).project(pose.target).unwrap().pixel;
            let followed = (after - before) / 90.0;
            assert!(followed.x.abs() < 1e-9 && (followed.y - 0.2).abs() < 0.03, "{followed}");
        }
        let right = pose.turned(DVec2::new(0.1, 0.0), &camera);
        assert!(camera_at(right).project(pose.target).unwrap().pixel.x > before.x + 5.0);
    }

    #[test]
    fn hands_bring_no_camera_under_the_ground() {
        let low = CameraPose { position: DVec3::new(0.0, 0.5, 4.0), ..POSE };
        let camera = camera_at(low);
        let up = DVec2::new(0.0, -0.4);
        for moved in
            [low.turned(up, &camera), low.panned(up, &camera), low.panned(-8.0 * up, &camera), low.dollied(-30.0)]
        {
            assert!(moved.position.y >= LOWEST, "{moved:?}");
        }
        let beneath = CameraPose { position: DVec3::new(0.0, -2.0, 4.0), ..POSE };
        assert_eq!(beneath.turned(DVec2::ZERO, &camera).position.y, -2.0, "who is there already stays");
    }

    #[test]
    fn what_is_panned_stays_under_the_hand() {
        let camera = camera();
        let before = camera.project(POSE.target).unwrap().pixel;
        let pose = POSE.panned(DVec2::new(0.25, -0.1), &camera);
        let after = camera_at(pose).project(POSE.target).unwrap().pixel;
        assert!((after - before - DVec2::new(0.25, -0.1) * 90.0).length() < 1e-6, "{before} {after}");
    }

    #[test]
    fn steps_nearer_and_back_come_to_the_same_place() {
        assert!(near(POSE.dollied(3.0).dollied(-3.0).position, POSE.position));
        assert!(near(POSE.dollied(1.0).position, DVec3::new(0.0, 1.0, 3.6)));
    }

    #[test]
    fn a_drag_to_the_right_blows_to_the_right() {
        assert!(near(wind(DVec2::new(0.5, 0.0), &camera()), DVec3::new(4.0, 0.0, 0.0)));
        assert!(near(wind(DVec2::new(0.0, -0.25), &camera()), DVec3::new(0.0, 2.0, 0.0)));
    }

    #[test]
    fn a_dragged_lamp_lies_under_the_pointer_at_its_depth() {
        let (camera, lamp, pixel) = (camera(), DVec3::new(0.5, 2.0, -1.0), DVec2::new(20.0, 70.0));
        let moved = dragged(lamp, pixel, &camera).unwrap();
        assert!((camera.depth(moved) - camera.depth(lamp)).abs() < 1e-9);
        assert!((camera.project(moved).unwrap().pixel - pixel).length() < 1e-9);
        assert_eq!(rounded(DVec3::new(1.234_56, -0.000_4, 2.0)), [1.235, 0.0, 2.0]);
    }
}
