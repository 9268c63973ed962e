//! How far a sheet moves in the picture while the shutter is open.

use bansho_base::{
    math::DVec3,
    parameters::Auto,
    phenomenon::strip::{PathCameras, View, parts_of_motion},
};

use super::time_samples::MAX_SCROLL;
use crate::sheet::model::{FlameInstance, FlameSheet};

/// Motion between the parts of an exposure, pixels; and where the motion is long.
const PIXELS_PER_PART: f64 = 0.5;
const PIXELS_PER_PART_IF_LONG: f64 = 1.0;
/// Most parts of an exposure, unless the motion is long.
const MAX_PARTS: usize = 32;
/// Exposure time up to which a flame keeps its form but for the rise of its gas, s; and length of the parts of longer exposures.
const KEEPS_FORM_S: f64 = 1.0 / 24.0;
const LONG_PART_S: f64 = 1.0 / 60.0;

impl FlameSheet {
    /// The parts of an exposure in which no flame is displaced by more than half a pixel. The motion of its gas is left to its time samples, as far as these
    /// suffice; where their number is given, so is the number of times at which the camera is taken.
    pub(crate) fn parts_of_exposure(&self, view: &View) -> usize {
        if self.parameters.time_samples != Auto::Auto {
            return 1;
        }
        let cameras = view.path_cameras();
        let parts = |flame: &FlameInstance| self.parts_of_flame(flame, view, &cameras);
        self.flames.iter().map(parts).max().unwrap_or(1)
    }

    fn parts_of_flame(&self, flame: &FlameInstance, view: &View, cameras: &PathCameras) -> usize {
        let height = self.sheet_size(flame).y;
        let displaced = if cameras.is_still() && self.parameters.position.constant().is_some() {
            1
        } else {
            let at = |fraction: f64| cameras.path_pixels(|t| self.base(flame, t) + DVec3::Y * (fraction * height));
            let motion = [0.0, 0.5, 1.0].map(at).into_iter().fold(0.0, f64::max);
            parts_of_motion(motion, PIXELS_PER_PART, MAX_PARTS).max(parts_of_motion(
                motion,
                PIXELS_PER_PART_IF_LONG,
                view.shutter.max_parts(),
            ))
        };
        let middle = self.base(flame, view.shutter.middle()) + DVec3::Y * (0.5 * height);
        let distance = (middle - view.camera.position).length().max(view.camera.near);
        let scrolled = self.rise_speed(flame, view.shutter.middle()) * view.shutter.duration();
        let scrolled_pixels = scrolled * view.camera.focal_pixels / distance;
        let duration = view.shutter.duration();
        let flickers =
            if duration > KEEPS_FORM_S * (1.0 + 1e-9) { parts_of_motion(duration, LONG_PART_S, MAX_PARTS) } else { 1 };
        displaced.max(flickers).max(parts_of_motion(scrolled_pixels, MAX_SCROLL, MAX_PARTS))
    }
}
