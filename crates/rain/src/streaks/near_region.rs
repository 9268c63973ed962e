//! Where drops are drawn one by one beside billboards.

use bansho_base::{
    math::{DVec3, simd::LANES},
    phenomenon::surroundings::{Emitter, Light},
};

use super::{
    project_lanes::{NOTHING, Row, Vectors},
    rasterize::at_least,
};
use crate::drops::exposure::{Ball, Moment, smoothstep};

/// Distance from the camera at which billboards begin, m: a cubic metre that is nearer cannot be seen as flat.
pub(super) const NEAREST: f64 = 1.0;
/// Distance from a lamp at which they begin, m: a cubic metre that is nearer is lit too unevenly.
pub(super) const NEAREST_TO_LAMP: f64 = 1.3;
/// Over how much further they take over, m.
const TAKE_OVER: f64 = 0.2;

/// The air around the camera and around lamps in the region.
pub(crate) struct Singles {
    balls: Vec<Ball>,
    /// Their middles from the camera, and their radii, m.
    from_camera: Vec<([f32; 3], f32)>,
}

impl Singles {
    pub(crate) fn new(moment: &Moment, lights: &[Light]) -> Self {
        let eye = moment.sight.middle().position;
        let lamp = |light: &Light| match light.emitter {
            Emitter::Directional { .. } => None,
            Emitter::Point { position, .. } | Emitter::Spot { position, .. } => Some(position),
        };
        let radius = NEAREST_TO_LAMP + TAKE_OVER;
        let near = |place: &DVec3| (*place - eye).length() < 1.1 * moment.distance + radius;
        let lamps = lights.iter().filter_map(lamp).filter(near).map(|centre| Ball { centre, radius });
        let balls: Vec<Ball> = [moment.around_camera(NEAREST + TAKE_OVER)].into_iter().chain(lamps).collect();
        let from_camera = |ball: &Ball| ((ball.centre - eye).as_vec3().to_array(), ball.radius as f32);
        Self { from_camera: balls.iter().map(from_camera).collect(), balls }
    }

    /// Outside of these no drop is drawn by itself.
    pub(crate) fn balls(&self) -> &[Ball] {
        &self.balls
    }

    /// How much of drops at places from the camera is drawn by itself, 0 to 1.
    #[inline(always)]
    pub(super) fn shares(&self, [xs, ys, zs]: &Vectors) -> Row {
        let mut shares = NOTHING;
        for &([x, y, z], radius) in &self.from_camera {
            for i in 0..LANES {
                let offset = [xs[i] - x, ys[i] - y, zs[i] - z];
                let away = (offset[0] * offset[0] + offset[1] * offset[1] + offset[2] * offset[2]).sqrt();
                shares[i] = at_least(shares[i], smoothstep((radius - away) * (1.0 / TAKE_OVER) as f32));
            }
        }
        shares
    }
}
