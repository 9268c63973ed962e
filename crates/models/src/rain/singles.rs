//! Where drops are drawn one by one beside billboards.

use bansho_base::{
    math::{DVec3, smoothstep},
    surroundings::{Emitter, Light},
};

use super::moment::{Ball, Moment};

/// Distance from the camera at which billboards begin, m: a cubic metre that is nearer cannot be seen as flat.
pub(super) const NEAREST: f64 = 1.0;
/// Distance from a lamp at which they begin, m: a cubic metre that is nearer is lit too unevenly.
pub(super) const NEAREST_TO_LAMP: f64 = 1.3;
/// Over how much further they take over, m.
const TAKE_OVER: f64 = 0.2;

/// The air around the camera and around lamps in the region.
pub(super) struct Singles(Vec<Ball>);

impl Singles {
    pub(super) fn new(moment: &Moment, lights: &[Light]) -> Self {
        let eye = moment.sight.middle().position;
        let lamp = |light: &Light| match light.emitter {
            Emitter::Directional { .. } => None,
            Emitter::Point { position, .. } | Emitter::Spot { position, .. } => Some(position),
        };
        let radius = NEAREST_TO_LAMP + TAKE_OVER;
        let near = |place: &DVec3| (*place - eye).length() < 1.1 * moment.distance + radius;
        let lamps = lights.iter().filter_map(lamp).filter(near).map(|centre| Ball { centre, radius });
        Self([moment.around_camera(NEAREST + TAKE_OVER)].into_iter().chain(lamps).collect())
    }

    /// Outside of these no drop is drawn by itself.
    pub(super) fn balls(&self) -> &[Ball] {
        &self.0
    }

    /// How much of a drop at a point is drawn by itself, 0 to 1.
    pub(super) fn share(&self, point: DVec3) -> f64 {
        let share = |ball: &Ball| {
            let square = (point - ball.centre).length_squared();
            if square >= ball.radius * ball.radius {
                return 0.0;
            }
            1.0 - smoothstep(ball.radius - TAKE_OVER, ball.radius, square.sqrt())
        };
        self.0.iter().map(share).fold(0.0, f64::max)
    }
}
