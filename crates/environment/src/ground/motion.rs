//! How far the ground moves in the picture while the shutter is open, with its shadows and waves.

use bansho_base::{
    math::{DVec2, DVec3},
    phenomenon::{
        strip::{PathCameras, View, parts_of_motion},
        surroundings::Surroundings,
    },
};

use super::{GroundKind, hits::HORIZON, model::Ground};

/// Motion between the parts of an exposure, pixels.
const PIXELS_PER_PART: f64 = 1.0;
/// Most parts of an exposure for waves, and of lakes, whose parts keep pictures.
const MAX_LAKE_PARTS: usize = 32;

impl Ground {
    /// The parts of an exposure in which nothing on the ground moves by much more than a pixel.
    pub(super) fn parts_of_exposure(&self, view: &View, surroundings: &Surroundings) -> usize {
        let cameras = view.path_cameras();
        let camera_motion = if cameras.is_still() { 0.0 } else { self.camera_motion(view, &cameras) };
        let motion = camera_motion.max(shadow_motion(view, surroundings));
        // Lights that move over ground that stands still are several, each with its share.
        let of_lights = if motion > 0.0 { surroundings.light_parts.len() } else { 1 };
        let max_parts =
            if self.parameters.kind == GroundKind::Water { MAX_LAKE_PARTS } else { view.shutter.max_parts() };
        parts_of_motion(motion, PIXELS_PER_PART, max_parts).max(self.parts_of_waves(view)).max(of_lights)
    }

    /// Longest path of a point of the ground in the picture as the camera moves, pixels.
    fn camera_motion(&self, view: &View, cameras: &PathCameras) -> f64 {
        /// Points along each side of the picture.
        const SIDE: usize = 5;
        let camera = &view.camera;
        let height = camera.position.y - self.parameters.height;
        let mut longest = 0.0_f64;
        for index in 0..SIDE * SIDE {
            let place = DVec2::new((index % SIDE) as f64, (index / SIDE) as f64) / (SIDE - 1) as f64;
            // Within the picture, so that a dome shows the middles of its sides.
            let pixel = DVec2::from(camera.size) * (0.02 + 0.96 * place);
            let Some(direction) = camera.direction(pixel).map(DVec3::normalize) else { continue };
            let is_below = direction.y * height < 0.0;
            let distance = if is_below { (-height / direction.y).min(HORIZON) } else { HORIZON };
            let point = camera.position + direction * distance;
            longest = longest.max(cameras.path_pixels(|_| point));
        }
        longest
    }

    /// The parts of an exposure in which the shortest waves of a lake pass by an eighth of their length.
    fn parts_of_waves(&self, view: &View) -> usize {
        const PARTS_PER_PERIOD: f64 = 8.0;
        if self.parameters.kind != GroundKind::Water || self.parameters.waves <= 0.0 {
            return 1;
        }
        let periods = view.shutter.duration() * super::waves::highest_frequency(self.parameters.wave_length);
        parts_of_motion(periods * PARTS_PER_PERIOD, 1.0, MAX_LAKE_PARTS)
    }
}

/// Length of the path of shadows in the picture, pixels, if they fall near to what casts them.
fn shadow_motion(view: &View, surroundings: &Surroundings) -> f64 {
    let others = &surroundings.others;
    if others.shadow_motion <= 0.0 {
        return 0.0;
    }
    let mut nearest = f64::INFINITY;
    for (center, radius) in others.shadow_casters.iter().filter_map(|caster| caster.bounding_sphere()) {
        nearest = nearest.min(((center - view.camera.position).length() - radius).max(0.5));
    }
    others.shadow_motion * view.camera.focal_pixels / nearest
}
