//! A camera that pans.

use bansho::{
    Animated, CameraParameters,
    base::math::{DQuat, DVec3, curve::Interpolation, sin_cos},
};

const DEGREES_PER_S: f64 = 1.0;

/// The camera turned at one degree a second about the vertical, or about the x axis where it looks up or down, from time 0 to `end`, s.
pub(crate) fn pan(camera: &CameraParameters, end: f64) -> CameraParameters {
    let seconds = end.max(1.0).ceil() as u32 + 1;
    let keys = (0..=seconds).map(|second| {
        let t = f64::from(second);
        let [position, target] = [&camera.position, &camera.target].map(|point| DVec3::from(point.at(t)));
        let direction = target - position;
        let is_vertical = direction.y.abs() > 0.95 * direction.length();
        let axis = if is_vertical { DVec3::X } else { DVec3::Y };
        (t, (position + rotated(direction, axis, (DEGREES_PER_S * t).to_radians())).to_array())
    });
    let target = Animated::keyed(keys.collect(), Interpolation::Linear).expect("times increase");
    CameraParameters { target, ..camera.clone() }
}

/// `direction` rotated about the unit vector `axis`.
fn rotated(direction: DVec3, axis: DVec3, angle: f64) -> DVec3 {
    let (sin, cos) = sin_cos(0.5 * angle);
    DQuat::from_xyzw(sin * axis.x, sin * axis.y, sin * axis.z, cos) * direction
}
